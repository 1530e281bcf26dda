//! Replaces numbers of materials, lights and cameras outside of the range that the specification gives.

use std::f64::consts::PI;
use std::fmt;
use std::fmt::{Display, Formatter};

use serde_json::{Value, json};

use super::json_tree::Object;
use crate::error::Warnings;

/// Largest plausible colour. Larger integers are bytes, as in MTL files.
const MAX_COLOR: f64 = 10.0;

/// The range of a property, and what replaces numbers outside.
#[derive(Clone, Copy, Debug)]
enum Range {
    /// A fraction, clamped to 0 to 1.
    Fraction,
    /// A number of at least 0, which replaces smaller ones.
    NotNegative,
    /// A linear colour, 0 to 1, possibly with alpha: see [`repair_color`].
    Color,
    /// A linear colour of any brightness: a factor of the specular colour, and that of a light in a file of Blender, which
    /// multiplies it by the colour of its temperature.
    UnboundedColor,
    /// An index of refraction: 0, or at least 1.
    Ior,
    /// A number above 0. Others are removed, which means this.
    Positive(&'static str),
}

use Range::{Color, Fraction, Ior, NotNegative, Positive, UnboundedColor};

/// Properties of a material.
const MATERIAL: [(&[&str], Range); 29] = [
    (&["pbrMetallicRoughness", "baseColorFactor"], Color),
    (&["pbrMetallicRoughness", "metallicFactor"], Fraction),
    (&["pbrMetallicRoughness", "roughnessFactor"], Fraction),
    (&["emissiveFactor"], Color),
    (&["alphaCutoff"], NotNegative),
    (&["occlusionTexture", "strength"], Fraction),
    (&["extensions", "KHR_materials_emissive_strength", "emissiveStrength"], NotNegative),
    (&["extensions", "KHR_materials_ior", "ior"], Ior),
    (&["extensions", "KHR_materials_specular", "specularFactor"], Fraction),
    (&["extensions", "KHR_materials_specular", "specularColorFactor"], UnboundedColor),
    (&["extensions", "KHR_materials_transmission", "transmissionFactor"], Fraction),
    (&["extensions", "KHR_materials_clearcoat", "clearcoatFactor"], Fraction),
    (&["extensions", "KHR_materials_clearcoat", "clearcoatRoughnessFactor"], Fraction),
    (&["extensions", "KHR_materials_volume", "thicknessFactor"], NotNegative),
    (&["extensions", "KHR_materials_volume", "attenuationColor"], Color),
    (&["extensions", "KHR_materials_volume", "attenuationDistance"], Positive("infinity")),
    (&["extensions", GLOSSY, "diffuseFactor"], Color),
    (&["extensions", GLOSSY, "specularFactor"], Color),
    (&["extensions", GLOSSY, "glossinessFactor"], Fraction),
    // Extensions of the registry that are not shown still decide whether a warning says so.
    (&["extensions", "KHR_materials_sheen", "sheenColorFactor"], Color),
    (&["extensions", "KHR_materials_sheen", "sheenRoughnessFactor"], Fraction),
    (&["extensions", "KHR_materials_diffuse_transmission", "diffuseTransmissionFactor"], Fraction),
    (&["extensions", "KHR_materials_diffuse_transmission", "diffuseTransmissionColorFactor"], Color),
    (&["extensions", "KHR_materials_iridescence", "iridescenceFactor"], Fraction),
    (&["extensions", "KHR_materials_iridescence", "iridescenceIor"], Ior),
    (&["extensions", "KHR_materials_iridescence", "iridescenceThicknessMinimum"], NotNegative),
    (&["extensions", "KHR_materials_iridescence", "iridescenceThicknessMaximum"], NotNegative),
    (&["extensions", "KHR_materials_anisotropy", "anisotropyStrength"], Fraction),
    (&["extensions", "KHR_materials_dispersion", "dispersion"], NotNegative),
];
const GLOSSY: &str = "KHR_materials_pbrSpecularGlossiness";

/// Properties of a perspective camera.
const PERSPECTIVE: [(&[&str], Range); 1] = [(&["aspectRatio"], Positive("that of the image"))];

/// Properties of a light.
const LIGHT: [(&[&str], Range); 3] =
    [(&["color"], Color), (&["intensity"], NotNegative), (&["range"], Positive("infinity"))];

/// Properties of a light in a file of Blender.
const BLENDER_LIGHT: [(&[&str], Range); 3] = [(&["color"], UnboundedColor), LIGHT[1], LIGHT[2]];

/// Properties of an area light.
const AREA_LIGHT: [(&[&str], Range); 4] = [
    (&["color"], Color),
    (&["intensity"], NotNegative),
    (&["size"], Positive("1")),
    (&["rect", "aspect"], Positive("1")),
];

/// Properties of an area light in a file of Blender.
const BLENDER_AREA_LIGHT: [(&[&str], Range); 4] =
    [(&["color"], UnboundedColor), AREA_LIGHT[1], AREA_LIGHT[2], AREA_LIGHT[3]];

/// The JSON path of a property.
#[derive(Clone, Copy)]
struct Location<'l> {
    object: &'l str,
    path: &'l [&'l str],
}

