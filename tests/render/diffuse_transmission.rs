//! Paper, leaves and wax: light from behind against closed forms, and against the same light in front of a matte surface.

use std::sync::Arc;

use blinn::geometry::Rgb;
use blinn::integrator::{Emitters, Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    ColorInput, Dielectric, DiffuseTransmission, Environment, Lighting, Material, PosedLight, PosedLightKind,
    Reflectance, ScalarInput, Scene, Volume,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::scenes::{self, add, cube, grid};
use crate::reflections::{physical, range};

const COLOR: Rgb = Rgb::new(1.0, 0.5, 0.25);

/// A surface of base colour 0.5 that transmits the share `factor` of its light, without microfacets.
fn paper(factor: f32) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::splat(0.5)),
        reflectance: Reflectance::MetallicRoughness {
            metallic: ScalarInput::new(0.0),
            roughness: ScalarInput::new(1.0),
            dielectric: Dielectric { specular: ScalarInput::new(0.0), ..Dielectric::default() },
        },
        diffuse_transmission: DiffuseTransmission {
            factor: ScalarInput::new(factor),
            color: ColorInput::new(COLOR),
        },
        double_sided: true,
        ..Material::default()
    }
}

fn sun(direction: Vec3) -> PosedLight {
    PosedLight {
        kind: PosedLightKind::Directional { direction: direction.normalize() },
        intensity: Rgb::new(2.0, 3.0, 4.0),
        range: f32::INFINITY,
        radius: 0.0,
    }
}

/// The mean colour of a picture along −z, perhaps of a scene lit by its glowing surfaces.
fn mean(scene: &Scene, lights: Vec<PosedLight>, change: impl Fn(&mut Frame), samples: u32) -> Rgb {
    let posed = scenes::posed(scene);
    let accel = scenes::build(&posed);
    let view = blinn::scene::View { view_width: Some(0.5), view_height: Some(0.5), ..scenes::front_view() };
    let (camera, _) = view.resolve(&posed, 8, 8).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let emitters = Emitters::new(&posed).map(Arc::new);
    let mut frame =
        Frame { lights, ambient: Rgb::ZERO, emitters, ..Frame::new(&posed, &accel, camera, &lit) };
    change(&mut frame);
    let settings = RenderSettings { width: 8, height: 8, samples, ..Default::default() };
    let colors = render(&frame, &Phong::default(), &settings, &()).unwrap().colors;
    colors.iter().map(|c| c.truncate()).sum::<Rgb>() / colors.len() as f32
}

fn assert_close(found: Rgb, expected: Rgb, tolerance: f32) {
    let error = (found - expected).abs().max_element();
    assert!(error <= tolerance * expected.max_element(), "{found} {expected}");
}

/// Lambert's law on both sides: a share of each light is scattered back, and the rest through.
#[test]
fn light_is_scattered_to_both_sides() {
    let scene = scenes::of_material(grid(1, 2), paper(0.25));
    for (z, k_d) in [(0.8, COLOR * 0.25), (-0.8, Rgb::splat(0.5 * 0.75))] {
        let light = sun(Vec3::new(0.6, 0.0, z));
        let expected = k_d * light.intensity * 0.8;
        assert_close(mean(&scene, vec![light], |_| (), 1), expected, 1e-5);
    }
}

/// Metals transmit nothing, and glass transmits what it does not refract.
#[test]
fn metal_and_glass_transmit_less() {
    let light = || vec![sun(Vec3::Z)];
    let mut metal = paper(1.0);
    metal.reflectance = physical(1.0, 1.0, 0.5).reflectance;
    assert_eq!(mean(&scenes::of_material(grid(1, 2), metal), light(), |_| (), 1), Rgb::ZERO);
    let glass = Material { transmission: ScalarInput::new(0.75), ..paper(1.0) };
    let found = mean(&scenes::of_material(grid(1, 2), glass), light(), |_| (), 1);
    assert_close(found, COLOR * 0.25 * sun(Vec3::Z).intensity, 1e-5);
}

