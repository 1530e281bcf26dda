//! Members that say nothing: null, as some writers say that there are none, and names that are no text.

use serde_json::{Map, Value};

use crate::import::error::Warnings;

/// Takes away every member that is null. Elements of arrays stay, where each has its place.
pub(crate) fn drop_nulls(value: &mut Value) {
    each_object(value, &|object| object.retain(|_, member| !member.is_null()));
}

/// Takes away numbers of which some are null: they mean nothing without those.
pub(crate) fn drop_gaps(value: &mut Value) {
    let has_gaps = |member: &Value| {
        let items = member.as_array().map_or(&[][..], Vec::as_slice);
        items.iter().any(Value::is_null) && items.iter().all(|item| item.is_null() || item.is_number())
    };
    each_object(value, &|object| object.retain(|_, member| !has_gaps(member)));
}

/// Names are for people: numbers are read as text, what else they may be goes away.
pub(crate) fn mend_labels(root: &mut Value, warnings: &mut Warnings) {
    let (mut count, mut first) = (0, None);
    let mut mend = |object: &mut Map<String, Value>, label: &str, place: &dyn Fn() -> String| {
        let Some(value) = object.get_mut(label).filter(|value| !value.is_string()) else { return };
        if value.is_number() {
            *value = Value::from(value.to_string());
        } else {
            object.remove(label);
        }
        count += 1;
        first.get_or_insert_with(|| format!("{}.{label}", place()));
    };
    if let Some(asset) = root.get_mut("asset").and_then(Value::as_object_mut) {
        ["copyright", "generator"].iter().for_each(|label| mend(asset, label, &|| "asset".into()));
    }
    let lists = |object: &mut Map<String, Value>, mend: &mut dyn FnMut(&mut Map<String, Value>, &str)| {
        for (list, items) in object.iter_mut().filter_map(|(list, v)| Some((list, v.as_array_mut()?))) {
            let objects = items.iter_mut().enumerate().filter_map(|(i, v)| Some((i, v.as_object_mut()?)));
            objects.for_each(|(i, object)| mend(object, &format!("{list}[{i}]")));
        }
    };
    let Some(root) = root.as_object_mut() else { return };
    lists(root, &mut |object, place| mend(object, "name", &|| place.into()));
    let extensions = root.get_mut("extensions").and_then(Value::as_object_mut);
    for (name, extension) in extensions.into_iter().flatten() {
        let Some(extension) = extension.as_object_mut() else { continue };
        lists(extension, &mut |object, place| mend(object, "name", &|| format!("extensions.{name}.{place}")));
    }
    if let Some(first) = first {
        warnings.add(
            first,
            format_args!("{count} names that are no text: numbers were read as text, others left out"),
        );
    }
}

/// The JSON parser bounds the depth, so recursion does no harm.
fn each_object(value: &mut Value, change: &dyn Fn(&mut Map<String, Value>)) {
    match value {
        Value::Object(object) => {
            change(object);
            let read = object.iter_mut().filter(|(name, _)| *name != "extras");
            read.for_each(|(_, member)| each_object(member, change));
        }
        Value::Array(items) => items.iter_mut().for_each(|item| each_object(item, change)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn members_go_and_elements_stay() {
        let mut value = json!({"a": null, "b": [null, 1, {"c": null, "d": 2}], "extras": {"e": null}});
        drop_nulls(&mut value);
        assert_eq!(value, json!({"b": [null, 1, {"d": 2}], "extras": {"e": null}}));
        drop_gaps(&mut value);
        assert_eq!(value, json!({"b": [null, 1, {"d": 2}], "extras": {"e": null}}));
        let mut value = json!({"max": [null, 1], "min": [0, 1], "extras": {"weights": [null]}});
        drop_gaps(&mut value);
        assert_eq!(value, json!({"min": [0, 1], "extras": {"weights": [null]}}));
    }

    #[test]
    fn numbers_become_names() {
        let lights = |name: Value| json!({"KHR_lights_punctual": {"lights": [{"name": name}]}});
        let mut value = json!({
            "asset": {"copyright": 2026, "generator": [], "version": "2.0"},
            "nodes": [{"name": 1.5, "mesh": 0}, {"name": "a", "extras": {"name": 3}}, {"name": {"b": 1}}],
            "extensions": lights(json!(7)),
        });
        let mut warnings = Warnings::default();
        mend_labels(&mut value, &mut warnings);
        let expected = json!({
            "asset": {"copyright": "2026", "version": "2.0"},
            "nodes": [{"name": "1.5", "mesh": 0}, {"name": "a", "extras": {"name": 3}}, {}],
            "extensions": lights(json!("7")),
        });
        assert_eq!(value, expected);
        let told: Vec<_> = warnings.into_vec().iter().map(ToString::to_string).collect();
        let what = "5 names that are no text: numbers were read as text, others left out";
        assert_eq!(told, [format!("asset.copyright: {what}")]);
    }
}
