//! KHR_materials_iridescence.

use ::gltf::json::texture::Info;
use serde::Deserialize;

use super::json_tree::Object;
use super::texture_slots::TextureSlots;
use super::untyped_extension;
use crate::error::Warnings;
use blinn_scene::{Iridescence, TextureChannel};

pub(super) const NAME: &str = "KHR_materials_iridescence";

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonIridescence {
    iridescence_factor: f32,
    iridescence_texture: Option<Info>,
    iridescence_ior: Option<f32>,
    iridescence_thickness_minimum: Option<f32>,
    iridescence_thickness_maximum: Option<f32>,
    iridescence_thickness_texture: Option<Info>,
}

/// Reads the thin film of a material from its extensions that are not typed.
pub(super) fn read(others: Option<&Object>, slots: &mut TextureSlots) -> Iridescence {
    let json: JsonIridescence = untyped_extension::read(others, NAME);
    let default = Iridescence::default();
    Iridescence {
        factor: slots.scalar(json.iridescence_factor, json.iridescence_texture.as_ref(), TextureChannel::R),
        ior: json.iridescence_ior.unwrap_or(default.ior).max(1.0),
        min_thickness: json.iridescence_thickness_minimum.unwrap_or(default.min_thickness),
        max_thickness: json.iridescence_thickness_maximum.unwrap_or(default.max_thickness),
        thickness_texture: slots.info(json.iridescence_thickness_texture.as_ref()),
    }
}

/// Removes members of the wrong type, each with a warning.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    untyped_extension::repair::<JsonIridescence>(material, NAME, location, warnings);
}
