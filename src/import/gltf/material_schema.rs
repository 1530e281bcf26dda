//! Members of materials that are of the wrong shape: none of them costs the file.

use ::gltf::json::Material;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::import::error::Warnings;
use crate::import::files::escape::printable;

type Object = Map<String, Value>;

/// How many numbers are in what is a list of them, wherever in a material it is.
const LENGTHS: [(&str, usize); 7] = [
    ("baseColorFactor", 4),
    ("diffuseFactor", 4),
    ("emissiveFactor", 3),
    ("specularFactor", 3),
    ("specularColorFactor", 3),
    ("offset", 2),
    ("scale", 2),
];

/// Mends what can be, and leaves out what then still is no material's.
pub(crate) fn mend(material: &mut Object, place: &str, warnings: &mut Warnings) {
    reshape(material, place, warnings);
    if !fits(material) {
        prune(material, place, &|object| fits(&object), warnings);
    }
}

fn fits(material: &Object) -> bool {
    Material::deserialize(material).is_ok()
}

/// Cuts lists that are too long, makes colours without alpha opaque, numbers of what is text, and extensions of what
/// only says that there is one.
fn reshape(object: &mut Object, place: &str, warnings: &mut Warnings) {
    for (key, value) in object.iter_mut().filter(|(key, _)| *key != "extras") {
        let mut told = |what: String| warnings.add(format_args!("{place}.{}", printable(key)), what);
        let length = LENGTHS.iter().find(|(name, _)| name == key).map(|(_, length)| *length);
        match (&mut *value, length) {
            (Value::Array(list), Some(length)) if list.len() > length => {
                told(format!("{} numbers where there are {length}; the first are taken", list.len()));
                list.truncate(length);
            }
            (Value::Array(list), Some(4)) if list.len() == 3 => {
                told("3 numbers where there are 4; taken as opaque".into());
                list.push(json!(1));
            }
            (Value::String(text), _) if key != "name" => {
                if let Some(number) = text.trim().parse::<f64>().ok().filter(|number| number.is_finite()) {
                    told(format!("'{}' is text; taken as a number", printable(text)));
                    *value = json!(number);
                }
            }
            (Value::Object(inner), _) => {
                if key == "extensions" {
                    for (name, body) in inner.iter_mut().filter(|(_, body)| **body == Value::Bool(true)) {
                        let place = format!("{place}.extensions.{}", printable(name));
                        warnings.add(place, "is true and no object; taken as an empty one");
                        *body = json!({});
                    }
                }
                reshape(inner, &format!("{place}.{}", printable(key)), warnings);
            }
            _ => {}
        }
    }
}

/// Leaves out members that do not fit on their own, or what in them does not.
fn prune(object: &mut Object, place: &str, fits: &dyn Fn(Object) -> bool, warnings: &mut Warnings) {
    object.retain(|key, value| {
        let alone = |value: Value| fits(Object::from_iter([(key.clone(), value)]));
        if alone(value.clone()) {
            return true;
        }
        let place = format!("{place}.{}", printable(key));
        match value {
            Value::Object(inner) if alone(json!({})) => {
                prune(inner, &place, &|inner| alone(Value::Object(inner)), warnings);
                true
            }
            _ => {
                let what = printable(&value.to_string()).replace('"', "'");
                warnings.add(place, format_args!("{what} makes no sense here, and is left out"));
                false
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(material: Value) -> (Value, Vec<String>) {
        let (mut material, mut warnings) = (material.as_object().unwrap().clone(), Warnings::default());
        mend(&mut material, "m", &mut warnings);
        assert!(fits(&material), "{material:?}");
        (Value::Object(material), warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn what_has_the_right_shape_passes_in_silence() {
        let good = json!({"name": "12", "doubleSided": true, "alphaMode": "BLEND", "alphaCutoff": 0.5,
            "emissiveFactor": [1, 1, 1], "extras": {"baseColorFactor": [1, 2, 3, 4, 5], "n": "1"},
            "normalTexture": {"index": 0, "scale": 2},
            "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "baseColorTexture":
                {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0, 1], "scale": [1, 1]}}}},
            "extensions": {"KHR_materials_unlit": {}, "X": {"y": [1]},
                "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 1, 1]}}});
        assert_eq!(told(good.clone()), (good, Vec::new()));
    }

    #[test]
    fn what_has_another_is_mended_or_left_out_alone() {
        let (mended, words) = told(json!({
            "alphaCutoff": "half", "emissiveFactor": [0, 0, 1, 1], "doubleSided": true,
            "normalTexture": {"index": 0, "scale": {}},
            "pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0], "metallicFactor": "0.25", "roughnessFactor": []},
            "extensions": {"KHR_materials_unlit": true, "KHR_materials_ior": 3, "X": [1],
                "KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1], "glossinessFactor": 0.5}},
        }));
        let (pbr, glossy) = ("m.pbrMetallicRoughness", "m.extensions.KHR_materials_pbrSpecularGlossiness");
        let nonsense = "makes no sense here, and is left out";
        let mut expected = [
            "m.emissiveFactor: 4 numbers where there are 3; the first are taken".into(),
            format!("{pbr}.baseColorFactor: 3 numbers where there are 4; taken as opaque"),
            format!("{pbr}.metallicFactor: '0.25' is text; taken as a number"),
            "m.extensions.KHR_materials_unlit: is true and no object; taken as an empty one".into(),
            format!("m.alphaCutoff: 'half' {nonsense}"),
            format!("m.normalTexture: {{'index':0,'scale':{{}}}} {nonsense}"),
            format!("{pbr}.roughnessFactor: [] {nonsense}"),
            format!("m.extensions.KHR_materials_ior: 3 {nonsense}"),
            format!("{glossy}.diffuseFactor: [1] {nonsense}"),
        ];
        let mut words = words;
        expected.sort();
        words.sort();
        assert_eq!(words, expected);
        assert_eq!(
            mended,
            json!({"emissiveFactor": [0, 0, 1], "doubleSided": true,
                "pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1], "metallicFactor": 0.25},
                "extensions": {"KHR_materials_unlit": {}, "X": [1],
                    "KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 0.5}}})
        );
    }
}
