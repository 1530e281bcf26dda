//! Removes null members, which some exporters write for absent values, and repairs names that are not
//! strings.

use serde_json::{Map, Value};

use super::json_tree::for_each_object;
use crate::import::error::Warnings;

/// Removes all object members that are null. Items of arrays keep their positions.
pub(super) fn remove_null_members(value: &mut Value) {
    for_each_object(value, &|object| object.retain(|_, member| !member.is_null()));
}

/// Removes arrays of numbers in which some are null.
pub(super) fn remove_arrays_with_null(value: &mut Value) {
    let is_incomplete = |member: &Value| {
        let items = member.as_array().map_or(&[][..], Vec::as_slice);
        items.iter().any(Value::is_null) && items.iter().all(|item| item.is_null() || item.is_number())
    };
    for_each_object(value, &|object| object.retain(|_, member| !is_incomplete(member)));
}

/// Repairs names that are not strings: numbers become text, other values are removed. One warning at the
/// first.
pub(super) fn repair_names(root: &mut Value, warnings: &mut Warnings) {
    let mut count = 0;
    let mut first = None;
    let mut repair = |object: &mut Map<String, Value>, key: &str, location: &dyn Fn() -> String| {
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
fn for_each_item(object: &mut Map<String, Value>, visit: &mut dyn FnMut(&mut Map<String, Value>, &str)) {
    for (array, items) in object.iter_mut().filter_map(|(array, v)| Some((array, v.as_array_mut()?))) {
        let objects = items.iter_mut().enumerate().filter_map(|(i, v)| Some((i, v.as_object_mut()?)));
        objects.for_each(|(i, object)| visit(object, &format!("{array}[{i}]")));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn null_members_are_removed_and_null_items_kept() {
        let mut value = json!({"a": null, "b": [null, 1, {"c": null, "d": 2}], "extras": {"e": null}});
        remove_null_members(&mut value);
        assert_eq!(value, json!({"b": [null, 1, {"d": 2}], "extras": {"e": null}}));
        remove_arrays_with_null(&mut value);
        assert_eq!(value, json!({"b": [null, 1, {"d": 2}], "extras": {"e": null}}));
        let mut value = json!({"max": [null, 1], "min": [0, 1], "extras": {"weights": [null]}});
        remove_arrays_with_null(&mut value);
        assert_eq!(value, json!({"min": [0, 1], "extras": {"weights": [null]}}));
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
