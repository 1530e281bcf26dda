//! Loaded scenes: the last one, and another with different options of loading, such as another material variant.

use std::path::Path;

use anyhow::{Context, Result};

use super::stage::Stage;
use crate::cancellation::CancelToken;
use crate::cli::plan::RenderPlan;
use crate::scene::Scene;

/// Most scenes in memory.
const MAX_STAGES: usize = 2;

/// Loaded scenes, the last used one at the end.
pub struct Stages(Vec<Stage>);

impl Stages {
    pub fn new(stage: Stage) -> Stages {
        Stages(vec![stage])
    }

    /// The last used scene.
    ///
    /// # Errors
    /// There is none after an internal error.
    pub fn scene(&self) -> Result<&Scene> {
        self.0.last().context("the scene is lost")?.scene()
    }

    /// Shows the scene of a plan. Loads it if its options of loading differ from those of the known ones.
    ///
    /// # Errors
    /// The scene cannot be loaded, or the plan does not suit it.
    pub fn show(&mut self, plan: &RenderPlan, path: &Path, cancel: &CancelToken) -> Result<&mut Stage> {
        let stage = match self.0.iter().position(|stage| stage.suits(plan)) {
            Some(known) => self.0.remove(known),
            None => {
                let stage = Stage::load(plan, path, cancel)?;
                if self.0.len() >= MAX_STAGES {
                    self.0.remove(0);
                }
                stage
            }
        };
        self.0.push(stage);
        let stage = self.0.last_mut().context("the scene is lost")?;
        stage.show(plan)?;
        Ok(stage)
    }
}
