//! Repairs material properties of the wrong type or length, so that they are warnings instead of errors.

use ::gltf::json::Material;
use serde::Deserialize;
use serde_json::{Value, json};

use super::json_tree::Object;
use crate::error::Warnings;
use crate::files::escape::printable;

/// Lengths of array properties, anywhere in a material.
const LENGTHS: [(&str, usize); 9] = [
    ("baseColorFactor", 4),
    ("diffuseFactor", 4),
    ("emissiveFactor", 3),
    ("specularFactor", 3),
    ("specularColorFactor", 3),
    ("sheenColorFactor", 3),
    ("diffuseTransmissionColorFactor", 3),
    ("offset", 2),
    ("scale", 2),
];

/// Converts properties where possible, and removes those that still cannot be typed.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    convert(material, location, warnings);
    if !is_valid(material) {
        remove_invalid(material, location, &|object| is_valid(&object), warnings);
    }
}

fn is_valid(material: &Object) -> bool {
    Material::deserialize(material).is_ok()
}

/// Truncates long arrays, adds alpha 1 to RGB colours, parses numbers that are text, and replaces extensions
/// that are `true` by empty objects.
fn convert(object: &mut Object, location: &str, warnings: &mut Warnings) {
    for (key, value) in object.iter_mut().filter(|(key, _)| *key != "extras") {
        let mut warn = |message: String| warnings.add(format_args!("{location}.{}", printable(key)), message);
        let length = LENGTHS.iter().find(|(name, _)| name == key).map(|(_, length)| *length);
        match (&mut *value, length) {
            (Value::Array(list), Some(length)) if list.len() > length => {
                warn(format!("{} numbers instead of {length}; used the first {length}", list.len()));
                list.truncate(length);
            }
            (Value::Array(list), Some(4)) if list.len() == 3 => {
                warn("3 numbers instead of 4; used alpha 1".into());
                list.push(json!(1));
            }
            (Value::String(text), _) if key != "name" => {
                if let Some(number) = text.trim().parse::<f64>().ok().filter(|number| number.is_finite()) {
                    warn(format!("read the text '{}' as a number", printable(text)));
                    *value = json!(number);
                }
            }
            (Value::Object(inner), _) => {
                if key == "extensions" {
                    for (name, body) in inner.iter_mut().filter(|(_, body)| **body == Value::Bool(true)) {
                        let location = format!("{location}.extensions.{}", printable(name));
                        warnings.add(location, "true instead of an object; used an empty object");
                        *body = json!({});
                    }
                }
                convert(inner, &format!("{location}.{}", printable(key)), warnings);
            }
            _ => {}
        }
    }
}

/// Removes members that are invalid on their own; of objects, only their invalid members.
fn remove_invalid(
    object: &mut Object,
    location: &str,
    is_valid: &dyn Fn(Object) -> bool,
    warnings: &mut Warnings,
) {
    object.retain(|key, value| {
        let is_valid_alone = |value: Value| is_valid(Object::from_iter([(key.clone(), value)]));
        if is_valid_alone(value.clone()) {
            return true;
        }
        let location = format!("{location}.{}", printable(key));
        match value {
            Value::Object(inner) if is_valid_alone(json!({})) => {
                remove_invalid(inner, &location, &|inner| is_valid_alone(Value::Object(inner)), warnings);
                true
            }
            _ => {
                let value = printable(&value.to_string()).replace('"', "'");
                warnings.add(location, format_args!("ignored invalid value {value}"));
                false
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn repaired(material: Value) -> (Value, Vec<String>) {
        let mut material = material.as_object().unwrap().clone();
        let mut warnings = Warnings::default();
        repair(&mut material, "m", &mut warnings);
        assert!(is_valid(&material), "{material:?}");
        (Value::Object(material), warnings.into_lines())
    }

    #[test]
    fn valid_materials_are_unchanged() {
        let good = json!({"name": "12", "doubleSided": true, "alphaMode": "BLEND", "alphaCutoff": 0.5,
            "emissiveFactor": [1, 1, 1], "extras": {"baseColorFactor": [1, 2, 3, 4, 5], "n": "1"},
            "normalTexture": {"index": 0, "scale": 2},
            "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "baseColorTexture":
                {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0, 1], "scale": [1, 1]}}}},
            "extensions": {"KHR_materials_unlit": {}, "X": {"y": [1]},
                "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 1, 1]}}});
        assert_eq!(repaired(good.clone()), (good, Vec::new()));
    }

    #[test]
    fn invalid_properties_are_converted_or_removed_one_by_one() {
        let (material, mut lines) = repaired(json!({
            "alphaCutoff": "half", "emissiveFactor": [0, 0, 1, 1], "doubleSided": true,
            "normalTexture": {"index": 0, "scale": {}},
            "pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0], "metallicFactor": "0.25", "roughnessFactor": []},
            "extensions": {"KHR_materials_unlit": true, "KHR_materials_ior": 3, "X": [1],
                "KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1], "glossinessFactor": 0.5}},
        }));
        let pbr = "m.pbrMetallicRoughness";
        let glossy = "m.extensions.KHR_materials_pbrSpecularGlossiness";
        let invalid = "ignored invalid value";
        let mut expected = [
            "m.emissiveFactor: 4 numbers instead of 3; used the first 3".into(),
            format!("{pbr}.baseColorFactor: 3 numbers instead of 4; used alpha 1"),
            format!("{pbr}.metallicFactor: read the text '0.25' as a number"),
            "m.extensions.KHR_materials_unlit: true instead of an object; used an empty object".into(),
            format!("m.alphaCutoff: {invalid} 'half'"),
            format!("m.normalTexture: {invalid} {{'index':0,'scale':{{}}}}"),
            format!("{pbr}.roughnessFactor: {invalid} []"),
            format!("m.extensions.KHR_materials_ior: {invalid} 3"),
            format!("{glossy}.diffuseFactor: {invalid} [1]"),
        ];
        expected.sort();
        lines.sort();
        assert_eq!(lines, expected);
        assert_eq!(
            material,
            json!({"emissiveFactor": [0, 0, 1], "doubleSided": true,
                "pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1], "metallicFactor": 0.25},
                "extensions": {"KHR_materials_unlit": {}, "X": [1],
                    "KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 0.5}}})
        );
    }
}
