//! Estimates the peak memory of rendering a scene, and checks it against the memory limit before anything is allocated.

use crate::edge_memory::edge_bytes;
use crate::error::SessionError;
use crate::memory::limit_bytes;
use crate::noise_sources::noise_sources;
use crate::options::Options;
use crate::plan::SessionPlan;
use blinn_accel::{FlattenBudget, MAX_STORED_TRIANGLES};
use blinn_core::worded;
use blinn_render::{MATTE_RANKS, light_layer_bytes, noise_filter_bytes};
use blinn_scene::{AlphaMode, Image, Material, Mesh, Scene};

/// Per triangle in a BVH, while it is built: 105 where triangles lie in a regular grid, 87 to 103 in others.
const BVH_TRIANGLE: u64 = 108;
/// Per triangle that a build stores beside.
const STORED_TRIANGLE: u64 = 48;
/// Per triangle in a BVH that is kept for the next time.
const KEPT_BVH_TRIANGLE: u64 = 88;
/// Per point and line in a BVH, and its sort.
const BVH_POINT: u64 = 24;
const BVH_LINE: u64 = 36;
/// Per texel of an image whose mip maps are computed: the colours of two levels.
const MIPS_TEXEL: u64 = 5;
/// Per pixel: the picture of the edges.
const EDGES_PIXEL: u64 = 16;
/// Per instance at one time: its transform, and its part of the top-level BVH while that is built.
const INSTANCE: u64 = 512;
/// Per node at one time.
const NODE: u64 = 112;
/// The environment as a blurred background, while it is made.
const BLURRED_ENVIRONMENT: u64 = 14 << 20;
/// Per vertex for the bounds of an animation clip. Each morph target adds one byte.
const CLIP_BOUNDS_VERTEX: u64 = 16;
/// Per pixel of the film.
const FILM_PIXEL: u64 = 16;
/// Per pixel while an image of an unknown format is encoded, such as a frame of a video.
const ENCODING_PIXEL: u64 = 48;
/// Per pixel and AOV channel: film, and the channel of a file that holds layers.
const AOV_CHANNEL: u64 = 4;
const ENCODED_CHANNEL: u64 = 5;
/// Per pixel while the preview of a layer is encoded.
const PREVIEW_PIXEL: u64 = 28;
/// Per pixel and Cryptomatte: the end of its ids, and each id with its coverage.
const MATTE_PIXEL: u64 = 4;
const MATTE_ID: u64 = 8;
/// Returns an error if rendering `frames` frames of a scene needs more memory than allowed or available, and else the bytes
/// that it needs beside what all scenes share.
///
/// # Errors
/// As described.
pub fn check_memory(plan: &SessionPlan, scene: &Scene, frames: usize) -> Result<u64, SessionError> {
    let plan = &*plan.for_scene(scene);
    let needed = estimate(plan, scene, frames);
    let allowed = plan.max_memory.or_else(limit_bytes).unwrap_or(u64::MAX);
    if needed > allowed {
        let (needed, allowed) = (format_bytes(needed), format_bytes(allowed));
        let bound = match plan.max_memory {
            Some(_) => worded!("`max-memory` allows {}; allow more", allowed),
            None => worded!("only {} are available; set `max-memory` to try anyway", allowed),
        };
        return Err(SessionError::Option(worded!(
            "rendering needs about {} of memory, but {}, or use a smaller `size` or fewer AOVs",
            needed,
            bound
        )));
    }
    Ok(needed.saturating_sub(plan.shared_bytes()))
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
    let stored = STORED_TRIANGLE * stored_triangles(scene, plan.build.flatten, triangles);
    let built = BVH_TRIANGLE * triangles + stored + rounds + posed + kept;
    // A single picture's edges are found after its BVHs are built.
    let drawn = match kept {
        0 => built.max(KEPT_BVH_TRIANGLE * triangles + rounds + posed + edges),
        _ => built + edges,
    };
    let blurred =
        plan.options.environment_blur().map_or(0, |blur| if blur > 0.0 { BLURRED_ENVIRONMENT } else { 0 });
    (plan.shared_bytes() + blurred + scene.memory_size() + mips_bytes(scene) + drawn.max(clip_bounds))
        .saturating_add(image_bytes(plan, scene).saturating_mul(images))
}

