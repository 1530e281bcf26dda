//! glTF 2.0 importer.
//!
//! Stages: container (GLB chunks), JSON parsing with repairs and validation, buffers, then the scene's nodes,
//! meshes, materials, skins and animations. The crate `gltf` provides only the typed JSON (`gltf::json`): its
//! importer and accessor views trust the file.

mod accessor;
mod animation;
mod anisotropy;
mod area_light;
mod attributes;
mod blender;
mod blinn_extras;
mod buffers;
mod build;
mod bump_nodes;
mod clearcoat;
mod coincident_meshes;
mod color;
mod container;
mod diffuse_transmission;
mod dispersion;
mod document;
mod draco;
mod edge_visibility;
mod extensions;
#[cfg(test)]
mod fixture;
mod float_integers;
mod forest;
mod graph;
mod image_based_light;
mod instancing;
mod iridescence;
mod json_tree;
mod keys;
mod levels_of_detail;
mod light;
mod light_temperature;
mod lost_lights;
mod material;
mod material_schema;
mod material_table;
mod meshopt;
mod meshopt_extension;
mod missing_material;
mod morph_targets;
mod node_light;
mod null_values;
mod objects;
mod parse;
mod photometric_light;
mod pointer;
mod primitive;
mod ranges;
mod references;
mod registry;
mod required;
mod round_primitive;
mod sheen;
mod skin;
mod sun_strengths;
mod target_attributes;
#[cfg(test)]
mod tests;
mod text_repair;
mod texture;
mod texture_slots;
mod topology;
mod undisplayed;
mod untyped_extension;
mod validate;
mod variants;
mod version;

use super::error::{LoadError, Warning, Warnings};
use super::files::scene_folder::SceneFolder;
use super::options::LoadOptions;
use blinn_scene::Scene;

pub(super) use variants::unknown_variant;

/// Loads a scene from the bytes of a .gltf or .glb.
pub(super) fn load(
    bytes: &[u8],
    folder: &SceneFolder,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let mut warnings = Warnings::default();
    let container = container::split(bytes, &mut warnings)?;
    let doc = document::Document::open(&container, folder, options, &mut warnings)?;
    let scene = build::scene(&doc, options, &mut warnings)?;
    Ok((scene, warnings.into_vec()))
}
