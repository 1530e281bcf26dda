//! Camera, pivot, ground and distances that all images of a scene share. They are taken from the start of the clip and
//! from the bounds over the clip, so that no frame differs.

use glam::DVec3;

use crate::dataset_views::depth_step;
use crate::error::SessionError;
use crate::log::SessionLog;
use crate::notice::Notice;
use crate::options::OcclusionSampling;
use crate::plan::SessionPlan;
use blinn_render::integrator::AmbientOcclusion;
use blinn_scene::{Camera, Ground, PosedScene, ViewNotes};

/// View, ground and distances that all images of a scene share.
pub struct Framing {
    /// The camera at the start of the clip.
    pub camera: Camera,
    /// How the camera was chosen.
    pub notes: ViewNotes,
    /// A point on the rotation axis of a turntable.
    pub pivot: DVec3,
    /// Ambient occlusion.
    pub occlusion: Option<AmbientOcclusion>,
    /// The ground below the scene.
    pub ground: Option<Ground>,
    /// The camera that camera-fixed lights follow in a dataset or for a list of cameras, so that all views are lit alike.
    pub light_camera: Option<Camera>,
    /// Metres per step of 16-bit depth in a dataset.
    pub depth_step: Option<f64>,
}

/// Default distance of ambient occlusion, as a fraction of the scene's diagonal.
const OCCLUSION_DISTANCE: f64 = 0.25;

impl Framing {
    /// Resolves the framing for images of `size` pixels.
    ///
    /// # Errors
    /// A camera does not suit the scene.
    pub fn new(plan: &SessionPlan, posed: &PosedScene, size: (u32, u32)) -> Result<Framing, SessionError> {
        let options = &plan.options;
        let (width, height) = size;
        let (camera, notes) = options.view.resolve(posed, width, height)?;
        // The views of a dataset may have a camera where this view has none.
        if let Some(first) = plan.dataset.and_then(|dataset| dataset.frames().next()) {
            options.camera(&first, posed, size)?;
        }
        let occlusion = |ao: OcclusionSampling| AmbientOcclusion {
            samples: ao.samples,
            distance: ao
                .distance
                .unwrap_or_else(|| OCCLUSION_DISTANCE * posed.clip_bounds().extent().length()),
        };
        Ok(Framing {
            camera,
            notes,
            // The centre that views are framed about, so that they hold all around.
            pivot: options.rotation.map_or(DVec3::ZERO, |_| posed.clip_sphere().centre),
            occlusion: options.ao.map(occlusion),
            ground: options.ground.map(|kind| Ground::under(&posed.clip_bounds(), kind)),
            light_camera: match plan.dataset.is_some() || plan.cameras.is_some() {
                true => Some(options.view.without_orbit().resolve(posed, width, height)?.0),
                false => None,
            },
            depth_step: depth_step(plan, posed, size)?,
        })
    }

    /// Reports the camera of all images, or the list of their cameras.
    ///
    /// # Errors
    /// The log treats warnings as errors.
    pub fn log_cameras(&self, plan: &SessionPlan, log: &dyn SessionLog) -> Result<(), SessionError> {
        if let Some(cameras) = &plan.cameras {
            let file = cameras.path().to_path_buf();
            if cameras.without_pose() > 0 {
                log.warn(Notice::CamerasWithoutPose { count: cameras.without_pose(), file: file.clone() })?;
            }
            log.note(Notice::CameraList { count: cameras.len(), file });
            return Ok(());
        }
        log.note(Notice::Camera(self.notes.description.clone()));
        for warning in &self.notes.warnings {
            log.warn(Notice::View(warning.clone()))?;
        }
        for hint in &self.notes.hints {
            log.hint(Notice::View(hint.clone()));
        }
        Ok(())
    }
}
