//! What a job takes in memory: as estimated before it is taken, for `--max-memory`, and in words.

use anyhow::{Result, bail};

use super::job::Job;
use crate::accel::Flatten;
use crate::scene::Scene;

/// The program itself, its threads and what they work with.
const PROGRAM: u64 = 48 << 20;
/// Bytes of a triangle in the trees while they are built.
const TREE: u64 = 320;
/// Bytes of an instance: its place, its share of the trees over instances.
const INSTANCE: u64 = 1024;
/// Bytes of a vertex that moves, at one moment.
const MOVED: u64 = 64;
/// Bytes of a pixel: on the film, on display, encoded.
const PIXEL: u64 = 64;
/// Bytes of a number of a layer: on the film, shown or encoded.
const LAYER: u64 = 16;
/// Bytes of a pixel's mattes, while they are gathered and ranked.
const MATTES: u64 = 256;

/// Bytes that pictures of `scene`, which is read, may take at most.
pub(super) fn estimate(job: &Job, scene: &Scene, frames: usize) -> u64 {
    let look = &job.look;
    let (width, height) = look.size_for(scene);
    let whole = u64::from(width) * u64::from(height);
    let pixels = look.settings.crop.map_or(whole, |c| u64::from(c.width) * u64::from(c.height));
    let triangles: u64 = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
    let drawn = scene.drawn_triangles();
    let bends = |m: &crate::scene::Mesh| !m.morphs.is_empty() || m.influences.per_vertex > 0;
    let moving = scene.meshes.iter().filter(|m| bends(m)).map(|m| m.positions.len() as u64).sum::<u64>();
    // What is drawn twice shares a tree, unless it bends or is small.
    let Flatten { still, moving: rebuilt } = job.build.flatten;
    let in_trees = if moving > 0 { drawn } else { drawn.min(triangles + still + rebuilt) };
    let moment = TREE * in_trees
        + MOVED * moving * (drawn / triangles.max(1)).max(1)
        + INSTANCE * scene.instances.len() as u64;
    let layers: u64 = look.layers.aovs.iter().map(|aov| LAYER * aov.width() as u64).sum();
    let mattes = if look.layers.cryptomatte { MATTES } else { 0 };
    let picture = pixels.saturating_mul(PIXEL + layers + mattes);
    // With many frames one is prepared and one written while one is rendered.
    let (moments, pictures) =
        if frames > 1 { (if scene.animations.is_empty() { 1 } else { 2 }, 2) } else { (1, 1) };
    (PROGRAM + scene.bytes() + moments * moment).saturating_add(picture.saturating_mul(pictures))
}

/// Refuses what would take more than was allowed.
pub(super) fn check(job: &Job, scene: &Scene, frames: usize) -> Result<()> {
    let Some(allowed) = job.max_memory else { return Ok(()) };
    let needed = estimate(job, scene, frames);
    if needed > allowed {
        bail!(
            "it would take about {} of memory, and --max-memory allows {}: allow more, or take a smaller --size or fewer --aov",
            text(needed),
            text(allowed)
        );
    }
    Ok(())
}

/// Bytes in words, to a tenth.
pub(super) fn text(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match UNITS.into_iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / unit as f64),
        None => format!("{bytes} bytes"),
    }
}
