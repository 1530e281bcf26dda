//! Compressed and quantised files against their uncompressed twins, and against an independent reader
//! (`models/tests/gltf/README.md`).

use std::path::PathBuf;

use blinn::accel::{Accel, AccelSettings};
use blinn::geometry::HitId;
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Aov, Frame};
use blinn::render::{RenderSettings, render_aovs};
use blinn::scene::{
    AnimationChoice, Camera, Lighting, PoseSettings, PosedScene, Reflectance, Scene, View, pose,
};
use glam::DVec3;
use serde_json::Value;

use crate::common::model_path;

const SIDE: u32 = 64;

fn folder() -> PathBuf {
    model_path("tests/gltf")
}

fn json(name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder().join(name)).unwrap()).unwrap()
}

fn scene(name: &str) -> Scene {
    load(&folder().join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}")).0
}

/// Every examined file with the other reader's results.
fn expected() -> Vec<(String, Value)> {
    let all = |at: &str| {
        let Value::Object(map) = json(&format!("{at}expected.json")) else { panic!("{at}") };
        map.into_iter().map(|(name, v)| (format!("{at}{name}"), v)).collect::<Vec<_>>()
    };
    let list: Vec<_> = all("").into_iter().chain(all("more/")).collect();
    assert_eq!(list.len(), 78);
    list
}

/// Poses at a time, or at rest.
fn posed(scene: &Scene, time: Option<f64>) -> PosedScene<'_> {
    let animation = if time.is_some() { AnimationChoice::One(0) } else { AnimationChoice::Rest };
    pose(scene, &PoseSettings { time: time.unwrap_or(0.0), animation, centre: None }).unwrap()
}

/// The number of drawn triangles and their area.
fn drawn(posed: &PosedScene) -> (u64, f64) {
    let (mut count, mut area) = (0, 0.0);
    for instance in 0..posed.instances.len() as u32 {
        for triangle in 0..posed.mesh(instance).triangles.len() as u32 {
            let [a, b, c] = posed.world_triangle(HitId { instance, triangle }).map(|p| p.as_dvec3());
            count += 1;
            area += 0.5 * (b - a).cross(c - a).length();
        }
    }
    (count, area)
}

fn check(name: &str, posed: &PosedScene, found: &Value, bounded: bool) {
    let vec3 = |key: &str| DVec3::from_array(std::array::from_fn(|i| found[key][i].as_f64().unwrap()));
    let (count, area) = drawn(posed);
    if let Some(triangles) = found["triangles"].as_u64() {
        assert_eq!(count, triangles, "{name}");
    }
    let bounds = posed.bounds();
    let size = (bounds.max - bounds.min).length();
    for (ours, theirs) in [(bounds.min, vec3("min")), (bounds.max, vec3("max"))] {
        assert!(
            !bounded || (ours - theirs).length() < 1e-4 * size,
            "{name}: {ours} where {theirs} was found"
        );
    }
    let theirs = found["area"].as_f64().unwrap();
    assert!((area / theirs - 1.0).abs() < 1e-4, "{name}: an area of {area}, where {theirs} was found");
}

#[test]
fn an_independent_reader_finds_the_same_triangles() {
    let mut moved = 0;
    for (name, found) in expected() {
        let scene = scene(&name);
        // The bounds of that reader include vertices that lines do not use.
        let other_modes = |p: &Value| p["mode"].as_u64().is_some_and(|mode| mode < 4);
        let bounded = !found["primitives"].as_array().unwrap().iter().any(other_modes);
        check(&name, &posed(&scene, None), &found["world"], bounded);
        // The other reader does not support KHR_animation_pointer.
        if name == "pointers.glb" {
            continue;
        }
        for (time, found) in found["poses"].as_object().into_iter().flatten() {
            check(&format!("{name} at {time} s"), &posed(&scene, time.parse().ok()), found, true);
            moved += 1;
        }
    }
    assert!(moved >= 6, "{moved} poses");
}

/// Renders depth, vertex normal and albedo through this camera.
fn render_layers(posed: &PosedScene, camera: &Camera) -> [Vec<f32>; 3] {
    let (accel, _) = Accel::build(posed, &AccelSettings::default());
    let lit = Lighting::default().resolve(posed, camera);
    let frame = Frame::new(posed, &accel, *camera, &lit);
    let settings = RenderSettings { width: SIDE, height: SIDE, samples: 1, ..Default::default() };
    let layers = render_aovs(&frame, &[Aov::Depth, Aov::VertexNormal, Aov::Albedo], &settings, &()).unwrap();
    layers.into_iter().map(|l| l.values).collect::<Vec<_>>().try_into().unwrap()
}

