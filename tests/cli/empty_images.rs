//! Images that show nothing are reported with the reason, once for each scene, and marked.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::gltf_fixture::Fixture;
use crate::common::program::*;

const SMALL: &str = "--size 32x18 -s 1";

/// A unit cube at the origin, single-sided, with this camera.
fn cube(camera: Value, camera_node: Value) -> Fixture {
    let mut fixture = Fixture::empty();
    let corner = |i: u16| [0, 1, 2].map(|k| if i >> k & 1 == 0 { -0.5 } else { 0.5 });
    let positions: Vec<[f32; 3]> = (0..8).map(corner).collect();
    let positions = fixture.vec3(&positions);
    let indices = fixture.indices(&[
        0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3,
        7, 5,
    ]);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    fixture.push("meshes", json!({"primitives": [primitive]}));
    fixture.node(json!({"mesh": 0, "name": "cube"}));
    if !camera.is_null() {
        fixture.push("cameras", camera);
        let mut node = camera_node;
        node["camera"] = json!(0);
        fixture.node(node);
    }
    fixture
}

/// A perspective camera between these planes.
fn perspective(near: f64, far: f64) -> Value {
    json!({"type": "perspective", "perspective": {"yfov": 0.7, "znear": near, "zfar": far}})
}

fn write(folder: &Path, fixture: &Fixture) {
    fs::write(folder.join("a.glb"), fixture.glb()).unwrap();
}

/// The warnings of a render of a.glb.
fn warnings(folder: &Path, flags: &str) -> Vec<String> {
    let messages = runs(folder, &format!("render a.glb {SMALL} {flags}"));
    messages.lines().filter(|line| line.starts_with("warning:")).map(String::from).collect()
}

#[test]
fn the_reason_and_the_flag_that_helps_are_named() {
    let (_dir, at) = folder();
    let usual = perspective(0.1, 100.0);
    let hidden = |extra: Value| {
        let mut fixture = cube(usual.clone(), json!({"translation": [0, 0, 5]}));
        fixture.json["nodes"][0].as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
        fixture
    };
    let invisible = json!({"extensions": {"KHR_node_visibility": {"visible": false}}});
    let mut clear = cube(usual.clone(), json!({"translation": [0, 0, 5]}));
    clear.push(
        "materials",
        json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0]}}),
    );
    clear.primitive()["material"] = json!(0);
    // Points or lines in place of triangles.
    let rounds = |mode: u32| {
        let mut fixture = cube(usual.clone(), json!({"translation": [0.01, 0.02, 5]}));
        fixture.primitive()["mode"] = json!(mode);
        fixture
    };
    let mut flat = cube(Value::Null, Value::Null);
    let line = flat.indices(&[0, 7, 0, 7, 7, 7]);
    flat.primitive()["indices"] = json!(line);
    for (fixture, flags, reason, remedy) in [
        (cube(usual.clone(), json!({"translation": [0, 0, -5]})), "", "looks away", "--look-at"),
        (cube(usual.clone(), json!({"translation": [9, 0, 5]})), "", "looks away", "--orbit"),
        (cube(usual.clone(), json!({})), "", "inside an object", "--cull off"),
        (cube(perspective(0.1, 2.0), json!({"translation": [0, 0, 5]})), "", "far plane", "--clip off"),
        (cube(perspective(9.0, 20.0), json!({"translation": [0, 0, 5]})), "", "near plane", "--clip off"),
        (cube(usual.clone(), json!({"translation": [0, 0, 9]})), "--clip 30,70", "near plane", "--clip off"),
        (
            cube(usual.clone(), json!({"translation": [0.013, 0.4, 99000]})),
            "--clip off",
            "smaller than a pixel",
            "--zoom",
        ),
        (hidden(json!({"scale": [0, 0, 0]})), "", "no triangle has an area", "blinn info"),
        (flat, "", "no triangle has an area", "blinn info"),
        (hidden(invisible.clone()), "", "the file hides all objects", "show them"),
        (clear, "", "alpha hides all objects", "alpha 1"),
        (rounds(0), "--point-size off", "only points are in view", "--point-size off"),
        (rounds(1), "--line-width off", "only lines are in view", "--line-width off"),
        (rounds(0), "--point-size 1e-6", "thinner than a pixel", "2px"),
        (rounds(1), "--line-width 1e-6", "thinner than a pixel", "2px"),
        (
            cube(usual.clone(), json!({"translation": [0, 0, 5]})),
            "--crop 0,0,3,3",
            "--crop shows only",
            "move",
        ),
        (
            cube(usual.clone(), json!({"translation": [0, 0, -5]})),
            "--ground plane",
            "looks away",
            "--look-at",
        ),
    ] {
        write(&at, &fixture);
        let lines = warnings(&at, flags);
        assert!(lines.len() == 1, "{reason}: {lines:?}");
        assert!(lines[0].contains("shows nothing") && lines[0].contains(reason), "{reason}: {lines:?}");
        assert!(lines[0].contains(remedy), "{reason}: {lines:?}");
        fs::remove_file(at.join("a.png")).unwrap();
        let words = format!("render a.glb {SMALL} {flags} --strict");
        fails(&at, &words.split_whitespace().collect::<Vec<_>>(), 1, reason);
    }
    // An image that shows something: no word.
    write(&at, &cube(usual.clone(), json!({"translation": [0, 0, 5]})));
    for flags in ["", "--ground plane", "--crop 14,7,4,4", "--orbit 30,20", "--zoom 0.2 --ground plane"] {
        assert!(warnings(&at, flags).is_empty(), "{flags}");
    }
}

