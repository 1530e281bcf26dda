//! Scenes as they are read.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;

use super::progress::SceneLog;
use crate::plan::RenderPlan;
use crate::scene_file::load_scene_file;
use blinn_core::cancellation::CancelToken;
use blinn_import::{LoadOptions, MemoryWatch};
use blinn_scene::Scene;
use blinn_session::{Notice, Permit, SessionLog, prepare_scene};

/// Reads a scene, removes hidden objects and reports warnings. The memory that it needs is claimed from `permit`.
///
/// # Errors
/// As [`load_scene_file`]; the objects of --hide and --only-objects are not found; with --strict, the first warning.
pub fn load_scene(
    plan: &RenderPlan,
    path: &Path,
    log: &SceneLog,
    permit: &Arc<Permit>,
    cancel: &CancelToken,
) -> Result<Scene> {
    let start = Instant::now();
    let permit = permit.clone();
    let load_options = LoadOptions {
        limits: plan.session.scene_limits(),
        cancel: cancel.clone(),
        memory: MemoryWatch::new(move |bytes| permit.grow(bytes)),
        ..plan.session.options.load.clone()
    };
    let (mut scene, warnings) =
        load_scene_file(path, &load_options, plan.session.options.blender.as_deref())?;
    let is_empty = scene.instances.is_empty();
    prepare_scene(&plan.session.options, &mut scene)?;
    log.stage_since("load", start, &format!("{} triangles", scene.instanced_triangle_count()));
    log.warn_of_import(warnings)?;
    if is_empty {
        log.warn(Notice::NothingToDraw)?;
    } else if scene.instances.is_empty() {
        log.warn(Notice::NothingSelected)?;
    }
    Ok(scene)
}
