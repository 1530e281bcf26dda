//! Metallic-roughness materials through the whole renderer, against the GGX microfacet surface that they
//! stand for. docs/scripts/ggx.py describes the set-up.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use blinn::geometry::Rgb;
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::linear_to_srgb;
use blinn::scene::{ColorInput, Lighting, Material, Mesh, PosedLight, Reflectance, Reflection, ScalarInput};
use glam::{DVec3, Vec3};

use crate::common::scenes;

const BASE: f64 = 0.8;
const SIDE: u32 = 256;

/// A ball of unit radius whose vertex normals are exact to a thousandth.
fn ball() -> Mesh {
    scenes::ball(256, 128)
}

fn physical(metallic: f64, roughness: f64) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::splat(BASE as f32)),
        reflectance: Reflectance::metallic_roughness(metallic as f32, roughness as f32),
        ..Default::default()
    }
}

/// The red channel of each pixel, seen from far away and lit at `angle` to the view direction.
fn render_red(mesh: &Mesh, material: Material, ambient: Rgb, angle: f64) -> Vec<f64> {
    let scene = scenes::of_material(mesh.clone(), material);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let (camera, _) = scenes::front_view().resolve(&posed, SIDE, SIDE).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame {
        // An irradiance of π: the lecture's units leave out the 1/π of Lambertian reflection.
        lights: vec![PosedLight::sun(-DVec3::new(angle.sin(), 0.0, angle.cos()), Rgb::ONE)],
        environment: None,
        ambient,
        shadows: false,
        ..Frame::new(&posed, &accel, camera, &lit)
    };
    let settings = RenderSettings { width: SIDE, height: SIDE, samples: 1, ..Default::default() };
    let pixels = render(&frame, &Phong::default(), &settings, &()).unwrap();
    pixels.colors.iter().map(|c| f64::from(c.x)).collect()
}

/// The radiance of the microfacet surface.
fn ggx(n: DVec3, metallic: f64, roughness: f64, angle: f64) -> f64 {
    let (v, l) = (DVec3::Z, DVec3::new(angle.sin(), 0.0, angle.cos()));
    let h = (v + l).normalize();
    let (nl, nv, nh, vh) = (n.dot(l), n.dot(v), n.dot(h), v.dot(h));
    if nl <= 0.0 {
        return 0.0;
    }
    let nl = nl.max(1e-6);
    let (a2, f0) = (roughness.powi(4), 0.04 + (BASE - 0.04) * metallic);
    let distribution = a2 / (PI * (nh * nh * (a2 - 1.0) + 1.0).powi(2));
    let masking = |c: f64| ((1.0 + a2 * (1.0 / (c * c) - 1.0)).sqrt() - 1.0) / 2.0;
    let fresnel = f0 + (1.0 - f0) * (1.0 - vh).powi(5);
    let specular = distribution * fresnel / (1.0 + masking(nl) + masking(nv)) / (4.0 * nl * nv);
    PI * (specular + BASE * (1.0 - metallic) * (1.0 - f0) / PI) * nl
}

fn encode_srgb(v: f64) -> f64 {
    255.0 * f64::from(linear_to_srgb(v.clamp(0.0, 1.0) as f32))
}

