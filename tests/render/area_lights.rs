//! Area lights, glowing surfaces and bounced light against closed forms.

use std::sync::Arc;

use blinn::geometry::Rgb;
use blinn::integrator::{Emitters, Frame};
use blinn::scene::{
    AreaLightShape, ColorInput, Lighting, Material, Mesh, MtlReflectance, PosedAreaLight, Projection,
    Reflectance, Reflection, Scene, View,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::scenes::{self, add, assert_near, grid};

fn matte(albedo: f32, emission: f32) -> Material {
    Material {
        base_color: ColorInput::new(Rgb::splat(albedo)),
        emission: ColorInput::new(Rgb::splat(emission)),
        reflectance: Reflectance::Mtl(MtlReflectance::default()),
        double_sided: true,
        ..Material::default()
    }
}

fn rough_metal() -> Material {
    Material {
        base_color: ColorInput::new(Rgb::splat(0.9)),
        reflectance: Reflectance::metallic_roughness(1.0, 0.5),
        reflection: Reflection::Fresnel,
        double_sided: true,
        ..Material::default()
    }
}

/// A horizontal square around the origin.
fn square(half: f32) -> Mesh {
    let mesh = grid(1, 1);
    Mesh { positions: mesh.positions.iter().map(|&p| p * half).collect(), ..mesh }
}

/// A view straight down of a small square around the origin.
fn down(width: f64) -> View {
    View {
        view_point: Some(DVec3::Y),
        view_dir: Some(DVec3::NEG_Y),
        view_up: Some(DVec3::NEG_Z),
        view_width: Some(width),
        view_height: Some(width),
        projection: Some(Projection::Orthographic),
        ..View::default()
    }
}

/// Lights of a picture besides the scene's own.
#[derive(Default)]
struct Lights {
    /// Positions are those of the world.
    area: Vec<PosedAreaLight>,
    indirect: u8,
    /// True if shadow rays find glowing surfaces.
    samples_emitters: bool,
}

/// The mean radiance of a picture of 16 × 16 pixels.
fn mean_radiance(scene: &Scene, view: &View, lights: &Lights, samples: u32) -> f64 {
    let posed = scenes::posed(scene);
    let accel = scenes::build(&posed);
    let (camera, _) = view.resolve(&posed, 16, 16).unwrap();
    let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
    let centred =
        |light: &PosedAreaLight| PosedAreaLight { centre: light.centre - posed.centre.as_vec3(), ..*light };
    let frame = Frame {
        area_lights: lights.area.iter().map(centred).collect(),
        indirect: lights.indirect,
        emitters: lights.samples_emitters.then(|| Arc::new(Emitters::new(&posed).expect("it glows"))),
        cull_back_faces: false,
        ..Frame::new(&posed, &accel, camera, &lit)
    };
    scenes::mean_radiance(&frame, samples)
}

fn facing_down(shape: AreaLightShape, size: [f32; 2], height: f64, radiance: f32) -> PosedAreaLight {
    let centre = DVec3::new(0.0, height, 0.0);
    PosedAreaLight::facing(shape, size, centre, DVec3::NEG_Y, Rgb::splat(radiance)).unwrap()
}

/// The form factor of a rectangle above a parallel element below its corner, at a height of 1.
fn corner_form_factor(a: f64, b: f64) -> f64 {
    let half = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    (half(a, b) + half(b, a)) / std::f64::consts::TAU
}

#[test]
fn rectangles_and_discs_light_a_plane_by_their_form_factors() {
    let scene = scenes::of_material(square(10.0), matte(0.7, 0.0));
    let radiance = 3.0;
    for (size, height) in [([1.0, 2.0], 1.0), ([0.2, 0.2], 2.0), ([4.0, 1.0], 0.5)] {
        let light = facing_down(AreaLightShape::Rect, size.map(|side: f64| side as f32), height, radiance);
        let [a, b] = size.map(|side| 0.5 * side / height);
        let expected = 0.7 * f64::from(radiance) * 4.0 * corner_form_factor(a, b);
        let lights = Lights { area: vec![light], ..Lights::default() };
        assert_near(mean_radiance(&scene, &down(0.01), &lights, 64), expected, 0.005, "rectangle");
    }
    for (diameter, height) in [(1.0, 1.0), (3.0, 1.0)] {
        let light = facing_down(AreaLightShape::Disk, [diameter as f32; 2], height, radiance);
        let r2 = 0.25 * diameter * diameter;
        let expected = 0.7 * f64::from(radiance) * r2 / (r2 + height * height);
        let lights = Lights { area: vec![light], ..Lights::default() };
        assert_near(mean_radiance(&scene, &down(0.01), &lights, 64), expected, 0.005, "disc");
    }
}

#[test]
fn area_lights_emit_on_one_side_and_cast_shadows() {
    let mut scene = scenes::of_material(square(10.0), matte(0.7, 0.0));
    let light = facing_down(AreaLightShape::Rect, [1.0, 1.0], 1.0, 1.0);
    let radiance = |scene: &Scene, light: PosedAreaLight| {
        mean_radiance(scene, &down(0.01), &Lights { area: vec![light], ..Lights::default() }, 16)
    };
    assert!(radiance(&scene, light) > 0.1);
    let upward = PosedAreaLight { normal: -light.normal, ..light };
    assert_eq!(radiance(&scene, upward), 0.0);
    // A sheet between the light and the floor, below which the camera cannot see it.
    add(&mut scene, square(2.0), matte(0.7, 0.0), &[DAffine3::from_translation(DVec3::new(3.0, 0.8, 0.0))]);
    let covered = radiance(&scene, PosedAreaLight { centre: light.centre + Vec3::X * 3.0, ..light });
    assert!(covered < 0.02, "{covered}");
}

/// A glowing square lights as an area light of the same radiance does, whether shadow rays or bounced rays find it.
#[test]
fn glowing_surfaces_light_like_area_lights() {
    let above = [DAffine3::from_translation(DVec3::new(0.0, 1.5, 0.0))];
    for material in [matte(0.6, 0.0), rough_metal()] {
        let plane = scenes::of_material(square(10.0), material);
        let light = facing_down(AreaLightShape::Rect, [2.0, 2.0], 1.5, 2.0);
        let by_light = Lights { area: vec![light], indirect: 1, ..Lights::default() };
        let expected = mean_radiance(&plane, &down(0.5), &by_light, 64);
        let mut glowing = plane;
        add(&mut glowing, square(1.0), matte(0.0, 2.0), &above);
        for samples_emitters in [false, true] {
            let lights = Lights { indirect: 1, samples_emitters, ..Lights::default() };
            let value = mean_radiance(&glowing, &down(0.5), &lights, 256);
            assert_near(value, expected, 0.01, if samples_emitters { "shadow rays" } else { "bounced rays" });
        }
    }
}

/// Points behind a diffuse bounce pick a few of many lights. The light is that of one light of the same power and shape.
#[test]
fn many_lights_light_like_their_sum() {
    let mut scene = scenes::of_material(square(10.0), matte(0.7, 0.0));
    // The ceiling is lit from below, and what it reflects lights the floor.
    add(&mut scene, square(10.0), matte(0.7, 0.0), &[DAffine3::from_translation(DVec3::new(0.0, 2.0, 0.0))]);
    let row = |count: u32, width: f32| -> Vec<PosedAreaLight> {
        let light = facing_down(AreaLightShape::Rect, [width, 1.0], 0.5, 3.0);
        let x = |i: u32| (i as f32 + 0.5 - 0.5 * count as f32) * width;
        (0..count)
            .map(|i| PosedAreaLight { normal: Vec3::Y, centre: light.centre + Vec3::X * x(i), ..light })
            .collect()
    };
    let radiance =
        |area| mean_radiance(&scene, &down(0.5), &Lights { area, indirect: 2, ..Lights::default() }, 256);
    assert_near(radiance(row(12, 0.5)), radiance(row(1, 6.0)), 0.01, "twelve lights");
}

/// Inside a closed room that glows by k_e and reflects the share ρ, the radiance is k_e / (1 − ρ) everywhere.
#[test]
fn a_furnace_has_its_analytic_radiance() {
    let scene = scenes::of_material(scenes::cube(1), matte(0.8, 0.2));
    let view = View {
        view_point: Some(DVec3::new(0.3, 0.2, 0.1)),
        view_dir: Some(DVec3::new(0.3, -0.5, -1.0)),
        projection: Some(Projection::Perspective),
        ..View::default()
    };
    for samples_emitters in [false, true] {
        let lights = Lights { indirect: 60, samples_emitters, ..Lights::default() };
        let value = mean_radiance(&scene, &view, &lights, 256);
        assert_near(value, 1.0, 0.01, if samples_emitters { "shadow rays" } else { "bounced rays" });
    }
    // Each bounce adds ρ times the last.
    for (bounces, expected) in [(1, 0.36), (2, 0.488)] {
        let lights = Lights { indirect: bounces, samples_emitters: false, ..Lights::default() };
        assert_near(mean_radiance(&scene, &view, &lights, 64), expected, 0.01, "bounces");
    }
}
