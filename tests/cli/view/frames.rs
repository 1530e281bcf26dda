//! Frames, and the commands that make them.

use std::fs;

use serde_json::{Value, json};

use super::{Server, run_command};
use crate::common::program::*;

const SIZE: [u32; 2] = [96, 54];

/// Changes of a state.
fn changed(view: &Value, changes: &Value) -> Value {
    let mut view = view.clone();
    for (key, value) in changes.as_object().unwrap() {
        view[key] = value.clone();
    }
    view
}

/// Whatever the controls show, the last frame has the bytes of the file that the copied command writes.
#[test]
fn the_last_frame_has_the_bytes_of_its_command() {
    let orbit = |projection: &str| {
        json!({"kind": "orbit", "target": [0.1, 0.7, -1e-3], "azimuth": -33.333, "elevation": 90, "distance": 7.1,
               "yfov": 33.3, "projection": projection, "height": 3.3})
    };
    let states = [
        json!({}),
        json!({"camera": orbit("perspective"), "samples": 1}),
        json!({"camera": orbit("orthographic"), "exposure": 0.7, "view_transform": "agx"}),
        json!({"hidden": [0], "ground": true, "ao": 3, "background": "transparent"}),
        json!({"hdri": "sky", "hdri_rotate": -12.5, "background": "hdri", "lights": "none", "time": 0.3,
               "ground": false}),
        json!({"lights": "headlight", "background": "#102030"}),
    ];
    for (scene, flags) in [
        ("figure/figure.glb", "--adaptive 0.1 --ground shadow --light-radius 0.01 --ambient .1,.1,.1 -s 16"),
        ("tests/cube.obj", "--background-blur .2 --background hdri --hdri studio"),
    ] {
        let (_dir, dir) = folder();
        let scene = model(scene);
        let server = Server::start(&dir, &format!("{scene} {flags}"));
        let mut viewer = server.viewer();
        let start = viewer.view();
        for changes in &states {
            let frames = viewer.show(&changed(&start, changes), SIZE);
            let last = frames.last().unwrap();
            assert_eq!((&last.header["width"], &last.header["height"]), (&json!(96), &json!(54)));
            let command = viewer.command["render"].as_str().unwrap();
            assert!(run_command(&dir, command) == last.bytes, "{command}");
            assert_eq!(viewer.command["serial"], viewer.serial);
        }
    }
}

/// Sizes of points and lines, and edges, are those of the command; a click finds a point.
#[test]
fn points_lines_and_edges_are_shown() {
    let (_dir, dir) = folder();
    let corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\n";
    fs::write(
        dir.join("a.obj"),
        format!("{corners}v 0 0 2\no points\np 4\no line\nl 1 4\no face\nf 1 2 3\n"),
    )
    .unwrap();
    let server = Server::start(
        &dir,
        "a.obj --orbit 0,0,10 --yfov 30 --point-size 9px --line-width .1 --edges feature",
    );
    let mut viewer = server.viewer();
    let view = viewer.view();
    let mut pictures = Vec::new();
    for changes in [json!({}), json!({"ground": true}), json!({"background": "transparent"})] {
        let last = viewer.show(&changed(&view, &changes), SIZE).pop().unwrap();
        let command = viewer.command["render"].as_str().unwrap();
        assert!(command.contains("--point-size=9px") && command.contains("--edges=feature"), "{command}");
        assert!(run_command(&dir, command) == last.bytes, "{command}");
        pictures.push(last.bytes);
    }
    // The point is in the middle of the picture, at z = 2, and its radius there is 4.5 pixels of 8 cm.
    viewer.send(&json!({"type": "pick", "serial": 1, "x": 48.0, "y": 27.0}));
    let picked = viewer.wait_for("picked");
    assert!((picked["point"][2].as_f64().unwrap() - 2.36).abs() < 0.06, "{picked}");
    assert!(pictures[0] != pictures[2]);
}

