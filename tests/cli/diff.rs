//! `blinn diff`: scenes and images that are equal, that differ, and that cannot be compared.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::gltf_fixture::Fixture;
use crate::common::html::assert_even_tables;
use crate::common::program::*;

/// Compares, checks the exit code, and returns the JSON.
#[track_caller]
fn diff(dir: &Path, line: &str, code: i32) -> Value {
    let output = blinn(dir, &format!("diff {line} --json -q"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {errors}");
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["equal"], code == 0, "{json:#}");
    json
}

/// A sheet of 20 × 20 squares of side 1 with another object beside it.
fn sheet_with(moved: &str) -> String {
    let mut text = "o sheet\n".to_string();
    for (y, x) in (0..=20).flat_map(|y| (0..=20).map(move |x| (y, x))) {
        let z = if (x, y) == (7, 13) { moved } else { "0" };
        text += &format!("v {x} {y} {z}\n");
    }
    for (y, x) in (0..20).flat_map(|y| (0..20).map(move |x| (y, x))) {
        let a = y * 21 + x + 1;
        text += &format!("f {a} {} {} {}\n", a + 1, a + 22, a + 21);
    }
    text + "o other\nv 22 0 0\nv 23 0 0\nv 23 1 0\nf -3 -2 -1\n"
}

#[test]
fn one_vertex_moved_by_a_thousandth_of_the_scene_is_found_and_boxed() {
    let (_dir, dir) = folder();
    fs::write(dir.join("old.obj"), sheet_with("0")).unwrap();
    fs::write(dir.join("new.obj"), sheet_with("0.03")).unwrap();
    let json = diff(&dir, "old.obj new.obj -o d.html --size 320x240", 1);
    let object = &json["objects"][0];
    assert_eq!((&object["name"], &object["change"]), (&json!("sheet"), &json!("changed")));
    assert!((object["max_distance"].as_f64().unwrap() - 0.03).abs() < 1e-6);
    assert_eq!(json["objects"].as_array().unwrap().len(), 1);
    let bounds = [0, 1].map(|i| [object["bounds"]["min"][i].as_f64(), object["bounds"]["max"][i].as_f64()]);
    assert_eq!(bounds, [[Some(6.0), Some(8.0)], [Some(12.0), Some(14.0)]]);
    let front = &json["views"][0];
    assert_eq!(front["name"], "front");
    assert!(front["changed_pixels"].as_u64().unwrap() > 20, "{front:#}");
    // All changed pixels lie in the box of the object.
    let side = |r: &Value, key: &str| r[key].as_i64().unwrap();
    let outer = &front["objects"][0]["box"];
    for inner in front["boxes"].as_array().unwrap() {
        for (at, size) in [("x", "width"), ("y", "height")] {
            let (low, high) = (side(outer, at), side(outer, at) + side(outer, size));
            assert!(side(inner, at) >= low && side(inner, at) + side(inner, size) <= high, "{front:#}");
        }
        assert!(side(inner, "width") < 60, "{inner}");
    }
    let page = fs::read_to_string(dir.join("d.html")).unwrap();
    assert_even_tables(&page);
    assert_eq!(page.matches("data:image/png;base64,").count(), 12);
    assert!(page.contains("<title>sheet</title>") && page.contains("moved by up to 0.030 units"));
    assert!(!page.contains("http:") && !page.contains("https:") && !page.contains("{{"));
    diff(&dir, "old.obj new.obj -o d.png --size 320x240", 1);
    assert_eq!(image::image_dimensions(dir.join("d.png")).unwrap(), (968, 1060));
    // The same file is equal to itself.
    let json = diff(&dir, "old.obj old.obj --size 64x48", 0);
    assert!(json["views"].as_array().unwrap().iter().all(|view| view["changed_pixels"] == 0));
}

/// Reverses the keys of all objects.
fn reversed(value: &Value) -> Value {
    match value {
        Value::Object(map) => {
            Value::Object(map.iter().rev().map(|(key, value)| (key.clone(), reversed(value))).collect())
        }
        Value::Array(list) => list.iter().map(reversed).collect(),
        other => other.clone(),
    }
}

#[test]
fn reordered_json_is_equal_and_another_colour_is_not() {
    let (_dir, dir) = folder();
    let mut fixture = Fixture::triangle();
    fixture.material(json!({"name": "Paint", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}));
    let text = fixture.gltf();
    fs::write(dir.join("old.gltf"), &text).unwrap();
    let value: Value = serde_json::from_slice(&text).unwrap();
    fs::write(dir.join("new.gltf"), reversed(&value).to_string()).unwrap();
    assert_ne!(fs::read(dir.join("old.gltf")).unwrap(), fs::read(dir.join("new.gltf")).unwrap());
    diff(&dir, "old.gltf new.gltf --size 64x48", 0);

    let mut painted = value.clone();
    painted["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0, 1, 0, 1]);
    fs::write(dir.join("painted.gltf"), painted.to_string()).unwrap();
    let json = diff(&dir, "old.gltf painted.gltf --size 64x48", 1);
    assert_eq!(json["properties"][0]["path"], "materials[Paint].base");
    assert_eq!(json["objects"][0]["material"], true);
    // As text, on one line for each.
    let output = blinn(&dir, "diff old.gltf painted.gltf --size 64x48");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("different: ") && text.contains("material changed"), "{text}");
}

/// Where triangles overlap at the same distance, the picture shows the first one.
#[test]
fn triangles_in_another_order_have_equal_pictures() {
    let (_dir, dir) = folder();
    let red = ["0 0 0", "4 0 0", "0 4 0"].map(|place| format!("v {place} 1 0 0\n")).concat();
    let green = ["1 -1 0", "4 3 0", "-1 3 0"].map(|place| format!("v {place} 0 1 0\n")).concat();
    let scene = |faces: &str| format!("o sheet\n{red}{green}{faces}");
    fs::write(dir.join("old.obj"), scene("f 1 2 3\nf 4 5 6\n")).unwrap();
    fs::write(dir.join("new.obj"), scene("f 5 6 4\nf 1 2 3\n")).unwrap();
    diff(&dir, "old.obj new.obj --size 64x48", 0);
}

/// A small fin is added to a room with bounced light. Its own pixels are reported, and not the other noise of
/// walls far away.
#[test]
fn pixels_that_only_noise_changed_are_not_reported() {
    let (_dir, dir) = folder();
    let room = fs::read_to_string(model("cornell/cornell.obj")).unwrap();
    let fin = "o fin\nv -1.9 0.1 1.5\nv -1.7 0.1 1.5\nv -1.8 0.3 1.5\nf -3 -2 -1\n";
    fs::copy(model("cornell/cornell.mtl"), dir.join("cornell.mtl")).unwrap();
    fs::write(dir.join("old.obj"), &room).unwrap();
    fs::write(dir.join("new.obj"), room.clone() + fin).unwrap();
    let options = "--size 80x60 --indirect 2 --lights headlight";
    let json = diff(&dir, &format!("old.obj new.obj {options}"), 1);
    let sum = |key: &str| -> u64 {
        json["views"].as_array().unwrap().iter().map(|view| view[key].as_u64().unwrap()).sum()
    };
    let (changed, noise) = (sum("changed_pixels"), sum("noise_pixels"));
    assert!(noise > 0 && changed > 0 && changed < noise, "{changed} changed, {noise} by noise");
    // Without random light, pixels are compared exactly.
    let json = diff(&dir, "old.obj new.obj --size 80x60 --lights headlight", 1);
    assert!(json["views"].as_array().unwrap().iter().all(|view| view["noise_pixels"] == 0), "{json}");
}

#[test]
fn images_are_compared_exactly_or_within_a_tolerance() {
    let (_dir, dir) = folder();
    let mut picture = image::RgbImage::from_pixel(40, 30, image::Rgb([100, 100, 100]));
    picture.save(dir.join("old.png")).unwrap();
    image::DynamicImage::from(picture.clone()).into_rgba8().save(dir.join("same.png")).unwrap();
    picture.put_pixel(31, 7, image::Rgb([100, 105, 100]));
    picture.save(dir.join("new.png")).unwrap();
    image::RgbImage::new(41, 30).save(dir.join("wide.png")).unwrap();
    diff(&dir, "old.png same.png", 0);
    let json = diff(&dir, "old.png new.png", 1);
    let view = &json["views"][0];
    assert_eq!(
        (&view["changed_pixels"], &view["boxes"][0]),
        (&json!(1), &json!({"x": 31, "y": 7, "width": 1, "height": 1}))
    );
    diff(&dir, "old.png new.png --tolerance 0.02", 0);
    diff(&dir, "old.png new.png --tolerance 0.019", 1);
    let json = diff(&dir, "old.png new.png --flip --tolerance 0.5", 0);
    assert!(json["metric"] == "flip" && json["views"][0]["max"].as_f64().unwrap() > 0.0);
    let text = blinn(&dir, "diff old.png new.png --flip").stdout;
    let text = String::from_utf8(text).unwrap();
    assert!(text.contains("%), FLIP mean 0.") && text.contains(", max 0."), "{text}");
    let json = diff(&dir, "old.png wide.png", 1);
    assert!(json["mismatch"].as_str().unwrap().contains("40 by 30"));
    // All channels of an EXR count: the depth of a black picture.
    for (name, distance) in [("a", 9), ("b", 10)] {
        let scene = model("tests/cube.obj");
        runs(
            &dir,
            &format!(
                "render {scene} --size 16x16 -s 1 --aov depth --lights none --background 0,0,0 --projection \
                 orthographic --view-width 1 --orbit 0,0,{distance} -o {name}.exr"
            ),
        );
    }
    diff(&dir, "a.exr a.exr", 0);
    let json = diff(&dir, "a.exr b.exr", 1);
    assert_eq!(json["views"][0]["max"], 1.0);
}

/// The frames of an animation are compared one by one.
#[test]
fn later_frames_of_animations_count() {
    let (_dir, dir) = folder();
    let frame = |shade: u8| image::RgbaImage::from_pixel(20, 10, image::Rgba([shade, 90, 30, 255]));
    let write = |name: &str, shades: &[u8], milliseconds: u32| {
        let delay = image::Delay::from_numer_denom_ms(milliseconds, 1);
        let mut encoder = image::codecs::gif::GifEncoder::new(fs::File::create(dir.join(name)).unwrap());
        let frames = shades.iter().map(|shade| image::Frame::from_parts(frame(*shade), 0, 0, delay));
        encoder.encode_frames(frames).unwrap();
    };
    write("a.gif", &[10, 20, 30], 100);
    write("b.gif", &[10, 20, 90], 100);
    write("slow.gif", &[10, 20, 30], 200);
    write("short.gif", &[10, 20], 100);
    write("one.gif", &[10], 100);
    frame(10).save(dir.join("one.png")).unwrap();
    let json = diff(&dir, "a.gif a.gif", 0);
    assert_eq!(json["views"].as_array().unwrap().len(), 1);
    let json = diff(&dir, "a.gif b.gif", 1);
    assert_eq!(
        (&json["views"][0]["name"], &json["views"][0]["changed_pixels"]),
        (&json!("frame 3"), &json!(200))
    );
    diff(&dir, "a.gif b.gif --tolerance 0.5", 0);
    for (pair, text) in [
        ("a.gif slow.gif", "frame 1 is shown for 100 and 200 ms"),
        ("a.gif short.gif", "the numbers of frames differ: 3 and 2"),
        ("one.png a.gif", "the numbers of frames differ: 1 and 3"),
    ] {
        let json = diff(&dir, pair, 1);
        assert!(json["mismatch"].as_str().unwrap().contains(text), "{json:#}");
    }
    diff(&dir, "one.gif one.png", 0);
}

/// NaN is equal to itself, and differs most from a number.
#[test]
fn flip_compares_pictures_with_nan() {
    let (_dir, dir) = folder();
    let write = |name: &str, shade: f32| {
        let mut picture = image::Rgb32FImage::from_pixel(40, 30, image::Rgb([0.25, 0.5, 0.75]));
        picture.put_pixel(7, 5, image::Rgb([shade, 0.5, 0.75]));
        picture.save(dir.join(name)).unwrap();
    };
    write("number.exr", 0.25);
    write("nan.exr", f32::NAN);
    write("infinite.exr", f32::INFINITY);
    for file in ["nan.exr", "infinite.exr", "number.exr"] {
        diff(&dir, &format!("{file} {file} --flip"), 0);
    }
    for other in ["nan.exr", "infinite.exr"] {
        let json = diff(&dir, &format!("number.exr {other} --flip --tolerance 0.9"), 1);
        let view = &json["views"][0];
        assert_eq!(
            (&view["max"], &view["boxes"][0]),
            (&json!(1.0), &json!({"x": 7, "y": 5, "width": 1, "height": 1}))
        );
    }
}

#[test]
fn failures_have_the_exit_code_2() {
    let (_dir, dir) = folder();
    let cube = model("tests/cube.obj");
    image::RgbImage::new(4, 4).save(dir.join("a.png")).unwrap();
    fs::write(dir.join("broken.glb"), "glTF").unwrap();
    refused(&dir, &format!("diff {cube}"), "2 values required");
    refused(&dir, &format!("diff {cube} missing.obj"), "missing.obj");
    refused(&dir, &format!("diff {cube} a.png"), "a.png is an image");
    refused(&dir, &format!("diff {cube} broken.glb"), "broken.glb");
    refused(&dir, &format!("diff {cube} {cube} -o a.gif"), "use .html or .png");
    refused(&dir, "diff a.png a.png --tolerance -1", "must not be negative");
}

/// Both pictures show the start, where the scenes are equal.
#[test]
fn animations_that_differ_later_are_different() {
    let (_dir, at) = folder();
    let write = |name: &str, end: f32| {
        let mut file = Fixture::triangle();
        file.json["nodes"][0]["name"] = json!("Door");
        let times = file.floats("SCALAR", 1, &[0.0, 1.0, 2.0]);
        let places = file.vec3(&[[0.0; 3], [1.0, 0.0, 0.0], [end, 0.0, 0.0]]);
        file.json["animations"] = json!([{
            "name": "Open", "samplers": [{"input": times, "output": places}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        }]);
        fs::write(at.join(name), file.glb()).unwrap();
    };
    write("a.glb", 2.0);
    write("b.glb", 3.0);
    diff(&at, "a.glb a.glb --size 32x32", 0);
    let json = diff(&at, "a.glb b.glb --size 32x32", 1);
    let property = &json["properties"][0];
    assert_eq!(property["path"], "animations[Open].node 'Door' translation at 1.500 s");
    assert_eq!((&property["old"], &property["new"]), (&json!([1.5, 0.0, 0.0]), &json!([2.0, 0.0, 0.0])));
    assert!(json["objects"].as_array().unwrap().is_empty());
}

/// A part in millimetres with z up, and the same in metres with y up.
#[test]
fn files_of_other_units_and_axes_are_compared() {
    let (_dir, at) = folder();
    fs::write(at.join("a.obj"), "v 0 0 0\nv 20 0 0\nv 0 30 0\nv 0 0 40\nf 1 2 3\nf 1 2 4\nf 1 3 4\n")
        .unwrap();
    fs::write(at.join("b.obj"), "v 0 0 0\nv .02 0 0\nv 0 0 -.03\nv 0 .04 0\nf 1 2 3\nf 1 2 4\nf 1 3 4\n")
        .unwrap();
    diff(&at, "a.obj b.obj --size 32x32 --tolerance .01 --up z --scale .001", 1);
    let json = diff(&at, "b.obj a.obj --size 32x32", 1);
    let hint =
        "the second scene has another up axis and is 1000 times as large: --new-up z --new-scale 0.001";
    assert_eq!(json["hint"], hint);
    // No up axis of the second file turns it like the first one.
    assert!(diff(&at, "a.obj b.obj --size 32x32", 1)["hint"].is_null());
    diff(&at, "a.obj b.obj --size 32x32 --tolerance .01 --up z --scale .001 --new-up y --new-scale 1", 0);
    diff(&at, "b.obj a.obj --size 32x32 --tolerance .01 --new-up z --new-scale .001", 0);
    runs(&at, "render a.obj --size 8x8 -q -o a.png");
    fails(&at, &["diff", "a.png", "a.png", "--new-scale", "2"], 2, "apply only to scenes");
}
