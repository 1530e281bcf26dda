//! Estimates the peak memory of rendering a scene, and checks it against the memory limit before anything is allocated.

use crate::edge_memory::edge_bytes;
use crate::error::SessionError;
use crate::memory::limit_bytes;
use crate::options::Options;
use crate::plan::SessionPlan;
use blinn_accel::{FlattenBudget, MAX_STORED_TRIANGLES};
use blinn_render::Denoise;
use blinn_scene::{Mesh, Scene};

/// The program itself, its threads and their working memory.
pub(crate) const PROGRAM: u64 = 40 << 20;
/// Per triangle in a BVH, while it is built.
const BVH_TRIANGLE: u64 = 112;
/// Per triangle that a build stores beside.
const STORED_TRIANGLE: u64 = 48;
/// Per triangle in a BVH that is kept for the next time.
const KEPT_BVH_TRIANGLE: u64 = 88;
/// Per point and line in a BVH, and its sort.
const BVH_POINT: u64 = 24;
const BVH_LINE: u64 = 36;
/// Per pixel: the picture of the edges.
const EDGES_PIXEL: u64 = 16;
/// Per instance at one time: its transform, and its part of the top-level BVH while that is built.
const INSTANCE: u64 = 512;
/// Per node at one time.
const NODE: u64 = 112;
/// Per deformed vertex at one time.
const DEFORMED_VERTEX: u64 = 64;
/// Per vertex for the bounds of an animation clip. Each morph target adds one byte.
const CLIP_BOUNDS_VERTEX: u64 = 16;
/// Per pixel: film, display colour and encoded image.
const PIXEL: u64 = 64;
/// Per pixel and AOV channel: film, and preview or encoded channel.
const AOV_CHANNEL: u64 = 12;
/// Per pixel for cryptomattes while they are collected and ranked.
const CRYPTOMATTE_PIXEL: u64 = 256;

/// Rows of a picture with a depth of field that are filtered at once, and bytes per pixel of them.
const LENS_ROWS: u64 = 168;
const LENS_PIXEL: u64 = 512;

/// Returns an error if rendering `frames` frames of a scene needs more memory than allowed or available, and else the bytes
/// that it needs beside the program itself.
///
/// # Errors
/// As described.
pub fn check_memory(plan: &SessionPlan, scene: &Scene, frames: usize) -> Result<u64, SessionError> {
    let needed = estimate(plan, scene, frames);
    let allowed = plan.max_memory.or_else(limit_bytes).unwrap_or(u64::MAX);
    if needed > allowed {
        let (needed, allowed) = (format_bytes(needed), format_bytes(allowed));
        let bound = match plan.max_memory {
            Some(_) => format!("`max-memory` allows {allowed}; allow more"),
            None => format!("only {allowed} are available; set `max-memory` to try anyway"),
        };
        return Err(SessionError::Option(format!(
            "rendering needs about {needed} of memory, but {bound}, or use a smaller `size` or fewer AOVs"
        )));
    }
    Ok(needed.saturating_sub(PROGRAM))
}

/// Upper bound in bytes for rendering `frames` frames of a loaded scene.
fn estimate(plan: &SessionPlan, scene: &Scene, frames: usize) -> u64 {
    let is_animated = !scene.animations.is_empty();
    let nodes = NODE * scene.nodes.len() as u64;
    let posed = posed_bytes(scene) + nodes;
    let triangles = bvh_triangles(scene, plan.build.flatten);
    let rounds = BVH_POINT * scene.instanced_point_count() + BVH_LINE * scene.instanced_line_count();
    // Clip bounds are found before BVHs are built. Each thread poses the nodes at another time.
    let clip_bounds = if is_animated {
        let vertices =
            |m: &Mesh| m.positions.len() as u64 * (CLIP_BOUNDS_VERTEX + m.morph_targets.len() as u64);
        posed + nodes * rayon::current_num_threads() as u64 + scene.meshes.iter().map(vertices).sum::<u64>()
    } else {
        posed
    };
    // With several frames, one is prepared and one is written while one is rendered.
    let kept_frames = u64::from(frames > 1 && is_animated);
    let neighbours = plan.options.aovs.aovs.iter().filter(|aov| aov.is_flow() && is_animated).count() as u64;
    let kept = (kept_frames + neighbours) * (KEPT_BVH_TRIANGLE * triangles + rounds + posed);
    let images = if frames > 1 { 2 } else { 1 };
    let edges = plan.options.edges.style().map_or(0, |style| edge_bytes(scene, &style));
    let stored = STORED_TRIANGLE * stored_triangles(scene, triangles);
    let built = BVH_TRIANGLE * triangles + stored + rounds + posed + kept;
    // A single picture's edges are found after its BVHs are built.
    let drawn = match kept {
        0 => built.max(KEPT_BVH_TRIANGLE * triangles + rounds + posed + edges),
        _ => built + edges,
    };
    (PROGRAM + scene.memory_size() + drawn.max(clip_bounds))
        .saturating_add(image_bytes(plan, scene).saturating_mul(images))
}

