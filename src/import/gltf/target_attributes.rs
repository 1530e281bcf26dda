//! Texture coordinates and colours of morph targets, which the typed JSON lacks.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use serde_json::Value;

use super::json_tree::{Object, objects};
use crate::error::Warnings;
use crate::files::escape::printable;

/// Supported sets of texture coordinates (TEXCOORD_n).
pub(super) const UV_SETS: u32 = 32;

/// A morph target, by the indices of its mesh and primitive and its own.
pub(super) type TargetId = [usize; 3];

/// The accessors of a morph target's texture coordinates and colours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct TargetAttributes {
    /// Accessors of TEXCOORD_n, by n.
    pub uvs: BTreeMap<u32, usize>,
    /// Accessor of COLOR_0.
    pub colors: Option<usize>,
}

/// An attribute of a morph target.
enum Name {
    Typed,
    Uvs(u32),
    Colors,
    ApplicationSpecific,
    Unsupported,
}

impl Name {
    fn of(name: &str) -> Name {
        if ["POSITION", "NORMAL", "TANGENT"].contains(&name) {
            return Name::Typed;
        }
        let set = name.strip_prefix("TEXCOORD_").and_then(|set| set.parse().ok());
        match set.filter(|&set| set < UV_SETS) {
            Some(set) => Name::Uvs(set),
            None if name == "COLOR_0" => Name::Colors,
            None if name.starts_with('_') => Name::ApplicationSpecific,
            None => Name::Unsupported,
        }
    }
}

/// Finds the texture coordinates and colours of all morph targets. Warns once for each primitive of an attribute that is not
/// supported.
pub(super) fn find(root: &mut Value, warnings: &mut Warnings) -> HashMap<TargetId, TargetAttributes> {
    let mut found = HashMap::new();
    for (i, mesh) in objects(root, "meshes") {
        for (j, primitive) in items(mesh.get("primitives")).enumerate() {
            let location = format!("meshes[{i}].primitives[{j}].targets");
            let mut unsupported = BTreeSet::new();
            for (k, target) in items(primitive.get("targets")).enumerate() {
                let attributes = read(target, &format!("{location}[{k}]"), &mut unsupported, warnings);
                if attributes != TargetAttributes::default() {
                    found.insert([i, j, k], attributes);
                }
            }
            for name in unsupported {
                warnings.add(&location, format_args!("ignored morph target attribute {}", printable(name)));
            }
        }
    }
    found
}

fn items(list: Option<&Value>) -> impl Iterator<Item = &Value> {
    list.and_then(Value::as_array).into_iter().flatten()
}

fn read<'v>(
    target: &'v Value,
    location: &str,
    unsupported: &mut BTreeSet<&'v str>,
    warnings: &mut Warnings,
) -> TargetAttributes {
    let mut out = TargetAttributes::default();
    for (name, value) in target.as_object().into_iter().flat_map(Object::iter) {
        let kind = Name::of(name);
        if let Name::Unsupported = kind {
            unsupported.insert(name);
        }
        if !matches!(kind, Name::Uvs(_) | Name::Colors) {
            continue;
        }
        let Some(accessor) = value.as_u64() else {
            let value = printable(&value.to_string()).replace('"', "'");
            let message = format!("ignored invalid value {value}; expected the index of an accessor");
            warnings.add(format_args!("{location}.{name}"), message);
            continue;
        };
        match kind {
            Name::Uvs(set) => drop(out.uvs.insert(set, accessor as usize)),
            _ => out.colors = Some(accessor as usize),
        }
    }
    out
}
