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

/// Points and lines have no light; their colour is replaced all the same.
#[test]
fn the_diffuse_coefficient_colours_points() {
    let (_dir, dir) = folder();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n\
               0 0 0 255 255 255\n1 0 0 10 200 30\n0 0 1 0 0 255\n";
    fs::write(dir.join("cloud.ply"), ply).unwrap();
    runs(
        &dir,
        "render cloud.ply --size 33x33 -s 1 --point-size 60px --kd red --ks 1,1,1 --view standard -o a.png",
    );
    let picture = image::open(dir.join("a.png")).unwrap().into_rgb8();
    assert_eq!(picture.get_pixel(16, 16).0, [255, 0, 0]);
}
