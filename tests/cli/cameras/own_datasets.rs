//! Datasets of blinn as lists of cameras.

use std::fs;

use super::write_scene;
use crate::common::program::*;

/// A dataset's `transforms.json` read back: images, layers and fingerprints have the same bytes.
#[test]
fn own_datasets_are_rendered_again_to_the_byte() {
    let (_dir, at) = folder();
    write_scene(&at);
    let figure = model("figure/figure.glb");
    for (i, (scene, flags, lens, format)) in [
        ("cube.obj", "-s 4", "--size 40x30", "png"),
        (
            "cube.obj",
            "-s 4 --background transparent",
            "--world-up y --size 40x30 --yfov 50 --proj-distance 3",
            "png",
        ),
        ("cube.obj", "-s 5 --ks 0.3,0.3,0.3", "--size 60x44 --crop 9,5,31,22 --clip 0.5,50", "png"),
        ("cube.obj", "-s 1", "--size 40x30 --intrinsics 50,51,17.3,16.1", "exr"),
        (figure.as_str(), "-s 2 --ao 2", "--size 40x30 --time 0.3", "webp"),
        (
            "cube.obj",
            "-s 2 --seed 7",
            "--size 40x30 --on random --roll 20 --look-at-jitter .2 --random-lights",
            "png",
        ),
        (
            figure.as_str(),
            "-s 1 --hdri sky --background hdri --lights three-point",
            "--size 40x30 --random-lights --random-hdri --normalize unit-cube --distance-range 2,4",
            "png",
        ),
        (
            "cube.obj",
            "-s 1 --lights headlight --hdri studio --depth 32",
            "--size 40x30 --random-hdri --normalize unit-sphere --on stereo --world-up y --crop 9,5,21,20",
            "exr",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let (a, b) = (format!("a{i}"), format!("b{i}"));
        runs(&at, &format!("turntable {scene} --views 4 {flags} {lens} -q -o {a}/#.{format}"));
        let list = format!("render {scene} --cameras {a}/transforms.json {flags} --aov depth,normal,mask");
        runs(&at, &format!("{list} -q -o {b}/{{camera}}.{format}"));
        let mut dataset = files(&at.join(&a));
        assert!(dataset.remove("transforms.json").is_some());
        let again = files(&at.join(&b));
        assert_eq!(again.keys().collect::<Vec<_>>(), dataset.keys().collect::<Vec<_>>(), "{flags} {lens}");
        for (name, bytes) in &again {
            assert!(*bytes == dataset[name], "{name} differs: {flags} {lens}");
        }
        // So --resume keeps the images of either.
        let messages = runs(&at, &format!("{list} -o {a}/{{camera}}.{format} --resume"));
        assert!(messages.contains("kept 4"), "{messages}");
    }
}

/// A lens that somebody changed is the one that counts.
#[test]
fn changed_datasets_are_rendered_as_they_are() {
    let (_dir, at) = folder();
    write_scene(&at);
    runs(&at, "turntable cube.obj --views 2 --size 40x30 -s 1 -q -o a/#.png");
    let text = fs::read_to_string(at.join("a/transforms.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let focal = json["fl_x"].as_f64().unwrap();
    let changed = text.replace(&format!("\"fl_x\": {focal}"), &format!("\"fl_x\": {}", 0.5 * focal));
    assert!(changed != text);
    fs::write(at.join("a/changed.json"), changed).unwrap();
    runs(&at, "render cube.obj --cameras a/changed.json -s 1 -q -o b/{camera}.png");
    let (a, b) = (files(&at.join("a")), files(&at.join("b")));
    assert!(a["1.png"] != b["1.png"]);
    fs::write(at.join("a/bad.json"), text.replace("\"up\": \"z\"", "\"up\": \"w\"")).unwrap();
    refused(&at, "render cube.obj --cameras a/bad.json", "up 'w' must be \"y\" or \"z\"");
}

/// Positions that somebody changed count, in the units of the file; keys of blinn in files of others do not.
#[test]
fn normalized_datasets_are_rendered_in_their_units() {
    let (_dir, at) = folder();
    write_scene(&at);
    let aov = "--aov position --size 40x30 -s 1";
    runs(&at, &format!("turntable cube.obj --views 2 --normalize unit-cube {aov} -q -o a/#.exr"));
    let text = fs::read_to_string(at.join("a/transforms.json")).unwrap();
    let dataset: serde_json::Value = serde_json::from_str(&text).unwrap();
    let write = |name: &str, change: &dyn Fn(&mut serde_json::Value)| {
        let mut changed = dataset.clone();
        change(&mut changed);
        fs::write(at.join("a").join(name), changed.to_string()).unwrap();
        runs(&at, &format!("render cube.obj --cameras a/{name} {aov} -q -o {name}-out/{{camera}}.exr"));
        files(&at.join(format!("{name}-out")))
    };
    let same = write("same.json", &|_| {});
    let without_position = write("rounded.json", &|json| {
        let frames = json["frames"].as_array_mut().unwrap();
        frames.iter_mut().for_each(|frame| frame["scene_view_point"] = serde_json::Value::Null);
    });
    let moved = write("moved.json", &|json| {
        let x = json["frames"][0]["transform_matrix"][0][3].as_f64().unwrap();
        json["frames"][0]["transform_matrix"][0][3] = (x + 0.1).into();
    });
    assert!(moved["1.exr"] != same["1.exr"] && moved["2.exr"] == same["2.exr"]);
    let pixels = |bytes: &[u8]| image::load_from_memory_with_format(bytes, image::ImageFormat::OpenExr);
    let difference = |a: &[u8], b: &[u8]| {
        let (a, b) = (pixels(a).unwrap().into_rgba32f(), pixels(b).unwrap().into_rgba32f());
        a.iter().zip(b.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(difference(&same["1.exr"], &without_position["1.exr"]) < 1e-3);
    // In another program's file, the units are metres and the lights are those of the scene.
    let foreign = |light: f64| {
        write(&format!("foreign{light}.json"), &|json| {
            json.as_object_mut().unwrap().remove("blinn");
            json["frames"][0]["light_rotation"] = light.into();
        })
    };
    assert!(foreign(0.0) == foreign(70.0));
    let scaled = text.replace("\"scale\": ", "\"scale\": -");
    assert!(scaled != text);
    fs::write(at.join("a/bad.json"), scaled).unwrap();
    refused(&at, "render cube.obj --cameras a/bad.json", "normalization.scale must be greater than zero");
}
