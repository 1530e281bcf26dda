//! `blinn info`, and what it and `render` report about a scene's triangles.

use std::fs;

use serde_json::json;

use crate::common::gltf_fixture::Fixture;
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

/// A glowing triangle of 2 m², a point light, area lights and an empty node, from Blender.
#[test]
fn info_lists_light_sources_with_position_and_power() {
    let (_dir, at) = folder();
    let mut file = Fixture::triangle();
    file.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.0.21");
    file.json["nodes"][0]["scale"] = json!([2, 2, 2]);
    file.push("materials", json!({"name": "glow", "emissiveFactor": [1, 0.5, 0], "doubleSided": true}));
    file.primitive()["material"] = json!(0);
    let down = [-0.5f64.sqrt(), 0.0, 0.0, 0.5f64.sqrt()];
    file.json["extensions"] = json!({
        "KHR_lights_punctual": {"lights": [
            {"type": "point", "name": "Bulb", "intensity": 54351.41306588226, "extras": {"shadow_soft_size": 0.25}},
            {"type": "directional", "intensity": 683}]},
        "EXT_lights_area": {"lights": [
            {"type": "rect", "name": "Panel", "intensity": 683, "size": 0.5, "rect": {"aspect": 3}},
            {"type": "disk", "intensity": 683, "size": 2}]}});
    file.node(
        json!({"name": "a", "translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}}),
    );
    file.node(json!({"name": "b", "rotation": down, "extensions": {"KHR_lights_punctual": {"light": 1}}}));
    file.node(json!({"name": "c", "rotation": down, "translation": [0, 2, 0], "scale": [2, 1, 1],
        "extensions": {"EXT_lights_area": {"light": 0}}}));
    file.node(json!({"name": "d", "extensions": {"EXT_lights_area": {"light": 1}}}));
    file.node(json!({"name": "lost", "rotation": down, "translation": [0, 4, 0]}));
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    let info = |line: &str| String::from_utf8(blinn(&at, line).stdout).unwrap();
    let text = info("info a.glb");
    let json: serde_json::Value = serde_json::from_str(&info("info a.glb --json")).unwrap();
    let lights = json["lights"].as_array().unwrap();
    let close = |value: &serde_json::Value, expected: f64| {
        assert!((value.as_f64().unwrap() - expected).abs() < 1e-4 * expected, "{value} {expected}");
    };
    let kinds: Vec<&str> = lights.iter().map(|light| light["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["point", "directional", "rect", "disk"]);
    close(&lights[0]["watts"], 1000.0);
    assert_eq!((&lights[0]["position"], &lights[0]["radius"]), (&json!([1.0, 2.0, 3.0]), &json!(0.25)));
    assert!(
        lights[0]["direction"].is_null() && lights[1]["watts"].is_null() && lights[1]["position"].is_null()
    );
    assert_eq!(lights[1]["direction"], json!([0.0, -1.0, 0.0]));
    close(&lights[2]["watts"], 3.0 * std::f64::consts::PI);
    assert_eq!((&lights[2]["width"], &lights[2]["height"]), (&json!(3.0), &json!(1.0)));
    assert_eq!((&lights[2]["direction"], &lights[2]["name"]), (&json!([0.0, -1.0, 0.0]), &json!("Panel")));
    close(&lights[3]["watts"], std::f64::consts::PI.powi(2));
    assert_eq!(lights[3]["diameter"], 2.0);
    let emissive = &json["emissive_materials"];
    assert_eq!((&emissive[0]["name"], &emissive[0]["triangles"]), (&json!("glow"), &json!(1)));
    close(&emissive[0]["area"], 2.0);
    close(&emissive[0]["watts"], 2.0 * std::f64::consts::PI);
    let lost = json!([{"node": "lost", "position": [0.0, 4.0, 0.0], "direction": [0.0, -1.0, 0.0]}]);
    assert_eq!(json["probable_area_lights"], lost);
    for line in [
        "lights (4):",
        "  name Bulb, node a, kind point, color 1 1 1, intensity 54351.414, unit cd, watts 1000",
        "  node lost, position 0 4 0, direction 0 -1 0",
        "  name glow, radiance 1 0.5 0, textured false, triangles 1, area 2, watts 6.283",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
}

/// A candela of glTF is 4π lumens; a program that does not know watts prints none.
#[test]
fn fluxes_have_the_unit_of_the_file() {
    let (_dir, at) = folder();
    let lights = |generator: &str, extras: serde_json::Value| -> Vec<serde_json::Value> {
        let mut file = Fixture::triangle();
        file.json["asset"]["generator"] = json!(generator);
        file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 100}, {"type": "directional", "intensity": 2}]}});
        if !extras.is_null() {
            file.json["scenes"][0]["extras"] = json!({"blinn": extras});
        }
        for light in 0..2 {
            file.node(json!({"extensions": {"KHR_lights_punctual": {"light": light}}}));
        }
        fs::write(at.join("a.glb"), file.glb()).unwrap();
        let json: serde_json::Value =
            serde_json::from_slice(&blinn(&at, "info a.glb --json").stdout).unwrap();
        json["lights"].as_array().unwrap().clone()
    };
    let four_pi = 4.0 * std::f64::consts::PI;
    let raw = json!({"version": 1, "lightUnits": "raw"});
    let unitless = json!({"version": 1, "lightUnits": "unitless"});
    let blender = "Khronos glTF Blender I/O v5.0.21";
    for (generator, extras, units, watts, lumens) in [
        ("a modeller", json!(null), ["cd", "lx"], None, Some(100.0 * four_pi)),
        (blender, json!(null), ["cd", "lx"], Some(100.0 * four_pi / 683.0), Some(100.0 * four_pi)),
        (blender, raw, ["W", "W/m²"], Some(100.0), None),
        (blender, unitless, ["W/sr", "W/m²"], Some(100.0 * four_pi), None),
    ] {
        let lights = lights(generator, extras);
        assert_eq!(lights.iter().map(|light| light["unit"].as_str().unwrap()).collect::<Vec<_>>(), units);
        for (key, expected) in [("watts", watts), ("lumens", lumens)] {
            let found = lights[0][key].as_f64();
            let is_close = |(a, b): (f64, f64)| (a / b - 1.0).abs() < 1e-5;
            assert_eq!(found.is_some(), expected.is_some(), "{generator} {units:?}: {key}");
            assert!(found.zip(expected).is_none_or(is_close), "{generator} {units:?}: {key} {found:?}");
            assert!(lights[1][key].is_null());
        }
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
    let expected =
        "a.gltf: nothing to render: no node of the scene has a mesh with triangles, points or lines";
    assert!(output.status.success() && errors.contains(expected), "{errors}");
    fails(dir.path(), &["render", "a.gltf", "--size", "8x8", "--strict"], 1, "nothing to render");
}

/// `info` has the warnings of `render`'s BVH build.
#[test]
fn names_of_files_in_backticks_are_no_options() {
    let dir = tempfile::tempdir().unwrap();
    let text =
        r#"{"asset":{"version":"2.0"},"cameras":[{"type":"perspective","perspective":{"znear":0.1}}]}"#;
    fs::write(dir.path().join("a.gltf"), text).unwrap();
    let output = blinn_args(dir.path(), &["info", "a.gltf"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("missing field `yfov`"), "{text}");
    fails(dir.path(), &["info", "of `hide`.glb"], 1, "of `hide`.glb");
}

#[test]
fn info_warns_of_ignored_triangles() {
    let dir = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n";
    fs::write(dir.path().join("a.obj"), text).unwrap();
    let output = blinn_args(dir.path(), &["info", "a.obj", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = "ignored 1 triangles with coordinates that are not finite numbers or beyond ±1e18";
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

/// Vertices beside faces, lines and points are not drawn, as in other viewers: `info` has their number.
#[test]
fn loose_vertices_are_counted_and_no_warning() {
    let dir = tempfile::tempdir().unwrap();
    let vertices = "0 0 0\n1 0 0\n0 1 0\n2 0 0\n3 0 0\n4 0 0\n5 0 0\n";
    let obj = format!("v {}", vertices.trim_end().replace('\n', "\nv ")) + "\nf 1 2 3\n";
    let header = "ply\nformat ascii 1.0\nelement vertex 7\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 1\nproperty list uchar int vertex_indices\n";
    let edges = "element edge 1\nproperty int vertex1\nproperty int vertex2\n";
    for (name, text, expected) in [
        ("faces.obj", obj.clone(), 4),
        ("all.obj", obj + "l 4 5\np 6\nf 1 2 3\n", 1),
        ("faces.ply", format!("{header}end_header\n{vertices}3 0 1 2\n"), 4),
        ("edges.ply", format!("{header}{edges}end_header\n{vertices}3 0 1 2\n3 4\n"), 2),
    ] {
        fs::write(dir.path().join(name), text).unwrap();
        let output = blinn_args(dir.path(), &["info", name, "--json", "--strict"]);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((&json["loose_vertices"], &json["warnings"]), (&json!(expected), &json!([])), "{name}");
    }
    fs::write(dir.path().join("cloud.obj"), "v 0 0 0\nv 1 0 0\n").unwrap();
    let output = blinn_args(dir.path(), &["info", "cloud.obj", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["points"], &json["loose_vertices"]), (&json!(2), &json!(null)));
}

/// A body of glass with every field of transmission, volume and reflection; a mask; and the lecture's coefficients.
#[test]
fn info_lists_the_fields_of_materials() {
    let (_dir, at) = folder();
    let mut file = Fixture::triangle();
    file.material(json!({
        "name": "glass", "normalTexture": {"index": 0, "scale": 0.5}, "emissiveFactor": [0.5, 0.25, 0],
        "pbrMetallicRoughness": {"metallicFactor": 0.25, "roughnessFactor": 0.5},
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 2},
            "KHR_materials_ior": {"ior": 1.25},
            "KHR_materials_specular": {"specularFactor": 0.75, "specularColorFactor": [1, 0.5, 0.25]},
            "KHR_materials_transmission": {"transmissionFactor": 0.5},
            "KHR_materials_volume": {"thicknessFactor": 0.25, "attenuationColor": [1, 0.5, 0],
                "attenuationDistance": 4}}}));
    file.json["textures"] = json!([{"source": 0}]);
    file.json["images"] = json!([{"uri": "n.png"}]);
    let second = file.primitive().clone();
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    file.json["meshes"][0]["primitives"][1]["material"] = json!(1);
    file.push("materials", json!({"name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25}));
    image::RgbImage::from_pixel(4, 4, image::Rgb([128, 128, 255])).save(at.join("n.png")).unwrap();
    fs::write(at.join("a.gltf"), file.gltf()).unwrap();
    let materials = |line: &str| {
        let output = blinn(&at, line);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json["materials"].clone()
    };
    let found = materials("info a.gltf --json");
    let [glass, leaf] = [&found[0], &found[1]];
    let reflectance = json!({"metallic": 0.25, "roughness": 0.5, "ior": 1.25, "specular": 0.75,
        "specular_color": [1.0, 0.5, 0.25]});
    assert_eq!(glass["reflectance"], reflectance);
    assert_eq!(glass["emission"], json!([1.0, 0.5, 0.0]));
    assert_eq!((&glass["alpha"], &glass["normal_map"]), (&json!({"mode": "opaque"}), &json!({"scale": 0.5})));
    let volume =
        json!({"thickness": 0.25, "attenuation_color": [1.0, 0.5, 0.0], "attenuation_distance": 4.0});
    let transmission = json!({"factor": 0.5, "color": null});
    assert_eq!(glass["layers"], json!({"transmission": transmission, "volume": volume}));
    assert_eq!(leaf["alpha"], json!({"mode": "mask", "factor": 1.0, "cutoff": 0.25}));
    assert!(leaf["normal_map"].is_null() && leaf["layers"] == json!({}));
    fs::write(
        at.join("a.mtl"),
        "newmtl m\nKa 0.25 0.25 0.25\nKd 0.5 0.5 0.5\nKs 1 0.5 0\nNs 32\nNi 1.5\nd 0.5\n",
    )
    .unwrap();
    fs::write(at.join("b.obj"), "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mtl = &materials("info b.obj --json")[0];
    let reflectance =
        json!({"ambient": [0.25, 0.25, 0.25], "specular": [1.0, 0.5, 0.0], "shininess": 32.0, "ior": 1.5});
    assert_eq!(mtl["reflectance"], reflectance);
    let phong = json!({"k_a": [0.25, 0.25, 0.25], "k_d": [0.5, 0.5, 0.5], "k_s": [1.0, 0.5, 0.0],
        "shininess": 32.0, "textured": false});
    assert_eq!(mtl["phong"], phong);
    // Roughness 0.5 is p = 30, and 1 is p = 0.
    let shininess = |material: &serde_json::Value| material["phong"]["shininess"].as_f64().unwrap();
    assert!((shininess(glass) - 30.0).abs() < 1e-4 && shininess(leaf).abs() < 1e-5, "{glass} {leaf}");
    let text = String::from_utf8(blinn(&at, "info b.obj").stdout).unwrap();
    let line = "phong k_a 0.25 0.25 0.25, k_d 0.5 0.5 0.5, k_s 1 0.5 0, shininess 32, textured false";
    assert!(text.contains(line), "{text}");
    assert_eq!(mtl["alpha"], json!({"mode": "blend", "factor": 0.5}));
}

/// Two objects of an OBJ, one of two materials; and an STL, whose z is up.
#[test]
fn info_lists_parts_and_sizes_along_the_axes_of_the_file() {
    let (_dir, at) = folder();
    let square = "v 0 0 0\nv 4 0 0\nv 4 2 0\nv 0 2 1\nv 9 9 9\n";
    let faces = "o a\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 2 4\no b\nf 1 3 4\n";
    fs::write(at.join("a.mtl"), "newmtl blue\nnewmtl red\n").unwrap();
    fs::write(at.join("a.obj"), format!("mtllib a.mtl\n{square}{faces}")).unwrap();
    let info =
        |line: &str| -> serde_json::Value { serde_json::from_slice(&blinn(&at, line).stdout).unwrap() };
    let obj = info("info a.obj --json");
    let (a, b) = (&obj["parts"][0], &obj["parts"][1]);
    assert_eq!((&a["id"], &a["name"], &a["triangles"]), (&json!(1), &json!("a"), &json!(2)));
    assert_eq!(a["bounds"], json!({"min": [0.0, 0.0, 0.0], "max": [4.0, 2.0, 1.0]}));
    let mut materials: Vec<&str> =
        a["materials"].as_array().unwrap().iter().flat_map(|m| m.as_str()).collect();
    materials.sort_unstable();
    assert_eq!(materials, ["blue", "red"]);
    assert_eq!((&b["name"], &b["triangles"], &b["materials"]), (&json!("b"), &json!(1), &json!(["blue"])));
    assert_eq!((&obj["size_in_file"], &obj["unit"]), (&json!([4.0, 2.0, 1.0]), &json!(null)));
    let stl = "solid\nfacet\nvertex 0 0 0\nvertex 4 0 0\nvertex 4 2 1\nendfacet\nendsolid\n";
    fs::write(at.join("a.stl"), stl).unwrap();
    let stl = info("info a.stl --json");
    assert_eq!(stl["size_in_file"], json!([4.0, 2.0, 1.0]));
    assert_eq!(stl["bounds"]["max"], json!([4.0, 1.0, 0.0]));
    let glb = info(&format!("info {} --json", model("tests/triangle.glb")));
    assert_eq!(glb["unit"], "metre");
    assert!(info("info a.obj a.stl --json")[0]["parts"].is_array());
    let text = blinn(&at, "info a.stl").stdout;
    assert!(String::from_utf8(text).unwrap().contains("\nsize_in_file: 4 2 1\n"));
}

#[test]
fn info_names_models_of_a_folder_that_are_left_out() {
    let (_dir, at) = folder();
    fs::create_dir(at.join("parts")).unwrap();
    fs::copy(model("tests/triangle.glb"), at.join("parts/a.glb")).unwrap();
    fs::write(at.join("parts/b.step"), "ISO-10303-21;").unwrap();
    let messages = runs(&at, "info --json parts");
    assert!(messages.contains("parts: left out 1 .step file, whose formats"), "{messages}");
    assert_eq!(runs(&at, "info --json -q parts"), "");
}