/// The number of pixels that both cover and that differ by more than `tolerance`, and the number that only
/// one covers.
fn differing(ours: &[f32], twins: &[f32], depth: [&[f32]; 2], tolerance: f32) -> (usize, usize) {
    let width = ours.len() / depth[0].len();
    let (mut differ, mut alone) = (0, 0);
    for pixel in 0..depth[0].len() {
        match depth.map(|d| d[pixel].is_finite()) {
            [true, true] => {
                let range = pixel * width..(pixel + 1) * width;
                let apart = ours[range.clone()].iter().zip(&twins[range]).map(|(a, b)| (a - b).abs());
                differ += usize::from(apart.fold(0.0, f32::max) > tolerance);
            }
            [false, false] => {}
            _ => alone += 1,
        }
    }
    (differ, alone)
}

#[test]
fn compressed_files_look_like_their_twins() {
    let mut compared = 0;
    for (name, found) in expected() {
        let Some(twin) = found["twin"].as_str() else { continue };
        let (scene, twin) = (self::scene(&name), self::scene(&same_folder(&name, twin)));
        let times: &[Option<f64>] =
            if twin.animations.is_empty() { &[None] } else { &[None, Some(0.3), Some(0.7)] };
        for &time in times {
            let (ours, twins) = (posed(&scene, time), posed(&twin, time));
            // Through the twin's camera, so that both have one view.
            let (camera, _) = View { view_dir: Some(DVec3::new(-0.6, -0.7, -0.5)), ..View::default() }
                .resolve(&twins, SIDE, SIDE)
                .unwrap();
            let (a, b) = (render_layers(&ours, &camera), render_layers(&twins, &camera));
            let depth = [&a[0][..], &b[0][..]];
            let covered = depth[1].iter().filter(|d| d.is_finite()).count();
            assert!(covered > 60, "{name}: {covered} pixels seen");
            let size = (twins.bounds().max - twins.bounds().min).length() as f32;
            // Textures, vertex colours and normals are quantised, and edges may move. ETC1S and WebP are
            // lossy; their decoding is tested elsewhere. Two files differ from their twin on purpose.
            let textures = match name.as_str() {
                "basisu.glb" => (0.1, 20),
                "blender_webp.glb" | "more/blender_webp_fallback.glb" => (0.2, 5),
                "basisu_fallback.glb" | "basisu_linked.gltf" => (1.0, 0),
                _ => (0.04, 2),
            };
            for (layer, (tolerance, percent)) in [(0, (0.01 * size, 2)), (1, (0.06, 2)), (2, textures)] {
                let (differ, alone) = differing(&a[layer], &b[layer], depth, tolerance);
                assert!(
                    differ * 100 <= percent * covered,
                    "{name} {time:?} layer {layer}: {differ} of {covered} differ"
                );
                assert!(alone * 100 <= 2 * covered, "{name} {time:?}: {alone} of {covered} alone");
            }
            compared += 1;
        }
    }
    assert!(compared > 100, "{compared} pictures compared");
}

/// The twin of a file under `more/` is there, or one folder up.
fn same_folder(name: &str, twin: &str) -> String {
    let beside = name.rsplit_once('/').map_or(twin.to_string(), |(folder, _)| format!("{folder}/{twin}"));
    if folder().join(&beside).exists() { beside } else { twin.to_string() }
}

/// KHR_animation_pointer: every animated value at eight times.
#[test]
fn pointers_drive_what_is_rendered() {
    let (scene, warnings) = load(&folder().join("pointers.glb"), &LoadOptions::default()).unwrap();
    // The second animation's targets do not exist.
    let left_out = warnings.iter().filter(|w| w.location.starts_with("animations[1]")).count();
    assert!(left_out > 0, "{warnings:?}");
    let Value::Array(list) = json("pointers.json") else { panic!() };
    let mut judged = 0;
    for entry in &list {
        let pointer = entry["pointer"].as_str().unwrap();
        for (time, values) in entry["values"].as_object().unwrap() {
            let settings = PoseSettings {
                time: time.parse().unwrap(),
                animation: AnimationChoice::One(0),
                centre: Some(DVec3::ZERO),
            };
            let posed = pose(&scene, &settings).unwrap();
            let wanted: Vec<f64> = values.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
            let Some(found) = read(&posed, pointer) else { panic!("{pointer} is not looked at") };
            let near = found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() <= 1e-5 * b.abs().max(1.0));
            assert!(near && found.len() == wanted.len(), "{pointer} at {time}: {found:?}, not {wanted:?}");
            judged += 1;
        }
    }
    assert_eq!((list.len(), judged), (19, 19 * 8));
}

