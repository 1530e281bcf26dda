//! Differences of two JSON values, without regard to order.

use std::collections::HashMap;

use serde_json::Value;

/// A value that two JSON values have in common no more.
#[derive(Clone, Debug, PartialEq)]
pub struct JsonDifference {
    /// Where it stands, such as `materials[Red].base`.
    pub path: String,
    /// The old value; `None` if it was added.
    pub old: Option<Value>,
    /// The new value; `None` if it was removed.
    pub new: Option<Value>,
}

/// Lists the differences of two values. The order of keys does not count. Elements of lists are matched by their
/// `name` if they have one, and else by their values, so that their order does not count either; lists of numbers are
/// compared in order.
pub fn json_differences(old: &Value, new: &Value) -> Vec<JsonDifference> {
    let mut differences = Vec::new();
    compare(String::new(), Some(old), Some(new), &mut differences);
    differences
}

fn compare(path: String, old: Option<&Value>, new: Option<&Value>, out: &mut Vec<JsonDifference>) {
    match (old, new) {
        (Some(a), Some(b)) if a == b => {}
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            let added = b.keys().filter(|key| !a.contains_key(*key));
            for key in a.keys().chain(added) {
                let inside = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                compare(inside, a.get(key), b.get(key), out);
            }
        }
        (Some(Value::Array(a)), Some(Value::Array(b))) if !is_vector(a) || !is_vector(b) => {
            compare_lists(&path, a, b, out);
        }
        _ => out.push(JsonDifference { path, old: old.cloned(), new: new.cloned() }),
    }
}

/// True for a list of numbers, such as a colour.
fn is_vector(list: &[Value]) -> bool {
    !list.is_empty() && list.iter().all(Value::is_number)
}

fn compare_lists(path: &str, old: &[Value], new: &[Value], out: &mut Vec<JsonDifference>) {
    let mut of_new: HashMap<String, Vec<&Value>> = HashMap::new();
    for (key, value) in keyed(new) {
        of_new.entry(key).or_default().push(value);
    }
    of_new.values_mut().for_each(|values| values.reverse());
    let mut removed = Vec::new();
    for (key, value) in keyed(old) {
        match of_new.get_mut(&key).and_then(Vec::pop) {
            Some(other) => compare(format!("{path}[{key}]"), Some(value), Some(other), out),
            None => removed.push((key, value)),
        }
    }
    for (key, value) in removed {
        compare(format!("{path}[{key}]"), Some(value), None, out);
    }
    // In the order of the new list.
    for (key, value) in keyed(new) {
        let is_left = |values: &&mut Vec<&Value>| values.iter().any(|left| std::ptr::eq(*left, value));
        if of_new.get_mut(&key).filter(is_left).is_some() {
            compare(format!("{path}[{key}]"), None, Some(value), out);
        }
    }
}

/// Elements with what identifies them: their name, or their value.
fn keyed(list: &[Value]) -> impl Iterator<Item = (String, &Value)> {
    list.iter().map(|value| {
        let name = value.get("name").and_then(Value::as_str).map(str::to_string);
        (name.or_else(|| value.as_str().map(str::to_string)).unwrap_or_else(|| value.to_string()), value)
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn paths(old: &Value, new: &Value) -> Vec<String> {
        json_differences(old, new).into_iter().map(|d| d.path).collect()
    }

    #[test]
    fn order_does_not_count() {
        let old =
            json!({"a": 1, "list": [{"name": "x", "v": 1}, {"name": "y", "v": 2}], "words": ["p", "q"]});
        let new =
            json!({"words": ["q", "p"], "list": [{"v": 2, "name": "y"}, {"v": 1, "name": "x"}], "a": 1});
        assert!(json_differences(&old, &new).is_empty());
    }

    #[test]
    fn changes_are_named_by_their_path() {
        let old =
            json!({"m": [{"name": "Red", "base": [1, 0, 0]}, {"name": "Red", "base": [2, 0, 0]}], "n": 3});
        let new =
            json!({"m": [{"name": "Red", "base": [1, 0, 0]}, {"name": "Red", "base": [0, 2, 0]}], "o": 3});
        assert_eq!(paths(&old, &new), ["m[Red].base", "n", "o"]);
        let found = json_differences(&json!([{"name": "a"}]), &json!([{"name": "b"}]));
        assert_eq!(
            found[0],
            JsonDifference { path: "[a]".into(), old: Some(json!({"name": "a"})), new: None }
        );
        assert_eq!(found[1].path, "[b]");
        assert_eq!(paths(&json!([1, 2]), &json!([2, 1])), [""], "the order of numbers counts");
        assert_eq!(paths(&json!({"w": ["a", "a"]}), &json!({"w": ["a"]})), ["w[a]"]);
    }
}
