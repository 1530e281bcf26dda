//! Render settings that the file holds (`extras.blinn`): a file with them and no flags gives the picture of a file without
//! them and the flags. Flags take precedence.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::gltf_fixture::Fixture;
use crate::common::program::*;

/// A triangle before a camera, lit by a sun.
fn scene() -> Fixture {
    let mut file = Fixture::triangle();
    let perspective = json!({"yfov": 0.8, "znear": 0.1, "aspectRatio": 2});
    file.push("cameras", json!({"type": "perspective", "perspective": perspective}));
    file.node(json!({"camera": 0, "translation": [0.4, 0.4, 3]}));
    let light = json!({"type": "directional", "intensity": 3});
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    file
}

/// Pixels and size of a picture of `file`.
fn picture(at: &Path, file: &Fixture, flags: &str) -> image::RgbaImage {
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    runs(at, &format!("render a.glb -o a.png {flags}"));
    image::open(at.join("a.png")).unwrap().into_rgba8()
}

fn with_settings(settings: &Value) -> Fixture {
    let mut file = scene();
    file.json["scenes"][0]["extras"] = json!({"blinn": settings});
    file
}

#[test]
fn settings_of_the_file_equal_flags_and_flags_take_precedence() {
    let (_dir, at) = folder();
    let view = |view: Value| json!({"view": view});
    for (settings, flags, other) in [
        (json!({"resolution": [80, 60], "percentage": 50}), "--size 40x30", "--size 24x16"),
        (view(json!({"exposure": 2})), "--exposure 2", "--exposure -1"),
        (view(json!({"exposure": 1, "filmExposure": 2})), "--exposure 2", "--exposure auto"),
        (view(json!({"transform": "AgX"})), "--view agx", "--view raw"),
        (view(json!({"transform": "Filmic"})), "--view filmic", "--view agx"),
        (
            view(json!({"transform": "Filmic", "look": "High Contrast"})),
            "--view filmic --look high-contrast",
            "--view filmic --look none",
        ),
        (
            view(json!({"transform": "Filmic", "look": "Medium Contrast"})),
            "--view filmic --look medium-contrast",
            "--view standard --look very-low-contrast",
        ),
        (
            view(json!({"transform": "Standard", "look": "Low Contrast"})),
            "--view standard --look low-contrast",
            "--view agx",
        ),
        (
            view(json!({"transform": "AgX", "look": "AgX - High Contrast"})),
            "--view agx --look high-contrast",
            "--view filmic --look high-contrast",
        ),
        (view(json!({"transform": "Khronos PBR Neutral"})), "--view pbr-neutral", "--view standard"),
        (json!({"filmTransparent": true}), "--background transparent", "--background 1,0,0"),
        (json!({"lightUnits": "standard"}), "--light-units standard --exposure auto", "--light-units raw"),
        (json!({"indirect": 2}), "--indirect 2", "--indirect 0"),
        (json!({"indirect": 2, "caustics": true}), "--indirect 2 --caustics", "--indirect 1"),
        (json!({"region": {"min": [0.25, 0.5], "max": [0.75, 1]}}), "--crop 10,0,20,10", "--crop 1,2,3,4"),
    ] {
        let size = if settings.get("resolution").is_some() { "" } else { "--size 40x20" };
        let [file, plain] = [with_settings(&settings), scene()];
        let line = |flags: &str| format!("{size} -s 4 {flags}");
        assert!(picture(&at, &file, &line("")) == picture(&at, &plain, &line(flags)), "{settings}");
        let own = picture(&at, &file, &line(other));
        // Caustics alone have no flag that turns them off.
        if settings.get("caustics").is_none() {
            assert!(own == picture(&at, &plain, &line(other)), "{settings} {other}");
        }
    }
}

#[test]
fn the_lens_of_the_file_shifts_the_view() {
    let (_dir, at) = folder();
    let mut file = scene();
    file.json["cameras"][0]["extras"] = json!({"blinn": {"shift": [0.2, -0.1]}});
    let line = "--size 40x20 -s 1";
    let shifted = picture(&at, &file, line);
    assert!(shifted == picture(&at, &scene(), &format!("{line} --shift .2,-.1")));
    let centred = picture(&at, &scene(), line);
    assert!(centred != shifted && centred == picture(&at, &file, &format!("{line} --shift 0,0")));
    // Another lens, or another view.
    assert!(
        picture(&at, &file, &format!("{line} --orbit 20,10"))
            == picture(&at, &scene(), &format!("{line} --orbit 20,10"))
    );
}

#[test]
fn pixels_may_be_wider_than_high() {
    let (_dir, at) = folder();
    let wide = with_settings(&json!({"resolution": [40, 40], "pixelAspect": 2}));
    let picture_of_wide = picture(&at, &wide, "-s 1");
    assert_eq!(picture_of_wide.dimensions(), (40, 40));
    // Each of its pixels covers two of a picture of the camera's own shape.
    let square = picture(&at, &scene(), "-s 1 --size 80x40");
    let is_lit = |pixel: &image::Rgba<u8>| pixel.0[0] > 60;
    let lit = |picture: &image::RgbaImage| picture.pixels().filter(|pixel| is_lit(pixel)).count() as f64;
    let (wide, square) = (lit(&picture_of_wide), lit(&square));
    assert!(wide > 50.0 && (square / wide - 2.0).abs() < 0.1, "{square} {wide}");
}

#[test]
fn the_marked_camera_is_the_default() {
    let (_dir, at) = folder();
    let mut file = scene();
    file.node(json!({"camera": 0, "translation": [0.4, 0.4, 6]}));
    let line = "--size 40x20 -s 1";
    let first = picture(&at, &file, line);
    file.json["nodes"][3]["extras"] = json!({"blinn": {"activeCamera": true}});
    let marked = picture(&at, &file, line);
    assert!(marked != first && marked == picture(&at, &file, &format!("{line} --camera 1")));
    assert!(first == picture(&at, &file, &format!("{line} --camera 0")));
}