/// The value of a pointer in a posed scene.
fn read(posed: &PosedScene, pointer: &str) -> Option<Vec<f64>> {
    use blinn::scene::{AlphaMode, FileProjection, LightUnits, PosedLightKind};
    let parts: Vec<&str> = pointer.split('/').skip(1).collect();
    let f = |v: f32| vec![f64::from(v)];
    let material = |i: &str| {
        // Scene materials are in the order of first use, here that of the file.
        &posed.materials[i.parse::<usize>().unwrap()]
    };
    let transform = |i: &str| material(i).base_color.texture.unwrap().transform;
    let light = |i: &str| posed.lights(LightUnits::Raw, 1.0)[i.parse::<usize>().unwrap()].clone();
    let stored = |i: &str| &posed.scene.lights[i.parse::<usize>().unwrap()];
    Some(match *parts.as_slice() {
        ["materials", i, "pbrMetallicRoughness", "baseColorFactor"] => {
            material(i).base_color.factor.extend(material(i).alpha.factor).as_dvec4().to_array().to_vec()
        }
        ["materials", i, "pbrMetallicRoughness", name @ ("roughnessFactor" | "metallicFactor")] => {
            let Reflectance::MetallicRoughness { metallic, roughness, .. } = material(i).reflectance else {
                return None;
            };
            f(if name == "roughnessFactor" { roughness.factor } else { metallic.factor })
        }
        ["materials", i, "emissiveFactor"] => material(i).emission.factor.as_dvec3().to_array().to_vec(),
        ["materials", i, .., "emissiveStrength"] => f(material(i).emission_strength),
        ["materials", i, .., "offset"] => transform(i).offset().as_dvec2().to_array().to_vec(),
        ["materials", i, .., "rotation"] => f(transform(i).rotation()),
        ["materials", i, .., "scale"] => transform(i).scale().as_dvec2().to_array().to_vec(),
        ["materials", i, "alphaCutoff"] => match material(i).alpha_mode {
            AlphaMode::Mask(cutoff) => f(cutoff),
            _ => return None,
        },
        [.., "lights", i, "intensity"] => {
            // The light's red is always 1 here.
            let factor = LightUnits::Raw.factor(stored(i).kind);
            f(light(i).intensity.x / factor)
        }
        [.., "lights", i, "color"] => {
            let i = light(i).intensity.as_dvec3();
            (i / i.x).to_array().to_vec()
        }
        [.., "lights", i, "range"] => f(light(i).range),
        [.., "lights", i, "spot", name] => {
            let PosedLightKind::Spot { cone, .. } = light(i).kind else { return None };
            let cos = if name == "outerConeAngle" { cone.cos_outer } else { cone.cos_outer + cone.width };
            vec![f64::from(cos).acos()]
        }
        ["cameras", i, ..] => match posed.cameras[i.parse::<usize>().unwrap()].projection {
            FileProjection::Perspective { yfov, .. } => vec![yfov],
            FileProjection::Orthographic { xmag, .. } => vec![xmag],
        },
        ["nodes", i, .., "visible"] => {
            let at = |n: u32| posed.scene.instances.iter().position(|x| x.node == n).unwrap();
            let instance = at(i.parse().unwrap());
            vec![f64::from(u8::from(posed.instances[instance].visible))]
        }
        ["nodes", i, "translation"] => {
            posed.node_to_world(i.parse().unwrap()).translation.to_array().to_vec()
        }
        // The morph target moves a vertex by its weight, which the position shows.
        ["nodes", i, "weights", _] => {
            let node: u32 = i.parse().unwrap();
            let instance = posed.scene.instances.iter().position(|x| x.node == node).unwrap() as u32;
            let mesh = posed.mesh(instance);
            let delta = &mesh.morph_targets[0].positions;
            let v =
                (0..delta.len()).max_by(|&a, &b| delta[a].length().total_cmp(&delta[b].length())).unwrap();
            let moved = posed.positions(instance)[v] - mesh.positions[v];
            f(moved.dot(delta[v]) / delta[v].length_squared())
        }
        _ => return None,
    })
}
