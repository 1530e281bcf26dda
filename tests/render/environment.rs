//! Environments: as the background of pictures, and as the light that ambient occlusion finds.

use std::f64::consts::{PI, TAU};

use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{AmbientOcclusion, Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    Camera, ColorInput, Environment, FileEnvironment, Lighting, Material, Panorama, Projection, Reflectance,
    ScalarInput, Scene, View,
};
use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::common::scenes;

const SIDE: u32 = 24;

/// An environment whose radiance is a function of the direction.
fn environment(radiance: impl Fn(DVec3) -> Rgb) -> Environment {
    let (width, height) = (512, 256);
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let around = ((f64::from(x) + 0.5) / f64::from(width) - 0.5) * TAU;
        let down = (f64::from(y) + 0.5) / f64::from(height) * PI;
        let d = DVec3::new(down.sin() * around.cos(), down.cos(), down.sin() * around.sin());
        radiance(d).to_array()
    };
    Environment::from_panorama(
        Panorama::new(width, height, (0..width * height).map(texel).collect()).unwrap(),
    )
}

/// The direction as a colour.
fn directions() -> Environment {
    environment(|d| d.as_vec3() * 0.5 + 0.5)
}

fn matte() -> Material {
    Material {
        base_color: ColorInput::new(Rgb::ONE),
        reflectance: Reflectance::MetallicRoughness {
            metallic: ScalarInput::new(0.0),
            roughness: ScalarInput::new(1.0),
            dielectric: blinn::scene::Dielectric { specular: ScalarInput::new(0.0), ..Default::default() },
        },
        double_sided: true,
        ..Material::default()
    }
}

fn camera(posed: &blinn::scene::PosedScene, projection: Projection, view_dir: DVec3) -> Camera {
    let view = View {
        view_point: Some(-6.0 * view_dir),
        view_dir: Some(view_dir),
        projection: Some(projection),
        view_width: Some(1.0),
        view_height: Some(1.0),
        ..View::default()
    };
    view.resolve(posed, SIDE, SIDE).unwrap().0
}

fn shoot(scene: &Scene, view_dir: DVec3, projection: Projection, edit: impl FnOnce(&mut Frame)) -> Vec<Rgba> {
    let posed = scenes::posed(scene);
    let accel = scenes::build(&posed);
    let camera = camera(&posed, projection, view_dir);
    let lighting =
        Lighting { sets: Some(Vec::new()), environment: Some(directions()), ..Lighting::default() };
    let mut frame = Frame::new(&posed, &accel, camera, &lighting.resolve(&posed, &camera));
    edit(&mut frame);
    let settings = RenderSettings { width: SIDE, height: SIDE, samples: 1, ..Default::default() };
    render(&frame, &Phong::default(), &settings, &()).unwrap().colors
}

/// A small ball far away from the view.
fn elsewhere() -> Scene {
    let mut scene = Scene::default();
    let aside = DAffine3::from_translation(DVec3::new(40.0, 40.0, 40.0));
    scenes::add(&mut scene, scenes::ball(8, 4), matte(), &[aside]);
    scene
}

#[test]
fn the_background_shows_the_environment_in_the_direction_of_each_ray() {
    let scene = elsewhere();
    let posed = scenes::posed(&scene);
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let view_dir = DVec3::new(-0.3, 0.4, -0.6).normalize();
        let show = |frame: &mut Frame| frame.background = frame.environment.clone();
        let colors = shoot(&scene, view_dir, projection, show);
        let camera = camera(&posed, projection, view_dir);
        for (i, color) in (0..).zip(colors) {
            let [x, y] = [i % SIDE, i / SIDE].map(|v| (f64::from(v) + 0.5) / f64::from(SIDE));
            let d = camera.eye_ray(x, 1.0 - y, posed.centre).d.normalize();
            let expected = (d * 0.5 + 0.5).extend(1.0);
            assert!(color.abs_diff_eq(expected, 0.03), "{projection:?} {i}: {color} {expected}");
        }
    }
}

