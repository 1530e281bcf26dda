//! Light units of Blender's exporter: nine files (`models/scripts/light_units.py`), a light of each kind in
//! each lighting mode, against Cycles' radiance of the original scene.

use std::path::{Path, PathBuf};
use std::process::Command;

use blinn::accel::{Accel, AccelSettings};
use blinn::geometry::Rgb;
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong, Stage};
use blinn::render::{RenderSettings, render};
use blinn::scene::{LightUnits, Lighting, MtlReflectance, PoseSettings, Reflectance, View, pose};
use exr::prelude::read_all_flat_layers_from_file;
use glam::Vec3;

use crate::common::model_path;

const KINDS: [&str; 3] = ["point", "spot", "sun"];
const MODES: [(&str, LightUnits); 3] =
    [("SPEC", LightUnits::Standard), ("COMPAT", LightUnits::Unitless), ("RAW", LightUnits::Raw)];
const SIZE: (u32, u32) = (48, 36);

fn folder() -> PathBuf {
    model_path("tests/light-units")
}

fn cycles(kind: &str) -> Vec<Vec3> {
    let image = read_all_flat_layers_from_file(folder().join(format!("{kind}.exr"))).unwrap();
    let list = &image.layer_data[0].channel_data.list;
    let channel = |name: &str| -> Vec<f32> {
        let found = list.iter().find(|c| c.name.to_string() == name).unwrap();
        found.sample_data.values_as_f32().collect()
    };
    let [r, g, b] = ["R", "G", "B"].map(channel);
    r.iter().zip(&g).zip(&b).map(|((&r, &g), &b)| Vec3::new(r, g, b)).collect()
}

/// The radiance of the file's scene with diffuse materials in their base colour.
fn ours(kind: &str, mode: &str, units: LightUnits) -> Vec<Vec3> {
    let path = folder().join(format!("{kind}_{mode}.glb"));
    let (mut scene, _) = load(&path, &LoadOptions::default()).unwrap();
    for material in &mut scene.materials {
        // k_d = base: Blender's diffuse shader, not the mapping of glossy materials.
        material.reflectance = Reflectance::Mtl(MtlReflectance::default());
    }
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let settings = RenderSettings { width: SIZE.0, height: SIZE.1, samples: 1, ..Default::default() };
    let (camera, _) = View::default().resolve(&posed, SIZE.0, SIZE.1).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let lighting = Lighting { units, ambient: Some(Rgb::ZERO), ..Lighting::default() };
    let frame = Frame::new(&posed, &accel, camera, &lighting.resolve(&posed, &camera));
    let pixels = render(&frame, &Phong { stage: Stage::Shadow }, &settings, &()).unwrap();
    pixels.colors.iter().map(|c| c.truncate()).collect()
}

/// Diffuse radiance equals Blender's, in W/(sr m²).
#[test]
fn diffuse_scenes_match_cycles_in_every_unit() {
    for kind in KINDS {
        let reference = cycles(kind);
        for (mode, units) in MODES {
            let ours = ours(kind, mode, units);
            assert_eq!(ours.len(), reference.len());
            let mut errors = Vec::new();
            let mut sides = 0;
            for (a, b) in ours.iter().zip(&reference) {
                if a.max_element() > 1e-3 && b.max_element() > 1e-3 {
                    errors.extend((0..3).filter(|&c| b[c] > 1e-3).map(|c| (a[c] / b[c] - 1.0).abs()));
                }
                sides += usize::from((a.max_element() > 1e-3) != (b.max_element() > 1e-3));
            }
            errors.sort_by(f32::total_cmp);
            assert!(errors.len() > 1000, "{kind} {mode}: {} lit", errors.len());
            let (median, p90) = (errors[errors.len() / 2], errors[errors.len() * 9 / 10]);
            assert!(median < 0.002 && p90 < 0.01, "{kind} {mode}: median {median}, 90 % {p90}");
            // Shadows and the spot's edge cover the same pixels.
            assert!(sides < 30, "{kind} {mode}: {sides} pixels are lit in one alone");
        }
    }
}

/// Runs the program. Returns the picture and the messages.
fn picture(folder: &Path, scene: &Path, flags: &[&str], out: &str) -> (image::GrayImage, String) {
    let fixed = ["render", scene.to_str().unwrap(), "--size", "48x36", "-s", "1", "-v", "-o", out];
    let output = Command::new(env!("CARGO_BIN_EXE_blinn"))
        .args(fixed)
        .args(flags)
        .current_dir(folder)
        .output()
        .unwrap();
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{messages}");
    (image::open(folder.join(out)).unwrap().into_luma8(), messages)
}

/// The log's line about the exposure.
fn exposure(messages: &str) -> &str {
    messages.lines().find_map(|l| l.strip_prefix("exposure: ")).unwrap_or_else(|| panic!("{messages}"))
}