/// Upper bound of the triangles that a build stores, of `triangles` in all BVHs. BVHs are built one after the other, and
/// those of many triangles compute them again.
fn stored_triangles(scene: &Scene, flatten: FlattenBudget, triangles: u64) -> u64 {
    let mut drawn = vec![0u64; scene.meshes.len()];
    for mesh in scene.instances.iter().map(|instance| instance.mesh as usize) {
        drawn[mesh] += scene.meshes[mesh].triangles.len() as u64;
    }
    let is_static = scene.animations.is_empty() && deformed_vertices(scene) == 0;
    // All meshes that are drawn once share a BVH, with those of few triangles. Others have one of their own.
    let (mut shared, mut flattened, mut largest) = (0u64, 0u64, 0u64);
    for (mesh, drawn) in scene.meshes.iter().zip(drawn) {
        let own = mesh.triangles.len() as u64;
        if is_static && drawn == own {
            shared += own;
        } else if drawn > 0 && own <= MAX_STORED_TRIANGLES {
            flattened += if drawn <= flatten.static_triangles { drawn } else { 0 };
            largest = largest.max(if is_static { own } else { MAX_STORED_TRIANGLES });
        }
    }
    if shared <= MAX_STORED_TRIANGLES {
        let flattened = flattened.min(flatten.static_triangles);
        largest = largest.max((shared + flattened).min(MAX_STORED_TRIANGLES));
    }
    largest.min(triangles)
}

/// Bytes of the colours from which mip maps are computed: each thread may compute those of an image.
fn mips_bytes(scene: &Scene) -> u64 {
    let texels = |image: &Image| u64::from(image.width) * u64::from(image.height);
    let mut texels: Vec<u64> = scene.images.iter().map(texels).collect();
    texels.sort_unstable_by(|a, b| b.cmp(a));
    MIPS_TEXEL * texels.iter().take(rayon::current_num_threads()).sum::<u64>()
}

/// Bytes of deformed vertices and instances at one time.
fn posed_bytes(scene: &Scene) -> u64 {
    let triangles: u64 = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
    let repetitions = (scene.instanced_triangle_count() / triangles.max(1)).max(1);
    let deformed = deformed_attribute_bytes(scene) + morphed_attribute_bytes(scene);
    deformed * repetitions + INSTANCE * scene.instances.len() as u64
}

fn deformed_meshes(scene: &Scene) -> impl Iterator<Item = &Mesh> {
    let is_deformed = |m: &&Mesh| !m.morph_targets.is_empty() || m.influences.per_vertex > 0;
    scene.meshes.iter().filter(is_deformed)
}

fn deformed_vertices(scene: &Scene) -> u64 {
    deformed_meshes(scene).map(|m| m.positions.len() as u64).sum()
}

/// Bytes of the attributes that every deformation changes.
fn deformed_attribute_bytes(scene: &Scene) -> u64 {
    let bytes =
        |m: &Mesh| size_of_val(&m.positions[..]) + size_of_val(&m.normals[..]) + size_of_val(&m.tangents[..]);
    deformed_meshes(scene).map(|m| bytes(m) as u64).sum()
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
    let channels: u64 = options.aovs.aovs.iter().map(|aov| aov.channel_count() as u64).sum();
    let layers = match (channels, options.aovs.cryptomatte) {
        (0, false) => 0,
        _ if plan.holds_layers => (AOV_CHANNEL + ENCODED_CHANNEL) * channels,
        _ => AOV_CHANNEL * channels + PREVIEW_PIXEL,
    };
    let mattes = if options.aovs.cryptomatte { matte_bytes(plan, scene) } else { 0 };
    let edges = if options.edges.style().is_some() { EDGES_PIXEL } else { 0 };
    let encoding = plan.encoding_bytes.unwrap_or(ENCODING_PIXEL);
    let settings = options.render_settings((width, height), 0.0);
    let noise = noise_sources(options, scene);
    let encoded = pixels.saturating_mul(encoding + layers + mattes + edges);
    // Light layers are rendered after the picture, and both before the file is encoded.
    let layered = match has_light_layers(options) {
        true => {
            light_layer_bytes(&settings, &noise).saturating_add(pixels.saturating_mul(AOV_CHANNEL * channels))
        }
        false => 0,
    };
    let work = noise_filter_bytes(&settings, &noise).max(layered).max(encoded);
    pixels.saturating_mul(FILM_PIXEL).saturating_add(work)
}

