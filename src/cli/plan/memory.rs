//! What a job takes in memory: as estimated before it is taken, for `--max-memory`, and in words.

use anyhow::{Result, bail};

use crate::accel::FlattenBudget;
use crate::bench::memory::limit_bytes;
use crate::cli::plan::Job;
use crate::import::Limits;
use crate::scene::Scene;

/// The program itself, its threads and what they work with.
const PROGRAM: u64 = 48 << 20;
/// Bytes of a triangle in the trees while they are built.
const TREE: u64 = 320;
/// Bytes of an instance at one moment: its place, its share of the tree over instances while that is built.
const INSTANCE: u64 = 512;
/// Bytes of a node at one moment.
const NODE: u64 = 112;
/// Bytes of a vertex that moves, at one moment.
const MOVED: u64 = 64;
/// Bytes of a vertex while a clip is looked through: its share of boxes, to which each morph target adds one.
const BOXES: u64 = 16;
/// Bytes of a pixel: on the film, on display, encoded.
const PIXEL: u64 = 64;
/// Bytes of a number of a layer: on the film, shown or encoded.
const LAYER: u64 = 12;
/// Bytes of a pixel's mattes, while they are gathered and ranked.
const MATTES: u64 = 256;

/// What may be read: within `--max-memory`, else within what there is. More than that would end the
/// program, and perhaps others.
pub(crate) fn limits(max_memory: Option<u64>) -> Limits {
    let all = || Limits { memory_bytes: limit_bytes().unwrap_or(u64::MAX), ..Limits::default() };
    max_memory.map_or_else(all, Limits::with_memory)
}

/// Bytes that pictures of `scene`, which is read, may take at most.
pub(crate) fn estimate(job: &Job, scene: &Scene, frames: usize) -> u64 {
    let look = &job.look;
    let (width, height) = look.size_for(scene);
    let whole = u64::from(width) * u64::from(height);
    let pixels = look.settings.crop.map_or(whole, |c| u64::from(c.width) * u64::from(c.height));
    let triangles: u64 = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
    let drawn = scene.instanced_triangle_count();
    let bends = |m: &crate::scene::Mesh| !m.morph_targets.is_empty() || m.influences.per_vertex > 0;
    let moving = scene.meshes.iter().filter(|m| bends(m)).map(|m| m.positions.len() as u64).sum::<u64>();
    // What is drawn twice shares a tree, unless it bends.
    let in_trees = if moving > 0 { drawn } else { in_trees(scene, job.build.flatten).min(drawn) };
    let nodes = NODE * scene.nodes.len() as u64;
    let posed =
        MOVED * moving * (drawn / triangles.max(1)).max(1) + INSTANCE * scene.instances.len() as u64 + nodes;
    let moment = TREE * in_trees + posed;
    // What a clip takes up is found before there are trees: each thread looks at a moment.
    let boxes = |m: &crate::scene::Mesh| m.positions.len() as u64 * (BOXES + m.morph_targets.len() as u64);
    let boxes: u64 = scene.meshes.iter().map(boxes).sum();
    let looks = if scene.animations.is_empty() { 0 } else { rayon::current_num_threads() as u64 };
    let looking = posed + nodes * looks + if looks > 0 { boxes } else { 0 };
    let layers: u64 = look.layers.aovs.iter().map(|aov| LAYER * aov.channel_count() as u64).sum();
    let mattes = if look.layers.cryptomatte { MATTES } else { 0 };
    let picture = pixels.saturating_mul(PIXEL + layers + mattes);
    // With many frames one is prepared and one written while one is rendered.
    let (moments, pictures) =
        if frames > 1 { (if scene.animations.is_empty() { 1 } else { 2 }, 2) } else { (1, 1) };
    (PROGRAM + scene.memory_size() + (moments * moment).max(looking))
        .saturating_add(picture.saturating_mul(pictures))
}

/// Triangles in all trees at most, where none bend: of a mesh that is drawn twice its own, or all that are drawn of
/// it while a world may take them.
fn in_trees(scene: &Scene, flatten: FlattenBudget) -> u64 {
    let FlattenBudget { static_triangles: still, dynamic_triangles: moving } = flatten;
    let mut drawn = vec![0u64; scene.meshes.len()];
    for mesh in scene.instances.iter().map(|instance| instance.mesh as usize) {
        drawn[mesh] += scene.meshes[mesh].triangles.len() as u64;
    }
    let (mut own, mut taken) = (0, 0);
    for (mesh, drawn) in scene.meshes.iter().zip(drawn) {
        let triangles = (mesh.triangles.len() as u64).min(drawn);
        // Of what moves and what does not, a world takes each by itself.
        let most = if scene.animations.is_empty() { still } else { u64::MAX };
        own += triangles;
        taken += if drawn <= most { drawn - triangles } else { 0 };
    }
    own + taken.min(still + moving)
}

/// Refuses what would take more than was allowed, or more than there is.
pub(crate) fn check(job: &Job, scene: &Scene, frames: usize) -> Result<()> {
    let (allowed, who) = match job.max_memory {
        Some(bytes) => (bytes, "--max-memory allows"),
        None => (limit_bytes().unwrap_or(u64::MAX), "without --max-memory there are"),
    };
    let needed = estimate(job, scene, frames);
    if needed > allowed {
        bail!(
            "it would take about {} of memory, and {who} {}: allow more, or take a smaller --size or fewer --aov",
            text(needed),
            text(allowed)
        );
    }
    Ok(())
}

/// Bytes in words, to a tenth.
pub(crate) fn text(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match UNITS.into_iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / unit as f64),
        None => format!("{bytes} bytes"),
    }
}
