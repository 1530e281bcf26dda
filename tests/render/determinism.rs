//! The same input gives the same bytes: on any number of threads, for any tile size, BVH preset and SIMD
//! level.

use blinn::accel::{Accel, AccelSettings, Preset, SimdLevel};
use blinn::integrator::{AmbientOcclusion, Aov, Frame, Phong};
use blinn::render::{Pixels, RenderSettings, render, render_aovs};
use blinn::scene::{Ground, GroundKind, Lighting, PoseSettings, Scene, View, pose};

use crate::common::load_model;

const SCENES: [&str; 3] = ["cornell/cornell.glb", "assembly/assembly.glb", "alpha/alpha.glb"];

/// Sharp shadows, or soft shadows with ambient occlusion and a ground.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Light {
    Sharp,
    Soft(GroundKind),
}

fn picture(
    scene: &Scene,
    threads: usize,
    tile: u32,
    preset: Preset,
    light: Light,
) -> (Pixels, Vec<Vec<u32>>) {
    let build = AccelSettings { preset, ..AccelSettings::default() };
    picture_with(scene, threads, tile, build, light)
}

fn picture_with(
    scene: &Scene,
    threads: usize,
    tile: u32,
    build: AccelSettings,
    light: Light,
) -> (Pixels, Vec<Vec<u32>>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let posed = pose(scene, &PoseSettings::default()).unwrap();
        let (accel, _) = Accel::build(&posed, &build);
        let settings = RenderSettings { width: 96, height: 54, samples: 3, tile, ..Default::default() };
        let (camera, _) = View::default().resolve(&posed, settings.width, settings.height).unwrap();
        let mut lighting = Lighting { boost_ambient: true, ..Default::default() };
        let mut ambient_occlusion = None;
        let mut ground = None;
        if let Light::Soft(kind) = light {
            lighting.radius = Some(0.2);
            ambient_occlusion = Some(AmbientOcclusion { samples: 5, distance: 1.0 });
            ground = Some(Ground::under(&posed.bounds(), kind));
        }
        let lit = lighting.resolve(&posed, &camera);
        let frame = Frame { ambient_occlusion, ground, ..Frame::new(&posed, &accel, camera, &lit) };
        let pixels = render(&frame, &Phong::default(), &settings, &()).unwrap();
        // Traversal steps depend on the BVH.
        let aovs: Vec<Aov> = Aov::ALL.into_iter().filter(|aov| *aov != Aov::Steps).collect();
        let layers = render_aovs(&frame, &aovs, &settings, &()).unwrap();
        (pixels, layers.iter().map(|l| l.values.iter().map(|v| v.to_bits()).collect()).collect())
    })
}

fn bits(p: &Pixels) -> Vec<u32> {
    p.colors.iter().flat_map(|c| c.to_array().map(f32::to_bits)).collect()
}

#[test]
fn pictures_do_not_depend_on_threads_tiles_or_bvh_presets() {
    for name in SCENES {
        let scene = load_model(name);
        for light in [Light::Sharp, Light::Soft(GroundKind::Plane), Light::Soft(GroundKind::ShadowCatcher)] {
            let expected = picture(&scene, 1, 16, Preset::Medium, light);
            assert!(expected.0.colors.iter().any(|c| c.w > 0.0), "{name} is not empty");
            for (threads, tile, preset) in [
                (1, 16, Preset::Fast),
                (1, 16, Preset::Slow),
                (2, 16, Preset::Medium),
                (3, 7, Preset::Medium),
                (8, 64, Preset::Medium),
            ] {
                let got = picture(&scene, threads, tile, preset, light);
                assert!(
                    bits(&got.0) == bits(&expected.0),
                    "{name}: {threads} threads, tiles of {tile}, {preset:?}, {light:?}"
                );
                assert!(got.1 == expected.1, "{name}: layers of {threads} threads, {preset:?}");
            }
        }
    }
}

/// Threads × tile sizes × SIMD levels, five times each.
#[test]
#[ignore = "takes minutes: just determinism"]
fn pictures_do_not_depend_on_threads_tiles_or_simd_levels() {
    for name in SCENES {
        let scene = load_model(name);
        let light = Light::Soft(GroundKind::ShadowCatcher);
        let expected = picture(&scene, 1, 16, Preset::Medium, light);
        let mut pictures = 0;
        for simd in SimdLevel::ALL.into_iter().filter(|t| t.is_supported()) {
            let build = AccelSettings { simd, ..AccelSettings::default() };
            for (threads, tile) in [1, 2, 3, 8, 64].into_iter().flat_map(|n| [7, 16, 64].map(|t| (n, t))) {
                for _ in 0..5 {
                    let got = picture_with(&scene, threads, tile, build, light);
                    let same = bits(&got.0) == bits(&expected.0) && got.1 == expected.1;
                    assert!(same, "{name}: {threads} threads, tiles of {tile}, {simd:?}");
                    pictures += 1;
                }
            }
        }
        println!("{name}: {pictures} pictures");
    }
}
