//! glTF 2.0: container, repair, checks, then the parts of the scene one by one.
//!
//! The JSON is typed by `gltf::json`, and nothing else of that family is used: its importer and its
//! accessor views trust the file.

mod accessor;
mod animation;
mod blender;
mod build;
mod color;
mod container;
mod document;
mod draco;
mod extensions;
#[cfg(test)]
mod fixture;
mod geometry;
mod graph;
mod instancing;
mod light;
mod material;
mod material_schema;
mod meshopt;
mod nonfinite;
mod null_members;
mod pointer;
mod references;
mod registry;
mod repair;
#[cfg(test)]
mod tests;
mod texture;
mod topology;
mod validate;
mod variants;

use super::LoadOptions;
use super::error::{LoadError, Warning, Warnings};
use crate::import::files::scene_folder::SceneFolder;
use crate::scene::Scene;

pub(crate) use variants::unknown_variant;

/// Reads a .gltf or .glb.
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
