//! Files that change while they are shown.

use std::fs;
use std::path::Path;

use serde_json::json;

use super::{Server, run_command};
use crate::common::program::*;

/// A cube whose material is in a file of its own.
fn write_cube(folder: &Path, color: &str) {
    let cube = fs::read_to_string(model("tests/cube.obj")).unwrap();
    let rest: String = cube
        .lines()
        .filter(|line| !["mtllib", "usemtl", "o ", "g "].iter().any(|word| line.starts_with(word)))
        .map(|line| format!("{line}\n"))
        .collect();
    fs::write(folder.join("c.obj"), format!("mtllib c.mtl\no first\nusemtl m\n{rest}o second\nf 1 2 3\n"))
        .unwrap();
    fs::write(folder.join("c.mtl"), format!("newmtl m\nKd {color}\n")).unwrap();
}

/// The scene and its material are read again; camera and hidden objects stay. What cannot be read changes nothing.
#[test]
fn changed_files_are_shown_with_the_same_view() {
    let (_dir, dir) = folder();
    write_cube(&dir, "1 0 0");
    let server = Server::start(&dir, "c.obj");
    let mut viewer = server.viewer();
    let mut view = viewer.view();
    view["camera"]["azimuth"] = json!(11.5);
    view["hidden"] = json!([1]);
    let red = viewer.show(&view, [64, 48]).pop().unwrap();

    // The material alone.
    fs::write(dir.join("new.mtl"), "newmtl m\nKd 0 0 1\n").unwrap();
    fs::rename(dir.join("new.mtl"), dir.join("c.mtl")).unwrap();
    let scene = viewer.wait_for("scene");
    assert_eq!(scene["generation"], 1);
    assert_eq!((&scene["view"]["camera"], &scene["view"]["hidden"]), (&view["camera"], &json!([1])));
    let blue = viewer.show(&view, [64, 48]).pop().unwrap();
    assert_ne!(red.bytes, blue.bytes);
    assert!(run_command(&dir, viewer.command["render"].as_str().unwrap()) == blue.bytes);

    // A file that is half written, and one that is missing for a while.
    let whole = fs::read(dir.join("c.obj")).unwrap();
    for broken in [true, false] {
        if broken {
            fs::write(dir.join("c.obj"), "f 1 2 3\n").unwrap();
        } else {
            fs::remove_file(dir.join("c.obj")).unwrap();
        }
        let error = viewer.wait_for("error");
        assert!(error["text"].as_str().unwrap().contains("c.obj"), "{error}");
        assert!(viewer.show(&view, [64, 48]).pop().unwrap().bytes == blue.bytes, "the old scene stays");
    }
    // The objects change places; the hidden one is found by its name.
    let text = String::from_utf8(whole).unwrap().replace("o first", "o zero\nf 1 2 4\no first");
    fs::write(dir.join("c.obj"), text).unwrap();
    let scene = viewer.wait_for("scene");
    assert_eq!(scene["view"]["hidden"], json!([2]));
    assert_eq!(scene["objects"].as_array().unwrap().len(), 3);
}

/// Scenes of a folder open one after the other, with the options that were changed; one that is broken changes nothing.
#[test]
fn scenes_of_a_folder_are_opened() {
    let (_dir, dir) = folder();
    fs::create_dir(dir.join("all")).unwrap();
    fs::copy(model("tests/cube.obj"), dir.join("all/b.obj")).unwrap();
    fs::write(dir.join("all/c.obj"), "f 1 2 3\n").unwrap();
    fs::copy(model("cornell/cornell.glb"), dir.join("all/d.glb")).unwrap();
    // The first that can be loaded is shown.
    fs::write(dir.join("all/a.obj"), "").unwrap();
    let server = Server::start(&dir, "all");
    let mut viewer = server.viewer();
    let names = json!(["all/a.obj", "all/b.obj", "all/c.obj", "all/d.glb"]);
    assert_eq!((&viewer.scene["file"], &viewer.scene["files"]["names"]), (&json!("all/b.obj"), &names));
    assert_eq!((&viewer.scene["files"]["index"], &viewer.scene["start"]), (&json!(1), &viewer.scene["view"]));

    let mut view = viewer.view();
    view["samples"] = json!(2);
    view["hidden"] = json!([0]);
    viewer.show(&view, [64, 48]);
    viewer.send(&json!({"type": "open", "file": 2}));
    assert!(viewer.wait_for("error")["text"].as_str().unwrap().contains("c.obj"));
    viewer.send(&json!({"type": "open", "file": 99}));
    viewer.send(&json!({"type": "open", "file": 3}));
    let scene = viewer.wait_for("scene");
    assert_eq!((&scene["file"], &scene["files"]["index"]), (&json!("all/d.glb"), &json!(3)));
    assert_eq!((&scene["view"]["samples"], &scene["view"]["hidden"]), (&json!(2), &json!([])));
    assert_eq!(scene["view"]["camera"], json!({"kind": "file", "index": 0}));
    assert_eq!(scene["start"]["samples"], json!(4));
    let picture = viewer.show(&scene["view"], [64, 48]).pop().unwrap();
    assert!(run_command(&dir, viewer.command["render"].as_str().unwrap()) == picture.bytes);
}