/// Mean |Δ| of 255 over the ball, four lights and `roughnesses` in tenths.
fn difference(metallic: f64, reflection: Reflection, roughnesses: RangeInclusive<u32>) -> f64 {
    let mesh = ball();
    let coordinate = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE) * 2.0 - 1.0;
    let normals: Vec<Option<DVec3>> = (0..SIDE * SIDE)
        .map(|i| (coordinate(i % SIDE), -coordinate(i / SIDE)))
        .map(|(x, y)| (x * x + y * y < 1.0).then(|| DVec3::new(x, y, (1.0 - x * x - y * y).sqrt())))
        .collect();
    let mut sum = 0.0;
    for (roughness, degrees) in
        roughnesses.clone().flat_map(|r| [0.0f64, 30.0, 60.0, 90.0].map(|d| (f64::from(r) / 10.0, d)))
    {
        let angle = degrees.to_radians();
        let material = Material { reflection, ..physical(metallic, roughness) };
        let picture = render_red(&mesh, material, Rgb::ZERO, angle);
        let covered = normals.iter().zip(&picture).filter_map(|(n, got)| n.map(|n| (n, *got)));
        let differences: Vec<f64> = covered
            .map(|(n, got)| (encode_srgb(got) - encode_srgb(ggx(n, metallic, roughness, angle))).abs())
            .collect();
        assert!(differences.len() > 51_000, "the ball fills the picture");
        sum += differences.iter().sum::<f64>() / differences.len() as f64;
    }
    sum / (4 * roughnesses.count()) as f64
}

/// docs/decisions/material-conversion.md has 0.35 and 12.1. Specular antialiasing
/// widens highlights narrower than a pixel (at roughness 0.1), and pixels at the silhouette may miss the
/// polygon, so there is a tolerance.
#[test]
fn the_mapping_has_the_documented_difference_to_ggx() {
    let difference = |metallic| difference(metallic, Reflection::None, 1..=10);
    let (dielectric, metal) = (difference(0.0), difference(1.0));
    println!("mean difference to GGX: dielectric {dielectric:.2}, metal {metal:.2}");
    assert!((dielectric - 0.35).abs() < 0.1, "{dielectric}");
    assert!((metal - 12.14).abs() < 0.4, "{metal}");
}

/// Surfaces that reflect their surroundings reflect lights in the same lobe. Rough metals are brighter than light that is reflected
/// once: `ggx` does not count what facets scatter on.
#[test]
fn highlights_of_reflecting_metals_are_those_of_ggx() {
    let smooth = difference(1.0, Reflection::Fresnel, 2..=4);
    let rough = difference(1.0, Reflection::Fresnel, 5..=10);
    println!("mean difference to GGX: smooth {smooth:.2}, rough {rough:.2}");
    assert!(smooth < 1.0, "{smooth}");
    assert!(rough < 18.0, "{rough}");
}

/// Zero and NaN normals are treated as missing: they have no curvature to widen a highlight by.
#[test]
fn normals_without_direction_are_ignored() {
    let flat = Mesh { normals: Vec::new(), ..ball() };
    let expected = render_red(&flat, physical(1.0, 0.3), Rgb::ZERO, 0.5);
    assert!(expected.iter().any(|&light| light > 1.0), "there is a highlight");
    for normal in [Vec3::ZERO, Vec3::NAN] {
        let mesh = Mesh { normals: vec![normal; flat.positions.len()], ..flat.clone() };
        assert_eq!(render_red(&mesh, physical(1.0, 0.3), Rgb::ZERO, 0.5), expected, "{normal}");
    }
}

/// Holds for rough metals too, which reflect mostly ambient light.
#[test]
fn specular_glossiness_and_metallic_roughness_agree_on_metals() {
    let mesh = ball();
    for roughness in [0.2, 0.6, 1.0] {
        let twin = Material {
            base_color: ColorInput::new(Rgb::ZERO),
            reflectance: Reflectance::SpecularGlossiness {
                specular: ColorInput::new(Rgb::splat(BASE as f32)),
                glossiness: ScalarInput::new(1.0 - roughness as f32),
            },
            ..Default::default()
        };
        let ambient = Rgb::splat(0.1);
        let expected = render_red(&mesh, physical(1.0, roughness), ambient, 0.5);
        let got = render_red(&mesh, twin, ambient, 0.5);
        assert!(expected.iter().any(|&light| light > 0.3), "{roughness}");
        let difference =
            got.iter().zip(&expected).map(|(a, b)| (a - b).abs() / (1e-3 + b)).fold(0.0, f64::max);
        assert!(difference < 1e-4, "roughness {roughness}: {difference}");
    }
}
