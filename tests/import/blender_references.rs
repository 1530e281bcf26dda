//! Our models against Blender's render passes (`models/tests/references`, by `models/scripts/references.py`):
//! mask, depth, shading normal and base colour.

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Aov, Frame};
use blinn::render::{RenderSettings, render_aovs};
use blinn::scene::{AnimationChoice, ClipPlanes, Lighting, PoseSettings, Projection, Scene, View, pose};
use glam::{DVec3, Vec3};
use serde_json::Value;

use crate::common::model_path;

/// Mask, depth, normal and albedo of a picture, row 0 on top.
struct Buffers {
    mask: Vec<bool>,
    depth: Vec<f32>,
    normal: Vec<Vec3>,
    albedo: Vec<Vec3>,
}

fn triples(v: &[f32]) -> Vec<Vec3> {
    v.as_chunks::<3>().0.iter().map(|&v| Vec3::from(v)).collect()
}

fn reference(case: &Value) -> Buffers {
    use exr::prelude::*;
    let path = model_path("tests/references").join(case["exr"].as_str().unwrap());
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(&path)
        .unwrap();
    let channels = image.layer_data.channel_data.list;
    let channel = |name: &str| -> Vec<f32> {
        let found = channels.iter().find(|c| c.name.to_string() == name);
        found.map_or_else(Vec::new, |c| c.sample_data.values_as_f32().collect())
    };
    let triple = |names: [&str; 3]| -> Vec<glam::Vec3> {
        let [x, y, z] = names.map(channel);
        x.iter().zip(&y).zip(&z).map(|((&x, &y), &z)| glam::Vec3::new(x, y, z)).collect()
    };
    Buffers {
        mask: channel("mask.A").iter().map(|&m| m > 0.5).collect(),
        depth: channel("depth.Z"),
        normal: triple(["normal.X", "normal.Y", "normal.Z"]),
        albedo: triple(["albedo.R", "albedo.G", "albedo.B"]),
    }
}

fn vec3(value: &Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| value[i].as_f64().unwrap()))
}

/// Renders the case's view of its file, or of a compressed twin.
fn ours(case: &Value, file: &str) -> Buffers {
    let (scene, _) =
        load(&model_path(file), &LoadOptions::default()).unwrap_or_else(|e| panic!("{file}: {e}"));
    let settings = PoseSettings {
        time: case["time"].as_f64().unwrap_or(0.0),
        animation: animation(case, &scene),
        centre: None,
    };
    let posed = pose(&scene, &settings).unwrap();
    let view = &case["view"];
    let view = match view["camera"].as_str() {
        Some(name) => View { camera: Some(name.into()), ..View::default() },
        None => View {
            view_point: Some(vec3(&view["view_point"])),
            look_at: Some(vec3(&view["look_at"])),
            view_up: Some(vec3(&view["view_up"])),
            yfov: view["yfov"].as_f64().map(f64::to_radians),
            view_height: view["view_height"].as_f64(),
            projection: (view["projection"] == "orthographic").then_some(Projection::Orthographic),
            clip: Some(ClipPlanes::OFF),
            ..View::default()
        },
    };
    let side = |i: usize| case["size"][i].as_u64().unwrap() as u32;
    let (width, height) = (side(0), side(1));
    let (camera, _) = view.resolve(&posed, width, height).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let lit = Lighting::default().resolve(&posed, &camera);
    let mut frame = Frame::new(&posed, &accel, camera, &lit);
    frame.cull_back_faces = false;
    let settings = RenderSettings { width, height, samples: 1, ..Default::default() };
    let layers =
        render_aovs(&frame, &[Aov::Mask, Aov::Depth, Aov::Normal, Aov::Albedo], &settings, &()).unwrap();
    Buffers {
        mask: layers[0].values.iter().map(|&m| m > 0.5).collect(),
        depth: layers[1].values.clone(),
        normal: triples(&layers[2].values),
        albedo: triples(&layers[3].values),
    }
}

fn animation(case: &Value, scene: &Scene) -> AnimationChoice {
    match (case["time"].is_null(), case["animation"].as_str()) {
        (true, _) => AnimationChoice::Rest,
        (false, None) => AnimationChoice::All,
        (false, Some(name)) => {
            AnimationChoice::One(scene.animations.iter().position(|a| a.name == name).unwrap())
        }
    }
}

