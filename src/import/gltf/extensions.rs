//! Extension support: errors for unsupported required extensions, and warnings for unsupported extensions in
//! use.

use std::collections::{BTreeMap, HashMap};

use ::gltf::json::Root;
use serde_json::{Map, Value};

use super::registry::Support::{Ignored, NotRequirable, Partial, Supported, Unrendered};
use super::registry::support;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;

/// The objects that use an extension.
#[derive(Debug, Default)]
pub(super) struct ExtensionUsers {
    /// Materials, by their indices in the file.
    pub materials: Vec<usize>,
    /// True if another object uses it.
    others: bool,
}

/// Users of each extension in the file, by name.
pub(super) type ExtensionUses = BTreeMap<String, ExtensionUsers>;

const UNLIT: &str = "KHR_materials_unlit";

/// Factors of material extensions. An extension has no effect while its factor is 0, which is the default;
/// its textures are multiplied by the factor.
pub(super) const FACTORS: &[(&str, &str)] = &[
    ("KHR_materials_anisotropy", "anisotropyStrength"),
    ("KHR_materials_clearcoat", "clearcoatFactor"),
    ("KHR_materials_coat", "coatFactor"),
    ("KHR_materials_diffuse_roughness", "diffuseRoughnessFactor"),
    ("KHR_materials_diffuse_transmission", "diffuseTransmissionFactor"),
    ("KHR_materials_dispersion", "dispersion"),
    ("KHR_materials_fuzz", "fuzzFactor"),
    ("KHR_materials_iridescence", "iridescenceFactor"),
    ("KHR_materials_sheen", "sheenColorFactor"),
    ("KHR_materials_transmission", "transmissionFactor"),
    ("KHR_materials_volume", "thicknessFactor"),
];

/// Finds the extensions that have an effect. The animations' JSON `pointers` may animate a factor away from
/// 0.
pub(super) fn find_uses(root: &Value, pointers: &HashMap<(usize, usize), String>) -> ExtensionUses {
    let mut uses = ExtensionUses::new();
    let Value::Object(root) = root else { return uses };
    record(root, None, &mut uses);
    for (name, member) in root.iter().filter(|(name, _)| *name != "extras") {
        match member {
            Value::Array(items) if name == "materials" => {
                items.iter().enumerate().for_each(|(i, item)| collect(item, Some(i), &mut uses));
            }
            _ => collect(member, None, &mut uses),
        }
    }
    for pointer in pointers.values() {
        if let ["", "materials", i, "extensions", name, ..] = pointer.split('/').collect::<Vec<_>>()[..]
            && let (Ok(i), Some(_)) = (i.parse(), support(name))
        {
            uses.entry(name.to_string()).or_default().materials.push(i);
        }
    }
    uses
}

/// Records the extensions of all objects below `value`. The JSON parser bounds the depth of the recursion.
fn collect(value: &Value, material: Option<usize>, uses: &mut ExtensionUses) {
    match value {
        Value::Object(object) => {
            record(object, material, uses);
            let members = object.iter().filter(|(name, _)| *name != "extras");
            members.for_each(|(_, member)| collect(member, material, uses));
        }
        Value::Array(items) => items.iter().for_each(|item| collect(item, material, uses)),
        _ => {}
    }
}

/// Records the extensions of one object, which belongs to `material` if that is set.
fn record(object: &Map<String, Value>, material: Option<usize>, uses: &mut ExtensionUses) {
    let Some(Value::Object(extensions)) = object.get("extensions") else { return };
    // Unlit materials have no layers.
    let is_unlit = material.is_some() && extensions.contains_key(UNLIT);
    let is_hidden = |name: &str| is_unlit && name.starts_with("KHR_materials_") && name != UNLIT;
    let has_effect = |name: &str, body: &Value| !is_hidden(name) && !has_no_effect(name, body);
    for (name, _) in extensions.iter().filter(|(name, body)| has_effect(name, body)) {
        let users = uses.entry(name.clone()).or_default();
        match material {
            Some(i) => users.materials.push(i),
            None => users.others = true,
        }
    }
}

/// Returns true for a material extension whose factor is 0.
fn has_no_effect(name: &str, body: &Value) -> bool {
    let is_zero = |value: &Value| value.as_f64() == Some(0.0);
    let factor = FACTORS.iter().find(|(known, _)| *known == name);
    let (Some((_, factor)), Value::Object(body)) = (factor, body) else { return false };
    match body.get(*factor) {
        None => true,
        Some(Value::Array(color)) => color.iter().all(is_zero),
        Some(factor) => is_zero(factor),
    }
}

/// Fails if `extensionsRequired` has unsupported extensions.
pub(super) fn check_required(root: &Root) -> Result<(), LoadError> {
    let mut unsupported = Vec::new();
    for name in &root.extensions_required {
        let text = match support(name) {
            None => format!("{name} (unknown)"),
            Some(NotRequirable(advice)) => format!("{name} ({advice})"),
            Some(_) => continue,
        };
        if !unsupported.contains(&text) {
            unsupported.push(text);
        }
    }
    if unsupported.is_empty() {
        return Ok(());
    }
    let list = unsupported.join(", ");
    Err(LoadError::Unsupported(format!("the file requires unsupported extensions: {list}")))
}

/// Warns of extensions that are not fully supported. `is_used` tells whether the scene uses a material of the
/// file.
pub(super) fn warn_unsupported(
    root: &Root,
    uses: &ExtensionUses,
    is_used: impl Fn(usize) -> bool,
    warnings: &mut Warnings,
) {
    let has_effect = |name: &&String| {
        let users = uses.get(*name);
        users.is_some_and(|users| users.others || users.materials.iter().any(|&i| is_used(i)))
    };
    let all = root.extensions_used.iter().chain(&root.extensions_required).chain(uses.keys());
    for name in all.filter(has_effect) {
        let quoted = printable(name);
        match support(name) {
            Some(Supported | Unrendered) => {}
            Some(Partial(missing)) => {
                warnings.add("", format_args!("{quoted} is supported in part: {missing}"));
            }
            Some(Ignored(effect)) => warnings.add("", format_args!("ignored {quoted}: {effect}")),
            Some(NotRequirable(_)) => {
                warnings.add("", format_args!("ignored {quoted}; used its fallback where there is one"));
            }
            None => warnings.add("", format_args!("ignored unknown extension {quoted}")),
        }
    }
}
