//! Keeps the last loaded scenes: loading options, such as the material variant, may change back.

use std::path::Path;

use anyhow::{Context, Result};

use super::view_scene::ViewScene;
use crate::plan::RenderPlan;
use blinn_core::cancellation::CancelToken;
use blinn_scene::Scene;

/// Maximum number of scenes in memory.
const MAX_SCENES: usize = 2;

/// The loaded scenes, from the least to the most recently used.
pub struct SceneCache(Vec<ViewScene>);

impl SceneCache {
    pub fn new(scene: ViewScene) -> SceneCache {
        SceneCache(vec![scene])
    }

    /// The most recently used scene.
    ///
    /// # Errors
    /// There is none after an internal error.
    pub fn scene(&self) -> Result<&Scene> {
        self.0.last().context("the scene is lost")?.scene()
    }

    /// Shows the scene of a plan. Loads it if no scene in memory was loaded with the same options.
    ///
    /// # Errors
    /// The scene cannot be loaded, or the plan does not suit it.
    pub fn show(&mut self, plan: &RenderPlan, path: &Path, cancel: &CancelToken) -> Result<&mut ViewScene> {
        let scene = match self.0.iter().position(|scene| scene.suits(plan)) {
            Some(known) => self.0.remove(known),
            None => {
                let scene = ViewScene::load(plan, path, cancel)?;
                if self.0.len() >= MAX_SCENES {
                    self.0.remove(0);
                }
                scene
            }
        };
        self.0.push(scene);
        let scene = self.0.last_mut().context("the scene is lost")?;
        scene.show(plan)?;
        Ok(scene)
    }
}