/// In every mode, the default exposure is usable, and the flag that the log prints reproduces it.
#[test]
fn the_default_exposure_is_usable_and_the_log_reproduces_it() {
    let dir = tempfile::tempdir().unwrap();
    for kind in KINDS {
        for (mode, _) in MODES {
            let scene = folder().join(format!("{kind}_{mode}.glb"));
            let picture = |flags: &[&str], out: &str| picture(dir.path(), &scene, flags, out);
            let (default_picture, messages) = picture(&[], "a.png");
            let line = exposure(&messages);
            let mut sorted = default_picture.to_vec();
            sorted.sort();
            let at = |share: usize| sorted[(sorted.len() - 1) * share / 100];
            let (low, median, high) = (at(5), at(50), at(95));
            assert!((60..200).contains(&median), "{kind} {mode}: median {median}, {line}");
            // Light and shade, not one flat colour.
            assert!(high - low > 60, "{kind} {mode}: {low} to {high}, {line}");
            let flags: Vec<&str> = line.split_whitespace().collect();
            assert!(picture(&flags, "b.png").0 == default_picture, "{kind} {mode}: {line} makes it again");
        }
    }
}

/// A scene with its ball, the third material, changed.
fn with_ball(scene: &str, change: serde_json::Value) -> Vec<u8> {
    changed(scene, |json| {
        for (key, value) in change.as_object().unwrap() {
            json["materials"][2][key] = value.clone();
        }
    })
}

/// A scene with its JSON changed.
fn changed(scene: &str, change: impl FnOnce(&mut serde_json::Value)) -> Vec<u8> {
    let glb = std::fs::read(folder().join(scene)).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let (json, bin) = glb[20..].split_at(length);
    let mut json: serde_json::Value = serde_json::from_slice(json).unwrap();
    change(&mut json);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let all = (20 + text.len() + bin.len()) as u32;
    let head = [&b"glTF\x02\0\0\0"[..], &all.to_le_bytes(), &(text.len() as u32).to_le_bytes(), b"JSON"];
    [head.concat(), text, bin.to_vec()].concat()
}

/// Emission has no light unit: it does not affect metering, and is not scaled with the lights.
#[test]
fn emission_is_neither_metered_nor_scaled_with_the_lights() {
    let dir = tempfile::tempdir().unwrap();
    let unlit = serde_json::json!({"extensions": {"KHR_materials_unlit": {}}});
    // Brighter than white, it would be among the lights.
    let emits = serde_json::json!({"emissiveFactor": [1, 1, 1]});
    for (mode, _) in &MODES[1..] {
        let scene = format!("point_{mode}.glb");
        let (plain, messages) = picture(dir.path(), &folder().join(&scene), &[], "plain.png");
        for (name, ball) in [("unlit", &unlit), ("emits", &emits)] {
            let changed = dir.path().join("changed.glb");
            std::fs::write(&changed, with_ball(&scene, ball.clone())).unwrap();
            let picture = |flags: &[&str]| picture(dir.path(), &changed, flags, "ball.png");
            let scale = |messages: &str| {
                let last = exposure(messages).split(' ').next_back().unwrap();
                last.parse::<f64>().unwrap_or_else(|_| panic!("{messages}"))
            };
            let (metered, other_messages) = picture(&[]);
            let ratio = scale(&other_messages) / scale(&messages);
            assert!((0.9..1.1).contains(&ratio), "{name} {mode}: {other_messages}, without {messages}");
            // The ball's own pixels, where they are brighter than the background.
            let (alone, _) = picture(&["--lights", "none", "--ambient", "0,0,0", "--exposure", "0"]);
            let mut emitting = 0;
            for ((pixel, alone), plain) in metered.iter().zip(alone.iter()).zip(plain.iter()) {
                if *alone > 100 {
                    emitting += 1;
                    assert!(name == "emits" || pixel == alone, "{name} {mode}: {pixel}, not {alone}");
                } else {
                    assert!(pixel.abs_diff(*plain) < 10, "{name} {mode}: {pixel}, without {plain}");
                }
            }
            assert!(emitting > 20, "{name} {mode}: {emitting}");
        }
    }
}

/// A dark room with a pool of light is dark on purpose: its lights keep their units, unless the pool is dark
/// as well.
#[test]
fn a_dark_room_with_a_bright_pool_keeps_its_lights() {
    let dir = tempfile::tempdir().unwrap();
    for (mode, keeps_lights) in [("SPEC", true), ("COMPAT", false), ("RAW", false)] {
        let dark = |material: &mut serde_json::Value, shade: f64| {
            material["pbrMetallicRoughness"] =
                serde_json::json!({"baseColorFactor": [shade, shade, shade, 1], "metallicFactor": 0});
            material["extensions"] = serde_json::json!({"KHR_materials_specular": {"specularFactor": 0}});
        };
        let glb = changed(&format!("point_{mode}.glb"), |json| {
            let materials = json["materials"].as_array_mut().unwrap();
            materials.iter_mut().for_each(|material| dark(material, 0.001));
            dark(&mut materials[2], 1.0);
        });
        let scene = dir.path().join("room.glb");
        std::fs::write(&scene, glb).unwrap();
        let (_, messages) = picture(dir.path(), &scene, &[], "room.png");
        assert_eq!(exposure(&messages) == "--exposure 0", keeps_lights, "{mode}: {messages}");
    }
}