/// The scene moves, and the environment does not.
#[test]
fn the_background_stands_still_when_the_scene_moves() {
    let scene = elsewhere();
    let view_dir = DVec3::NEG_Z;
    let show = |frame: &mut Frame| frame.background = frame.environment.clone();
    let still = shoot(&scene, view_dir, Projection::Perspective, show);
    let moved = shoot(&scene, view_dir, Projection::Perspective, |frame| {
        show(frame);
        let (sin, cos) = 1.3f64.sin_cos();
        let turn = DMat3::from_cols_array(&[cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos]);
        *frame = frame.clone().with_scene_motion(&DAffine3::from_mat3(turn));
    });
    for (a, b) in still.iter().zip(moved) {
        assert!(a.abs_diff_eq(b, 2e-3), "{a} {b}");
    }
}

/// A blended pane lets its share through, and a red thin one the red light of the environment.
#[test]
fn panes_tint_the_background() {
    let pane = |material: Material| {
        let mut scene = Scene::default();
        let large = DAffine3::from_scale(DVec3::splat(50.0));
        scenes::add(&mut scene, scenes::grid(1, 2), material, &[large]);
        let show = |frame: &mut Frame| {
            frame.background = Some(Environment::uniform(Rgb::new(0.8, 0.6, 0.4)));
            frame.environment = None;
            frame.sky = None;
            frame.ambient = Rgb::ZERO;
            frame.bounces = 0;
        };
        shoot(&scene, DVec3::NEG_Z, Projection::Perspective, show)[200]
    };
    let tint = Rgb::new(1.0, 0.25, 0.5);
    let glass =
        pane(Material { base_color: ColorInput::new(tint), transmission: ScalarInput::new(1.0), ..matte() });
    assert!(glass.abs_diff_eq(Rgba::new(0.8, 0.15, 0.2, 1.0), 1e-3), "{glass}");
    let blended = pane(Material {
        alpha: ScalarInput::new(0.25),
        alpha_mode: blinn::scene::AlphaMode::Blend,
        ..matte()
    });
    assert!(blended.abs_diff_eq(Rgba::new(0.6, 0.45, 0.3, 1.0), 1e-3), "{blended}");
}

/// A wall beside a point of the floor hides half of the sky. Only what it hides counts: with harmonics alone, both walls
/// would darken the floor alike.
#[test]
fn occlusion_takes_away_the_light_that_is_hidden() {
    let from_right = environment(|d| if d.x > 0.0 { Rgb::ONE } else { Rgb::ZERO });
    let floor_beside_wall = |wall_x: f64| {
        let mut scene = Scene::default();
        scenes::add(&mut scene, scenes::grid(1, 1), matte(), &[DAffine3::from_scale(DVec3::splat(20.0))]);
        let wall = DAffine3::from_translation(DVec3::X * wall_x) * DAffine3::from_scale(DVec3::splat(400.0));
        scenes::add(&mut scene, scenes::grid(1, 0), matte(), &[wall]);
        let colors = shoot(&scene, DVec3::NEG_Y, Projection::Orthographic, |frame| {
            let lighting = Lighting { environment: Some(from_right.clone()), ..Lighting::default() };
            let lit = lighting.resolve(frame.posed, &frame.camera);
            (frame.sky, frame.environment) = (lit.rig.sky, lit.rig.environment);
            frame.ambient_occlusion = Some(AmbientOcclusion { samples: 256, distance: f64::INFINITY });
        });
        let middle: Vec3 = colors.iter().map(|color| color.truncate()).sum::<Vec3>() / colors.len() as f32;
        middle.x
    };
    let [hidden, open] = [0.6, -0.6].map(floor_beside_wall);
    assert!(hidden < 0.03 && (open - 0.5).abs() < 0.03, "{hidden} {open}");
}

