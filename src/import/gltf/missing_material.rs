//! The material of primitives that have none. glTF's default is a white metal, which programs that write no materials do
//! not mean: their own windows show matte white.

use super::material;
use blinn_scene::{Material, Reflectance, Source};

/// Texts in the generators of programs that write meshes without materials.
const GENERATORS: [&str; 5] = ["mikedh/trimesh", "Open3D", "fury", "jscad-plan-to-gltf", "kulisse"];

/// Returns true if primitives without a material are matte. Files of other programs, and of those that do not name
/// themselves, have glTF's default.
pub(super) fn means_matte(source: &Source) -> bool {
    GENERATORS.iter().any(|mark| source.generator.contains(mark))
}

/// Returns a matte white material.
pub(super) fn matte() -> Material {
    let mut material = material::default();
    if let Reflectance::MetallicRoughness { metallic, .. } = &mut material.reflectance {
        metallic.factor = 0.0;
    }
    material
}
