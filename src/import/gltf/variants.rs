//! KHR_materials_variants: one model in several sets of materials.

use ::gltf::json::mesh::Primitive;
use serde_json::Value;

use super::document::Document;
use crate::import::error::LoadError;
use crate::import::files::escape::printable;

const NAME: &str = "KHR_materials_variants";

/// Names of the file's variants, in its order.
pub(super) fn names(doc: &Document<'_>) -> Vec<String> {
    let extension = doc.root().extensions.as_ref().and_then(|e| e.others.get(NAME));
    let list = extension.and_then(|v| v.get("variants")).and_then(Value::as_array);
    let name = |v: &Value| v.get("name").and_then(Value::as_str).unwrap_or_default().to_string();
    list.into_iter().flatten().map(name).collect()
}

/// The number of the variant that was asked for; `none` asks for the default materials.
///
/// # Errors
/// A name that the file does not have.
pub(super) fn choose(doc: &Document<'_>, wanted: Option<&str>) -> Result<Option<usize>, LoadError> {
    let Some(wanted) = wanted else { return Ok(None) };
    let names = names(doc);
    match names.iter().position(|n| n == wanted) {
        Some(index) => Ok(Some(index)),
        None if wanted == "none" => Ok(None),
        None => Err(unknown_variant(wanted, &names)),
    }
}

/// What is said of a variant that is not there.
pub(crate) fn unknown_variant(wanted: &str, names: &[String]) -> LoadError {
    let list: Vec<String> = names.iter().map(|n| format!("'{}'", printable(n))).collect();
    let list = if list.is_empty() { "none".into() } else { list.join(", ") };
    let rule = format!("there is no variant '{}'; the file has: {list}", printable(wanted));
    LoadError::invalid("variants", rule)
}

/// The primitive's material in that variant: its own where the variant says nothing of it.
pub(super) fn material(json: &Primitive, variant: Option<usize>) -> Option<usize> {
    let mappings = json.extensions.as_ref().and_then(|e| e.others.get(NAME)?.get("mappings")?.as_array());
    let names = |mapping: &&Value| {
        let variants = mapping.get("variants").and_then(Value::as_array);
        variants.into_iter().flatten().any(|v| v.as_u64().is_some_and(|v| Some(v as usize) == variant))
    };
    let mapped = mappings.into_iter().flatten().find(names);
    let mapped = mapped.and_then(|m| m.get("material")).and_then(Value::as_u64).map(|i| i as usize);
    mapped.or(json.material.map(|m| m.value()))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::fixture::Fixture;
    use crate::import::LoadOptions;

    /// Two variants; the second has a material of its own for the first primitive alone.
    fn fixture() -> Fixture {
        let mut fixture = Fixture::triangle();
        let second = fixture.primitive().clone();
        fixture.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
        for name in ["own", "other"] {
            fixture.push("materials", json!({"name": name}));
        }
        fixture.json["extensionsUsed"] = json!([super::NAME]);
        fixture.json["extensions"] =
            json!({super::NAME: {"variants": [{"name": "plain"}, {"name": "festive"}]}});
        for primitive in fixture.json["meshes"][0]["primitives"].as_array_mut().unwrap() {
            primitive["material"] = json!(0);
        }
        fixture.primitive()["extensions"] =
            json!({super::NAME: {"mappings": [{"material": 1, "variants": [1]}]}});
        fixture
    }

    fn shown(variant: Option<&str>) -> Vec<String> {
        let options = LoadOptions { variant: variant.map(String::from), ..LoadOptions::default() };
        let (scene, warnings) = fixture().load_with(&options);
        assert_eq!(warnings, Vec::<String>::new());
        assert_eq!(scene.source.variants, ["plain", "festive"]);
        scene.meshes.iter().map(|m| scene.materials[m.material as usize].name.clone()).collect()
    }

    #[test]
    fn a_variant_changes_what_it_names_and_no_more() {
        assert_eq!(shown(None), ["own", "own"]);
        assert_eq!(shown(Some("none")), ["own", "own"]);
        assert_eq!(shown(Some("plain")), ["own", "own"]);
        assert_eq!(shown(Some("festive")), ["other", "own"]);
    }

    #[test]
    fn a_variant_that_is_not_there_is_an_error_with_those_that_are() {
        let options = LoadOptions { variant: Some("red".into()), ..LoadOptions::default() };
        let error = fixture().try_load_with(&options).unwrap_err().to_string();
        assert_eq!(error, "variants: there is no variant 'red'; the file has: 'plain', 'festive'");
        let error = Fixture::triangle().try_load_with(&options).unwrap_err().to_string();
        assert_eq!(error, "variants: there is no variant 'red'; the file has: none");
        // A mapping to a material that is not there is found before anything is read.
        let mut broken = fixture();
        broken.primitive()["extensions"][super::NAME]["mappings"][0]["material"] = json!(9);
        assert!(broken.error().contains("mappings[0].material: 9 is out of range"));
    }
}