#[test]
fn the_world_of_the_file_is_light_and_background() {
    let (_dir, at) = folder();
    let file = with_settings(&json!({"world": {"color": [0.25, 0.5, 1]}, "filmTransparent": false}));
    let line = "--size 40x20 -s 1 --exposure 0 --view raw";
    let corner = |flags: &str| picture(&at, &file, &format!("{line} {flags}")).get_pixel(0, 0).0;
    assert_eq!(corner(""), [64, 128, 255, 255]);
    assert_eq!(corner("--background 1,0,0"), [255, 0, 0, 255]);
    // Another light takes its place.
    assert_eq!(corner("--ambient .1,.1,.1"), corner("--lights headlight"));
    assert_ne!(corner("--hdri sky"), corner(""));
}

#[test]
fn what_is_not_supported_is_one_warning() {
    let (_dir, at) = folder();
    let file = with_settings(&json!({"view": {"transform": "False Color", "look": "High Contrast"}}));
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    let messages = runs(&at, "render a.glb --size 8x8");
    let expected = "ignored settings of the file that are not supported: view transform 'False Color', look 'High Contrast'\n";
    assert_eq!(messages.matches(expected).count(), 1, "{messages}");
    assert!(!runs(&at, "render a.glb --size 8x8 --view agx --orbit 0,0").contains("False Color"));
}

#[test]
fn looks_of_other_views_are_named() {
    let (_dir, at) = folder();
    for (transform, look) in
        [("Filmic", "AgX - Punchy"), ("AgX", "Medium Contrast"), ("Raw", "High Contrast")]
    {
        let file = with_settings(&json!({"view": {"transform": transform, "look": look}}));
        fs::write(at.join("a.glb"), file.glb()).unwrap();
        let messages = runs(&at, "render a.glb --size 8x8");
        let expected = format!("ignored settings of the file that are not supported: look '{look}'\n");
        assert_eq!(messages.matches(&expected).count(), 1, "{transform}: {messages}");
    }
    fs::write(at.join("b.glb"), scene().glb()).unwrap();
    for (flags, views) in [
        ("--view filmic --look punchy", "--view agx"),
        ("--view agx --look medium-contrast", "--view filmic"),
        ("--view raw --look low-contrast", "--view agx or --view filmic"),
    ] {
        let messages = runs(&at, &format!("render b.glb --size 8x8 {flags}"));
        let expected =
            format!("--look has no effect: the view transform does not have this look; add {views}\n");
        assert_eq!(messages.matches(&expected).count(), 1, "{flags}: {messages}");
    }
    for flags in ["--view filmic --look very-high-contrast", "--view standard --look medium-contrast"] {
        assert!(!runs(&at, &format!("render b.glb --size 8x8 {flags}")).contains("--look"), "{flags}");
    }
}

/// A triangle that moves to the right, in two seconds.
fn moving(frames: Value) -> Fixture {
    let mut file = with_settings(&json!({"frames": frames}));
    let time = file.accessor(5126, "SCALAR", 2, &[0f32, 2.0].map(f32::to_le_bytes).concat());
    let values =
        file.accessor(5126, "VEC3", 2, &[0f32, 0.0, 0.0, 2.0, 0.0, 0.0].map(f32::to_le_bytes).concat());
    file.push(
        "animations",
        json!({"samplers": [{"input": time, "output": values}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}),
    );
    file
}

#[test]
fn frames_are_those_of_the_file() {
    let (_dir, at) = folder();
    let file = moving(json!({"start": 3, "end": 8, "step": 2, "rate": 10}));
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    runs(&at, "render a.glb -o f/####.png --frames --size 16x8 -s 1");
    assert_eq!(names(&at.join("f")), ["0003.png", "0005.png", "0007.png"]);
    runs(&at, "render a.glb -o g/####.png --frames 5 --size 16x8 -s 1");
    runs(&at, "render a.glb -o h/####.png --frames 5 --fps 10 --size 16x8 -s 1");
    runs(&at, "render a.glb -o i/####.png --frames 5 --fps 24 --size 16x8 -s 1");
    let frame = |folder: &str| image::open(at.join(folder).join("0005.png")).unwrap().into_rgba8();
    assert!(frame("f") == frame("g") && frame("g") == frame("h") && frame("h") != frame("i"));
    // Frames at the rate of the file are kept, those at another rate are not.
    let kept = |flags: &str| {
        runs(&at, &format!("render a.glb -o g/####.png --frames 5 --size 16x8 -s 1 --resume {flags}"))
    };
    assert!(!kept("").contains("wrote"));
    assert!(kept("--fps 24").contains("wrote"));
}

#[test]
fn a_scene_without_animation_has_one_frame() {
    let (_dir, at) = folder();
    let file = with_settings(&json!({"frames": {"start": 1, "end": 250, "rate": 24}}));
    fs::write(at.join("a.glb"), file.glb()).unwrap();
    runs(&at, "render a.glb -o f/####.png --frames --size 8x8 -s 1");
    assert_eq!(names(&at.join("f")).len(), 1);
}

#[test]
fn a_region_does_not_apply_to_other_views() {
    let (_dir, at) = folder();
    let file = with_settings(&json!({"region": {"min": [0, 0], "max": [0.5, 0.5]}}));
    assert_eq!(picture(&at, &file, "--size 40x20").dimensions(), (20, 10));
    assert_eq!(picture(&at, &file, "--size 40x20 --orbit 0,0").dimensions(), (40, 20));
}
