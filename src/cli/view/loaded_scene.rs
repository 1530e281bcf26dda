//! A scene as loaded, of which parts can be hidden and shown again without another load.

use std::path::Path;

use anyhow::Result;

use crate::plan::RenderPlan;
use crate::scene_file::load_scene_file;
use blinn_core::cancellation::CancelToken;
use blinn_import::LoadOptions;
use blinn_scene::{Animation, AreaLight, Instance, Light, Scene, Selection};
use blinn_session::{BackFaceCulling, without_error_codes};

/// A scene, and the parts that a selection removes from it.
pub struct LoadedScene {
    /// The scene with the parts that are shown.
    pub scene: Scene,
    pub warnings: Vec<String>,
    instances: Vec<Instance>,
    /// Lights and animations, which selections change beside the instances; `None` if there are no lights.
    lights: Option<Lights>,
}

/// All lights of a scene, and the animations that may drive them.
struct Lights {
    lights: Vec<Light>,
    area_lights: Vec<AreaLight>,
    animations: Vec<Animation>,
}

impl LoadedScene {
    /// Loads a scene with the options of a plan. All of it is shown.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn load(plan: &RenderPlan, path: &Path, cancel: &CancelToken) -> Result<LoadedScene> {
        let limits = plan.session.scene_limits();
        let options = LoadOptions { limits, cancel: cancel.clone(), ..plan.session.options.load.clone() };
        let (mut scene, warnings) = load_scene_file(path, &options, plan.session.options.blender.as_deref())?;
        if plan.session.options.cull == BackFaceCulling::All {
            scene.materials.iter_mut().for_each(|material| material.double_sided = false);
        }
        Ok(LoadedScene {
            instances: scene.instances.clone(),
            lights: (!scene.lights.is_empty() || !scene.area_lights.is_empty()).then(|| Lights {
                lights: scene.lights.clone(),
                area_lights: scene.area_lights.clone(),
                animations: scene.animations.clone(),
            }),
            warnings: warnings.iter().map(|warning| without_error_codes(&warning.to_string())).collect(),
            scene,
        })
    }

    /// Shows a part of the scene, as `--hide` and `--only-objects` do; all of it after an error.
    ///
    /// # Errors
    /// A pattern without a match.
    pub fn show(&mut self, selection: &Selection) -> Result<()> {
        self.scene.instances.clone_from(&self.instances);
        if let Some(Lights { lights, area_lights, animations }) = &self.lights {
            self.scene.lights.clone_from(lights);
            self.scene.area_lights.clone_from(area_lights);
            self.scene.animations.clone_from(animations);
        }
        Ok(self.scene.select(selection)?)
    }
}
