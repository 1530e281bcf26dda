//! Translucent panes in front of a white wall, without reflections: what is seen through them, and how much light they transmit.

use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    AlphaMode, ColorInput, Lighting, Material, PosedLight, PosedLightKind, Projection, Reflectance,
    ScalarInput, Scene, View,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::scenes;

/// A pane of this material in front of a wall, seen head on, with a sun of this strength along the view. 9 ×
/// 9 pixels, some of whose centres are on the pane's diagonal.
fn render_through(pane: Material, wall: Reflectance, sun: f32) -> Vec<Rgba> {
    let mut scene = Scene::default();
    let wall = Material { reflectance: wall, double_sided: true, ..Material::default() };
    let behind = DAffine3::from_translation(DVec3::NEG_Z) * DAffine3::from_scale(DVec3::splat(4.0));
    scenes::add(&mut scene, scenes::grid(1, 2), wall, &[behind]);
    scenes::add(&mut scene, scenes::grid(1, 2), pane, &[DAffine3::IDENTITY]);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let view = View {
        view_point: Some(DVec3::new(0.0, 0.0, 3.0)),
        view_dir: Some(DVec3::NEG_Z),
        projection: Some(Projection::Orthographic),
        view_width: Some(1.5),
        view_height: Some(1.5),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, 9, 9).unwrap();
    let kind = PosedLightKind::Directional { direction: Vec3::NEG_Z };
    let sun = PosedLight { kind, intensity: Rgb::splat(sun), range: f32::INFINITY, radius: 0.0 };
    let no_lights = Lighting { sets: Some(Vec::new()), ..Lighting::default() };
    let lit = no_lights.resolve(&posed, &camera);
    let frame = Frame {
        lights: vec![sun],
        ambient: Rgb::ZERO,
        bounces: 0,
        ..Frame::new(&posed, &accel, camera, &lit)
    };
    let settings = RenderSettings { width: 9, height: 9, samples: 1, ..RenderSettings::default() };
    render(&frame, &Phong::default(), &settings, &()).unwrap().colors
}

/// A pane that transmits its base colour, with this metalness.
fn glass(metallic: f32) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::new(0.25, 0.5, 1.0)),
        reflectance: Reflectance::metallic_roughness(metallic, 1.0),
        transmission: ScalarInput::new(1.0),
        double_sided: true,
        ..Material::default()
    }
}

#[test]
fn a_blended_pane_is_hit_once_on_its_diagonal() {
    let pane = Material {
        base_color: ColorInput::new(Rgb::ZERO),
        alpha: ScalarInput::new(0.5),
        alpha_mode: AlphaMode::Blend,
        reflectance: Reflectance::Unlit,
        double_sided: true,
        ..Material::default()
    };
    let pixels = render_through(pane, Reflectance::Unlit, 0.0);
    assert!(pixels.iter().all(|p| p.truncate() == Vec3::splat(0.5)), "{pixels:?}");
}

/// Transmitted light is a share of the diffuse light, which metals do not have.
#[test]
fn metals_do_not_transmit_light() {
    let render = |metallic: f32, transmission: f32, sun: f32| {
        let transmission = ScalarInput::new(transmission);
        let pane = Material { transmission, ..glass(metallic) };
        render_through(pane, Reflectance::Unlit, sun)[40].truncate()
    };
    assert_eq!(render(1.0, 1.0, 1.0), render(1.0, 0.0, 1.0));
    assert_eq!(render(0.0, 1.0, 0.0), Vec3::new(0.25, 0.5, 1.0));
    assert_eq!(render(0.5, 1.0, 0.0), Vec3::new(0.125, 0.25, 0.5));
    assert_eq!(render(1.0, 1.0, 0.0), Vec3::ZERO);
}

/// KHR_materials_unlit overrides other extensions: only its colour counts.
#[test]
fn unlit_materials_do_not_transmit_light() {
    let lit = Reflectance::metallic_roughness(0.0, 1.0);
    // The pane is opaque, and the wall is in its shadow; with an alpha below 1, too.
    for alpha_mode in [AlphaMode::Opaque, AlphaMode::Blend] {
        let render = |transmission: f32| {
            let (alpha, transmission) = (ScalarInput::new(0.5), ScalarInput::new(transmission));
            let pane =
                Material { reflectance: Reflectance::Unlit, alpha, alpha_mode, transmission, ..glass(0.0) };
            render_through(pane, lit, 1.0)
        };
        assert_eq!(render(1.0), render(0.0));
    }
    let pane = Material { reflectance: Reflectance::Unlit, ..glass(0.0) };
    assert_eq!(render_through(pane, Reflectance::Unlit, 1.0)[40].truncate(), Vec3::new(0.25, 0.5, 1.0));
}

/// An alpha mask cuts holes; the rest transmits light as glass.
#[test]
fn masked_glass_transmits_light() {
    let render = |alpha_mode: AlphaMode| {
        let wall = Reflectance::metallic_roughness(0.0, 1.0);
        render_through(Material { alpha_mode, ..glass(0.0) }, wall, 1.0)
    };
    let opaque = render(AlphaMode::Opaque);
    assert!(opaque[40].min_element() > 0.0, "the wall is lit: {}", opaque[40]);
    assert_eq!(render(AlphaMode::Mask(0.5)), opaque);
}
