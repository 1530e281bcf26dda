//! Lights that are seen in other surfaces: their highlights in mirrors, and behind rough glass.

use blinn::geometry::Rgb;
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    ColorInput, Lighting, Material, PosedLight, Projection, Reflectance, Reflection, ScalarInput, Scene, View,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::scenes;

fn physical(metallic: f32, roughness: f32) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::ONE),
        reflectance: Reflectance::metallic_roughness(metallic, roughness),
        reflection: Reflection::Fresnel,
        double_sided: true,
        ..Material::default()
    }
}

/// The red channel at the centre of a picture from `view_point` towards `view_dir`, lit by `lights` alone.
fn centre(scene: &Scene, view_point: DVec3, view_dir: DVec3, lights: Vec<PosedLight>) -> f32 {
    let posed = scenes::posed(scene);
    let accel = scenes::build(&posed);
    let view = View {
        view_point: Some(view_point),
        view_dir: Some(view_dir),
        projection: Some(Projection::Orthographic),
        view_width: Some(0.01),
        view_height: Some(0.01),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, 1, 1).unwrap();
    let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
    // Positions are relative to the scene's centre.
    let to_scene = DAffine3::from_translation(-posed.centre);
    let lights = lights.iter().map(|light| light.transformed(&to_scene, DVec3::ZERO)).collect();
    let frame =
        Frame { lights, ambient: Rgb::ZERO, environment: None, ..Frame::new(&posed, &accel, camera, &lit) };
    let settings = RenderSettings { width: 1, height: 1, samples: 16, ..Default::default() };
    render(&frame, &Phong::default(), &settings, &()).unwrap().colors[0].x
}

fn at(p: DVec3, scale: f64) -> DAffine3 {
    DAffine3::from_translation(p) * DAffine3::from_scale(DVec3::splat(scale))
}

/// A ball of brushed metal that is seen at normal incidence: directly, or in a mirror in the plane z = 0. Lights shine
/// along the view.
fn highlight(in_mirror: bool, lights: &[PosedLight]) -> f32 {
    let mut scene = Scene::default();
    scenes::add(&mut scene, scenes::ball(128, 64), physical(1.0, 0.2), &[at(DVec3::new(3.0, 0.0, 3.0), 2.0)]);
    if in_mirror {
        scenes::add(&mut scene, scenes::grid(1, 2), physical(1.0, 0.0), &[at(DVec3::ZERO, 3.0)]);
    }
    let z = if in_mirror { 2.0 } else { -2.0 };
    centre(&scene, DVec3::new(-2.0, 0.0, z), DVec3::new(1.0, 0.0, -z / 2.0), lights.to_vec())
}

/// In a mirror, the highlights of a point have a sum of at most 10, each in proportion to the irradiance of its light.
#[test]
fn highlights_in_mirrors_are_bounded_for_each_light() {
    let sun = PosedLight::sun(DVec3::new(1.0, 0.0, 1.0), Rgb::splat(10.0));
    assert!(highlight(false, &[sun]) > 500.0, "it is bright where the eye sees it");
    // Between the mirror and the ball, on the way of the ray.
    let light = PosedLight::point(Vec3::new(1.2, 0.0, 1.2), Rgb::splat(5.0));
    let one = highlight(true, std::slice::from_ref(&light));
    assert!((one - 10.0).abs() < 0.5, "{one}");
    let both = highlight(true, &[light.clone(), light.clone()]);
    assert!((both - 10.0).abs() < 0.5, "{both}");
    // As near to the ball, but seen by it at a cosine of 0.56.
    let beside = PosedLight::point(Vec3::new(1.374, 0.45, 1.374), Rgb::splat(5.0));
    let shared = highlight(true, &[light, beside]);
    assert!((shared - 6.5).abs() < 0.6, "{shared}");
}

/// A ball of glass between the eye and a sun.
fn sun_behind_glass(roughness: f32, wall: bool) -> f32 {
    let glass = Material { transmission: ScalarInput::new(1.0), ..physical(0.0, roughness) };
    let mut scene = Scene::default();
    let ball = blinn::scene::Mesh { is_body: true, ..scenes::ball(128, 64) };
    scenes::add(&mut scene, ball, glass, &[DAffine3::IDENTITY]);
    if wall {
        scenes::add(
            &mut scene,
            scenes::grid(1, 2),
            physical(0.0, 1.0),
            &[at(DVec3::new(0.0, 0.0, -3.0), 3.0)],
        );
    }
    let sun = PosedLight::sun(DVec3::Z, Rgb::ONE);
    centre(&scene, DVec3::new(0.0, 0.3, 5.0), DVec3::NEG_Z, vec![sun])
}

/// Rough glass refracts a light behind it to the eye. Lights have no size, and so no image behind smooth glass.
#[test]
fn rough_glass_shows_lights_behind_it() {
    let rough = sun_behind_glass(0.6, false);
    // Light that passes straight at 18° to the normal: D · η²/(η − 1)² / (n·v) of the first surface is 26, and the second one has at
    // most 10.
    assert!(rough > 20.0 && rough < 40.0, "{rough}");
    assert_eq!(sun_behind_glass(0.0, false), 0.0);
    assert_eq!(sun_behind_glass(0.6, true), 0.0, "a wall is in the way");
}
