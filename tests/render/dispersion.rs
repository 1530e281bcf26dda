//! Dispersion: a wedge of glass sends each colour in a direction of its own.

use blinn::geometry::Rgb;
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{Environment, Lighting, Material, Mesh, ScalarInput, View, Volume};
use glam::Vec3;

use crate::common::scenes::{self, cube};
use crate::reflections::physical;

/// Angle between the front and the back of the wedge.
const ANGLE: f32 = 30.0 * std::f32::consts::PI / 180.0;

/// A closed wedge whose front faces +z. Its back has the normal (sin, 0, −cos).
fn wedge() -> Mesh {
    let mesh = cube(1);
    let lean = |p: &Vec3| if p.z < 0.0 { Vec3::new(p.x, p.y, p.x * ANGLE.tan() - 1.0) } else { *p };
    Mesh { positions: mesh.positions.iter().map(lean).collect(), is_body: true, ..mesh }
}

/// The light that comes through the wedge along z, of an environment that is white in a ring 2 degrees wide around the direction in
/// which light of index `ior` leaves the back.
fn seen_through(dispersion: f32, ior: f32) -> Rgb {
    let glass = Material {
        transmission: ScalarInput::new(1.0),
        volume: Some(Volume {
            thickness: 1.0,
            attenuation_color: Rgb::ONE,
            attenuation_distance: f32::INFINITY,
        }),
        dispersion,
        ..physical(1.0, 0.0, 0.0)
    };
    let n = Vec3::new(ANGLE.sin(), 0.0, -ANGLE.cos());
    let leaves = (ior * ANGLE.sin()).asin();
    let environment = Environment::from_function(1024, 1, |d| {
        let angle = d.dot(n).clamp(-1.0, 1.0).acos();
        Rgb::splat(f32::from((angle - leaves).abs() < 1f32.to_radians()))
    });
    let scene = scenes::of_material(wedge(), glass);
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let view = View { view_width: Some(0.5), view_height: Some(0.5), ..scenes::front_view() };
    let (camera, _) = view.resolve(&posed, 4, 4).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame {
        lights: Vec::new(),
        ambient: Rgb::ZERO,
        environment: Some(environment),
        ..Frame::new(&posed, &accel, camera, &lit)
    };
    let settings = RenderSettings { width: 4, height: 4, samples: 1, ..Default::default() };
    let colors = render(&frame, &Phong::default(), &settings, &()).unwrap().colors;
    colors.iter().map(|c| c.truncate()).sum::<Rgb>() / colors.len() as f32
}

/// Transmittance of the front, met along its normal, and of the back.
fn transmittance(ior: f32) -> f32 {
    let front = 1.0 - ((ior - 1.0) / (ior + 1.0)).powi(2);
    let (cos_i, cos_t) = (ANGLE.cos(), (1.0 - (ior * ANGLE.sin()).powi(2)).sqrt());
    let s = ((ior * cos_i - cos_t) / (ior * cos_i + cos_t)).powi(2);
    let p = ((ior * cos_t - cos_i) / (ior * cos_t + cos_i)).powi(2);
    front * (1.0 - 0.5 * (s + p))
}

#[test]
fn each_colour_leaves_by_its_own_index() {
    // n − 1 = 0.5 at an Abbe number of 4: 1.4375, 1.5 and 1.5625.
    for (channel, ior) in [1.4375, 1.5, 1.5625].into_iter().enumerate() {
        let found = seen_through(5.0, ior);
        let expected = transmittance(ior);
        for i in 0..3 {
            let expected = if i == channel { expected } else { 0.0 };
            assert!((found[i] - expected).abs() < 0.01, "index {ior}: {found} {expected}");
        }
    }
}

#[test]
fn glass_without_dispersion_keeps_colours_together() {
    let found = seen_through(0.0, 1.5);
    assert!((found - Rgb::splat(transmittance(1.5))).abs().max_element() < 0.01, "{found}");
    assert!(seen_through(0.0, 1.5625).max_element() < 0.01);
}
