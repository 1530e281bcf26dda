//! Access to the untyped JSON of a glTF.

use serde_json::{Map, Value};

pub(super) type Object = Map<String, Value>;

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

/// Calls `visit` with every object below `value`, except in `extras`. The JSON parser bounds the depth of the
/// recursion.
pub(super) fn for_each_object(value: &mut Value, visit: &dyn Fn(&mut Object)) {
    match value {
        Value::Object(object) => {
            visit(object);
            let members = object.iter_mut().filter(|(name, _)| *name != "extras");
            members.for_each(|(_, member)| for_each_object(member, visit));
        }
        Value::Array(items) => items.iter_mut().for_each(|item| for_each_object(item, visit)),
        _ => {}
    }
}
