//! KHR_materials_variants: choice of a variant and its materials.

use serde_json::json;

use super::super::fixture::Fixture;
use super::super::variants::NAME;
use crate::LoadOptions;

/// Two variants; the second maps the first primitive to another material.
fn fixture() -> Fixture {
    let mut fixture = Fixture::triangle();
    let second = fixture.primitive().clone();
    fixture.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    for name in ["own", "other"] {
        fixture.push("materials", json!({"name": name}));
    }
    fixture.json["extensionsUsed"] = json!([NAME]);
    fixture.json["extensions"] = json!({NAME: {"variants": [{"name": "plain"}, {"name": "festive"}]}});
    for primitive in fixture.json["meshes"][0]["primitives"].as_array_mut().unwrap() {
        primitive["material"] = json!(0);
    }
    fixture.primitive()["extensions"] = json!({NAME: {"mappings": [{"material": 1, "variants": [1]}]}});
    fixture
}

fn material_names(variant: Option<&str>) -> Vec<String> {
    let options = LoadOptions { variant: variant.map(String::from), ..LoadOptions::default() };
    let (scene, warnings) = fixture().load_with(&options);
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(scene.source.variants, ["plain", "festive"]);
    scene.meshes.iter().map(|m| scene.materials[m.material as usize].name.clone()).collect()
}

#[test]
fn a_variant_changes_only_the_mapped_primitives() {
    assert_eq!(material_names(None), ["own", "own"]);
    assert_eq!(material_names(Some("none")), ["own", "own"]);
    assert_eq!(material_names(Some("plain")), ["own", "own"]);
    assert_eq!(material_names(Some("festive")), ["other", "own"]);
}

#[test]
fn an_unknown_variant_is_an_error_that_lists_the_others() {
    let options = LoadOptions { variant: Some("red".into()), ..LoadOptions::default() };
    let error = fixture().try_load_with(&options).unwrap_err().to_string();
    assert_eq!(error, "variants: no material variant 'red'; available: 'plain', 'festive'");
    let error = Fixture::triangle().try_load_with(&options).unwrap_err().to_string();
    assert_eq!(error, "variants: no material variant 'red'; available: none");
    // Mapped materials are checked like all indices.
    let mut broken = fixture();
    broken.primitive()["extensions"][NAME]["mappings"][0]["material"] = json!(9);
    assert!(broken.error().contains("mappings[0].material: 9 is out of range"));
}
