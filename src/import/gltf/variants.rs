//! KHR_materials_variants: alternative sets of materials.

use ::gltf::json::mesh::Primitive;
use serde_json::Value;

use super::document::Document;
use crate::error::LoadError;
use crate::files::escape::printable;

pub(super) const NAME: &str = "KHR_materials_variants";

/// Names of the file's variants, in order.
pub(super) fn names(doc: &Document<'_>) -> Vec<String> {
    let extension = doc.root().extensions.as_ref().and_then(|e| e.others.get(NAME));
    let list = extension.and_then(|v| v.get("variants")).and_then(Value::as_array);
    let name = |v: &Value| v.get("name").and_then(Value::as_str).unwrap_or_default().to_string();
    list.into_iter().flatten().map(name).collect()
}

/// Index of the named variant; `none` selects the default materials.
///
/// # Errors
/// The file has no variant with this name.
pub(super) fn find(doc: &Document<'_>, name: Option<&str>) -> Result<Option<usize>, LoadError> {
    let Some(name) = name else { return Ok(None) };
    let names = names(doc);
    match names.iter().position(|n| n == name) {
        Some(index) => Ok(Some(index)),
        None if name == "none" => Ok(None),
        None => Err(unknown_variant(name, &names)),
    }
}

/// The error of a variant that does not exist.
pub(crate) fn unknown_variant(name: &str, names: &[String]) -> LoadError {
    let list: Vec<String> = names.iter().map(|n| format!("'{}'", printable(n))).collect();
    let list = if list.is_empty() { "none".into() } else { list.join(", ") };
    let message = format!("no material variant '{}'; available: {list}", printable(name));
    LoadError::invalid("variants", message)
}

/// The primitive's material in a variant; its default material if the variant does not map it.
pub(super) fn material(json: &Primitive, variant: Option<usize>) -> Option<usize> {
    let mappings = json.extensions.as_ref().and_then(|e| e.others.get(NAME)?.get("mappings")?.as_array());
    let applies = |mapping: &&Value| {
        let variants = mapping.get("variants").and_then(Value::as_array);
        variants.into_iter().flatten().any(|v| v.as_u64().is_some_and(|v| Some(v as usize) == variant))
    };
    let mapped = mappings.into_iter().flatten().find(applies);
    let mapped = mapped.and_then(|m| m.get("material")).and_then(Value::as_u64).map(|i| i as usize);
    mapped.or(json.material.map(|m| m.value()))
}