/// The turntable of a state has the state's camera and lights.
#[test]
fn the_command_of_a_turntable_runs() {
    let (_dir, dir) = folder();
    fs::copy(model("tests/cube.obj"), dir.join("a cube.obj")).unwrap();
    fs::copy(model("tests/cube.obj"), dir.join("plain.obj")).unwrap();
    for (name, background) in [("plain.obj", ""), ("plain.obj", "transparent")] {
        let server = Server::start(&dir, name);
        let mut viewer = server.viewer();
        let view = changed(&viewer.view(), &json!({"background": background, "lights": "headlight"}));
        viewer.show(&view, [16, 16]);
        let command = format!("{} --count 2", viewer.command["turntable"].as_str().unwrap());
        let words = shlex::split(&command).unwrap();
        let output = blinn_args(&dir, &words[1..].iter().map(String::as_str).collect::<Vec<_>>());
        assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// Names of objects and files that a shell or a pattern would change.
#[test]
fn odd_names_are_hidden_and_quoted() {
    let (_dir, dir) = folder();
    let cube = fs::read_to_string(model("tests/cube.obj")).unwrap();
    let vertices: String =
        cube.lines().filter(|line| line.starts_with("v ")).map(|line| format!("{line}\n")).collect();
    let odd = "$(it's) [*] \"ß\"";
    fs::write(dir.join("o.obj"), format!("{vertices}o {odd}\nf 1 2 3\no rest\nf 5 6 7\nf 5 7 8\n")).unwrap();
    let server = Server::start(&dir, "o.obj");
    let mut viewer = server.viewer();
    assert_eq!(viewer.scene["objects"][0]["name"], odd);
    let frames = viewer.show(&changed(&viewer.view(), &json!({"hidden": [0]})), SIZE);
    assert_eq!(viewer.command["hidden"], json!([0]));
    let command = viewer.command["render"].as_str().unwrap();
    assert!(run_command(&dir, command) == frames.last().unwrap().bytes, "{command}");
}

#[test]
fn a_click_finds_the_object_and_the_point() {
    let (_dir, dir) = folder();
    let server = Server::start(&dir, &format!("{} --orbit 0,0,10 --yfov 30", model("tests/cube.obj")));
    let mut viewer = server.viewer();
    let view = viewer.view();
    viewer.show(&view, [60, 40]);
    let mut pick = |x: f64, y: f64| {
        viewer.send(&json!({"type": "pick", "serial": 7, "x": x, "y": y}));
        viewer.wait_for("picked")
    };
    let middle = pick(30.0, 20.0);
    assert_eq!((&middle["object"], &middle["serial"]), (&json!(0), &json!(7)));
    let bounds = viewer_bounds(&pick_scene(&server));
    let z = middle["point"][2].as_f64().unwrap();
    assert!((z - bounds).abs() < 1e-5, "{middle}");
    let corner = pick(0.5, 0.5);
    assert!(corner["object"].is_null() && corner["point"].is_null());
    assert!(pick(f64::MAX, -1e300)["object"].is_null());
}

fn pick_scene(server: &Server) -> Value {
    server.viewer().scene
}

/// The front of the scene's bounds.
fn viewer_bounds(scene: &Value) -> f64 {
    scene["bounds"]["max"][2].as_f64().unwrap()
}

/// While the view moves, each state has one frame that comes soon; then the picture gets better.
#[test]
fn moving_frames_are_coarse_and_single() {
    let (_dir, dir) = folder();
    let server = Server::start(&dir, &model("figure/figure.glb"));
    let mut viewer = server.viewer();
    let view = viewer.view();
    for _ in 0..3 {
        viewer.post(&view, [1600, 900], true);
        let frame = viewer.next_frame();
        assert_eq!(frame.header["samples"], 1);
        assert_eq!(frame.header["serial"], viewer.serial);
        assert!(frame.header["width"].as_u64().unwrap() < 1600);
        image::load_from_memory(&frame.bytes).unwrap();
    }
    // A new state ends the refinement of the one before: its last frame never comes.
    let slow = changed(&view, &json!({"samples": 4096}));
    viewer.post(&slow, [1600, 900], false);
    viewer.next_frame();
    let frames = viewer.show(&view, [32, 18]);
    assert_eq!(frames.last().unwrap().header["samples"], 4);
}

#[test]
fn states_that_do_not_suit_the_scene_are_errors() {
    let (_dir, dir) = folder();
    let server = Server::start(&dir, &model("tests/cube.obj"));
    let mut viewer = server.viewer();
    let view = viewer.view();
    for (changes, message) in [
        (json!({"camera": {"kind": "file", "index": 3}}), "no camera 3"),
        (json!({"hdri": "/etc/passwd"}), "start blinn view with this file"),
        (json!({"lights": "moon"}), "moon"),
        (json!({"variant": "red"}), "red"),
        (json!({"background": "hdri"}), "no environment"),
        (json!({"samples": 0}), "--samples"),
    ] {
        viewer.post(&changed(&view, &changes), SIZE, false);
        let error = viewer.wait_for("error");
        assert!(error["text"].as_str().unwrap().contains(message), "{changes}: {error}");
    }
    viewer.send(&json!({"type": "exit"}));
    viewer.wait_for("error");
    assert!(!viewer.show(&view, SIZE).is_empty());
}

#[test]
fn flags_without_a_page_are_refused() {
    let (_dir, dir) = folder();
    let cube = model("tests/cube.obj");
    for (line, message) in [
        (format!("view {cube} -"), "standard input"),
        (format!("view {cube} --base-url hub/proxy/80"), "https://"),
        (format!("view {cube} --allow-host https://hub"), "without https://"),
        ("view -".into(), "standard input"),
        (format!("view {cube} --aov depth"), "whole pictures"),
        (format!("view {cube} --crop 0,0,1,1 --size 9x9"), "whole pictures"),
        (format!("view {cube} --port 0"), "--port"),
        (format!("view {cube} -s 0"), "--samples"),
    ] {
        refused(&dir, &line, message);
    }
    fails(&dir, &["view", "missing.glb"], 1, "missing.glb");
    fails(&dir, &["view", &cube, "--camera", "x"], 1, "no camera 'x'");
}

/// A picture that takes long gives way to the gestures of others, and is finished when they pause.
#[test]
fn a_long_picture_delays_no_other_viewer() {
    let (_dir, dir) = folder();
    let server = Server::start(&dir, &model("figure/figure.glb"));
    let (mut patient, mut other) = (server.viewer(), server.viewer());
    let view = patient.view();
    patient.post(&changed(&view, &json!({"samples": 60_000})), [640, 360], false);
    patient.next_frame();
    for _ in 0..6 {
        other.post(&view, [320, 180], true);
        assert_eq!(other.next_frame().header["serial"], other.serial);
    }
    let frames = patient.show(&changed(&view, &json!({"samples": 9})), [64, 36]);
    assert_eq!(frames.last().unwrap().header["samples"], 9);
}
