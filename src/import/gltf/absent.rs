//! Members that are null, as some writers say that there are none.

use serde_json::{Map, Value};

/// Takes away every member that is null. Elements of arrays stay, where each has its place.
pub(super) fn drop_nulls(value: &mut Value) {
    each_object(value, &|object| object.retain(|_, member| !member.is_null()));
}

/// Takes away numbers of which some are null: they mean nothing without those.
pub(super) fn drop_gaps(value: &mut Value) {
    let has_gaps = |member: &Value| {
        let items = member.as_array().map_or(&[][..], Vec::as_slice);
        items.iter().any(Value::is_null) && items.iter().all(|item| item.is_null() || item.is_number())
    };
    each_object(value, &|object| object.retain(|_, member| !has_gaps(member)));
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
}