impl Display for Location<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.object)?;
        self.path.iter().try_for_each(|name| write!(f, ".{name}"))
    }
}

/// Repairs the numbers of a material.
pub(super) fn repair_material(material: &mut Object, location: &str, warnings: &mut Warnings) {
    repair_all(&MATERIAL, material, location, warnings);
}

/// Repairs the numbers of a light, except the angles of its cone.
pub(super) fn repair_light(light: &mut Object, is_blender: bool, location: &str, warnings: &mut Warnings) {
    repair_all(if is_blender { &BLENDER_LIGHT } else { &LIGHT }, light, location, warnings);
}

/// Repairs the numbers of an area light.
pub(super) fn repair_area_light(
    light: &mut Object,
    is_blender: bool,
    location: &str,
    warnings: &mut Warnings,
) {
    repair_all(if is_blender { &BLENDER_AREA_LIGHT } else { &AREA_LIGHT }, light, location, warnings);
}

/// Repairs the numbers of a perspective camera. A vertical field of view above π is in degrees.
pub(super) fn repair_perspective(camera: &mut Object, location: &str, warnings: &mut Warnings) {
    repair_all(&PERSPECTIVE, camera, location, warnings);
    if let Some(yfov) = camera.get("yfov").and_then(Value::as_f64).filter(|yfov| (PI..180.0).contains(yfov)) {
        warnings.add(format_args!("{location}.yfov"), format_args!("{yfov} exceeds π: read as degrees"));
        camera.insert("yfov".into(), json!(yfov.to_radians()));
    }
}

fn repair_all(ranges: &[(&[&str], Range)], object: &mut Object, location: &str, warnings: &mut Warnings) {
    let has_extensions = object.contains_key("extensions");
    for &(path, range) in ranges.iter().filter(|(path, _)| has_extensions || path[0] != "extensions") {
        let Some((key, parents)) = path.split_last() else { continue };
        let mut parent = Some(&mut *object);
        for name in parents {
            parent = parent.and_then(|object| object.get_mut(*name)?.as_object_mut());
        }
        if let Some(parent) = parent {
            repair(parent, key, range, Location { object: location, path }, warnings);
        }
    }
}

fn repair(object: &mut Object, key: &str, range: Range, location: Location<'_>, warnings: &mut Warnings) {
    let Some(value) = object.get_mut(key) else { return };
    if let (Color | UnboundedColor, Value::Array(components)) = (range, &mut *value) {
        let warn = |message: &str| warnings.add(location, message);
        return match range {
            Color => repair_color(components, warn),
            _ => remove_negative(components, warn),
        };
    }
    let Some(number) = value.as_f64() else { return };
    match range {
        NotNegative if number < 0.0 => {
            warnings.add(location, format_args!("ignored negative value {number}; used 0"));
            *value = json!(0);
        }
        Fraction if !(0.0..=1.0).contains(&number) => {
            let nearest = if number < 0.0 { 0 } else { 1 };
            warnings.add(location, format_args!("ignored value {number} outside of 0 to 1; used {nearest}"));
            *value = json!(nearest);
        }
        Ior if number != 0.0 && number < 1.0 => {
            warnings.add(location, format_args!("ignored value {number}, which is less than 1; used 1"));
            *value = json!(1);
        }
        Positive(default) if number <= 0.0 => {
            let message = format!("ignored value {number}, which is not positive; used {default}");
            warnings.add(location, message);
            object.remove(key);
        }
        _ => {}
    }
}

