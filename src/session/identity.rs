//! Identities of images: hashes of everything that decides them except their input files.

use serde::{Serialize, Serializer};

use crate::camera_list::{CameraList, ImageCamera};
use crate::options::{AovSelection, Options};
use crate::plan::SessionPlan;
use crate::planned_frame::PlannedFrame;
use crate::settings_hash::SettingsHash;
use blinn_output::datasets::WorldUp;
use blinn_scene::View;

impl SessionPlan {
    /// Hash of everything that decides an image, neither of a dataset nor of a list of cameras, except the input files. `kind`
    /// is that of the file.
    pub fn settings_hash(&self, kind: &impl Serialize, frame: &PlannedFrame) -> SettingsHash {
        let has_flow = self.options.aovs.aovs.iter().any(|aov| aov.is_flow());
        let neighbours = has_flow.then(|| [-1, 1].map(|step| self.neighbours.frame(frame, step)));
        let frame = (frame.time, frame.rate, frame.angle, frame.view);
        SettingsHash::of(&(&self.options, kind, frame, neighbours))
    }

    /// Hash of everything that decides an image of a dataset or of a list of cameras except the input files. It is the
    /// same for a dataset and for its `transforms.json` as a list, and does not change with other cameras of a list.
    pub fn view_hash(&self, kind: &impl Serialize, frame: &PlannedFrame, view: &ImageCamera) -> SettingsHash {
        let options = &self.options;
        // Lights that follow the camera follow the view at rest.
        let rest = (&options.view.camera, options.view.look_at);
        let aovs = if self.holds_layers { options.aovs.clone() } else { AovSelection::default() };
        // The normalization of the view counts.
        let options = Options {
            size: None,
            view: View::default(),
            normalize: None,
            aovs,
            crop: None,
            ..options.clone()
        };
        let up = match (&self.dataset, &self.cameras) {
            (Some(dataset), _) => dataset.up,
            (None, Some(cameras)) => cameras.world_up(),
            (None, None) => WorldUp::Y,
        };
        let depth_step = options.depth_unit.or(view.depth_step);
        let view = ImageCamera { camera: view.camera.with_positive_zeros(), depth_step, ..*view };
        let neighbours = self.listed_neighbours(frame);
        SettingsHash::of(&(&options, rest, kind, frame.time, view, up, neighbours))
    }

    /// Times and cameras of the neighbours in a list to which layers of flow lead.
    fn listed_neighbours(&self, frame: &PlannedFrame) -> [Option<(f64, Option<ImageCamera>)>; 2] {
        let has_flow = self.options.aovs.aovs.iter().any(|aov| aov.is_flow());
        [-1, 1].map(|step| {
            let cameras = self.cameras.as_ref().filter(|_| has_flow)?;
            let PlannedFrame { time, camera, .. } = self.neighbours.frame(frame, step)?;
            Some((time, cameras.camera(camera?).ok()))
        })
    }
}

/// Serialises the names, the times and the cameras of images.
impl Serialize for CameraList {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq((0..self.len()).map(|index| {
            let listed = self.listed(index).ok()?;
            let camera = self.image_camera(&listed);
            Some((listed.name, self.time(index), camera))
        }))
    }
}
