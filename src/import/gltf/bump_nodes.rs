//! Shows the heights of Bump nodes. Blender's exporter writes the image of one as a normal map, also where a normal map is
//! plugged into the node.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::coincident_meshes::world_transforms;
use super::document::Document;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use crate::heights::{self, BYTES_PER_TEXEL, FULL_HEIGHT};
use crate::normal_maps::holds_normals;
use blinn_scene::{Image, Mesh, Scene, Texture, TextureRef, Wrap};

/// The metres that white rises above black: the default distance of a Bump node. The exporter leaves out its distance and
/// strength.
const DISTANCE: f64 = 0.001;

/// Scales beyond this one stand every normal on edge.
const MAX_SCALE: f64 = 1e6;

/// Replaces the heights that materials have as normal maps by the normals of the default relief. `root_scale` is that of the
/// scene's root: lengths of the world over those of the file.
pub(super) fn show(
    doc: &Document<'_>,
    scene: &mut Scene,
    root_scale: f64,
    warnings: &mut Warnings,
) -> Result<(), LoadError> {
    let mut has_normals: HashMap<u32, bool> = HashMap::new();
    let mut converted: HashMap<u32, u32> = HashMap::new();
    let mut instances_of_meshes = None;
    for id in 0..scene.materials.len() {
        let Some(mut map) = scene.materials[id].normal else { continue };
        let Some(&texture) = scene.textures.get(map.texture.texture as usize) else { continue };
        let image = &scene.images[texture.image as usize];
        if *has_normals.entry(texture.image).or_insert_with(|| holds_normals(image)) {
            continue;
        }
        warnings.add(
            "",
            format_args!(
                "normal map '{}' holds heights: Blender exports those of Bump nodes as normals, without distance and \
                 strength; shown {} mm high; bake a normal map to show the relief of Blender",
                printable(&image.name),
                DISTANCE * 1e3
            ),
        );
        let of_meshes = instances_of_meshes.get_or_insert_with(|| instances(scene));
        let Some(width) = image_width(scene, of_meshes, id as u32, &map.texture, image) else {
            scene.materials[id].normal = None;
            continue;
        };
        let normals = match converted.get(&map.texture.texture) {
            Some(&normals) => normals,
            None => {
                doc.budget.charge(texels(image).saturating_mul(BYTES_PER_TEXEL))?;
                let clamped = texture.wrap == [Wrap::Clamp; 2];
                let normals = heights::normal_map(image, clamped, |i| luminance(image, i));
                scene.textures.push(Texture { image: scene.images.len() as u32, ..texture });
                scene.images.push(normals);
                let normals = scene.textures.len() as u32 - 1;
                converted.insert(map.texture.texture, normals);
                normals
            }
        };
        map.texture.texture = normals;
        map.scale = (DISTANCE * root_scale / (f64::from(FULL_HEIGHT) * width)).min(MAX_SCALE) as f32;
        // Slopes are scaled.
        map.scale_is_strength = false;
        scene.materials[id].normal = Some(map);
    }
    Ok(())
}

fn texels(image: &Image) -> u64 {
    u64::from(image.width) * u64::from(image.height)
}

/// The height of a texel: Blender takes the luminance of colours.
fn luminance(image: &Image, texel: usize) -> f32 {
    let rgb = image.stored(texel).truncate();
    0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z
}

/// The instances of a mesh.
#[derive(Clone, Copy, Default)]
struct Instances {
    count: f64,
    /// Their areas over that of the mesh, summed.
    area_factor: f64,
}

/// The instances of each mesh.
fn instances(scene: &Scene) -> Vec<Instances> {
    let transforms = world_transforms(&scene.nodes);
    let mut of_meshes = vec![Instances::default(); scene.meshes.len()];
    for instance in &scene.instances {
        let length = match instance.skin {
            // The joints place a skinned mesh.
            Some(_) => 1.0,
            None => libm::cbrt(transforms[instance.node as usize].matrix3.determinant().abs()),
        };
        let of_mesh = &mut of_meshes[instance.mesh as usize];
        of_mesh.count += 1.0;
        of_mesh.area_factor += length * length;
    }
    of_meshes
}

/// The metres of a surface of `material` that the width of an image covers, in the mean of its triangles; `None` if no triangle
/// has an area and texture coordinates.
fn image_width(
    scene: &Scene,
    instances: &[Instances],
    material: u32,
    texture: &TextureRef,
    image: &Image,
) -> Option<f64> {
    let [mut surface, mut covered] = [0.0; 2];
    for (mesh, of_mesh) in scene.meshes.iter().zip(instances) {
        let Some(uvs) = mesh.uv_set(texture.uv_set).filter(|_| mesh.material == material) else { continue };
        let uvs: Vec<DVec2> = uvs.iter().map(|&uv| texture.transform.apply(uv).as_dvec2()).collect();
        let [own, of_uvs] = areas(mesh, &uvs);
        surface += of_mesh.area_factor * own;
        covered += of_mesh.count * of_uvs;
    }
    // Texels are squares.
    let width = (surface / covered * f64::from(image.width) / f64::from(image.height)).sqrt();
    (width.is_finite() && width > 0.0).then_some(width)
}

/// The area of a mesh in its own space and in that of its texture coordinates.
fn areas(mesh: &Mesh, uvs: &[DVec2]) -> [f64; 2] {
    let mut areas = [0.0; 2];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
        areas[0] += 0.5 * DVec3::cross(b - a, c - a).length();
        let [a, b, c] = triangle.map(|i| uvs[i as usize]);
        areas[1] += 0.5 * DVec2::perp_dot(b - a, c - a).abs();
    }
    areas
}
