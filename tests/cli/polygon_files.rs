//! STL and PLY files as scenes, and files of other formats.

use std::fs;

use serde_json::Value;

use crate::common::program::*;
use crate::common::seed_files;

#[test]
fn stl_and_ply_are_scenes() {
    let (_guard, folder) = folder();
    fs::create_dir(folder.join("scans")).unwrap();
    for (name, file, bytes) in seed_files::polygon_files() {
        let extension = file.rsplit('.').next().unwrap();
        let file = format!("scans/{}.{extension}", name.replace('.', "_"));
        fs::write(folder.join(&file), bytes).unwrap();
        let info = blinn(&folder, &format!("info --json {file}"));
        let info: Value = serde_json::from_slice(&info.stdout).unwrap();
        assert_eq!(info["format"], extension.to_uppercase(), "{info:#}");
    }
    runs(&folder, "render scans --size 32x24 -o out/");
    let rendered: Vec<String> = names(&folder.join("out"));
    assert_eq!(rendered, ["binary_stl.png", "strips_ply.png", "text_ply.png", "text_stl.png"]);
}

#[test]
fn other_formats_are_named_with_the_way_to_a_scene() {
    let (_guard, folder) = folder();
    for (name, bytes, message) in [
        ("a.fbx", &b"Kaydara FBX Binary  \0"[..], "a.fbx: the file is an FBX file; import it in Blender"),
        (
            "part.step",
            b"ISO-10303-21;\nHEADER;",
            "part.step: the file is a STEP file; export it as .glb or .stl",
        ),
        ("a.glb", b"", "a.glb: the file is empty"),
        ("a.zip", b"PK\x03\x04", "a.zip: the file is a ZIP archive; extract it"),
        ("photo.jpg", b"\xff\xd8\xff\xe0", "photo.jpg: the file is a JPEG picture"),
    ] {
        fs::write(folder.join(name), bytes).unwrap();
        fails(&folder, &["render", name], 1, message);
    }
}
