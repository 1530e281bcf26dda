//! Pictures do not depend on the scene's scale and position: all ray tolerances are relative.

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{AmbientOcclusion, Frame, Phong};
use blinn::render::{Pixels, RenderSettings, render};
use blinn::scene::{
    FileProjection, Ground, GroundKind, LightKind, Lighting, LocalTransform, PoseSettings, Scene, View, pose,
};
use glam::{DAffine3, DVec3};

use crate::common::load_model;

/// Scenes with cameras, lights of each kind, alpha masks, glass, instances and skins.
const SCENES: [&str; 6] = [
    "cornell/cornell.glb",
    "alpha/alpha.glb",
    "tests/lights.glb",
    "assembly/assembly.glb",
    "figure/figure.glb",
    "tests/gltf/instances_gpu.glb",
];

fn scene(name: &str) -> Scene {
    // Without animations, whose keys are lengths too.
    Scene { animations: Vec::new(), ..load_model(name) }
}

/// The scene scaled by `s`: all lengths by `s`, and intensities by s² for the same irradiance.
fn scale_scene(mut scene: Scene, s: f64) -> Scene {
    transform_roots(&mut scene, DAffine3::from_scale(DVec3::splat(s)));
    for camera in &mut scene.cameras {
        camera.znear *= s;
        camera.zfar *= s;
        if let FileProjection::Orthographic { xmag, ymag } = &mut camera.projection {
            *xmag *= s;
            *ymag *= s;
        }
    }
    for light in &mut scene.lights {
        light.range *= s as f32;
        if !matches!(light.kind, LightKind::Directional) {
            light.intensity *= (s * s) as f32;
        }
    }
    scene
}

/// Transforms the root nodes.
fn transform_roots(scene: &mut Scene, by: DAffine3) {
    for node in scene.nodes.iter_mut().filter(|n| n.parent.is_none()) {
        node.local = LocalTransform::Matrix(by * node.local.affine());
    }
}

/// Renders with soft shadows, ambient occlusion and a ground, all sized by `s`.
fn render_scaled(scene: &Scene, s: f64) -> Pixels {
    let posed = pose(scene, &PoseSettings::default()).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let settings = RenderSettings { width: 64, height: 36, samples: 4, ..Default::default() };
    let (camera, _) = View::default().resolve(&posed, settings.width, settings.height).unwrap();
    // `light_radius` is an angle for suns and a length for other lights. Scenes without lights get a rig of
    // suns.
    let suns =
        scene.lights.is_empty() || scene.lights.iter().any(|l| matches!(l.kind, LightKind::Directional));
    let radius = if suns { 0.0 } else { (0.05 * s) as f32 };
    let lighting = Lighting { radius: Some(radius), boost_ambient: true, ..Default::default() };
    let lit = lighting.resolve(&posed, &camera);
    let occlusion = Some(AmbientOcclusion { samples: 4, distance: s });
    let ground = Some(Ground::under(&posed.bounds(), GroundKind::Plane));
    let frame = Frame { ambient_occlusion: occlusion, ground, ..Frame::new(&posed, &accel, camera, &lit) };
    render(&frame, &Phong::default(), &settings, &()).unwrap()
}

/// Returns the largest difference of a channel after the display transform.
fn max_difference(a: &Pixels, b: &Pixels) -> f32 {
    let display = |v: f32| blinn::scene::linear_to_srgb(v.clamp(0.0, 1.0));
    let all = a.colors.iter().zip(&b.colors);
    all.flat_map(|(a, b)| (*a).to_array().into_iter().zip(b.to_array()))
        .map(|(a, b)| (display(a) - display(b)).abs())
        .fold(0.0, f32::max)
}

#[test]
fn scaling_by_powers_of_two_is_bit_identical() {
    for name in SCENES {
        let reference = render_scaled(&scene(name), 1.0);
        assert!(reference.colors.iter().any(|c| c.x > 0.05), "{name} shows something");
        for power in [-20, 20] {
            let s = 2f64.powi(power);
            let bits = |p: &Pixels| -> Vec<u32> {
                p.colors.iter().flat_map(|c| c.to_array().map(f32::to_bits)).collect()
            };
            let other = render_scaled(&scale_scene(scene(name), s), s);
            let differ = bits(&reference).iter().zip(bits(&other)).filter(|(a, b)| **a != *b).count();
            assert_eq!(differ, 0, "{name} × 2^{power}: differs by {}", max_difference(&reference, &other));
        }
    }
}

/// The coordinates differ, and the mesh does not: recentring keeps the digits that f32 would lose.
#[test]
fn an_obj_far_from_the_origin_renders_as_at_the_origin() {
    let dir = tempfile::tempdir().unwrap();
    let read = |origin: DVec3| {
        let mut text = String::new();
        for i in 0..33 {
            for j in 0..33 {
                let (x, z) = (f64::from(i) * 0.25, f64::from(j) * 0.25);
                let p = origin + DVec3::new(x, (x * 1.3).sin() * (z * 0.9).cos(), z);
                text += &format!("v {:.4} {:.4} {:.4}\n", p.x, p.y, p.z);
            }
        }
        let corner = |i: i32, j: i32| 33 * i + j + 1;
        for (i, j) in (0..32).flat_map(|i| (0..32).map(move |j| (i, j))) {
            let square = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
            text += &format!("f {} {} {} {}\n", square[0], square[1], square[2], square[3]);
        }
        let path = dir.path().join("hills.obj");
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default()).unwrap().0
    };
    let near = render_scaled(&read(DVec3::ZERO), 1.0);
    let far = render_scaled(&read(DVec3::new(500_000.0, 120.0, 5_300_000.0)), 1.0);
    // At an edge, either facet may be hit.
    let same = near.colors.iter().zip(&far.colors).filter(|(a, b)| a.abs_diff_eq(**b, 1.0 / 255.0)).count();
    assert!(same * 100 >= near.colors.len() * 99, "{same} of {}", near.colors.len());
}

#[test]
fn other_scales_and_positions_differ_by_at_most_one_level() {
    for name in SCENES {
        let reference = render_scaled(&scene(name), 1.0);
        for power in [-6, -3, 3, 6] {
            let s = 10f64.powi(power);
            let difference = max_difference(&reference, &render_scaled(&scale_scene(scene(name), s), s));
            println!("{name} × 10^{power}: {difference}");
            assert!(difference <= 1.0 / 255.0, "{name} × 10^{power}: {difference}");
        }
        let mut far = scene(name);
        transform_roots(&mut far, DAffine3::from_translation(DVec3::new(1e5, -1e5, 1e5)));
        let difference = max_difference(&reference, &render_scaled(&far, 1.0));
        println!("{name}, moved: {difference}");
        assert!(difference <= 1.0 / 255.0, "{name}, moved: {difference}");
    }
}