/// Edges where there are none, in drawings and over surfaces.
#[test]
fn edges_that_are_not_there_are_explained() {
    let (_dir, at) = folder();
    let line = "v -1 0 0\nv 1 0.3 0\nl 1 2\n";
    let square = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
    let messages = |content: &str, flags: &str| {
        fs::write(at.join("a.obj"), content).unwrap();
        runs(&at, &format!("render a.obj -o a.png --orbit 0,0 {SMALL} {flags}"))
    };
    for (content, flags, reason, remedy) in [
        (line, "--line-width off --edges-only --edges feature", "no surface in view", "--edges feature"),
        (line, "--edges feature", "no surface in view has such edges", "--edges feature,silhouette"),
    ] {
        let messages = messages(content, flags);
        assert!(messages.contains(reason) && messages.contains(remedy), "{flags}: {messages}");
        assert_eq!(messages.matches(reason).count(), 1, "{flags}: {messages}");
    }
    for (content, flags) in
        [(line, ""), (square, "--edges feature"), (square, "--edges-only --edges feature")]
    {
        let messages = messages(content, flags);
        assert!(!messages.contains("such edges"), "{flags}: {messages}");
    }
}

/// The cube's alpha is 0 from 1 s on, but not at the start, so that the camera sees it in bounds of the clip.
#[test]
fn animated_alpha_is_named_as_the_reason() {
    let (_dir, at) = folder();
    let mut fixture = cube(perspective(0.1, 100.0), json!({"translation": [0, 0, 5]}));
    fixture.push("materials", json!({"alphaMode": "BLEND"}));
    fixture.primitive()["material"] = json!(0);
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let colors = fixture.vec4(&[[1.0; 4], [1.0, 1.0, 1.0, 0.0]]);
    let pointer = json!({"pointer": "/materials/0/pbrMetallicRoughness/baseColorFactor"});
    let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": pointer}});
    fixture.push(
        "animations",
        json!({"samplers": [{"input": times, "output": colors}],
            "channels": [{"sampler": 0, "target": target}]}),
    );
    write(&at, &fixture);
    assert!(warnings(&at, "--time 0.5").is_empty());
    for flags in ["--time 1", "--time 1 --clip off", "--time 1 --cull off", "--time 1 --crop 14,7,4,4"] {
        let lines = warnings(&at, flags);
        assert!(
            lines.len() == 1 && lines[0].contains("alpha hides everything in view"),
            "{flags}: {lines:?}"
        );
    }
}

/// The cube is visible from 2 s on: six frames of ten show nothing.
#[test]
fn one_line_counts_the_frames_of_a_scene() {
    let (_dir, at) = folder();
    let mut fixture = cube(perspective(0.1, 100.0), json!({"translation": [0, 0, 5]}));
    let times = fixture.floats("SCALAR", 1, &[0.0, 2.0]);
    let scales = fixture.vec3(&[[0.0; 3], [1.0; 3]]);
    fixture.push(
        "animations",
        json!({"samplers": [{"input": times, "output": scales, "interpolation": "STEP"}],
               "channels": [{"sampler": 0, "target": {"node": 0, "path": "scale"}}]}),
    );
    write(&at, &fixture);
    let line = format!("render a.glb {SMALL} --frames 1-10 --fps 3 -o f/####.png");
    let messages = runs(&at, &line);
    let expected = "5 of 10 images show nothing; frames 1, 2, 3 and 2 more: all objects are hidden";
    assert_eq!(messages.matches("warning:").count(), 1, "{messages}");
    assert!(messages.contains(expected), "{messages}");
    // JSON events and the report mark them.
    let messages = runs(&at, &format!("{line} --progress json --report r.html"));
    let events: Vec<Value> = messages.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let wrote: Vec<&Value> =
        events.iter().filter(|e| e["event"] == "wrote" && !e["scene"].is_null()).collect();
    let empty: Vec<bool> = wrote.iter().map(|e| e["empty"] == true).collect();
    assert_eq!(empty, [[true; 5], [false; 5]].concat());
    assert_eq!(events.last().unwrap()["empty"], 5);
    let page = fs::read_to_string(at.join("r.html")).unwrap();
    assert_eq!(page.matches(">empty<").count(), 5);
    assert!(page.contains(expected));
}

