//! KHR_materials_sheen.

use ::gltf::json::texture::Info;
use serde::Deserialize;

use super::json_tree::Object;
use super::texture_slots::TextureSlots;
use super::untyped_extension;
use crate::error::Warnings;
use blinn_scene::{Sheen, SheenModel, TextureChannel};

pub(super) const NAME: &str = "KHR_materials_sheen";

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct JsonSheen {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<Info>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<Info>,
}

/// Reads the sheen of a material from its extensions that are not typed.
pub(super) fn read(others: Option<&Object>, slots: &mut TextureSlots) -> Sheen {
    let json: JsonSheen = untyped_extension::read(others, NAME);
    Sheen {
        color: slots.color(json.sheen_color_factor.into(), json.sheen_color_texture.as_ref()),
        roughness: slots.scalar(
            json.sheen_roughness_factor,
            json.sheen_roughness_texture.as_ref(),
            TextureChannel::A,
        ),
        model: SheenModel::Charlie,
    }
}

/// Removes members of the wrong type, each with a warning.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    untyped_extension::repair::<JsonSheen>(material, NAME, location, warnings);
}
