//! The glTF version in `asset`.

use serde_json::{Map, Value, json};

use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;

/// The message for files of glTF 1.0.
pub(super) const VERSION_1: &str =
    "glTF 1.0 is not supported; convert the file to glTF 2.0, for example with gltf-pipeline or Blender";

/// Checks `asset.version`, and inserts it if it is missing or a number.
pub(super) fn check(root: &mut Map<String, Value>, warnings: &mut Warnings) -> Result<(), LoadError> {
    // In glTF 1.0 the top-level collections are objects.
    let is_version_1 =
        ["meshes", "nodes", "accessors", "scenes"].iter().any(|k| root.get(*k).is_some_and(Value::is_object));
    let asset = root.entry("asset").or_insert_with(|| json!({}));
    let version = text_or_number(asset.get("version"));
    let is_old = |v: &str| v == "1" || v.starts_with("1.") || v.starts_with("0.");
    if is_version_1 || version.as_deref().is_some_and(is_old) {
        return Err(LoadError::Unsupported(VERSION_1.into()));
    }
    match &version {
        None => warnings.add("asset.version", "version is missing; used 2.0"),
        Some(v) if v != "2" && !v.starts_with("2.") => {
            let message = format!("glTF version {} is not supported; expected 2.0", printable(v));
            return Err(LoadError::Unsupported(message));
        }
        Some(v) => {
            if asset["version"].is_number() {
                warnings.add("asset.version", format_args!("read the number {v} as text"));
            }
        }
    }
    if !asset.is_object() {
        *asset = json!({});
    }
    asset["version"] = json!(version.unwrap_or_else(|| "2.0".into()));
    check_min_version(asset, warnings);
    Ok(())
}

/// Warns of a file that needs a newer version than glTF 2.0.
fn check_min_version(asset: &mut Value, warnings: &mut Warnings) {
    let Some(version) = text_or_number(asset.get("minVersion")) else { return };
    let mut parts = version.split('.').map(|part| part.parse::<u64>().unwrap_or(0));
    if (parts.next(), parts.next()) > (Some(2), Some(0)) {
        let message = format!("the file needs glTF {}; ignored features newer than 2.0", printable(&version));
        warnings.add("asset.minVersion", message);
    }
    asset["minVersion"] = json!(version);
}

fn text_or_number(value: Option<&Value>) -> Option<String> {
    match value {
        Some(Value::String(s)) => Some(s.trim().to_string()),
        Some(Value::Number(n)) => Some(n.to_string()),
        _ => None,
    }
}
