//! Glowing surfaces among the lights of a file, and remarks on lights that cannot be seen.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::gltf_fixture::Fixture;
use crate::common::program::*;

/// A matte floor below a square of the given side that emits `emission`.
fn write_lamp(at: &Path, side: f64, emission: f64) {
    let h = 0.5 * side;
    let corner = |x: f64, y: f64, z: f64| format!("v {x} {y} {z}\n");
    let floor = [(-2.0, -2.0), (-2.0, 2.0), (2.0, 2.0), (2.0, -2.0)].map(|(x, z)| corner(x, 0.0, z)).concat();
    let lamp = [(-h, -h), (-h, h), (h, h), (h, -h)].map(|(x, z)| corner(x, 1.0, z)).concat();
    let faces = "usemtl Floor\nf 1 2 3 4\nusemtl Lamp\nf 5 6 7 8\n";
    fs::write(at.join("lamp.obj"), format!("mtllib lamp.mtl\n{floor}{lamp}{faces}")).unwrap();
    let lamp =
        format!("newmtl Floor\nKd .8 .8 .8\nnewmtl Lamp\nKd 0 0 0\nKe {emission} {emission} {emission}\n");
    fs::write(at.join("lamp.mtl"), lamp).unwrap();
}

const VIEW: &str = "--view-point 0,.6,4 --view-dir 0,-.1,-1 --size 32x24";

/// Renders the lamp; its messages and the colour of the floor in front.
fn lit_floor(at: &Path, flags: &str) -> (String, u8) {
    let messages = runs(at, &format!("render lamp.obj -v -o a.png {VIEW} {flags}"));
    let picture = image::open(at.join("a.png")).unwrap().into_rgba8();
    (messages, picture.get_pixel(16, 16).0[1])
}

#[test]
fn surfaces_brighter_than_white_light_the_scene() {
    let (_dir, at) = folder();
    write_lamp(&at, 1.0, 5.0);
    let (messages, own) = lit_floor(&at, "-s 16");
    assert!(messages.contains("lights: glowing surfaces of the file"), "{messages}");
    assert!((40..200).contains(&own), "{own}");
    // Without bounces, bounced light adds nothing where only the floor is matte.
    let (_, traced) = lit_floor(&at, "-s 16 --indirect 1 --ambient 0,0,0");
    assert!(own.abs_diff(traced) < 12, "{own} and {traced}");
    let (messages, other) = lit_floor(&at, "-s 4 --lights three-point");
    assert!(!messages.contains("glowing surfaces") && other != own, "{messages}");
    let (_, both) = lit_floor(&at, "-s 4 --lights file,three-point");
    assert!(both > other, "{both} and {other}");
}

#[test]
fn weak_and_small_glowing_surfaces_keep_the_three_point_rig() {
    let (_dir, at) = folder();
    for (side, emission) in [(1.0, 1.0), (0.05, 5.0)] {
        write_lamp(&at, side, emission);
        let (messages, _) = lit_floor(&at, "-s 1");
        assert!(messages.contains("lights: the three-point rig"), "{side} {emission}: {messages}");
    }
}

/// A triangle before a camera, and a point light in a closed cube beside it.
fn bulb(material: &Value) -> Vec<u8> {
    let mut file = Fixture::triangle();
    let corners: Vec<[f32; 3]> =
        (0..8u8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|bit| 0.02 * (f32::from(bit) - 0.5))).collect();
    let positions = file.vec3(&corners);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<u16> = faces.into_iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]).collect();
    let indices = file.indices(&triangles);
    let material = file.push("materials", material.clone());
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices, "material": material});
    let mesh = file.push("meshes", json!({"primitives": [primitive]}));
    file.node(json!({"name": "Globe", "mesh": mesh, "translation": [0.5, 0.5, 1]}));
    let light = json!({"type": "point", "intensity": 100});
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_materials_transmission"]);
    let light = json!({"KHR_lights_punctual": {"light": 0}});
    file.node(json!({"name": "Lamp", "translation": [0.5, 0.5, 1], "extensions": light}));
    file.glb()
}

