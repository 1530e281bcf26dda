//! What Blender's exporter does to lights, undone: nine files (`models/scripts/light_units.py`), a
//! light of each kind in each lighting mode, against Cycles' radiance of the scene they came from.

use std::path::{Path, PathBuf};
use std::process::Command;

use blinn::accel::{Accel, BuildSettings};
use blinn::geometry::Rgb;
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Frame, Phong, Stage};
use blinn::render::{RenderSettings, render};
use blinn::scene::{LightUnits, Lighting, MtlReflectance, PoseSettings, Reflectance, View, pose};
use exr::prelude::read_all_flat_layers_from_file;
use glam::Vec3;

const KINDS: [&str; 3] = ["point", "spot", "sun"];
const MODES: [(&str, LightUnits); 3] =
    [("SPEC", LightUnits::Standard), ("COMPAT", LightUnits::Unitless), ("RAW", LightUnits::Raw)];
const SIZE: (u32, u32) = (48, 36);

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models/tests/light-units")
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

/// The file's light on surfaces that reflect their base colour and nothing else.
fn ours(kind: &str, mode: &str, units: LightUnits) -> Vec<Vec3> {
    let path = folder().join(format!("{kind}_{mode}.glb"));
    let (mut scene, _) = load(&path, &LoadOptions::default()).unwrap();
    for material in &mut scene.materials {
        // k_d = base exactly: Blender's diffuse shader, not the mapping of a glossy one.
        material.reflectance = Reflectance::Mtl(MtlReflectance::default());
    }
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let settings = RenderSettings { width: SIZE.0, height: SIZE.1, samples: 1, ..Default::default() };
    let (camera, _) = View::default().resolve(&posed, SIZE.0, SIZE.1).unwrap();
    let (accel, _) = Accel::build(&posed, &BuildSettings::default());
    let lighting = Lighting { units, ambient: Some(Rgb::ZERO), ..Lighting::default() };
    let frame = Frame::new(&posed, &accel, camera, &lighting.resolve(&posed, &camera));
    let pixels = render(&frame, &Phong { stage: Stage::Shadow }, &settings, &()).unwrap();
    pixels.colors.iter().map(|c| c.truncate()).collect()
}

/// A diffuse scene is as bright as Blender's, in watts per steradian and square metre.
#[test]
fn with_the_right_unit_a_diffuse_scene_equals_blenders() {
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
            // Shadows and the spot's edge fall into the same pixels.
            assert!(sides < 30, "{kind} {mode}: {sides} pixels are lit in one alone");
        }
    }
}

/// Whatever the mode, the picture that a user gets without a flag is a picture, and the log's line
/// makes the same again.
#[test]
fn every_mode_is_exposed_and_the_log_says_how() {
    let dir = tempfile::tempdir().unwrap();
    for kind in KINDS {
        for (mode, _) in MODES {
            let scene = folder().join(format!("{kind}_{mode}.glb"));
            let picture = |flags: &[&str], out: &str| {
                let fixed =
                    ["render", scene.to_str().unwrap(), "--size", "48x36", "-s", "1", "-v", "-o", out];
                let output = Command::new(env!("CARGO_BIN_EXE_blinn"))
                    .args(fixed)
                    .args(flags)
                    .current_dir(dir.path())
                    .output()
                    .unwrap();
                let told = String::from_utf8(output.stderr).unwrap();
                assert_eq!(output.status.code(), Some(0), "{told}");
                (image::open(dir.path().join(out)).unwrap().into_luma8(), told)
            };
            let (usual, told) = picture(&[], "a.png");
            let line =
                told.lines().find_map(|l| l.strip_prefix("exposure: ")).unwrap_or_else(|| panic!("{told}"));
            let mut sorted = usual.to_vec();
            sorted.sort();
            let at = |share: usize| sorted[(sorted.len() - 1) * share / 100];
            let (low, median, high) = (at(5), at(50), at(95));
            assert!((60..200).contains(&median), "{kind} {mode}: median {median}, {line}");
            // Light and shade, not one flat colour.
            assert!(high - low > 60, "{kind} {mode}: {low} to {high}, {line}");
            let flags: Vec<&str> = line.split_whitespace().collect();
            assert!(picture(&flags, "b.png").0 == usual, "{kind} {mode}: {line} makes it again");
        }
    }
}
