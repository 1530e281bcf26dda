//! Parses the JSON of a glTF. Mistakes that exporters are known to make are repaired with a warning before
//! the JSON is typed.

use std::borrow::Cow;
use std::collections::HashMap;

use ::gltf::json::Root;
use serde_json::{Value, json};

use super::json_tree::objects;
use super::target_attributes::{TargetAttributes, TargetId};
use super::text_repair::Position;
use super::{
    extensions, float_integers, null_values, references, required, target_attributes, text_repair,
    undisplayed, validate, version,
};
use crate::error::{LoadError, Warnings};

/// The typed JSON of a glTF.
#[derive(Debug)]
pub(super) struct ParsedGltf {
    /// The objects. Every index that [`references`] checks is in range, with one exception: `target.node` of
    /// an animation channel is `u32::MAX` if the channel has no node.
    pub root: Root,
    /// JSON pointers of KHR_animation_pointer by animation and channel, except those that became core
    /// channels.
    pub pointers: HashMap<(usize, usize), String>,
    /// Texture coordinates and colours of morph targets.
    pub target_attributes: HashMap<TargetId, TargetAttributes>,
    /// The extensions in the file, whether listed in `extensionsUsed` or not.
    pub extensions: extensions::ExtensionUses,
}

/// Parses, repairs and types the JSON.
pub(super) fn parse(text: &[u8], warnings: &mut Warnings) -> Result<ParsedGltf, LoadError> {
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") || text.iter().take(4).any(|&b| b == 0)
    {
        return Err(LoadError::parse("JSON", "the text is UTF-16; save it as UTF-8"));
    }
    let text = String::from_utf8_lossy(text);
    if matches!(text, Cow::Owned(_)) {
        warnings.add("JSON", "replaced bytes that are not UTF-8");
    }
    let (mut value, has_nonfinite) = parse_value(&text, warnings)?;
    null_values::repair(&mut value, has_nonfinite, warnings);
    let Some(root) = value.as_object_mut() else {
        return Err(LoadError::parse("JSON", "the JSON is not an object"));
    };
    version::check(root, warnings)?;
    float_integers::convert(&mut value, warnings);
    null_values::repair_names(&mut value, warnings);
    undisplayed::remove_invalid(&mut value, warnings);
    references::check_indices(&value)?;
    let pointers = extract_pointers(&mut value);
    let target_attributes = target_attributes::find(&mut value, warnings);
    let extensions = extensions::find_uses(&value, &pointers);
    required::insert_missing(&mut value, warnings);
    validate::validate(&mut value, warnings);
    let root = serde_path_to_error::deserialize(value).map_err(|e| {
        let path = e.path().to_string();
        LoadError::parse(path, e.into_inner())
    })?;
    Ok(ParsedGltf { root, pointers, target_attributes, extensions })
}

/// Parses JSON. Text that is not JSON is parsed once more with its defects repaired. Returns true beside the
/// value if it had NaN or infinite numbers, which are null now.
fn parse_value(text: &str, warnings: &mut Warnings) -> Result<(Value, bool), LoadError> {
    let error = |e: &serde_json::Error, at: Position| {
        let message = e.to_string();
        let message = message.split(" at line ").next().unwrap_or(&message);
        LoadError::parse(format_args!("JSON, line {} column {}", at.line, at.column), message)
    };
    let position = |e: &serde_json::Error| Position { line: e.line(), column: e.column() };
    serde_json::from_str(text).map(|value| (value, false)).or_else(|e| {
        let Some(repaired) = text_repair::repair(text) else { return Err(error(&e, position(&e))) };
        let value = serde_json::from_str(&repaired.text)
            .map_err(|e| error(&e, repaired.original_position(text, position(&e))))?;
        repaired.warn(text, warnings);
        Ok((value, repaired.has_nonfinite()))
    })
}

/// Removes the targets of KHR_animation_pointer and returns their pointers. Pointers to a node's transform or
/// weights become core channels instead.
fn extract_pointers(value: &mut Value) -> HashMap<(usize, usize), String> {
    let nodes = value.get("nodes").and_then(Value::as_array).map_or(0, Vec::len);
    let mut pointers = HashMap::new();
    for (animation, object) in objects(value, "animations") {
        let Some(channels) = object.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        for (channel, object) in channels.iter_mut().enumerate() {
            let Some(target) = object.get_mut("target").and_then(Value::as_object_mut) else { continue };
            let pointer = target.get("extensions").and_then(|e| e.get("KHR_animation_pointer"));
            let Some(pointer) = pointer.and_then(|e| e.get("pointer")).and_then(Value::as_str) else {
                continue;
            };
            let pointer = pointer.to_string();
            let parts: Vec<&str> = pointer.split('/').collect();
            if let ["", "nodes", node, path @ ("translation" | "rotation" | "scale" | "weights")] = parts[..]
                && let Some(node) = node.parse::<usize>().ok().filter(|&n| n < nodes)
            {
                target.insert("path".into(), json!(path));
                target.insert("node".into(), json!(node));
            } else {
                target.insert("path".into(), json!("pointer"));
                target.remove("node");
                pointers.insert((animation, channel), pointer);
            }
        }
    }
    pointers
}