fn has_light_layers(options: &Options) -> bool {
    options.aovs.aovs.iter().any(|aov| aov.light().is_some())
}

/// Bytes per pixel of the Cryptomattes of an image.
fn matte_bytes(plan: &SessionPlan, scene: &Scene) -> u64 {
    let options = &plan.options;
    let is_opaque = |material: &Material| material.alpha_mode != AlphaMode::Blend;
    // A sample sees one surface, or several one behind the other.
    let seen = match scene.materials.iter().all(is_opaque) {
        true => options.samples.max(1) as usize,
        false => MATTE_RANKS,
    };
    let copies = if plan.holds_layers { 2 } else { 1 };
    let matte = |names: usize| MATTE_PIXEL + copies * MATTE_ID * names.min(seen).min(MATTE_RANKS) as u64;
    matte(scene.objects.len()) + matte(scene.materials.len())
}

/// Bytes with a unit and one decimal, such as `2.9 GiB`.
pub fn format_bytes(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match UNITS.into_iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / unit as f64),
        None => format!("{bytes} bytes"),
    }
}

#[cfg(test)]
mod tests {
    use crate::options::Options;
    use blinn_render::Denoise;
    use blinn_scene::{Environment, Instance, Lighting, Panorama};

    use super::*;

    fn needed(options: Options) -> u64 {
        let options = Options { size: Some((640, 360)), ..options };
        estimate(&SessionPlan::new(options), &Scene::default(), 1)
    }

    #[test]
    fn pictures_are_charged_for_noise_filters_that_may_run() {
        let plain = needed(Options::default());
        let lit = |denoise| needed(Options { indirect: Some(1), denoise, ..Options::default() });
        assert_eq!(needed(Options { denoise: Denoise::Off, ..Options::default() }), plain);
        assert_eq!(lit(Denoise::Off), plain);
        assert!(lit(Denoise::Auto) > plain + (8 << 20));
        assert_eq!(needed(Options { indirect: Some(1), samples: 1, ..Options::default() }), plain);
    }

    #[test]
    fn an_environment_is_shared_and_counts_once() {
        let texels = vec![[0.5; 3]; 512 * 256];
        let environment = Environment::from_panorama(Panorama::new(512, 256, texels).unwrap());
        let bytes = environment.memory_size();
        let lighting = Lighting { environment: Some(environment), ..Lighting::default() };
        let options = Options { lighting, ..Options::default() };
        assert!(bytes > 512 * 256 * 12);
        assert_eq!(needed(options.clone()), needed(Options::default()) + bytes);
        let plan = SessionPlan::new(options);
        assert_eq!(plan.scene_limits().taken_bytes, crate::shared_memory::program_bytes() + bytes);
        let claimed = check_memory(&plan, &Scene::default(), 1).unwrap();
        assert_eq!(
            claimed,
            check_memory(&SessionPlan::new(Options::default()), &Scene::default(), 1).unwrap()
        );
    }

    #[test]
    fn one_build_at_a_time_stores_triangles_unless_they_are_many() {
        const HALF: usize = MAX_STORED_TRIANGLES as usize / 2;
        let stored = |meshes: &[(usize, usize)]| {
            let mut scene = Scene::default();
            for &(triangles, uses) in meshes {
                let instance = Instance { mesh: scene.meshes.len() as u32, ..Instance::default() };
                scene.instances.extend(std::iter::repeat_n(instance, uses));
                scene.meshes.push(Mesh { triangles: vec![[0; 3]; triangles], ..Mesh::default() });
            }
            let triangles = bvh_triangles(&scene, FlattenBudget::ZERO);
            stored_triangles(&scene, FlattenBudget::ZERO, triangles) as usize
        };
        assert_eq!(stored(&[(HALF, 1)]), HALF);
        assert_eq!(stored(&[(HALF, 1), (HALF, 1)]), 2 * HALF);
        assert_eq!(stored(&[(HALF, 1), (HALF, 1), (1, 1)]), 0);
        assert_eq!(stored(&[(HALF, 2), (HALF - 1, 3), (7, 1)]), HALF);
        assert_eq!(stored(&[(2 * HALF + 1, 5)]), 0);
    }
}