/// Soft shadows, glowing surfaces and bounced light arrive from behind as they do in front of a matte surface.
#[test]
fn a_back_side_is_lit_as_a_matte_surface() {
    let scene = |is_behind: bool| {
        let mut material = if is_behind { paper(1.0) } else { paper(0.0) };
        if !is_behind {
            material.base_color = ColorInput::new(COLOR);
        }
        let mut scene = scenes::of_material(grid(1, 2), material);
        let side = if is_behind { -1.0 } else { 1.0 };
        let glow = Material { emission: ColorInput::new(Rgb::new(3.0, 2.0, 1.0)), ..paper(0.0) };
        // Beside the view, and an occluder.
        let place = |x: f64| {
            DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.3),
                glam::DQuat::from_rotation_y(0.5 * x * side),
                DVec3::new(x, 0.1, side),
            )
        };
        add(&mut scene, grid(1, 2), glow, &[place(0.9)]);
        add(&mut scene, grid(1, 2), paper(0.0), &[place(-0.9)]);
        (scene, side as f32)
    };
    let radiance = |is_behind: bool, indirect: u8| {
        let (scene, side) = scene(is_behind);
        let light = PosedLight { radius: 0.2, ..sun(Vec3::new(0.7, 0.0, -side)) };
        mean(&scene, vec![light], |frame| frame.indirect = indirect, 256)
    };
    // With one bounce, so that the other side of the paper sends nothing back.
    for indirect in [0, 1] {
        let [front, back] = [false, true].map(|is_behind| radiance(is_behind, indirect));
        assert!(front.min_element() > 0.1, "{front}");
        assert_close(back, front, 0.02);
    }
}

/// Light passes a body straight, attenuated along its way, and is scattered where it leaves to the viewer.
#[test]
fn wax_attenuates_light_along_its_way() {
    let volume =
        Volume { thickness: 1.0, attenuation_color: Rgb::new(0.8, 0.5, 0.2), attenuation_distance: 1.5 };
    let mut scene = scenes::of_material(cube(2), Material { volume: Some(volume), ..paper(0.5) });
    scene.meshes[0].is_body = true;
    let light = sun(Vec3::new(0.0, 0.0, 1.0));
    let attenuation = Rgb::from_array(volume.attenuation_color.to_array().map(|color| color.powf(2.0 / 1.5)));
    let expected = COLOR * 0.5 * attenuation * light.intensity;
    assert_close(mean(&scene, vec![light.clone()], |_| (), 1), expected, 1e-4);
    // A thin box is opaque to light that passes straight.
    scene.meshes[0].is_body = false;
    assert_eq!(mean(&scene, vec![light], |_| (), 1), Rgb::ZERO);
    // Ambient light has passed the thickness.
    scene.meshes[0].is_body = true;
    let ambient = Rgb::new(0.3, 0.2, 0.1);
    let thickness = volume.attenuation_color.to_array().map(|color| color.powf(1.0 / 1.5));
    let expected = ambient * (Rgb::splat(0.25) + COLOR * 0.5 * Rgb::from_array(thickness));
    assert_close(mean(&scene, Vec::new(), |frame| frame.ambient = ambient, 1), expected, 1e-4);
}

/// A surface that is white on both sides is as bright as its surroundings, also below microfacets.
#[test]
fn white_paper_vanishes_in_a_white_world() {
    for (factor, roughness) in [(0.3, 0.2), (1.0, 0.6)] {
        let white =
            DiffuseTransmission { factor: ScalarInput::new(factor), ..DiffuseTransmission::default() };
        let (low, high) = range(Material { diffuse_transmission: white, ..physical(1.0, 0.0, roughness) });
        assert!(low > 0.99 && high <= 1.0 + 1e-5, "{factor}: {low} to {high}");
    }
}

/// Without paths beyond, paper in a white world is white with traced light as well.
#[test]
fn bounced_light_comes_from_both_sides() {
    let white = DiffuseTransmission { factor: ScalarInput::new(0.5), ..DiffuseTransmission::default() };
    let mut material = Material { diffuse_transmission: white, ..paper(0.0) };
    material.base_color = ColorInput::new(Rgb::ONE);
    let scene = scenes::of_material(grid(1, 2), material);
    let found = mean(
        &scene,
        Vec::new(),
        |frame| {
            frame.indirect = 1;
            frame.environment = Some(Environment::uniform(Rgb::ONE));
            frame.ambient = Rgb::ONE;
        },
        4,
    );
    assert_close(found, Rgb::ONE, 1e-4);
}