#[test]
fn backgrounds_and_occlusion_do_not_depend_on_threads_or_tiles() {
    let mut scene = Scene::default();
    scenes::add(&mut scene, scenes::ball(16, 8), matte(), &[DAffine3::IDENTITY]);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let camera = camera(&posed, Projection::Perspective, DVec3::NEG_Z);
    let picture = |threads: usize, tile: u32| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let environment = Some(directions());
            let lighting = Lighting {
                environment,
                environment_rotation: 0.7,
                environment_strength: 1.5,
                ..Lighting::default()
            };
            let lit = lighting.resolve(&posed, &camera);
            let frame = Frame::new(&posed, &accel, camera, &lit);
            let background = frame.environment.as_ref().map(|environment| environment.blurred(0.3));
            let ambient_occlusion = Some(AmbientOcclusion { samples: 8, distance: f64::INFINITY });
            let frame = Frame { background, ambient_occlusion, ..frame };
            let settings = RenderSettings { width: 24, height: 24, samples: 4, tile, ..Default::default() };
            render(&frame, &Phong::default(), &settings, &()).unwrap().colors
        })
    };
    let bits = |colors: Vec<Rgba>| -> Vec<[u32; 4]> {
        colors.iter().map(|color| color.to_array().map(f32::to_bits)).collect()
    };
    let expected = bits(picture(1, 16));
    assert!(bits(picture(3, 7)) == expected && bits(picture(8, 32)) == expected);
}

/// A file's environment lights its scene with the file's lights, unless a flag gives another or an I_a.
#[test]
fn the_environment_of_a_file_lights_its_scene() {
    let mut scene = elsewhere();
    scene.environment = Some(FileEnvironment::uniform(Rgb::splat(0.5)));
    let posed = scenes::posed(&scene);
    let camera = camera(&posed, Projection::Perspective, DVec3::NEG_Z);
    let resolve = |lighting: Lighting| lighting.resolve(&posed, &camera).rig;
    let mean = |lighting| resolve(lighting).environment.map(|environment| environment.mean().x);
    let rig = resolve(Lighting::default());
    assert!(rig.lights.is_empty(), "no three-point rig");
    assert_eq!(rig.sky.map(|sky| sky.ambient(DVec3::Y).x), Some(0.5));
    let twice = Lighting { environment_strength: 2.0, ..Lighting::default() };
    assert_eq!((mean(Lighting::default()), mean(twice)), (Some(0.5), Some(1.0)));
    let other = Some(Environment::uniform(Rgb::splat(0.25)));
    assert_eq!(mean(Lighting { environment: other, ..Lighting::default() }), Some(0.25));
    assert_eq!(mean(Lighting { ambient: Some(Rgb::splat(0.1)), ..Lighting::default() }), Some(0.1));
    assert_eq!(mean(Lighting { sets: Some(Vec::new()), ..Lighting::default() }), None);
}

/// A convex body before a small bright light: no noise, whatever the number of rays.
#[test]
fn open_surfaces_have_no_noise_under_ambient_occlusion() {
    // Twelve rows of the picture.
    let radius = 12.0 / 256.0 * PI;
    let spot = environment(|d| Rgb::splat(if d.y > radius.cos() { 50.0 } else { 0.2 }));
    let mut scene = Scene::default();
    scenes::add(&mut scene, scenes::grid(1, 1), matte(), &[DAffine3::from_scale(DVec3::splat(20.0))]);
    let colors = shoot(&scene, DVec3::NEG_Y, Projection::Orthographic, |frame| {
        let lighting = Lighting { environment: Some(spot.clone()), ..Lighting::default() };
        let lit = lighting.resolve(frame.posed, &frame.camera);
        (frame.sky, frame.environment) = (lit.rig.sky, lit.rig.environment);
        frame.ambient_occlusion = Some(AmbientOcclusion { samples: 4, distance: f64::INFINITY });
    });
    // The share of the light with its cosine: sin² of its radius.
    let expected = 0.2 + 49.8 * radius.sin().powi(2);
    for color in &colors {
        assert!((f64::from(color.x) / expected - 1.0).abs() < 0.02, "{color}: {expected}");
        assert_eq!(color.x.to_bits(), colors[0].x.to_bits());
    }
}
