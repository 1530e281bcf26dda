//! Many images of a scene.

use std::path::PathBuf;
use std::sync::Arc;

use crate::empty_images::EmptyImages;
use crate::error::SessionError;
use crate::log::{NoticeLog, SessionLog};
use crate::memory_estimate::check_memory;
use crate::memory_limit::load_limits;
use crate::notice::Notice;
use crate::options::Options;
use crate::picture::Picture;
use crate::plan::SessionPlan;
use crate::planned_frame::PlannedFrame;
use crate::posed_frame::PosedFrame;
use crate::scene::Scene;
use crate::scene_renderer::SceneRenderer;
use blinn_core::cancellation::CancelToken;
use blinn_render::ProgressMonitor;
use blinn_scene::{Camera, ClipBoundsCache, Scene as SceneData, Source, View};

/// What differs between the images of a session.
#[derive(Clone, Copy, Debug, Default)]
pub struct Request {
    /// The camera; `None` for that of the options.
    pub camera: Option<Camera>,
    /// Time in the animation, in seconds. The last pose holds after the end.
    pub time: f64,
}

struct Renderer<'a> {
    scene: SceneRenderer<'a>,
    /// The scene at the time of the last image.
    frame: PosedFrame<'a>,
}

struct Owner {
    scene: Arc<SceneData>,
    log: NoticeLog,
}

self_cell::self_cell!(
    struct RendererCell {
        owner: Owner,
        #[covariant]
        dependent: Renderer,
    }
);

/// A scene with everything that its images share: framing, lights, exposure and acceleration structure. All are resolved
/// once, at the start of the animation, so that nothing flickers from image to image.
pub struct Session {
    cell: RendererCell,
    plan: Arc<SessionPlan>,
    path: PathBuf,
    source: Arc<Source>,
}

impl Session {
    /// Prepares a scene for images with `options`.
    ///
    /// # Errors
    /// A file that the options name cannot be read, the options do not suit the scene, or it needs more memory than there
    /// is.
    pub fn new(scene: &Scene, options: &Options) -> Result<Session, SessionError> {
        let mut options = options.clone();
        options.read_files(&load_limits(None))?;
        // Names of ids are for files beside images.
        let plan = Arc::new(SessionPlan { holds_layers: false, ..SessionPlan::new(options.clone()) });
        let owner = Owner { scene: scene.prepared(&options)?, log: NoticeLog::default() };
        let cell = RendererCell::try_new(owner, |Owner { scene, log }| {
            if scene.instances.is_empty() {
                log.warn(Notice::NothingToDraw)?;
            }
            check_memory(&plan, scene, 1)?;
            let (clip_bounds, cancel) = (ClipBoundsCache::default(), CancelToken::default());
            let (scene, frame) = SceneRenderer::new(&plan, scene, 1, log, &clip_bounds, &cancel)?;
            Ok::<_, SessionError>(Renderer { scene, frame })
        })?;
        Ok(Session { cell, plan, path: scene.path.clone(), source: Arc::new(scene.data.source.clone()) })
    }

    /// Renders an image.
    ///
    /// # Errors
    /// The camera does not suit the scene.
    pub fn image(&mut self, request: &Request) -> Result<Picture, SessionError> {
        self.image_with_progress(request, &())
    }

    /// Renders an image as [`Session::image`] does, and reports its progress.
    ///
    /// # Errors
    /// As [`Session::image`]; `monitor` cancels.
    pub fn image_with_progress(
        &mut self,
        request: &Request,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Picture, SessionError> {
        let planned = PlannedFrame::at(1, request.time);
        let image = self.cell.with_dependent_mut(|_, Renderer { scene, frame }| {
            if !scene.setup.is_at(frame, request.time) {
                let reusable = frame.accel.take();
                *frame = scene.setup.pose_at(request.time, frame, reusable)?;
            }
            scene.setup.build(frame)?;
            match request.camera {
                Some(camera) => scene.render_view(camera, &planned, frame, monitor),
                None => scene.render(&planned, frame, monitor),
            }
        })?;
        let empty_images = EmptyImages::default();
        image.empty.map(|reason| empty_images.add(reason, planned.number));
        let mut notices = self.notices();
        notices.extend(empty_images.summary(1));
        let plan = request.camera.map_or_else(|| self.plan.clone(), |camera| self.plan_from(camera));
        let (scene, source) = (self.path.clone(), self.source.clone());
        Ok(Picture { image: image.picture, notices, plan, frame: planned, scene, source })
    }

    /// The warnings so far.
    pub fn notices(&self) -> Vec<Notice> {
        self.cell.borrow_owner().log.notices()
    }

    /// The plan whose images show what `camera` sees.
    fn plan_from(&self, camera: Camera) -> Arc<SessionPlan> {
        let view = View { complete: Some(camera), ..View::default() };
        let options = Options { view, ..self.plan.options.clone() };
        Arc::new(SessionPlan { options, ..SessionPlan::clone(&self.plan) })
    }
}

impl Scene {
    /// Renders a picture at the start of the animation: the same as `blinn render` with the same options.
    ///
    /// # Errors
    /// The options do not suit the scene.
    pub fn render(&self, options: &Options) -> Result<Picture, SessionError> {
        Session::new(self, options)?.image(&Request::default())
    }
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Session").field("path", &self.path).finish_non_exhaustive()
    }
}