/// Repairs a linear colour of three components, or four with alpha.
///
/// - Integers far above 1 are bytes, 0 to 255. So is alpha alone.
/// - Components below 0 become 0, and alpha above 1 becomes 1.
/// - Other components above 1 are kept, with a warning.
fn repair_color(components: &mut [Value], mut warn: impl FnMut(&str)) {
    let Some(mut color) = components.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>() else { return };
    if color.len() < 3 {
        return;
    }
    let written = color.clone();
    let (rgb, alpha) = color.split_at_mut(3);
    let max = rgb.iter().copied().fold(0.0, f64::max);
    let is_byte = |v: &f64| (0.0..=255.0).contains(v) && v.fract() == 0.0;
    let max_alpha = alpha.iter().copied().fold(0.0, f64::max);
    if rgb.iter().all(is_byte) && (max > MAX_COLOR || max > 1.0 && max_alpha > MAX_COLOR) {
        rgb.iter_mut().for_each(|v| *v /= 255.0);
        alpha.iter_mut().filter(|v| **v > 1.0).for_each(|v| *v /= 255.0);
        warn("exceeds 1: read as bytes from 0 to 255");
    } else if alpha.iter().all(is_byte) && max_alpha > MAX_COLOR {
        alpha.iter_mut().for_each(|v| *v /= 255.0);
        warn("alpha exceeds 1: read as a byte from 0 to 255");
    } else if max > 1.0 {
        warn(&format!("has the value {max}, expected 0 to 1 or bytes"));
    }
    if let Some(alpha) = color.get_mut(3).filter(|v| **v > 1.0) {
        warn(&format!("alpha {alpha} exceeds 1; used 1"));
        *alpha = 1.0;
    }
    if color != written {
        components.iter_mut().zip(color).for_each(|(component, v)| *component = json!(v));
    }
    remove_negative(components, warn);
}

/// Replaces components below 0 by 0.
fn remove_negative(components: &mut [Value], mut warn: impl FnMut(&str)) {
    let is_negative = |v: &Value| v.as_f64().is_some_and(|v| v < 0.0);
    if components.iter().any(is_negative) {
        warn("used 0 instead of a negative value");
        components.iter_mut().filter(|v| is_negative(v)).for_each(|v| *v = json!(0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn color(written: Value) -> (Value, Vec<String>) {
        let mut components = written.as_array().unwrap().clone();
        let mut messages = Vec::new();
        repair_color(&mut components, |message| messages.push(message.to_string()));
        (Value::Array(components), messages)
    }

    #[test]
    fn bytes_negative_and_bright_colours_are_told_apart() {
        let bytes = "exceeds 1: read as bytes from 0 to 255";
        let unit = |v: f64| v / 255.0;
        for (written, expected, message) in [
            (json!([94, 94, 94, 255]), json!([unit(94.0), unit(94.0), unit(94.0), 1.0]), bytes),
            (json!([255, 0, 0, 1]), json!([1.0, 0.0, 0.0, 1.0]), bytes),
            (json!([2.0, 3, 1, 255]), json!([unit(2.0), unit(3.0), unit(1.0), 1.0]), bytes),
            (json!([0, 128, 255]), json!([0.0, unit(128.0), 1.0]), bytes),
            (
                json!([1, 0, 0, 255]),
                json!([1.0, 0.0, 0.0, 1.0]),
                "alpha exceeds 1: read as a byte from 0 to 255",
            ),
            (
                json!([0.5, 0.5, 0.5, 51]),
                json!([0.5, 0.5, 0.5, 0.2]),
                "alpha exceeds 1: read as a byte from 0 to 255",
            ),
            (json!([-0.5, 0.5, 0, 1]), json!([0.0, 0.5, 0, 1]), "used 0 instead of a negative value"),
            (json!([0.5, 0.5, 0, 1.5]), json!([0.5, 0.5, 0.0, 1.0]), "alpha 1.5 exceeds 1; used 1"),
            (json!([1.5, 1, 1, 1]), json!([1.5, 1, 1, 1]), "has the value 1.5, expected 0 to 1 or bytes"),
            (json!([300, 0, 0]), json!([300, 0, 0]), "has the value 300, expected 0 to 1 or bytes"),
            (json!([93.5, 0, 0]), json!([93.5, 0, 0]), "has the value 93.5, expected 0 to 1 or bytes"),
        ] {
            assert_eq!(color(written.clone()), (expected, vec![message.to_string()]), "{written}");
        }
        for valid in [json!([0, 0.5, 1, 1]), json!([1, 1, 1]), json!([0, 0, 0, 0]), json!(["a", 2, 3])] {
            assert_eq!(color(valid.clone()), (valid, vec![]));
        }
    }
}