#[test]
fn a_light_in_a_closed_object_is_named() {
    let (_dir, at) = folder();
    let opaque = json!({"doubleSided": true});
    let clear = json!({"pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}});
    let glowing = json!({"emissiveFactor": [1, 1, 1]});
    for (material, is_named) in [(opaque, true), (clear, false), (glowing, false)] {
        fs::write(at.join("a.glb"), bulb(&material)).unwrap();
        let messages = runs(&at, "render a.glb --size 16x16 -s 1 -o a.png");
        let named = messages.contains("the light 'Lamp' is inside 'Globe', which shadows it on all sides");
        assert_eq!(named, is_named, "{material}: {messages}");
    }
    let messages = runs(&at, "render a.glb --size 16x16 -s 1 -o a.png --no-shadows");
    assert!(!messages.contains("is inside"), "{messages}");
}

#[test]
fn a_dark_picture_names_its_lights_and_what_helps() {
    let (_dir, at) = folder();
    write_lamp(&at, 1.0, 0.0);
    let dark = runs(&at, &format!("render lamp.obj -o a.png {VIEW} -s 1 --sun 0,1,0,1"));
    assert!(
        dark.contains(
            "the picture is dark; lights: 1 given; use --lights three-point, --hdri studio or --ambient"
        ),
        "{dark}"
    );
    let dim = runs(&at, &format!("render lamp.obj -o a.png {VIEW} -s 1 --sun 0,-1,0,.001"));
    assert!(dim.contains("use --exposure auto, --indirect 4, --hdri studio or --ambient"), "{dim}");
    // Light from outside does not reach a closed room.
    let cube = fs::read_to_string(model("tests/cube.obj")).unwrap();
    fs::write(at.join("room.obj"), cube).unwrap();
    let inside = "--view-point 0,0,0 --look-at 0,0,-1 --size 16x16 -s 1 --lights three-point";
    let room = runs(&at, &format!("render room.obj -o a.png {inside} --ambient 0"));
    assert!(room.contains("use --point-light or --area-light inside the scene"), "{room}");
    let lit = runs(&at, &format!("render lamp.obj -o a.png {VIEW} -s 1 --sun 0,-1,0,1"));
    assert!(!lit.contains("is dark"), "{lit}");
    let few = runs(
        &at,
        "turntable lamp.obj -o t/a.png --frames 3 --size 16x16 -s 1 --sun 0,1,0,.001 --lights none",
    );
    assert_eq!(few.matches("is dark").count(), 1, "{few}");
}

/// A picture without any light is black: one hint names what helps, whatever the materials reflect.
#[test]
fn a_picture_without_light_has_one_hint() {
    let (_dir, at) = folder();
    let mut file = Fixture::triangle();
    file.material(json!({"pbrMetallicRoughness": {"metallicFactor": 1}}));
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    for scene in ["a.glb".to_string(), model("tests/cube.obj")] {
        let line = format!("render {scene} --size 16x16 -s 1 -o a.png --lights none --ambient 0");
        let messages = runs(&at, &line);
        let hint = "the picture is dark; lights: none; use --lights three-point, --hdri studio or --ambient";
        assert!(messages.contains(hint) && !messages.contains("show black"), "{messages}");
        for more in ["--sun 0,-1,-1,1", "--integrator color"] {
            assert!(!runs(&at, &format!("{line} {more}")).contains("is dark"), "{more}");
        }
    }
}

/// With a single sample per pixel, the noise of random light stays.
#[test]
fn grain_of_a_single_sample_is_named() {
    let (_dir, at) = folder();
    let line = format!("render {} --size 16x16 -o a.png --indirect 1", model("tests/cube.obj"));
    let hint = "the picture is grainy, because noise is removed from two samples per pixel on; use --samples 4 or more";
    assert!(runs(&at, &format!("{line} -s 1")).contains(hint));
    for more in ["-s 2", "-s 1 --denoise off"] {
        assert!(!runs(&at, &format!("{line} {more}")).contains("grainy"), "{more}");
    }
    let exact = runs(&at, &line.replace("--indirect 1", "-s 1"));
    assert!(!exact.contains("grainy"), "{exact}");
}

#[test]
fn metal_without_surroundings_is_named() {
    let (_dir, at) = folder();
    let mut file = Fixture::triangle();
    file.material(json!({"pbrMetallicRoughness": {"metallicFactor": 1}}));
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    let line = "render a.glb --size 16x16 -s 1 -o a.png --sun 0,0,-1,1";
    let hint = "metal and glass show black";
    assert!(runs(&at, line).contains(hint));
    for more in ["--hdri studio", "--ambient .1,.1,.1", "--bounces 0"] {
        assert!(!runs(&at, &format!("{line} {more}")).contains(hint), "{more}");
    }
}