/// Upper bound of the triangles that builds store, of `triangles` in all BVHs: builds of many compute them again.
fn stored_triangles(scene: &Scene, triangles: u64) -> u64 {
    let meshes = scene.instances.iter().map(|instance| &scene.meshes[instance.mesh as usize]);
    let stored = meshes.map(|mesh| (mesh.triangles.len() as u64).min(MAX_STORED_TRIANGLES));
    stored.fold(0, u64::saturating_add).min(triangles)
}

/// Bytes of deformed vertices and instances at one time.
fn posed_bytes(scene: &Scene) -> u64 {
    let triangles: u64 = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
    let repetitions = (scene.instanced_triangle_count() / triangles.max(1)).max(1);
    let deformed = DEFORMED_VERTEX * deformed_vertices(scene) + morphed_attribute_bytes(scene);
    deformed * repetitions + INSTANCE * scene.instances.len() as u64
}

fn deformed_vertices(scene: &Scene) -> u64 {
    let is_deformed = |m: &&Mesh| !m.morph_targets.is_empty() || m.influences.per_vertex > 0;
    scene.meshes.iter().filter(is_deformed).map(|m| m.positions.len() as u64).sum()
}

/// Bytes of the texture coordinates and colours of meshes whose morph targets displace them.
fn morphed_attribute_bytes(scene: &Scene) -> u64 {
    let bytes = |m: &Mesh| {
        let has_uvs = m.morph_targets.iter().any(|target| !target.uvs.is_empty());
        let has_colors = m.morph_targets.iter().any(|target| !target.colors.is_empty());
        let uvs: usize = m.uvs.iter().map(|set| size_of_val(&set[..])).sum();
        (if has_uvs { uvs } else { 0 }) + (if has_colors { size_of_val(&m.colors[..]) } else { 0 })
    };
    scene.meshes.iter().map(|m| bytes(m) as u64).sum()
}

/// Upper bound of the triangles in all BVHs. A mesh that is drawn several times shares a BVH unless it is deformed or
/// its instances are flattened into a world-space BVH.
pub fn bvh_triangles(scene: &Scene, flatten: FlattenBudget) -> u64 {
    let all_drawn = scene.instanced_triangle_count();
    if deformed_vertices(scene) > 0 {
        return all_drawn;
    }
    let FlattenBudget { static_triangles, dynamic_triangles } = flatten;
    let mut drawn = vec![0u64; scene.meshes.len()];
    for mesh in scene.instances.iter().map(|instance| instance.mesh as usize) {
        drawn[mesh] += scene.meshes[mesh].triangles.len() as u64;
    }
    // There are two flattened BVHs, of static and of moving instances, each with a limit of its own.
    let flatten_limit = if scene.animations.is_empty() { static_triangles } else { u64::MAX };
    let mut own = 0;
    let mut flattened = 0;
    for (mesh, drawn) in scene.meshes.iter().zip(drawn) {
        let triangles = (mesh.triangles.len() as u64).min(drawn);
        own += triangles;
        flattened += if drawn <= flatten_limit { drawn - triangles } else { 0 };
    }
    (own + flattened.min(static_triangles + dynamic_triangles)).min(all_drawn)
}

/// Bytes of an image with its AOVs.
fn image_bytes(plan: &SessionPlan, scene: &Scene) -> u64 {
    let options = &plan.options;
    let (width, height) = options.size_for(scene);
    let full = u64::from(width) * u64::from(height);
    let pixels = options.crop.map_or(full, |c| u64::from(c.width) * u64::from(c.height));
    let channels: u64 = options.aovs.aovs.iter().map(|aov| AOV_CHANNEL * aov.channel_count() as u64).sum();
    let cryptomatte = if options.aovs.cryptomatte { CRYPTOMATTE_PIXEL } else { 0 };
    let edges = if options.edges.style().is_some() { EDGES_PIXEL } else { 0 };
    let lens = if has_lens_filter(options, scene) { u64::from(width) * LENS_ROWS * LENS_PIXEL } else { 0 };
    pixels.saturating_mul(PIXEL + channels + cryptomatte + edges).saturating_add(lens)
}

/// True if what the lens of a camera blurs may be filtered.
fn has_lens_filter(options: &Options, scene: &Scene) -> bool {
    let has_lens = match options.view.aperture_radius {
        Some(radius) => radius > 0.0,
        None => scene.cameras.iter().any(|camera| camera.lens.is_some()),
    };
    has_lens && options.denoise != Denoise::Off
}

/// Bytes with a unit and one decimal, such as `2.9 GiB`.
pub fn format_bytes(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match UNITS.into_iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / unit as f64),
        None => format!("{bytes} bytes"),
    }
}
