//! `blinn diff` of two folders of scenes.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::program::*;

/// A triangle whose corner at the right is `width` away from the left ones.
fn triangle(width: u32) -> String {
    format!("o part\nv 0 0 0\nv {width} 0 0\nv 0 1 0\nf 1 2 3\n")
}

const STL: &str = "solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
                   endfacet\nendsolid part\n";

/// Writes the folders `rev1` and `rev2`.
fn write_revisions(at: &Path) {
    let files = [
        ("rev1/equal.obj", triangle(1)),
        ("rev2/equal.obj", triangle(1)),
        ("rev1/sub/moved.obj", triangle(1)),
        ("rev2/sub/moved.obj", triangle(2)),
        ("rev1/old.obj", triangle(1)),
        ("rev2/new.obj", triangle(1)),
        ("rev1/turned.obj", triangle(1)),
        ("rev2/turned.stl", STL.into()),
    ];
    for (name, text) in files {
        let file = at.join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, text).unwrap();
    }
}

/// Compares both folders, and returns the exit code, standard output and messages.
fn diff(at: &Path, options: &str) -> (Option<i32>, String, String) {
    let output = blinn(at, &format!("diff rev1 rev2 --size 32x24 {options}"));
    let [text, errors] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.code(), text, errors)
}

#[test]
fn scenes_of_one_name_are_compared() {
    let (_dir, at) = folder();
    write_revisions(&at);
    let (code, text, errors) = diff(&at, "-q");
    assert_eq!(code, Some(1), "{errors}");
    let expected = [
        "equal: equal.obj",
        "only in rev2: new.obj",
        "only in rev1: old.obj",
        "different: sub/moved.obj: 2 of 4 views, 1 object, 1 property",
        "different: turned.obj and turned.stl: 3 of 4 views, 1 object, 3 properties",
        "3 pairs: 1 equal, 2 different, 1 only in rev1, 1 only in rev2",
    ];
    assert_eq!(text.lines().collect::<Vec<_>>(), expected);
    // Equal folders.
    let output = blinn(&at, "diff rev1 rev1 --size 32x24 -q");
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8(output.stdout).unwrap().ends_with("\n4 pairs: 4 equal\n"));
    refused(&at, "diff rev1 rev1/equal.obj", "rev1 is a folder and rev1/equal.obj is not");
    refused(&at, "diff rev1 rev3", "rev3 does not exist; did you mean 'rev1'?");
    fs::create_dir(at.join("empty")).unwrap();
    refused(&at, "diff rev1 empty", "empty: a folder without");
}

#[test]
fn json_is_an_array_of_all_scenes() {
    let (_dir, at) = folder();
    write_revisions(&at);
    let (code, text, errors) = diff(&at, "--json -q");
    assert_eq!(code, Some(1), "{errors}");
    let all: Vec<Value> = serde_json::from_str(&text).unwrap();
    let equal: Vec<&Value> = all.iter().map(|scene| &scene["equal"]).collect();
    assert_eq!(equal, [true, false, false, false, false]);
    assert_eq!(all[1], json!({"old": null, "new": "rev2/new.obj", "equal": false}));
    assert_eq!(all[2], json!({"old": "rev1/old.obj", "new": null, "equal": false}));
    let moved = &all[3];
    assert_eq!((&moved["old"], &moved["new"]), (&json!("rev1/sub/moved.obj"), &json!("rev2/sub/moved.obj")));
    assert_eq!(moved["objects"][0]["max_distance"], 1.0);
    // A pair is compared as it would be alone.
    let alone = blinn(&at, "diff rev1/sub/moved.obj rev2/sub/moved.obj --size 32x24 --json -q").stdout;
    assert_eq!(*moved, serde_json::from_slice::<Value>(&alone).unwrap());
}

#[test]
fn a_pair_that_fails_does_not_stop_the_others() {
    let (_dir, at) = folder();
    write_revisions(&at);
    for (old, new) in [("rev1/damaged.glb", "rev2/damaged.glb"), ("rev1/late.obj", "rev2/late.glb")] {
        fs::write(at.join(old), if old.ends_with("glb") { "glTF".to_string() } else { triangle(1) }).unwrap();
        fs::write(at.join(new), "glTF").unwrap();
    }
    let (code, text, errors) = diff(&at, "-q");
    assert_eq!(code, Some(2), "{errors}");
    let lines: Vec<&str> = text.lines().collect();
    let found = [lines[0], lines[1], lines[2], lines[lines.len() - 1]];
    let expected = [
        "failed: damaged.glb",
        "equal: equal.obj",
        "failed: late.obj and late.glb",
        "5 pairs: 1 equal, 2 different, 2 failed, 1 only in rev1, 1 only in rev2",
    ];
    assert_eq!(found, expected, "{text}");
    for part in
        [": rev1/damaged.glb: byte 4", ": rev2/late.glb: byte 4", "2 of 5 pairs could not be compared"]
    {
        assert!(errors.contains(part), "{errors}");
    }
    let (code, text, _) = diff(&at, "--json -q");
    assert_eq!(code, Some(2));
    let all: Vec<Value> = serde_json::from_str(&text).unwrap();
    let failed = all.iter().find(|scene| scene["old"] == "rev1/damaged.glb").unwrap();
    assert!(failed["error"].as_str().unwrap().contains("damaged.glb"), "{failed}");
    assert_eq!((all.len(), failed.get("equal")), (7, None));
}

#[test]
fn pages_of_pairs_have_the_names_of_the_old_files() {
    let (_dir, at) = folder();
    write_revisions(&at);
    let written = |output: &str| {
        let (code, _, errors) = diff(&at, &format!("-o {output} --threads 3"));
        assert_eq!(code, Some(1), "{errors}");
        let pages = files(&at.join("out"));
        fs::remove_dir_all(at.join("out")).unwrap();
        pages
    };
    let pages = written("out/");
    assert_eq!(pages.keys().collect::<Vec<_>>(), ["equal.html", "sub/moved.html", "turned.html"]);
    let (_, _, errors) = diff(&at, "-o out --threads 1");
    assert!(errors.contains("wrote out/sub/moved.html"), "{errors}");
    assert!(files(&at.join("out")) == pages, "pages depend on the number of threads");
    fs::remove_dir_all(at.join("out")).unwrap();
    let pictures = written("out/{stem}.{ext}.png");
    assert_eq!(pictures.keys().collect::<Vec<_>>(), ["equal.obj.png", "moved.obj.png", "turned.obj.png"]);
    refused(&at, "diff rev1 rev2 -o all.html", "would both be written to all.html");
    refused(&at, "diff rev1 rev2 -o {stem}.gif", "use .html or .png");
    refused(&at, "diff rev1 rev2 -o {stem}_{camera}.png", "the placeholders of diff are {stem}");
}
