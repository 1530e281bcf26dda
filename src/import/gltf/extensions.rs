//! Which extensions are shown, and what is said of the others.

use std::collections::BTreeSet;

use ::gltf::json::Root;
use serde_json::Value;

use super::registry::Support::{Approximated, Data, NotShown, Refused, Shown};
use super::registry::support;
use super::repair::Json;
use crate::import::error::{LoadError, Warnings};

/// The names of the extensions that anything in the file has, listed by it or not.
pub(super) fn met(root: &Value) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    gather(root, &mut names);
    names
}

/// The JSON parser bounds the depth, so recursion does no harm.
fn gather(value: &Value, names: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (name, member) in object.iter().filter(|(name, _)| *name != "extras") {
                if let Some(extensions) = member.as_object().filter(|_| name == "extensions") {
                    let new = extensions.keys().filter(|name| !names.contains(*name)).cloned();
                    names.extend(new.collect::<Vec<_>>());
                }
                gather(member, names);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| gather(item, names)),
        _ => {}
    }
}

/// Refuses what the file requires and this reader lacks; warns of what it merely uses.
pub(super) fn judge(json: &Json, warnings: &mut Warnings) -> Result<(), LoadError> {
    let Root { extensions_used, extensions_required, .. } = &json.root;
    let mut missing = Vec::new();
    for name in extensions_required {
        let text = match support(name) {
            None => format!("{name} (not known)"),
            Some(Refused(advice)) => format!("{name} ({advice})"),
            Some(_) => continue,
        };
        if !missing.contains(&text) {
            missing.push(text);
        }
    }
    if !missing.is_empty() {
        let list = missing.join(", ");
        return Err(LoadError::Unsupported(format!("the file requires what is not supported: {list}")));
    }
    for name in extensions_used.iter().chain(extensions_required).chain(&json.extensions) {
        let quoted = super::super::uri::printable(name);
        match support(name) {
            Some(Shown | Data) => {}
            Some(Approximated(how)) => {
                warnings.add("", format_args!("{quoted} is shown in part: {how}"));
            }
            Some(NotShown(what)) => warnings.add("", format_args!("{quoted}: {what}")),
            Some(Refused(_)) => warnings.add("", format_args!("{quoted} is not read: fallbacks are used")),
            None => warnings.add("", format_args!("{quoted} is not known, and was ignored")),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::fixture::Fixture;
    use serde_json::json;

    fn with(required: &[&str], used: &[&str]) -> Fixture {
        let mut fixture = Fixture::triangle();
        fixture.json["extensionsRequired"] = json!(required);
        fixture.json["extensionsUsed"] = json!(used);
        fixture
    }

    #[test]
    fn what_is_required_and_missing_is_named() {
        let error = with(&["KHR_texture_transform", "MSFT_texture_dds", "ACME_x"], &[]).error();
        assert!(error.contains("MSFT_texture_dds") && error.contains("ACME_x (not known)"), "{error}");
        assert!(!error.contains("texture_transform"));
    }

    #[test]
    fn what_is_merely_used_is_a_warning() {
        let names = ["MSFT_texture_dds", "ACME_x", "KHR_materials_sheen", "KHR_lights_punctual"];
        let (_, warnings) = with(&["KHR_materials_sheen"], &names).load();
        assert_eq!(warnings.len(), 3, "{warnings:?}");
    }

    #[test]
    fn what_no_list_has_is_told_once() {
        let mut fixture = with(&["KHR_materials_sheen"], &[]);
        let coat = json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatNormalTexture": {
            "extensions": {"ACME_x": {}}}}}, "extras": {"extensions": {"ACME_y": {}}}});
        fixture.push("materials", coat.clone());
        fixture.push("materials", coat);
        let (_, warnings) = fixture.load();
        assert_eq!(
            warnings,
            [
                "KHR_materials_sheen: the sheen is not shown",
                "ACME_x is not known, and was ignored",
                "KHR_materials_clearcoat: the coat is not shown"
            ]
        );
    }
}
