//! The plan of a session: everything but the scene.

use std::sync::Arc;

use crate::camera_list::CameraList;
use crate::dataset_plan::DatasetPlan;
use crate::frame_neighbours::FrameNeighbours;
use crate::options::Options;
use blinn_accel::AccelSettings;

/// Everything that a session needs besides the scene: options, and the source of its cameras.
#[derive(Clone, Debug)]
pub struct SessionPlan {
    /// Options of all images.
    pub options: Options,
    /// How the BVHs are built.
    pub build: AccelSettings,
    /// The frames before and after each frame, for layers of flow.
    pub neighbours: FrameNeighbours,
    /// The dataset that the images belong to.
    pub dataset: Option<DatasetPlan>,
    /// The list that the cameras come from.
    pub cameras: Option<Arc<CameraList>>,
    /// True if layers are stored in the images themselves, false for files beside them.
    pub holds_layers: bool,
    /// Bytes per pixel that encoding an image takes; `None` if its format is not known.
    pub encoding_bytes: Option<u64>,
    /// Memory limit in bytes for a scene and its images. `None` for the memory of the machine.
    pub max_memory: Option<u64>,
}

impl SessionPlan {
    /// Images with `options`, from the camera that they describe.
    pub fn new(options: Options) -> SessionPlan {
        SessionPlan {
            options,
            build: AccelSettings::default(),
            neighbours: FrameNeighbours::None,
            dataset: None,
            cameras: None,
            holds_layers: true,
            encoding_bytes: None,
            max_memory: None,
        }
    }
}
