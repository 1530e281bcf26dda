//! Which extensions are shown, and what is said of the others.

use std::collections::{BTreeMap, HashMap};

use ::gltf::json::Root;
use serde_json::{Map, Value};

use super::registry::Support::{Approximated, Data, NotShown, Refused, Shown};
use super::registry::support;
use super::repair::Json;
use crate::import::error::{LoadError, Warnings};

/// Who has something of an extension.
#[derive(Debug, Default)]
pub(super) struct Users {
    /// Which of the file's materials.
    materials: Vec<usize>,
    /// True where anything else has.
    others: bool,
}

/// The extensions that anything in the file has, listed by it or not, by name.
pub(super) type Met = BTreeMap<String, Users>;

/// What has to be above 0 for an extension of a material to change anything. It is 0 where it is not given, and
/// textures are multiplied by it.
const FACTORS: &[(&str, &str)] = &[
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

/// Finds the extensions of which something in the file has more than nothing. `pointers` are those of its
/// animations, which may drive a factor away from 0.
pub(super) fn met(root: &Value, pointers: &HashMap<(usize, usize), String>) -> Met {
    let mut met = Met::new();
    let Value::Object(root) = root else { return met };
    note(root, None, &mut met);
    for (name, member) in root.iter().filter(|(name, _)| *name != "extras") {
        match member {
            Value::Array(items) if name == "materials" => {
                items.iter().enumerate().for_each(|(i, item)| gather(item, Some(i), &mut met));
            }
            _ => gather(member, None, &mut met),
        }
    }
    for pointer in pointers.values() {
        if let ["", "materials", i, "extensions", name, ..] = pointer.split('/').collect::<Vec<_>>()[..]
            && let (Ok(i), Some(_)) = (i.parse(), support(name))
        {
            met.entry(name.to_string()).or_default().materials.push(i);
        }
    }
    met
}

/// The JSON parser bounds the depth, so recursion does no harm.
fn gather(value: &Value, material: Option<usize>, met: &mut Met) {
    match value {
        Value::Object(object) => {
            note(object, material, met);
            let members = object.iter().filter(|(name, _)| *name != "extras");
            members.for_each(|(_, member)| gather(member, material, met));
        }
        Value::Array(items) => items.iter().for_each(|item| gather(item, material, met)),
        _ => {}
    }
}

/// Notes the extensions of one object, which a material has or something else.
fn note(object: &Map<String, Value>, material: Option<usize>, met: &mut Met) {
    let Some(Value::Object(extensions)) = object.get("extensions") else { return };
    for (name, _) in extensions.iter().filter(|(name, body)| !says_nothing(name, body)) {
        let users = met.entry(name.clone()).or_default();
        match material {
            Some(i) => users.materials.push(i),
            None => users.others = true,
        }
    }
}

/// True of an extension of a material that leaves it as it is.
fn says_nothing(name: &str, body: &Value) -> bool {
    let zero = |value: &Value| value.as_f64() == Some(0.0);
    let factor = FACTORS.iter().find(|(known, _)| *known == name);
    let (Some((_, factor)), Value::Object(body)) = (factor, body) else { return false };
    match body.get(*factor) {
        None => true,
        Some(Value::Array(colour)) => colour.iter().all(zero),
        Some(factor) => zero(factor),
    }
}

/// Refuses what the file requires and this reader lacks.
pub(super) fn refuse(root: &Root) -> Result<(), LoadError> {
    let mut missing = Vec::new();
    for name in &root.extensions_required {
        let text = match support(name) {
            None => format!("{name} (not known)"),
            Some(Refused(advice)) => format!("{name} ({advice})"),
            Some(_) => continue,
        };
        if !missing.contains(&text) {
            missing.push(text);
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    let list = missing.join(", ");
    Err(LoadError::Unsupported(format!("the file requires what is not supported: {list}")))
}

/// Warns of what the picture lacks. `shown` says which of the file's materials are in it.
pub(super) fn warn(json: &Json, shown: impl Fn(usize) -> bool, warnings: &mut Warnings) {
    let Root { extensions_used, extensions_required, .. } = &json.root;
    let matters = |name: &&String| {
        let users = json.extensions.get(*name);
        users.is_some_and(|users| users.others || users.materials.iter().any(|&i| shown(i)))
    };
    let all = extensions_used.iter().chain(extensions_required).chain(json.extensions.keys());
    for name in all.filter(matters) {
        let quoted = crate::import::files::escape::printable(name);
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
}

#[cfg(test)]
mod tests {
    use super::super::fixture::Fixture;
    use super::support;
    use crate::import::{LoadOptions, SceneChoice};
    use serde_json::{Value, json};

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

    /// A triangle whose material has these extensions.
    fn material(extensions: Value) -> Fixture {
        let mut fixture = Fixture::triangle();
        fixture.push("materials", json!({"extensions": extensions}));
        fixture.primitive()["material"] = json!(0);
        fixture
    }

    #[test]
    fn what_is_merely_used_is_a_warning() {
        let mut fixture =
            material(json!({"KHR_materials_sheen": {"sheenColorFactor": [0, 0, 0.5]}, "ACME_x": {}}));
        fixture.json["asset"]["extensions"] = json!({"MSFT_texture_dds": {}, "KHR_lights_punctual": {}});
        let (_, warnings) = fixture.load();
        assert_eq!(warnings.len(), 3, "{warnings:?}");
    }

    #[test]
    fn what_no_list_has_is_told_once() {
        let coat = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatNormalTexture": {
            "extensions": {"ACME_x": {}}}}});
        let mut fixture = material(coat.clone());
        fixture.json["materials"][0]["extras"] = json!({"extensions": {"ACME_y": {}}});
        fixture.json["meshes"][0]["extensions"] = coat;
        fixture.json["nodes"][0]["extensions"] = json!({"CESIUM_primitive_outline": {}});
        fixture.json["extensionsRequired"] = json!(["CESIUM_primitive_outline"]);
        let (_, warnings) = fixture.load();
        assert_eq!(
            warnings,
            [
                "CESIUM_primitive_outline: the outline is not drawn",
                "ACME_x is not known, and was ignored",
                "KHR_materials_clearcoat: the coat is not shown"
            ]
        );
    }

    #[test]
    fn what_is_listed_alone_is_no_warning() {
        let names = ["MSFT_texture_dds", "ACME_x", "KHR_materials_sheen", "KHR_materials_transmission"];
        let (_, warnings) = with(&["KHR_materials_sheen"], &names).load();
        assert!(warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn a_factor_of_nothing_is_no_warning() {
        for (name, factor) in super::FACTORS {
            assert!(support(name).is_some(), "{name}");
            let body = |value: Value| json!({*name: {*factor: value, "someTexture": {"index": 0}}});
            let mut zero = material(body(json!(0)));
            zero.push("materials", json!({"extensions": {*name: {}}}));
            zero.push("materials", json!({"extensions": body(json!(0.0))}));
            zero.push("images", json!({"uri": "data:image/bmp;base64,"}));
            zero.push("textures", json!({"source": 0}));
            for index in 0..3 {
                zero.primitive()["material"] = json!(index);
                let (_, warnings) = zero.load();
                let told = warnings.iter().any(|w| w.contains(name));
                assert!(!told, "{name}: {warnings:?}");
            }
        }
        let told = |factor: Value| {
            let body = json!({"KHR_materials_sheen": {"sheenColorFactor": factor}});
            material(body).load().1.len()
        };
        assert_eq!((told(json!([0, 0, 0])), told(json!([0, 0.1, 0]))), (0, 1));
    }

    /// Its material is read as it stands, and grows clear with time.
    #[test]
    fn a_factor_that_an_animation_drives_from_nothing_is_a_warning() {
        let pointer = "/materials/0/extensions/KHR_materials_transmission/transmissionFactor";
        let value = json!({"materials": [{"extensions": {"KHR_materials_transmission": {}}}]});
        let driven = std::collections::HashMap::from([((0, 0), pointer.to_string())]);
        assert!(super::met(&value, &Default::default()).is_empty());
        assert_eq!(super::met(&value, &driven)["KHR_materials_transmission"].materials, [0]);
    }

    #[test]
    fn what_only_materials_have_that_nothing_shown_uses_is_no_warning() {
        let mut fixture = Fixture::triangle();
        let coat = json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1}}});
        fixture.push("materials", coat);
        assert!(fixture.load().1.is_empty());
        // In another scene of the file.
        let mut other = fixture.json["meshes"][0].clone();
        other["primitives"][0]["material"] = json!(0);
        let mesh = fixture.push("meshes", other);
        let node = fixture.push("nodes", json!({"mesh": mesh}));
        fixture.push("scenes", json!({"name": "other", "nodes": [node]}));
        assert!(fixture.load().1.is_empty());
        let scene = SceneChoice::Named("other".into());
        let (_, warnings) = fixture.load_with(&LoadOptions { scene, ..LoadOptions::default() });
        assert_eq!(warnings, ["KHR_materials_clearcoat: the coat is not shown"]);
    }
}
