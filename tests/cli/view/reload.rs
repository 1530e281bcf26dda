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
