//! Access to the untyped JSON of a glTF.

use serde_json::{Map, Value};

use crate::files::escape::printable;

pub(super) type Object = Map<String, Value>;

/// A step of a JSON path.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step<'v> {
    Key(&'v str),
    Index(usize),
}

/// A JSON path as text, such as `nodes[3].mesh`.
pub(super) fn path_text(path: &[Step<'_>]) -> String {
    let mut text = String::new();
    for step in path {
        match step {
            Step::Key(key) if text.is_empty() => text.push_str(&printable(key)),
            Step::Key(key) => {
                text.push('.');
                text.push_str(&printable(key));
            }
            Step::Index(i) => text.push_str(&format!("[{i}]")),
        }
    }
    text
}

/// The objects in the array `value[key]`, each with its index.
pub(super) fn objects<'v>(value: &'v mut Value, key: &str) -> impl Iterator<Item = (usize, &'v mut Object)> {
    as_objects(value.get_mut(key))
}

/// The primitives of a mesh, each with its index.
pub(super) fn primitives(mesh: &mut Object) -> impl Iterator<Item = (usize, &mut Object)> {
    as_objects(mesh.get_mut("primitives"))
}

/// The objects in an array, each with its index; none for another value.
pub(super) fn as_objects(array: Option<&mut Value>) -> impl Iterator<Item = (usize, &mut Object)> {
    let items = array.and_then(Value::as_array_mut).into_iter().flatten();
    items.enumerate().filter_map(|(i, item)| Some((i, item.as_object_mut()?)))
}

/// Calls `visit` with every object below `value` and its path, except in `extras`. The JSON parser bounds the
/// depth of the recursion.
pub(super) fn for_each_object(value: &mut Value, visit: &mut dyn FnMut(&mut Object, &[Step<'_>])) {
    visit_objects(value, &mut Vec::new(), visit);
}

fn visit_objects<'v>(
    value: &'v mut Value,
    path: &mut Vec<Step<'v>>,
    visit: &mut dyn FnMut(&mut Object, &[Step<'_>]),
) {
    match value {
        Value::Object(object) => {
            visit(object, path);
            for (name, member) in object.iter_mut().filter(|(name, _)| *name != "extras") {
                if member.is_object() || member.is_array() {
                    path.push(Step::Key(name));
                    visit_objects(member, path, visit);
                    path.pop();
                }
            }
        }
        Value::Array(items) => {
            for (i, item) in items.iter_mut().enumerate() {
                if item.is_object() || item.is_array() {
                    path.push(Step::Index(i));
                    visit_objects(item, path, visit);
                    path.pop();
                }
            }
        }
        _ => {}
    }
}
