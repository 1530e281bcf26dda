//! Plans of pictures, with the exposures and the plan that later pictures reuse.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Error, Result};

use super::flags::FlagContext;
use super::messages::ViewMessage;
use super::scene_cache::SceneCache;
use super::start_flags::StartFlags;
use super::state::ExposureState;
use super::visibility::HidePatterns;
use crate::plan::RenderPlan;
use crate::render_flags::render_plan;
use crate::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_session::{ResolvedExposure, SessionPlan};

/// Maximum number of metered exposures that are kept.
const MAX_EXPOSURES: usize = 64;

/// A picture as flags and as a plan.
#[derive(Clone)]
pub struct PicturePlan {
    pub flags: Vec<OsString>,
    pub plan: RenderPlan,
}

/// Makes the plans of pictures.
pub struct PicturePlans {
    pub path: PathBuf,
    pub start: StartFlags,
    /// In bytes.
    pub max_memory: Option<u64>,
    pub patterns: HidePatterns,
    /// Diameter of the scene's bounding sphere in metres.
    pub scene_diameter: f64,
    /// Exposures by the flags that they depend on.
    exposures: HashMap<Vec<OsString>, ResolvedExposure>,
    /// The last plan.
    last: Option<PicturePlan>,
}

impl PicturePlans {
    pub fn new(path: &Path, start: StartFlags, max_memory: Option<u64>) -> PicturePlans {
        PicturePlans {
            path: path.to_path_buf(),
            start,
            max_memory,
            patterns: HidePatterns::default(),
            scene_diameter: 1.0,
            exposures: HashMap::new(),
            last: None,
        }
    }

    /// The plan of the command line's own picture.
    ///
    /// # Errors
    /// The flags cannot be combined.
    pub fn start_plan(&self) -> Result<RenderPlan, UsageError> {
        self.parse(self.start.all.to_args())
    }

    fn parse(&self, flags: Vec<OsString>) -> Result<RenderPlan, UsageError> {
        let plan = render_plan(flags, &self.path)?;
        let session = SessionPlan { max_memory: self.max_memory, ..plan.session };
        Ok(RenderPlan { session, ..plan })
    }

    /// Forgets what depends on the files.
    pub fn forget(&mut self) {
        self.exposures.clear();
        self.last = None;
    }

    /// The plan of a state. `scenes` holds the scene.
    ///
    /// # Errors
    /// The state does not suit the scene, or the flags cannot be combined.
    pub fn plan(
        &mut self,
        message: &ViewMessage,
        scenes: &mut SceneCache,
        cancel: &CancelToken,
    ) -> Result<PicturePlan> {
        let scene_flags = self.context(scenes)?.scene_flags(&message.view)?;
        let exposure = match message.view.exposure {
            ExposureState::Stops(_) => None,
            ExposureState::Named(_) => Some(self.exposure(&scene_flags, scenes, cancel)?),
        };
        let metered = exposure.as_ref().filter(|exposure| exposure.is_metered);
        let context = self.context(scenes)?;
        let flags = context.picture_flags(&scene_flags, &message.view, message.size, metered)?;
        if let Some(last) = self.last.as_ref().filter(|last| last.flags == flags) {
            return Ok(last.clone());
        }
        let picture = PicturePlan { plan: self.parse(flags.clone()).map_err(to_error)?, flags };
        self.last = Some(picture.clone());
        Ok(picture)
    }

    fn context<'a>(&'a self, scenes: &'a SceneCache) -> Result<FlagContext<'a>> {
        let PicturePlans { start, patterns, scene_diameter, .. } = self;
        Ok(FlagContext { start, patterns, scene: scenes.scene()?, scene_diameter: *scene_diameter })
    }

    fn exposure(
        &mut self,
        flags: &[OsString],
        scenes: &mut SceneCache,
        cancel: &CancelToken,
    ) -> Result<ResolvedExposure> {
        if let Some(known) = self.exposures.get(flags) {
            return Ok(*known);
        }
        let plan = self.parse(flags.to_vec()).map_err(to_error)?;
        let exposure = scenes.show(&plan, &self.path, cancel)?.exposure(&plan, &self.path, cancel)?;
        if self.exposures.len() >= MAX_EXPOSURES {
            self.exposures.clear();
        }
        self.exposures.insert(flags.to_vec(), exposure);
        Ok(exposure)
    }
}

fn to_error(error: UsageError) -> Error {
    Error::msg(error.0)
}
