//! The materials and textures that a scene uses, numbered in the order of their first use.

use std::collections::HashMap;

use super::document::Document;
use super::primitive::PrimitiveId;
use super::texture::Textures;
use super::{blender, blinn_extras, material, missing_material, variants};
use crate::error::{LoadError, Warnings};
use blinn_scene::{Material, Source};

/// The materials of the primitives, and their textures.
pub(super) struct MaterialTable {
    pub materials: Vec<Material>,
    pub textures: Textures,
    /// Material of each primitive.
    pub by_primitive: HashMap<PrimitiveId, u32>,
    /// The scene's material for an index of the file.
    pub by_index: HashMap<usize, u32>,
}

impl MaterialTable {
    /// Reads the materials of `primitives` in a variant, for a file of this `source`.
    pub fn read(
        doc: &Document<'_>,
        primitives: &[PrimitiveId],
        variant: Option<usize>,
        source: &Source,
    ) -> Result<(MaterialTable, Warnings), LoadError> {
        let is_blender = source.is_blender();
        let mut warnings = Warnings::default();
        let mut order: Vec<Option<usize>> = Vec::new();
        let mut ids: HashMap<Option<usize>, u32> = HashMap::new();
        let mut by_primitive = HashMap::new();
        for primitive in primitives {
            let index = primitive.json(doc).and_then(|p| variants::material(p, variant));
            let id = *ids.entry(index).or_insert_with(|| {
                order.push(index);
                order.len() as u32 - 1
            });
            by_primitive.insert(*primitive, id);
        }
        let json = |index: &Option<usize>| index.and_then(|i| doc.root().materials.get(i));
        let used = used_textures(doc, order.iter().filter_map(json));
        let textures = Textures::read(doc, &used, &mut warnings)?;
        let read = |index: &Option<usize>| match json(index) {
            Some(json) => {
                let mut material = material::read(json, &mut |texture| textures.get(texture));
                if is_blender {
                    let extras = json.extras.as_ref().map(|raw| raw.get());
                    material.thin_wall =
                        blinn_extras::is_thin_wall(extras, index.unwrap_or_default(), &mut warnings);
                    blender::restore_shading(&mut material, json, &mut warnings);
                    blender::restore_sheen(&mut material, json);
                    blender::restore_anisotropy(&mut material);
                }
                material
            }
            None if is_blender => blender::default_material(),
            None if missing_material::means_matte(source) => missing_material::matte(),
            None => material::default(),
        };
        let materials = order.iter().map(read).collect();
        let by_index = ids.into_iter().filter_map(|(index, id)| Some((index?, id))).collect();
        Ok((MaterialTable { materials, textures, by_primitive, by_index }, warnings))
    }
}

/// The textures of materials in the order of their first use. Found by reading each material once without
/// textures.
fn used_textures<'j>(
    doc: &Document<'_>,
    materials: impl Iterator<Item = &'j ::gltf::json::Material>,
) -> Vec<usize> {
    let mut used: Vec<usize> = Vec::new();
    let mut is_used = vec![false; doc.root().textures.len()];
    for json in materials {
        material::read(json, &mut |texture| {
            if is_used.get_mut(texture).is_some_and(|s| !std::mem::replace(s, true)) {
                used.push(texture);
            }
            None
        });
    }
    used
}