/// The 95th percentile.
fn p95(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values.get(values.len() * 95 / 100).copied().unwrap_or(0.0)
}

/// The allowed differences.
struct Tolerance {
    pixels: usize,
    depth: f32,
    degrees: f32,
    color: f32,
}

/// Twice the rounding error of the references.
const EXACT: Tolerance = Tolerance { pixels: 2, depth: 2e-4, degrees: 0.2, color: 2e-3 };
/// For files with fewer bits.
const TWIN: Tolerance = Tolerance { pixels: 5, depth: 5e-4, degrees: 0.8, color: 4e-3 };
/// For two files with very few bits.
const COARSE: Tolerance = Tolerance { pixels: 30, depth: 6e-3, degrees: 2.5, color: 1e-2 };

/// The differences beyond the tolerance, or an empty text.
fn compare(theirs: &Buffers, ours: &Buffers, case: &Value, tolerance: &Tolerance) -> String {
    let mut wrong = String::new();
    let mut check = |what: &str, found: f32, allowed: f32| {
        if !(found <= allowed) {
            wrong.push_str(&format!(" {what} {found} over {allowed};"));
        }
    };
    let has = |name: &str| case["buffers"].as_array().unwrap().iter().any(|b| b == name);
    let limit = |name: &str, default: f32| case["limits"][name].as_f64().map_or(default, |v| v as f32);
    let differ = theirs.mask.iter().zip(&ours.mask).filter(|(a, b)| a != b).count();
    check("pixels of the mask", differ as f32, tolerance.pixels as f32);
    let both: Vec<usize> = (0..ours.mask.len()).filter(|&i| theirs.mask[i] && ours.mask[i]).collect();
    check("pixels not seen", if both.len() < 100 { 1.0 } else { 0.0 }, 0.0);
    let depth = both.iter().map(|&i| (ours.depth[i] / theirs.depth[i] - 1.0).abs());
    check("depth", p95(depth.clone().collect()), tolerance.depth);
    check("pixels of another depth", depth.filter(|&d| d > 0.01).count() as f32, tolerance.pixels as f32);
    if has("normal") {
        let angle = |&i: &usize| ours.normal[i].angle_between(theirs.normal[i]).to_degrees();
        let angles: Vec<f32> = both.iter().map(angle).collect();
        let other = angles.iter().filter(|&&a| a > 5.0).count() as f32 / both.len() as f32;
        let widened = limit("normal_deg_p95", 0.0);
        check(
            "share of other normals",
            other,
            if widened > 0.0 { 0.01 } else { 0.002 + 0.003 * tolerance.degrees },
        );
        check("degrees", p95(angles), widened.max(tolerance.degrees));
    }
    if has("albedo") {
        let apart = both.iter().map(|&i| (ours.albedo[i] - theirs.albedo[i]).abs().max_element());
        let mean = apart.clone().sum::<f32>() / both.len() as f32;
        let other = apart.filter(|&d| d > 0.1).count() as f32 / both.len() as f32;
        check("base colour", mean, tolerance.color);
        check("share of other colours", other, 2.0 * tolerance.color);
    }
    wrong
}

#[test]
fn blender_sees_the_same() {
    let text = std::fs::read(model_path("tests/references/cases.json")).unwrap();
    let Value::Array(cases) = serde_json::from_slice(&text).unwrap() else { panic!() };
    let (mut judged, mut failures) = (0, Vec::new());
    for case in &cases {
        let theirs = reference(case);
        let file = case["file"].as_str().unwrap();
        let twins = case["twins"].as_array().into_iter().flatten().map(|t| (t.as_str().unwrap(), true));
        for (file, twin) in std::iter::once((file, false)).chain(twins) {
            // gltfpack resampled this animation at 30 Hz, past the key.
            if file.contains("torus_pack_khr_cz") && !case["time"].is_null() {
                continue;
            }
            let coarse = ["torus_draco_eb_fast", "patch_draco_fallback"].iter().any(|n| file.contains(n));
            let tolerance = match (twin, coarse) {
                (false, _) => &EXACT,
                (true, false) => &TWIN,
                (true, true) => &COARSE,
            };
            let wrong = compare(&theirs, &ours(case, file), case, tolerance);
            if !wrong.is_empty() {
                failures.push(format!("{} ({file}):{wrong}", case["name"]));
            }
            judged += 1;
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert_eq!((cases.len(), judged), (35, 76));
}
