//! Repairs null, which JavaScript writes for NaN and some exporters for absent values, and numbers that
//! overflow f32.

use serde_json::{Value, json};

use super::json_tree::{Object, Step, for_each_object, path_text};
use crate::error::Warnings;

/// Names of arrays of objects below the top level, where all arrays hold objects.
const OBJECT_LISTS: [&str; 8] =
    ["primitives", "targets", "channels", "samplers", "lights", "mappings", "variants", "attributes"];

/// Repairs of one kind.
#[derive(Default)]
struct Repairs {
    count: usize,
    /// Path of the first.
    first: Option<String>,
}

impl Repairs {
    fn add(&mut self, count: usize, path: &[Step<'_>], key: &str) {
        self.count += count;
        self.first.get_or_insert_with(|| path_text(&[path, &[Step::Key(key)]].concat()));
    }

    fn warn(self, what: &str, warnings: &mut Warnings) {
        if let Some(first) = self.first {
            warnings.add(first, format_args!("{} {what}", self.count));
        }
    }
}

/// Removes members that are null, and repairs null in arrays:
///
/// - Items of `children`, of a scene's `nodes` and of lists of strings are removed.
/// - Items of `weights` become 0, which leaves the other weights in place.
/// - Items of `joints` become the first joint: vertices refer to joints by position.
/// - Items of lists of objects become empty objects: indices refer to them.
/// - Other arrays, such as vectors and matrices, are removed as a whole; their defaults apply.
///
/// Numbers that overflow f32 count as null. `is_announced` is set if a warning of NaN in the text stands for
/// those of null numbers.
pub(super) fn repair(value: &mut Value, is_announced: bool, warnings: &mut Warnings) {
    let mut numbers = Repairs::default();
    let mut objects = Repairs::default();
    for_each_object(value, &mut |object, path| {
        object.retain(|key, member| match member {
            Value::Null => false,
            _ if key == "extras" => true,
            Value::Number(_) if overflows(member) => {
                numbers.add(1, path, key);
                false
            }
            Value::Array(items) => {
                let count = items.iter().filter(|item| is_missing(item)).count();
                if count == 0 {
                    return true;
                }
                if holds_objects(key, items, path.is_empty()) {
                    objects.add(count, path, key);
                    items.iter_mut().filter(|item| is_missing(item)).for_each(|item| *item = json!({}));
                    return true;
                }
                numbers.add(count, path, key);
                repair_numbers(key, items)
            }
            _ => true,
        });
    });
    if !is_announced {
        numbers.warn("values are null or too large for a 32-bit float; ignored them or the array", warnings);
    }
    objects.warn("items are null; read them as empty objects", warnings);
}

fn is_missing(value: &Value) -> bool {
    value.is_null() || overflows(value)
}

/// Returns true for a number that is infinite as f32.
fn overflows(value: &Value) -> bool {
    value.is_f64() && value.as_f64().is_some_and(|number| (number as f32).is_infinite())
}

/// Returns true for an array whose items are objects; by its name if all are null. At the top level, only
/// `extensionsUsed` and `extensionsRequired` have other items.
fn holds_objects(key: &str, items: &[Value], is_top_level: bool) -> bool {
    match items.iter().find(|item| !is_missing(item)) {
        Some(item) => item.is_object(),
        None => OBJECT_LISTS.contains(&key) || is_top_level && !key.starts_with("extensions"),
    }
}

/// Repairs an array of numbers or strings. Returns false if it is to be removed.
fn repair_numbers(key: &str, items: &mut Vec<Value>) -> bool {
    let replacement = match key {
        "weights" => Some(json!(0)),
        "joints" => items.iter().find(|item| !is_missing(item)).cloned(),
        _ => None,
    };
    if let Some(replacement) = replacement {
        items.iter_mut().filter(|item| is_missing(item)).for_each(|item| *item = replacement.clone());
        return true;
    }
    let is_list = matches!(key, "children" | "nodes" | "joints" | "variants");
    if is_list || items.iter().any(Value::is_string) {
        items.retain(|item| !is_missing(item));
        return true;
    }
    false
}

/// Repairs names that are not strings: numbers become text, other values are removed. One warning at the
/// first.
pub(super) fn repair_names(root: &mut Value, warnings: &mut Warnings) {
    let mut count = 0;
    let mut first = None;
    let mut repair = |object: &mut Object, key: &str, location: &dyn Fn() -> String| {
        let Some(value) = object.get_mut(key).filter(|value| !value.is_string()) else { return };
        if value.is_number() {
            *value = Value::from(value.to_string());
        } else {
            object.remove(key);
        }
        count += 1;
        first.get_or_insert_with(|| format!("{}.{key}", location()));
    };
    if let Some(asset) = root.get_mut("asset").and_then(Value::as_object_mut) {
        ["copyright", "generator"].iter().for_each(|key| repair(asset, key, &|| "asset".into()));
    }
    let Some(root) = root.as_object_mut() else { return };
    for_each_item(root, &mut |object, location| repair(object, "name", &|| location.into()));
    let extensions = root.get_mut("extensions").and_then(Value::as_object_mut);
    for (name, extension) in extensions.into_iter().flatten() {
        let Some(extension) = extension.as_object_mut() else { continue };
        for_each_item(extension, &mut |object, location| {
            repair(object, "name", &|| format!("extensions.{name}.{location}"));
        });
    }
    if let Some(first) = first {
        let message =
            format!("repaired {count} names that are not strings: numbers became text, others were ignored");
        warnings.add(first, message);
    }
}

/// Calls `visit` with every object in the arrays of `object`, and its location such as `nodes[3]`.
fn for_each_item(object: &mut Object, visit: &mut dyn FnMut(&mut Object, &str)) {
    for (array, items) in object.iter_mut().filter_map(|(array, v)| Some((array, v.as_array_mut()?))) {
        let objects = items.iter_mut().enumerate().filter_map(|(i, v)| Some((i, v.as_object_mut()?)));
        objects.for_each(|(i, object)| visit(object, &format!("{array}[{i}]")));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn repaired(mut value: Value) -> (Value, Vec<String>) {
        let mut warnings = Warnings::default();
        repair(&mut value, false, &mut warnings);
        (value, warnings.into_lines())
    }

    #[test]
    fn null_members_are_removed_without_a_warning() {
        let value = json!({"a": null, "b": {"c": null, "d": 2}, "extras": {"e": null, "f": [null, 1e39]}});
        let expected = json!({"b": {"d": 2}, "extras": {"e": null, "f": [null, 1e39]}});
        assert_eq!(repaired(value), (expected, Vec::new()));
    }

    #[test]
    fn null_in_arrays_is_repaired_by_what_the_array_holds() {
        let (value, warnings) = repaired(json!({
            "scenes": [null, {"nodes": [null, 1, null]}],
            "nodes": [{"translation": [null, null, null], "children": [null]}, {"matrix": [1, null]}],
            "meshes": [{"weights": [null, 0.5], "primitives": [null, {"targets": [null]}]}],
            "skins": [{"joints": [null, 3, null, 4]}, {"joints": [null]}],
            "accessors": [{"min": [null], "count": 3, "sparse": {"count": null}}],
            "extensionsUsed": ["a", null],
            "cameras": [{"perspective": {"zfar": 1e39, "yfov": 1}}],
            "materials": [null],
        }));
        let expected = json!({
            "scenes": [{}, {"nodes": [1]}],
            "nodes": [{"children": []}, {}],
            "meshes": [{"weights": [0, 0.5], "primitives": [{}, {"targets": [{}]}]}],
            "skins": [{"joints": [3, 3, 3, 4]}, {"joints": []}],
            "accessors": [{"count": 3, "sparse": {}}],
            "extensionsUsed": ["a"],
            "cameras": [{"perspective": {"yfov": 1}}],
            "materials": [{}],
        });
        assert_eq!(value, expected);
        let lines = [
            "nodes[0].translation: 14 values are null or too large for a 32-bit float; ignored them or the array",
            "scenes: 4 items are null; read them as empty objects",
        ];
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        lines.iter().for_each(|line| {
            assert!(warnings.iter().any(|w| w.ends_with(&line[line.find(": ").unwrap()..])), "{warnings:?}")
        });
    }

    #[test]
    fn numbers_become_names_and_other_values_are_removed() {
        let lights = |name: Value| json!({"KHR_lights_punctual": {"lights": [{"name": name}]}});
        let mut value = json!({
            "asset": {"copyright": 2026, "generator": [], "version": "2.0"},
            "nodes": [{"name": 1.5, "mesh": 0}, {"name": "a", "extras": {"name": 3}}, {"name": {"b": 1}}],
            "extensions": lights(json!(7)),
        });
        let mut warnings = Warnings::default();
        repair_names(&mut value, &mut warnings);
        let expected = json!({
            "asset": {"copyright": "2026", "version": "2.0"},
            "nodes": [{"name": "1.5", "mesh": 0}, {"name": "a", "extras": {"name": 3}}, {}],
            "extensions": lights(json!("7")),
        });
        assert_eq!(value, expected);
        let message = "repaired 5 names that are not strings: numbers became text, others were ignored";
        assert_eq!(warnings.into_lines(), [format!("asset.copyright: {message}")]);
    }
}
