//! Converts integers that are written as floats, such as `3.0`.

use serde_json::{Value, json};

use super::json_tree::Object;
use crate::error::Warnings;

/// Names of integer properties in the core and in supported extensions.
const INTEGERS: &[&str] = &[
    "buffer",
    "bufferView",
    "byteLength",
    "byteOffset",
    "byteStride",
    "camera",
    "componentType",
    "count",
    "index",
    "indices",
    "input",
    "inverseBindMatrices",
    "light",
    "magFilter",
    "material",
    "mesh",
    "minFilter",
    "mode",
    "node",
    "output",
    "sampler",
    "scene",
    "skeleton",
    "skin",
    "source",
    "target",
    "texCoord",
    "wrapS",
    "wrapT",
];
/// Names of arrays of integers.
const INTEGER_ARRAYS: &[&str] = &["nodes", "children", "joints"];
/// Names of objects with integer values only, and of arrays of such objects.
const INTEGER_MAPS: &[&str] = &["attributes", "targets"];

/// Converts all integer properties, with one warning at the first.
pub(super) fn convert(value: &mut Value, warnings: &mut Warnings) {
    let mut converter = Converter::default();
    converter.convert(value);
    if let Some(first) = converter.first {
        warnings
            .add(first, format_args!("read {} numbers with a decimal point as integers", converter.count));
    }
}

#[derive(Default)]
struct Converter {
    count: usize,
    /// Name of the first converted property.
    first: Option<String>,
}

impl Converter {
    /// Converts the properties below `value`. The JSON parser bounds the depth of the recursion.
    fn convert(&mut self, value: &mut Value) {
        match value {
            Value::Object(object) => {
                for (key, member) in object.iter_mut().filter(|(k, _)| *k != "extras") {
                    self.convert_member(key, member);
                }
            }
            Value::Array(items) => items.iter_mut().for_each(|i| self.convert(i)),
            _ => {}
        }
    }

    fn convert_member(&mut self, name: &str, member: &mut Value) {
        match member {
            Value::Number(_) if INTEGERS.contains(&name) => self.number(name, member),
            Value::Array(items) if INTEGER_ARRAYS.contains(&name) => {
                items.iter_mut().for_each(|i| self.number(name, i));
                items.iter_mut().for_each(|i| self.convert(i));
            }
            Value::Object(map) if INTEGER_MAPS.contains(&name) => self.map(name, map),
            Value::Array(items) if INTEGER_MAPS.contains(&name) => {
                items.iter_mut().filter_map(Value::as_object_mut).for_each(|m| self.map(name, m));
            }
            other => self.convert(other),
        }
    }

    fn map(&mut self, name: &str, map: &mut Object) {
        map.values_mut().for_each(|v| self.number(name, v));
    }

    fn number(&mut self, name: &str, value: &mut Value) {
        let is_integer = |f: f64| f.fract() == 0.0 && (0.0..9e15).contains(&f);
        if value.is_f64() && value.as_f64().is_some_and(is_integer) {
            *value = json!(value.as_f64().unwrap_or(0.0) as u64);
            self.count += 1;
            self.first.get_or_insert_with(|| name.to_string());
        }
    }
}
