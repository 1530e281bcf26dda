//! KHR_materials_clearcoat.

use ::gltf::json::material::NormalTexture;
use ::gltf::json::texture::Info;
use serde::Deserialize;

use super::json_tree::Object;
use super::texture_slots::TextureSlots;
use super::untyped_extension;
use crate::error::Warnings;
use blinn_scene::{Clearcoat, TextureChannel};

pub(super) const NAME: &str = "KHR_materials_clearcoat";

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonClearcoat {
    clearcoat_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<NormalTexture>,
}

/// Reads the coat of a material from its extensions that are not typed.
pub(super) fn read(others: Option<&Object>, slots: &mut TextureSlots) -> Clearcoat {
    let json: JsonClearcoat = untyped_extension::read(others, NAME);
    Clearcoat {
        factor: slots.scalar(json.clearcoat_factor, json.clearcoat_texture.as_ref(), TextureChannel::R),
        roughness: slots.scalar(
            json.clearcoat_roughness_factor,
            json.clearcoat_roughness_texture.as_ref(),
            TextureChannel::G,
        ),
        normal: json.clearcoat_normal_texture.and_then(|map| slots.normal(&map)),
    }
}

/// Removes members of the wrong type, each with a warning.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    untyped_extension::repair::<JsonClearcoat>(material, NAME, location, warnings);
}
