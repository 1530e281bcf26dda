//! The materials that the faces of a file name, as materials of the scene.

use std::collections::HashMap;

use super::super::error::Warnings;
use super::material::{build_material, undefined_material};
use super::material_libraries::MaterialLibraries;
use super::mtl::MtlMaterial;
use super::textures::TextureLibrary;
use blinn_core::geometry::Rgb;
use blinn_scene::{Material, named_color};

/// Returns the colour that the name of a material stands for: JSCAD writes CSS names, "default" for faces without a colour,
/// and no MTL.
pub(super) fn color_of_name(name: &str, generator: &str) -> Option<Rgb> {
    match name {
        _ if !generator.ends_with("JSCAD") => None,
        "default" => Some(Rgb::ONE),
        _ => named_color(name),
    }
}

/// The materials that faces name, added to a scene in order of first use.
pub(super) struct UsedMaterials<'l> {
    /// By the index of `usemtl`.
    names: Vec<String>,
    /// By the index of `usemtl`; `None` if no library defines the material.
    mtls: Vec<Option<&'l MtlMaterial>>,
    /// Indices into the materials of the scene; `None` is the material of faces without a name.
    indices: HashMap<Option<u32>, u32>,
}

impl<'l> UsedMaterials<'l> {
    /// Looks up the names of `usemtl`.
    pub fn new(names: Vec<String>, libraries: &'l MaterialLibraries) -> UsedMaterials<'l> {
        let mtls = names.iter().map(|name| libraries.material(name)).collect();
        UsedMaterials { names, mtls, indices: HashMap::new() }
    }

    /// The materials that libraries define.
    pub fn defined(&self) -> Vec<&'l MtlMaterial> {
        self.mtls.iter().flatten().copied().collect()
    }

    /// The definition of the material with an index of `usemtl`.
    pub fn mtl(&self, material: Option<u32>) -> Option<&'l MtlMaterial> {
        self.mtls[material? as usize]
    }

    /// Returns the index of a material in `materials`, and adds it at its first use.
    pub fn index(
        &mut self,
        material: Option<u32>,
        generator: &str,
        images: &mut TextureLibrary,
        materials: &mut Vec<Material>,
        warnings: &mut Warnings,
    ) -> u32 {
        // `usemtl` names a part even if no library defines the material.
        let name = material.map_or("", |index| self.names[index as usize].as_str());
        let slot = material.filter(|_| !name.is_empty());
        *self.indices.entry(slot).or_insert_with(|| {
            materials.push(match material.and_then(|index| self.mtls[index as usize]) {
                Some(mtl) => build_material(mtl, images, warnings),
                None => undefined_material(name, color_of_name(name, generator)),
            });
            materials.len() as u32 - 1
        })
    }
}
