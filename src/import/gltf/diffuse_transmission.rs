//! KHR_materials_diffuse_transmission.

use ::gltf::json::texture::Info;
use serde::Deserialize;

use super::json_tree::Object;
use super::texture_slots::TextureSlots;
use super::untyped_extension;
use crate::error::Warnings;
use blinn_scene::{DiffuseTransmission, TextureChannel};

pub(super) const NAME: &str = "KHR_materials_diffuse_transmission";

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonDiffuseTransmission {
    diffuse_transmission_factor: f32,
    diffuse_transmission_texture: Option<Info>,
    diffuse_transmission_color_factor: Option<[f32; 3]>,
    diffuse_transmission_color_texture: Option<Info>,
}

/// Reads the diffuse transmission of a material from its extensions that are not typed.
pub(super) fn read(others: Option<&Object>, slots: &mut TextureSlots) -> DiffuseTransmission {
    let json: JsonDiffuseTransmission = untyped_extension::read(others, NAME);
    let color = json.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
    DiffuseTransmission {
        factor: slots.scalar(
            json.diffuse_transmission_factor,
            json.diffuse_transmission_texture.as_ref(),
            TextureChannel::A,
        ),
        color: slots.color(color.into(), json.diffuse_transmission_color_texture.as_ref()),
    }
}

/// Removes members of the wrong type, each with a warning.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    untyped_extension::repair::<JsonDiffuseTransmission>(material, NAME, location, warnings);
}
