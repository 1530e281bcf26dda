//! `blinn info`, and what it and `render` report about a scene's triangles.

use std::fs;

use crate::common::program::*;

#[test]
fn info_prints_text_and_json() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    let text = blinn_args(dir.path(), &["info", scene.as_str()]);
    assert!(String::from_utf8(text.stdout).unwrap().contains("triangles: "));
    let output = blinn_args(dir.path(), &["info", scene.as_str(), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["format"], "glTF");
    assert!(json["triangles"].as_u64().unwrap() > 10);
    assert_eq!(json["cameras"].as_array().unwrap().len(), 1);
    assert_eq!(json["lights"][0]["kind"], "point");
    let ids = json["object_ids"].as_array().unwrap();
    assert_eq!((ids.len() as u64, &ids[0]["id"]), (json["objects"].as_u64().unwrap(), &1.into()));
    for (i, material) in json["materials"].as_array().unwrap().iter().enumerate() {
        assert_eq!(json["material_ids"][i], serde_json::json!({"id": i + 1, "name": material["name"]}));
    }
}

/// `--json` reports failed scenes as well: an object for one scene, a list for several.
#[test]
fn info_json_includes_scenes_that_fail() {
    let dir = tempfile::tempdir().unwrap();
    let scene = model("cornell/cornell.glb");
    fs::write(dir.path().join("broken.glb"), "glTF").unwrap();
    let info = |scenes: &[&str]| -> serde_json::Value {
        let output = blinn_args(dir.path(), &[&["info", "--json"], scenes].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(String::from_utf8(output.stderr).unwrap().starts_with("blinn: broken.glb"));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let alone = info(&["broken.glb"]);
    assert_eq!(alone["file"], "broken.glb");
    assert!(alone["error"].as_str().unwrap().starts_with("broken.glb: "), "{alone}");
    let both = info(&["broken.glb", scene.as_str()]);
    assert_eq!((both.as_array().unwrap().len(), &both[0]), (2, &alone));
    assert!(both[1]["error"].is_null() && both[1]["triangles"].is_u64(), "{both}");
}

#[test]
fn a_scene_without_meshes_is_a_warning() {
    let dir = tempfile::tempdir().unwrap();
    let text = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{}]}"#;
    fs::write(dir.path().join("a.gltf"), text).unwrap();
    let output = blinn_args(dir.path(), &["render", "a.gltf", "--size", "8x8"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && errors.contains("a.gltf: nothing to render"), "{errors}");
    fails(dir.path(), &["render", "a.gltf", "--size", "8x8", "--strict"], 1, "nothing to render");
}

/// `info` has the warnings of `render`'s BVH build.
#[test]
fn info_warns_of_ignored_triangles() {
    let dir = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n";
    fs::write(dir.path().join("a.obj"), text).unwrap();
    let output = blinn_args(dir.path(), &["info", "a.obj", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = "ignored 1 triangles with vertices that are not finite numbers";
    assert_eq!(json["warnings"], serde_json::json!([text]));
    fails(dir.path(), &["info", "a.obj", "--strict"], 1, text);
    fails(dir.path(), &["render", "a.obj", "--size", "8x8", "--strict"], 1, text);
}

/// Triangles without area are common (poles of spheres, CAD exports) and invisible: no warning.
#[test]
fn triangles_without_area_are_counted_and_no_warning() {
    let dir = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 3 4\n";
    fs::write(dir.path().join("a.obj"), text).unwrap();
    let output = blinn_args(dir.path(), &["info", "a.obj", "--json", "--strict"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["warnings"], &json["triangles_without_area"]), (&serde_json::json!([]), &1.into()));
    let output = blinn_args(dir.path(), &["render", "a.obj", "--size", "8x8", "--strict", "--perf"]);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && messages.contains("  1 triangles without area"), "{messages}");
}
