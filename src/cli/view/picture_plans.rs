//! Plans of pictures, with the exposures and the plan that later pictures reuse.

use std::collections::HashMap;
use std::path::PathBuf;

use anyhow::{Error, Result};

use super::flags::FlagContext;
use super::messages::ViewMessage;
use super::scene_cache::SceneCache;
use super::start_flags::StartFlags;
use super::state::ExposureState;
use super::visibility::HidePatterns;
use crate::args::{ExplicitFlags, Flag, OutputArgs};
use crate::plan::{ImagePolicy, RenderPlan, scene_list};
use crate::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_session::{NamedOptions, ResolvedExposure, values};

/// Maximum number of metered exposures that are kept.
const MAX_EXPOSURES: usize = 64;

/// A picture as options by name and as a plan.
#[derive(Clone)]
pub struct PicturePlan {
    pub flags: ExplicitFlags,
    pub plan: RenderPlan,
}

/// Makes the plans of pictures.
pub struct PicturePlans {
    /// All scenes that the page can open.
    pub files: Vec<PathBuf>,
    /// The scene that is shown.
    pub path: PathBuf,
    pub start: StartFlags,
    /// In bytes.
    pub max_memory: Option<u64>,
    pub patterns: HidePatterns,
    /// Diameter of the scene's bounding sphere in metres.
    pub scene_diameter: f64,
    /// Exposures by the flags that they depend on.
    exposures: HashMap<ExplicitFlags, ResolvedExposure>,
    /// The last plan.
    last: Option<PicturePlan>,
}

impl PicturePlans {
    /// The plans of the first of some files.
    pub fn new(files: Vec<PathBuf>, start: StartFlags, max_memory: Option<u64>) -> PicturePlans {
        PicturePlans {
            path: files.first().cloned().unwrap_or_default(),
            files,
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
    /// The flags cannot be combined, or a file that they name cannot be read.
    pub fn start_plan(&self) -> Result<RenderPlan, UsageError> {
        self.plan_of(&self.start.all)
    }

    /// The plan of the picture that flags describe.
    fn plan_of(&self, flags: &ExplicitFlags) -> Result<RenderPlan, UsageError> {
        let mut options = NamedOptions::default();
        let mut time = 0.0;
        for Flag { name, value } in flags.iter().filter(|flag| flag.name != "strict") {
            let value = value.as_deref().unwrap_or_default();
            match name.as_str() {
                "time" => time = values::number(&value.to_string_lossy()).map_err(UsageError)?,
                _ => options.set(name, value)?,
            }
        }
        let policy = ImagePolicy {
            strict: flags.contains("strict"),
            max_memory: self.max_memory,
            image_name: None,
            is_shared: false,
        };
        let scenes = scene_list(std::slice::from_ref(&self.path))?;
        let mut plan =
            RenderPlan::for_images(scenes, options.finish()?, time, &OutputArgs::default(), policy)?;
        plan.read_files()?;
        Ok(plan)
    }

    /// Index of the scene that is shown, in all.
    pub fn file_index(&self) -> usize {
        self.files.iter().position(|file| *file == self.path).unwrap_or_default()
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
        let picture = PicturePlan { plan: self.plan_of(&flags).map_err(to_error)?, flags };
        self.last = Some(picture.clone());
        Ok(picture)
    }

    fn context<'a>(&'a self, scenes: &'a SceneCache) -> Result<FlagContext<'a>> {
        let PicturePlans { start, patterns, scene_diameter, .. } = self;
        Ok(FlagContext { start, patterns, scene: scenes.scene()?, scene_diameter: *scene_diameter })
    }

    fn exposure(
        &mut self,
        flags: &ExplicitFlags,
        scenes: &mut SceneCache,
        cancel: &CancelToken,
    ) -> Result<ResolvedExposure> {
        if let Some(known) = self.exposures.get(flags) {
            return Ok(*known);
        }
        let plan = self.plan_of(flags).map_err(to_error)?;
        let exposure = scenes.show(&plan, &self.path, cancel)?.exposure(&plan, &self.path, cancel)?;
        if self.exposures.len() >= MAX_EXPOSURES {
            self.exposures.clear();
        }
        self.exposures.insert(flags.clone(), exposure);
        Ok(exposure)
    }
}

fn to_error(error: UsageError) -> Error {
    Error::msg(error.0)
}
