//! Lights of extensions that have a list of them at the root, to which nodes refer by index.

use ::gltf::json::{Node, Root};
use serde_json::Value;

/// Returns the index of a node's light among those of an extension.
pub(super) fn index_of(json: &Node, extension: &str) -> Option<u64> {
    json.extensions.as_ref()?.others.get(extension)?.get("light")?.as_u64()
}

/// Returns the lights of an extension.
pub(super) fn lights_of<'d>(root: &'d Root, extension: &str) -> &'d [Value] {
    let lights = root.extensions.as_ref().and_then(|e| e.others.get(extension)?.get("lights")?.as_array());
    lights.map_or(&[], Vec::as_slice)
}
