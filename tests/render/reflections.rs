//! Reflections of the environment: white furnaces and what stays matte.

use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    Clearcoat, ColorInput, Environment, Lighting, Material, Mesh, MtlReflectance, Reflectance, Reflection,
    ScalarInput, SkyIrradiance,
};

use crate::common::scenes;

const SIDE: u32 = 48;

fn ball() -> Mesh {
    scenes::ball(64, 32)
}

pub(crate) fn physical(base: f32, metallic: f32, roughness: f32) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::splat(base)),
        reflectance: Reflectance::metallic_roughness(metallic, roughness),
        reflection: Reflection::Fresnel,
        ..Default::default()
    }
}

/// The pixels of a ball that fills the picture, one sample each, under an environment and no lights.
fn picture(material: Material, environment: Option<Environment>) -> Vec<Rgba> {
    let scene = scenes::of_material(ball(), material);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let (camera, _) = scenes::front_view().resolve(&posed, SIDE, SIDE).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame {
        lights: Vec::new(),
        ambient: Rgb::ONE,
        sky: None::<SkyIrradiance>,
        environment,
        ..Frame::new(&posed, &accel, camera, &lit)
    };
    let settings = RenderSettings { width: SIDE, height: SIDE, samples: 1, ..Default::default() };
    render(&frame, &Phong::default(), &settings, &()).unwrap().colors
}

/// The least and the greatest radiance on the ball.
pub(crate) fn range(material: Material) -> (f32, f32) {
    let colors = picture(material, Some(Environment::uniform(Rgb::ONE)));
    let covered: Vec<f32> = colors.iter().filter(|c| c.w == 1.0).map(|c| c.x).collect();
    assert!(covered.len() > 1500, "{}", covered.len());
    covered.iter().fold((f32::MAX, f32::MIN), |(low, high), &x| (low.min(x), high.max(x)))
}

const ROUGHNESSES: [f32; 7] = [0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 1.0];

/// White furnace: a body that absorbs nothing is as bright as its surroundings.
#[test]
fn white_metal_vanishes_in_a_white_world() {
    for roughness in ROUGHNESSES {
        let (low, high) = range(physical(1.0, 1.0, roughness));
        assert!(low > 0.99 && high <= 1.0 + 1e-6, "roughness {roughness}: {low} to {high}");
    }
}

#[test]
fn white_plastic_never_exceeds_a_white_world() {
    for roughness in ROUGHNESSES {
        let (low, high) = range(physical(1.0, 0.0, roughness));
        assert!(low > 0.99 && high <= 1.0 + 1e-6, "roughness {roughness}: {low} to {high}");
        let coat =
            Clearcoat { factor: ScalarInput::new(1.0), roughness: ScalarInput::new(roughness), normal: None };
        let (low, high) = range(Material { clearcoat: coat, ..physical(1.0, 0.5, 0.5) });
        assert!(low > 0.98 && high <= 1.0 + 1e-6, "coat of roughness {roughness}: {low} to {high}");
    }
}

/// A black dielectric shows its specular layer alone: 4 % in the middle, much more at the rim.
#[test]
fn black_plastic_reflects_by_fresnel() {
    let (low, high) = range(physical(0.0, 0.0, 0.0));
    assert!((low - 0.04).abs() < 1e-3 && high > 0.2, "{low} to {high}");
    let coat = Clearcoat { factor: ScalarInput::new(0.5), roughness: ScalarInput::new(0.0), normal: None };
    let (low, _) = range(Material { clearcoat: coat, ..physical(0.0, 0.0, 0.0) });
    assert!((low - (0.02 + 0.98 * 0.04)).abs() < 1e-3, "{low}");
}

/// MTL's constant reflection has no Fresnel term, and does not reduce Kd.
#[test]
fn mtl_reflects_by_ks_from_illum_3_on() {
    let mtl = MtlReflectance {
        ambient: Some(ColorInput::new(Rgb::splat(0.2))),
        specular: ColorInput::new(Rgb::splat(0.3)),
        shininess: 1000.0,
        ior: 0.0,
    };
    let material = |reflection| Material {
        reflectance: Reflectance::Mtl(mtl),
        reflection,
        double_sided: true,
        ..Default::default()
    };
    let (low, high) = range(material(Reflection::Constant));
    // At the rim, light scattered between facets is reflected twice.
    assert!(low > 0.47 && (high - 0.5).abs() < 2e-3, "{low} to {high}");
    let (low, high) = range(material(Reflection::None));
    assert_eq!((low, high), (0.2, 0.2));
}

/// Matte surfaces have the same bits with and without an environment.
#[test]
fn matte_materials_reflect_nothing() {
    let white = || Some(Environment::uniform(Rgb::ONE));
    let matte = Material { reflection: Reflection::None, ..physical(0.5, 0.3, 0.3) };
    assert_eq!(picture(matte.clone(), white()), picture(matte, None));
    let mut dielectric = physical(0.5, 0.0, 0.3);
    if let Reflectance::MetallicRoughness { dielectric, .. } = &mut dielectric.reflectance {
        dielectric.specular = ScalarInput::new(0.0);
    }
    assert_eq!(picture(dielectric.clone(), white()), picture(dielectric, None));
}