/// A square in the plane z = 0, which shows nothing from behind unless it is double-sided.
fn square(double_sided: bool) -> Fixture {
    let mut fixture = Fixture::empty();
    let positions = fixture.vec3(&[[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]]);
    let indices = fixture.indices(&[0, 1, 2, 0, 2, 3]);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices, "material": 0});
    fixture.push("materials", json!({"doubleSided": double_sided}));
    fixture.push("meshes", json!({"primitives": [primitive]}));
    fixture.node(json!({"mesh": 0}));
    fixture
}

#[test]
fn transforms_mark_empty_views_and_keep_the_marks_of_other_tasks() {
    let (_dir, at) = folder();
    let marks = || -> Vec<bool> {
        let text = fs::read_to_string(at.join("v/transforms.json")).unwrap();
        let all: Value = serde_json::from_str(&text).unwrap();
        all["frames"].as_array().unwrap().iter().map(|frame| frame["empty"] == true).collect()
    };
    let views = |flags: &str| {
        runs(&at, &format!("turntable a.glb --views 6 --size 16x16 -s 1 -o v/####.png {flags}"));
    };
    write(&at, &square(false));
    views("");
    let from_behind = marks();
    let hidden: Vec<usize> = (0..6).filter(|&i| from_behind[i]).collect();
    assert!((2..=4).contains(&hidden.len()), "{from_behind:?}");
    // The views are the same; all of them show something now.
    write(&at, &square(true));
    let mut expected = from_behind;
    views(&format!("--only {}", hidden[0] + 1));
    expected[hidden[0]] = false;
    assert_eq!(marks(), expected);
    let other = hidden[1] + 1;
    fs::remove_file(at.join(format!("v/{other:04}.png"))).unwrap();
    for layer in ["depth", "normal", "mask"] {
        fs::remove_file(at.join(format!("v/{other:04}.{layer}.png"))).unwrap();
    }
    views(&format!("--only {other} --no-overwrite"));
    assert_eq!(marks(), expected, "the file is kept");
}

/// Unused vertices, collapsed and transparent objects change neither the view nor the ground.
#[test]
fn what_cannot_be_seen_changes_no_picture() {
    let (_dir, at) = folder();
    let plain = cube(Value::Null, Value::Null);
    fs::write(at.join("plain.glb"), plain.glb()).unwrap();
    let mut stray = cube(Value::Null, Value::Null);
    let corner = |i: u16| [0, 1, 2].map(|k| if i >> k & 1 == 0 { -0.5 } else { 0.5 });
    let mut positions: Vec<[f32; 3]> = (0..8).map(corner).collect();
    positions.push([1e6, 0.0, 0.0]);
    let accessor = stray.vec3(&positions);
    stray.primitive()["attributes"]["POSITION"] = json!(accessor);
    let mut hidden = cube(Value::Null, Value::Null);
    hidden.node(json!({"mesh": 0, "translation": [1e4, 0, 0], "scale": [0, 0, 0]}));
    let mut clear = cube(Value::Null, Value::Null);
    let of_triangle = clear.vec3(&[[100.0, 0.0, 0.0], [100.0, 200.0, 0.0], [0.0, 300.0, 5.0]]);
    clear.push(
        "materials",
        json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0]}}),
    );
    let primitive = json!({"attributes": {"POSITION": of_triangle}, "material": 0});
    clear.push("meshes", json!({"primitives": [primitive]}));
    clear.node(json!({"mesh": 1}));
    let flags = format!("{SMALL} --ground plane --ao 4");
    runs(&at, &format!("render plain.glb -o plain.png {flags}"));
    let expected = fs::read(at.join("plain.png")).unwrap();
    let pixels = |file: &Path| image::open(file).unwrap().into_rgba8();
    for (name, fixture) in [("stray", stray), ("hidden", hidden), ("clear", clear)] {
        write(&at, &fixture);
        runs(&at, &format!("render a.glb {flags}"));
        assert!(expected.len() > 100 && pixels(&at.join("a.png")) == pixels(&at.join("plain.png")), "{name}");
    }
}
