//! KHR_materials_dispersion.

use serde::Deserialize;

use super::json_tree::Object;
use super::untyped_extension;
use crate::error::Warnings;

pub(super) const NAME: &str = "KHR_materials_dispersion";

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct JsonDispersion {
    dispersion: f32,
}

/// Reads the dispersion of a material from its extensions that are not typed.
pub(super) fn read(others: Option<&Object>) -> f32 {
    untyped_extension::read::<JsonDispersion>(others, NAME).dispersion.max(0.0)
}

/// Removes a member of the wrong type, with a warning.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    untyped_extension::repair::<JsonDispersion>(material, NAME, location, warnings);
}
