//! Warnings and errors for unsupported extensions.

use super::super::extensions;
use super::super::fixture::Fixture;
use super::super::registry::support;
use crate::{LoadOptions, SceneChoice};
use serde_json::{Value, json};

fn with(required: &[&str], used: &[&str]) -> Fixture {
    let mut fixture = Fixture::triangle();
    fixture.json["extensionsRequired"] = json!(required);
    fixture.json["extensionsUsed"] = json!(used);
    fixture
}

#[test]
fn unsupported_required_extensions_are_an_error() {
    let error = with(&["KHR_texture_transform", "MSFT_texture_dds", "ACME_x"], &[]).error();
    assert!(error.contains("MSFT_texture_dds") && error.contains("ACME_x (unknown)"), "{error}");
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
fn unsupported_extensions_in_use_are_warnings() {
    let mut fixture = material(json!({"KHR_materials_fuzz": {"fuzzFactor": 0.5}, "ACME_x": {}}));
    fixture.json["asset"]["extensions"] = json!({"MSFT_texture_dds": {}, "KHR_lights_punctual": {}});
    let (_, warnings) = fixture.load();
    assert_eq!(warnings.len(), 3, "{warnings:?}");
}

#[test]
fn unlisted_extensions_are_warnings_once() {
    let fuzz = json!({"KHR_materials_fuzz": {"fuzzFactor": 1, "fuzzTexture": {
        "extensions": {"ACME_x": {}}}}});
    let mut fixture = material(fuzz.clone());
    fixture.json["materials"][0]["extras"] = json!({"extensions": {"ACME_y": {}}});
    fixture.json["meshes"][0]["extensions"] = fuzz;
    fixture.json["nodes"][0]["extensions"] = json!({"CESIUM_primitive_outline": {}});
    fixture.json["extensionsRequired"] = json!(["CESIUM_primitive_outline"]);
    let (_, warnings) = fixture.load();
    assert_eq!(
        warnings,
        [
            "ignored CESIUM_primitive_outline: outlines are missing",
            "ignored unknown extension ACME_x",
            "ignored KHR_materials_fuzz: the fuzz is missing"
        ]
    );
}

#[test]
fn listed_but_unused_extensions_are_no_warnings() {
    let names = ["MSFT_texture_dds", "ACME_x", "KHR_materials_fuzz", "KHR_materials_transmission"];
    let (_, warnings) = with(&["KHR_materials_fuzz"], &names).load();
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn extensions_with_a_factor_of_0_are_no_warnings() {
    for (name, factor) in extensions::FACTORS {
        assert!(support(name).is_some(), "{name}");
        let body = |value: Value| json!({*name: {*factor: value, "someTexture": {"index": 0}}});
        let value = |zero: Value| if factor.ends_with("ColorFactor") { json!([zero, 0, 0]) } else { zero };
        let mut zero = material(body(value(json!(0))));
        zero.push("materials", json!({"extensions": {*name: {}}}));
        zero.push("materials", json!({"extensions": body(value(json!(0.0)))}));
        zero.push("images", json!({"uri": "data:image/bmp;base64,"}));
        zero.push("textures", json!({"source": 0}));
        for index in 0..3 {
            zero.primitive()["material"] = json!(index);
            let (_, warnings) = zero.load();
            let is_warned = warnings.iter().any(|w| w.contains(name));
            assert!(!is_warned, "{name}: {warnings:?}");
        }
    }
    let is_used = |factor: Value| {
        let value =
            json!({"materials": [{"extensions": {"KHR_materials_sheen": {"sheenColorFactor": factor}}}]});
        !extensions::find_uses(&value, &Default::default()).is_empty()
    };
    assert_eq!((is_used(json!([0, 0, 0])), is_used(json!([0, 0.1, 0]))), (false, true));
}

/// The factor is 0 in the material, and animated.
#[test]
fn an_animated_factor_is_a_use() {
    let pointer = "/materials/0/extensions/KHR_materials_transmission/transmissionFactor";
    let value = json!({"materials": [{"extensions": {"KHR_materials_transmission": {}}}]});
    let animated = std::collections::HashMap::from([((0, 0), pointer.to_string())]);
    assert!(extensions::find_uses(&value, &Default::default()).is_empty());
    assert_eq!(extensions::find_uses(&value, &animated)["KHR_materials_transmission"].materials, [0]);
}

#[test]
fn extensions_of_unused_materials_are_no_warnings() {
    let mut fixture = Fixture::triangle();
    let fuzz = json!({"extensions": {"KHR_materials_fuzz": {"fuzzFactor": 1}}});
    fixture.push("materials", fuzz);
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
    assert_eq!(warnings, ["ignored KHR_materials_fuzz: the fuzz is missing"]);
}

#[test]
fn layers_of_unlit_materials_cause_no_warning() {
    let warnings = |extensions: serde_json::Value| {
        let mut fixture = Fixture::triangle();
        fixture.push("materials", json!({"extensions": extensions}));
        fixture.primitive()["material"] = json!(0);
        fixture.load().1
    };
    let fuzz = json!({"fuzzFactor": 1});
    assert_eq!(warnings(json!({"KHR_materials_fuzz": fuzz})).len(), 1);
    assert!(warnings(json!({"KHR_materials_fuzz": fuzz, "KHR_materials_unlit": {}})).is_empty());
    assert_eq!(warnings(json!({"VENDOR_x": {}, "KHR_materials_unlit": {}})).len(), 1);
}
