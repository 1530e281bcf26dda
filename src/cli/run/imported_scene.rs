//! Scenes as they are read: in their turn, or while the one before is rendered.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Result;

use super::panics;
use super::progress::SceneLog;
use crate::plan::RenderPlan;
use crate::scene_file::{is_stdin, load_scene_file};
use blinn_core::cancellation::CancelToken;
use blinn_import::{Limits, LoadOptions, Warning};
use blinn_scene::Scene;
use blinn_session::{Notice, SessionLog, load_limits, prepare_scene};

/// A scene without its hidden objects, and what is to be reported about it in its turn.
pub struct ImportedScene {
    scene: Scene,
    warnings: Vec<Warning>,
    /// True if no node has triangles.
    is_empty: bool,
    /// Time for reading it.
    pub time: Duration,
}

impl ImportedScene {
    /// Reads a scene and removes hidden objects.
    ///
    /// # Errors
    /// As [`load_scene_file`]; the objects of --hide and --only-objects are not found.
    pub fn read(
        plan: &RenderPlan,
        path: &Path,
        limits: Limits,
        cancel: &CancelToken,
    ) -> Result<ImportedScene> {
        let start = Instant::now();
        let load_options =
            LoadOptions { limits, cancel: cancel.clone(), ..plan.session.options.load.clone() };
        let (mut scene, warnings) =
            load_scene_file(path, &load_options, plan.session.options.blender.as_deref())?;
        let is_empty = scene.instances.is_empty();
        prepare_scene(&plan.session.options, &mut scene)?;
        Ok(ImportedScene { scene, warnings, is_empty, time: start.elapsed() })
    }

    /// Reports the time and the warnings.
    ///
    /// # Errors
    /// With --strict, the first warning.
    pub fn report(self, log: &SceneLog) -> Result<Scene> {
        let ImportedScene { scene, warnings, is_empty, time } = self;
        log.stage("load", time, &format!("{} triangles", scene.instanced_triangle_count()));
        log.warn_of_import(warnings)?;
        if is_empty {
            log.warn(Notice::NoTriangles)?;
        } else if scene.instances.is_empty() {
            log.warn(Notice::NothingSelected)?;
        }
        Ok(scene)
    }
}

/// The scene of a batch that follows another.
#[derive(Clone, Copy)]
pub struct NextScene<'a> {
    pub path: &'a Path,
    /// Time that it may take.
    pub timeout: Option<Duration>,
}

impl NextScene<'_> {
    /// Reads the scene before its turn, with at most `memory` bytes. `None` if that fails for any reason: the scene is read
    /// again in its turn, which reports the reason.
    pub fn read(&self, plan: &RenderPlan, memory: u64) -> Option<ImportedScene> {
        // Standard input can be read only once, and a single thread gains nothing.
        if is_stdin(self.path) || rayon::current_num_threads() == 1 {
            return None;
        }
        let cancel = self.timeout.map_or_else(CancelToken::default, CancelToken::with_timeout);
        panics::catch(|| ImportedScene::read(plan, self.path, Limits::with_memory(memory), &cancel)).ok()
    }
}

/// Reads a scene, removes hidden objects and reports warnings.
///
/// # Errors
/// As [`ImportedScene::read`] and [`ImportedScene::report`].
pub fn load_scene(plan: &RenderPlan, path: &Path, log: &SceneLog, cancel: &CancelToken) -> Result<Scene> {
    ImportedScene::read(plan, path, load_limits(plan.session.max_memory), cancel)?.report(log)
}
