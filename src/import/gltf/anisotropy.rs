//! KHR_materials_anisotropy.

use ::gltf::json::texture::Info;
use serde::Deserialize;

use super::json_tree::Object;
use super::texture_slots::TextureSlots;
use super::untyped_extension;
use crate::error::Warnings;
use blinn_scene::{Anisotropy, AnisotropyModel};

pub(super) const NAME: &str = "KHR_materials_anisotropy";

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonAnisotropy {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
    anisotropy_texture: Option<Info>,
}

/// Reads the anisotropy of a material from its extensions that are not typed; `None` without the extension.
pub(super) fn read(others: Option<&Object>, slots: &mut TextureSlots) -> Option<Anisotropy> {
    others?.get(NAME)?;
    let json: JsonAnisotropy = untyped_extension::read(others, NAME);
    Some(Anisotropy {
        strength: json.anisotropy_strength,
        rotation: json.anisotropy_rotation,
        texture: slots.info(json.anisotropy_texture.as_ref()),
        model: AnisotropyModel::Gltf,
    })
}

/// Removes members of the wrong type, each with a warning.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    untyped_extension::repair::<JsonAnisotropy>(material, NAME, location, warnings);
}
