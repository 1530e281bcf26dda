//! Loads a scene and keeps what its poses share.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};

use pyo3::prelude::*;

use super::array_words::{names_arrays, with_arguments};
use super::errors::{CallDepth, load_error, value_error, warn};
use super::pool;
use super::posed::PosedCell;
use super::render_job::ClipStart;
use blinn_import::{GlassMode, LoadOptions, load_bytes};
use blinn_scene::{AnimationChoice, Scene};
use blinn_session::{BackFaceCulling, SessionPlan, load_scene};

/// Where a scene comes from.
pub enum SceneInput {
    File(PathBuf),
    Memory(Vec<u8>),
}

/// A scene and what its poses share.
pub struct LoadedScene {
    pub scene: Arc<Scene>,
    /// Path or name, for messages.
    pub name: PathBuf,
    pub warnings: Vec<String>,
    pub glass: GlassMode,
    /// The scene with single-sided materials, for `cull="back"`.
    single_sided: OnceLock<Arc<Scene>>,
    /// The starts of clips: by animation, and by whether all materials are single-sided.
    starts: Mutex<HashMap<(Option<String>, bool), Arc<ClipStart>>>,
}

impl LoadedScene {
    /// Loads a scene with the options of a plan, and issues its warnings.
    pub fn load(
        py: Python<'_>,
        input: SceneInput,
        name: PathBuf,
        plan: &SessionPlan,
    ) -> PyResult<LoadedScene> {
        let limits = pool::run(py, || Ok(plan.scene_limits()))?;
        let options = LoadOptions { limits, ..plan.options.load.clone() };
        let glass = options.glass;
        let is_arrays = matches!(input, SceneInput::Memory(_)) && names_arrays(&name);
        let (path, blender) = (name.clone(), plan.options.blender.clone());
        let loaded = pool::run_interruptible(py, move || {
            Ok(match &input {
                SceneInput::File(file) => load_scene(file, &options, blender.as_deref()),
                SceneInput::Memory(bytes) => load_bytes(bytes, &path, &options),
            })
        })?;
        let text = name.display().to_string();
        let (mut scene, warnings) = loaded.map_err(|error| load_error(&text, error))?;
        scene.select(&plan.options.selection).map_err(|e| value_error(e.to_string()))?;
        let in_words = |text: String| if is_arrays { with_arguments(&text) } else { text };
        let warnings: Vec<String> = warnings.iter().map(|warning| in_words(warning.to_string())).collect();
        warn(py, &text, &warnings, CallDepth::Wrapped)?;
        Ok(LoadedScene {
            scene: Arc::new(scene),
            name,
            warnings,
            glass,
            single_sided: OnceLock::new(),
            starts: Mutex::default(),
        })
    }

    /// The start of the clip that a plan renders. `animation` is the option of that name.
    pub fn clip_start(
        &self,
        py: Python<'_>,
        plan: &SessionPlan,
        animation: Option<&str>,
        choice: &AnimationChoice,
    ) -> PyResult<Arc<ClipStart>> {
        let is_single_sided = plan.options.cull == BackFaceCulling::All;
        let key = (animation.map(String::from), is_single_sided);
        let known = self.starts.lock().unwrap_or_else(|e| e.into_inner()).get(&key).cloned();
        if let Some(start) = known {
            return Ok(start);
        }
        let cell = pool::run(py, || {
            let scene = if is_single_sided { self.single_sided() } else { self.scene.clone() };
            PosedCell::pose(scene, 0.0, choice)
        })?;
        let mut starts = self.starts.lock().unwrap_or_else(|e| e.into_inner());
        Ok(starts.entry(key).or_insert_with(|| Arc::new(ClipStart::new(cell))).clone())
    }

    /// The scene with single-sided materials.
    pub fn single_sided(&self) -> Arc<Scene> {
        let single_sided = || {
            let mut scene = Scene::clone(&self.scene);
            scene.materials.iter_mut().for_each(|material| material.double_sided = false);
            Arc::new(scene)
        };
        self.single_sided.get_or_init(single_sided).clone()
    }
}
