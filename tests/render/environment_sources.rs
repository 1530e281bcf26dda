//! The bright parts of environments light surfaces and cast shadows, with and without indirect light.

use std::f64::consts::{PI, TAU};

use blinn::accel::{Accel, AccelSettings, SimdLevel};
use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{Frame, Phong};
use blinn::render::{Denoise, RenderSettings, render};
use blinn::scene::{
    ColorInput, Environment, Lighting, Material, Mesh, MtlReflectance, Panorama, Projection, Reflectance,
    Scene, View,
};
use glam::{DAffine3, DQuat, DVec3};

use crate::common::scenes::{self, add, grid};

const SIDE: u32 = 24;
const ALBEDO: f32 = 0.5;
/// Radius of the sun in radians.
const SUN_RADIUS: f64 = 0.05;
const SUN_RADIANCE: f64 = 400.0;
const SKY_RADIANCE: f64 = 0.2;

/// The direction to the sun: 30° from straight up.
fn to_sun() -> DVec3 {
    DVec3::new(0.5, 0.75f64.sqrt(), 0.0)
}

/// A uniform sky with a sun.
fn sunny() -> Environment {
    let (width, height) = (1024, 512);
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let around = ((f64::from(x) + 0.5) / f64::from(width) - 0.5) * TAU;
        let down = (f64::from(y) + 0.5) / f64::from(height) * PI;
        let d = DVec3::new(down.sin() * around.cos(), down.cos(), down.sin() * around.sin());
        let is_sun = d.angle_between(to_sun()) < SUN_RADIUS;
        [if is_sun { SUN_RADIANCE as f32 } else { SKY_RADIANCE as f32 }; 3]
    };
    Environment::from_panorama(
        Panorama::new(width, height, (0..width * height).map(texel).collect()).unwrap(),
    )
}

fn matte() -> Material {
    Material {
        base_color: ColorInput::new(Rgb::splat(ALBEDO)),
        reflectance: Reflectance::Mtl(MtlReflectance::default()),
        double_sided: true,
        ..Material::default()
    }
}

/// A floor of 20 by 20 m around the origin.
fn floor() -> Scene {
    let mesh = grid(1, 1);
    let mesh = Mesh { positions: mesh.positions.iter().map(|&p| p * 10.0).collect(), ..mesh };
    scenes::of_material(mesh, matte())
}

struct Shot {
    indirect: u8,
    simd: SimdLevel,
    tile: u32,
    denoise: Denoise,
}

impl Default for Shot {
    fn default() -> Shot {
        Shot { indirect: 0, simd: SimdLevel::detect(), tile: 32, denoise: Denoise::Off }
    }
}

/// A view straight down of a square of `width` metres around the origin.
fn picture(scene: &Scene, width: f64, shot: &Shot) -> Vec<Rgba> {
    let posed = scenes::posed(scene);
    let settings = AccelSettings { simd: shot.simd, ..AccelSettings::default() };
    let accel = Accel::build(&posed, &settings).0;
    let view = View {
        view_point: Some(DVec3::Y),
        view_dir: Some(DVec3::NEG_Y),
        view_up: Some(DVec3::NEG_Z),
        view_width: Some(width),
        view_height: Some(width),
        projection: Some(Projection::Orthographic),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, SIDE, SIDE).unwrap();
    let lighting = Lighting { sets: Some(Vec::new()), environment: Some(sunny()), ..Lighting::default() };
    let lit = lighting.resolve(&posed, &camera);
    let frame = Frame { indirect: shot.indirect, ..Frame::new(&posed, &accel, camera, &lit) };
    let settings = RenderSettings {
        width: SIDE,
        height: SIDE,
        samples: 16,
        tile: shot.tile,
        denoise: shot.denoise,
        ..RenderSettings::default()
    };
    render(&frame, &Phong::default(), &settings, &()).unwrap().colors
}

fn mean(pixels: &[Rgba]) -> f64 {
    pixels.iter().map(|c| f64::from(c.x)).sum::<f64>() / pixels.len() as f64
}

/// Radiance of the floor by the sun alone: E k_d / π, with the solid angle π sin² of the sun's radius.
fn of_sun() -> f64 {
    let sin = SUN_RADIUS.sin();
    (SUN_RADIANCE - SKY_RADIANCE) * sin * sin * to_sun().y * f64::from(ALBEDO)
}

#[test]
fn the_sun_of_an_environment_lights_a_plane_by_its_irradiance() {
    let sky = SKY_RADIANCE * f64::from(ALBEDO);
    for indirect in [0, 2] {
        let radiance = mean(&picture(&floor(), 0.1, &Shot { indirect, ..Shot::default() }));
        let expected = of_sun() + sky;
        assert!((radiance / expected - 1.0).abs() < 0.01, "{indirect}: {radiance}, expected {expected}");
    }
}

/// A small blocker in the direction of the sun leaves the light of the sky.
#[test]
fn what_hides_the_sun_casts_a_shadow() {
    let mut scene = floor();
    let tilt = DQuat::from_rotation_arc(DVec3::Y, to_sun());
    // Behind the camera, which looks from a height of 1.
    let blocker = DAffine3::from_scale_rotation_translation(DVec3::splat(0.6), tilt, to_sun() * 4.0);
    add(&mut scene, grid(1, 1), matte(), &[blocker]);
    let sky = SKY_RADIANCE * f64::from(ALBEDO);
    for indirect in [0, 2] {
        let radiance = mean(&picture(&scene, 0.1, &Shot { indirect, ..Shot::default() }));
        // The blocker hides little of the sky and reflects little light.
        assert!((radiance / sky - 1.0).abs() < 0.05, "{indirect}: {radiance}, expected {sky}");
    }
}

#[test]
fn sunny_pictures_do_not_depend_on_threads_tiles_or_simd_levels() {
    let mut scene = floor();
    add(&mut scene, scenes::ball(16, 8), matte(), &[DAffine3::from_scale(DVec3::splat(0.4))]);
    let bits = |pixels: Vec<Rgba>| pixels.iter().map(|c| c.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    for indirect in [0, 1] {
        let expected =
            bits(picture(&scene, 2.0, &Shot { indirect, denoise: Denoise::Auto, ..Shot::default() }));
        let shot = |simd, tile| Shot { indirect, simd, tile, denoise: Denoise::Auto };
        for simd in scenes::simd_levels() {
            assert!(bits(picture(&scene, 2.0, &shot(simd, 9))) == expected, "{simd:?}");
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let pixels = pool.install(|| picture(&scene, 2.0, &shot(SimdLevel::detect(), 32)));
        assert!(bits(pixels) == expected);
    }
}
