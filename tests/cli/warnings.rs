//! Warnings: the first few of each kind and their number; all of them where programs read them.

use std::fmt::Write as _;
use std::fs;

use serde_json::{Value, json};

use crate::common::gltf_fixture::Fixture;
use crate::common::program::*;

const COUNT: usize = 300;

/// A triangle, and materials with images that do not exist.
fn missing_images() -> Fixture {
    let mut fixture = Fixture::triangle();
    for i in 0..COUNT {
        fixture.push("images", json!({"uri": format!("tex/{i}.png")}));
        fixture.push("textures", json!({"source": i}));
        let texture = json!({"baseColorTexture": {"index": i}});
        fixture.push("materials", json!({"name": format!("m{i}"), "pbrMetallicRoughness": texture}));
    }
    fixture.primitive()["material"] = json!(0);
    let mesh = fixture.json["meshes"][0].clone();
    for i in 1..COUNT {
        let mut mesh = mesh.clone();
        mesh["primitives"][0]["material"] = json!(i);
        fixture.push("meshes", mesh);
        fixture.node(json!({"mesh": i}));
    }
    fixture
}

/// Options of a lens do nothing where the camera has none.
#[test]
fn focus_and_blades_without_a_depth_of_field_are_remarked_on() {
    let (_dir, at) = folder();
    fs::write(at.join("a.glb"), Fixture::triangle().glb()).unwrap();
    let end = " no effect, as everything is sharp; add --aperture-radius for a depth of field";
    for (flags, options) in [
        ("--focus 3", Some("--focus has")),
        ("--aperture-blades 6", Some("--aperture-blades has")),
        ("--focus 1,2,3 --aperture-blades 6 --aperture-radius 0", Some("--focus and --aperture-blades have")),
        ("--focus 3 --aperture-blades 6 --aperture-radius 0.01", None),
        ("--aperture-radius 0", None),
    ] {
        let messages = runs(&at, &format!("render a.glb --size 8x8 -s 1 {flags}"));
        match options {
            Some(options) => assert!(messages.contains(&format!("{options}{end}")), "{flags}: {messages}"),
            None => assert!(!messages.contains("no effect"), "{flags}: {messages}"),
        }
    }
}

#[test]
fn many_warnings_of_a_kind_are_a_few_lines_and_a_count() {
    let (_dir, at) = folder();
    fs::write(at.join("a.glb"), missing_images().glb()).unwrap();
    let render = "render a.glb --size 8x8 -s 1";
    let lines = |messages: &str| messages.lines().filter(|line| line.contains("tex/")).count();
    let messages = runs(&at, render);
    let shown = lines(&messages);
    assert!((3..20).contains(&shown), "{messages}");
    assert!(messages.contains(&format!("{} more warnings such as: ", COUNT - (shown - 1))), "{messages}");
    assert!(messages.contains("use --verbose to print all"), "{messages}");
    // All of them.
    assert_eq!(lines(&runs(&at, &format!("{render} --verbose"))), COUNT);
    assert_eq!(lines(&runs(&at, &format!("{render} --progress json"))), COUNT);
    runs(&at, &format!("{render} --report r.html"));
    assert_eq!(
        fs::read_to_string(at.join("r.html")).unwrap().matches("class=\"caution\">warning: ").count(),
        COUNT
    );
    let info = |flags: &str| String::from_utf8(blinn(&at, &format!("info a.glb {flags}")).stdout).unwrap();
    assert!(info("").contains("use --json to print all"));
    let all: Value = serde_json::from_str(&info("--json")).unwrap();
    assert_eq!(all["warnings"].as_array().unwrap().len(), COUNT);
}

#[test]
fn other_kinds_are_not_lost_among_many() {
    let (_dir, at) = folder();
    let mut mtl = String::new();
    for i in 0..COUNT {
        write!(mtl, "newmtl m{i}\nKd 1 1 1\nnewmtl m{i}\nKd 0 1 1\n").unwrap();
    }
    mtl += "newmtl odd\nKd -1 0 0\n";
    fs::write(at.join("a.mtl"), mtl).unwrap();
    fs::write(at.join("a.obj"), "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl odd\nf 1 2 3\n").unwrap();
    let messages = runs(&at, "render a.obj --size 8x8 -s 1");
    assert!(messages.lines().count() < 15, "{messages}");
    assert!(messages.contains("instead of a negative value"), "{messages}");
    assert!(messages.contains("more warnings such as: "), "{messages}");
}

#[test]
fn the_version_may_follow_a_command() {
    let (_dir, at) = folder();
    let expected = blinn(&at, "--version").stdout;
    assert!(String::from_utf8_lossy(&expected).starts_with("blinn "));
    for line in ["-V", "render --version", "render a.glb --version", "job slurm -V", "info --json --version"]
    {
        let output = blinn(&at, line);
        assert_eq!((output.status.code(), &output.stdout), (Some(0), &expected), "{line}");
    }
}

/// Two coincident triangles of opposite winding, as in ShapeNet's files: seen from the back of one, the other shows.
#[test]
fn back_faces_of_double_sided_materials_can_be_culled() {
    let (_dir, at) = folder();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(at.join("front.obj"), text).unwrap();
    fs::write(at.join("both.obj"), format!("{text}f 3 2 1\n")).unwrap();
    let covered = |file: &str, flags: &str| {
        let line = format!("render {file}.obj --size 16x16 -s 1 --background transparent -o a.png {flags}");
        let output = blinn(&at, &line);
        assert_eq!(output.status.code(), Some(0), "{line}");
        image::open(at.join("a.png")).unwrap().into_rgba8().pixels().filter(|p| p[3] > 0).count()
    };
    let (front, back) = ("--view-point 0.3,0.3,3", "--view-point 0.3,0.3,-3");
    for (flags, from_front, from_back) in [
        ("", true, true),
        ("--cull auto", true, true),
        ("--cull off", true, true),
        ("--cull back", true, false),
    ] {
        assert_eq!(covered("front", &format!("{front} {flags}")) > 0, from_front, "{flags}");
        assert_eq!(covered("front", &format!("{back} {flags}")) > 0, from_back, "{flags}");
        assert!(covered("both", &format!("{back} {flags}")) > 0, "{flags}");
    }
}

/// FBX2glTF writes clip planes in centimetres: the picture is cut, which a hint names. Planes in front of everything, and those
/// of `--clip`, are no surprise.
#[test]
fn near_planes_that_cut_the_picture_are_a_hint() {
    let (_dir, at) = folder();
    let messages = |near: f64, flags: &str| {
        let mut file = Fixture::triangle();
        // A second triangle that is farther away.
        file.node(json!({"mesh": 0, "translation": [-0.5, -0.5, -20]}));
        let lens = json!({"yfov": 0.8, "znear": near, "zfar": 1000});
        file.push("cameras", json!({"type": "perspective", "perspective": lens}));
        file.node(json!({"camera": 0, "translation": [0.3, 0.3, 4]}));
        fs::write(at.join("a.glb"), file.glb()).unwrap();
        runs(&at, &format!("render a.glb -o a.png --size 32x24 -s 1 {flags}"))
    };
    let hint = "the near plane of the file's camera clips a part of the scene, which is nearer than 10 m; use --clip off";
    assert!(messages(10.0, "").contains(hint), "{}", messages(10.0, ""));
    for (near, flags) in
        [(0.1, ""), (3.9, ""), (10.0, "--clip off"), (10.0, "--clip 10,100"), (10.0, "--orbit 30,20")]
    {
        let messages = messages(near, flags);
        assert!(!messages.contains("near plane"), "{near} {flags}: {messages}");
    }
}
