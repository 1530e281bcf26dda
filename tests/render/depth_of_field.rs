//! Depth of field of a thin lens against closed forms.

use std::f64::consts::PI;

use blinn::geometry::Rgb;
use blinn::integrator::{Aov, Frame, Phong};
use blinn::render::{Denoise, PixelFilter, RenderSettings, render, render_aovs};
use blinn::scene::{
    Camera, ColorInput, Focus, Lighting, Material, Mesh, MtlReflectance, Projection, Reflectance, Scene, View,
};
use glam::{DVec3, Vec3};

use crate::common::scenes::{self, grid};

const SIDE: u32 = 24;

/// A glowing half-plane x > 0, perpendicular to the view direction −Z, at a distance from the origin.
fn half_plane(distance: f32) -> Scene {
    let mesh = grid(1, 2);
    let far = 50.0;
    let place = |p: &Vec3| Vec3::new(far * (p.x + 1.0), far * p.y, -distance);
    let glow = Material {
        base_color: ColorInput::new(Rgb::ZERO),
        emission: ColorInput::new(Rgb::ONE),
        reflectance: Reflectance::Mtl(MtlReflectance::default()),
        double_sided: true,
        ..Material::default()
    };
    scenes::of_material(Mesh { positions: mesh.positions.iter().map(place).collect(), ..mesh }, glow)
}

/// A view from the origin along −Z, 0.4 wide at distance 1, or everywhere.
fn view(projection: Projection, lens: View) -> View {
    View {
        view_point: Some(DVec3::ZERO),
        view_dir: Some(DVec3::NEG_Z),
        view_width: Some(0.4),
        view_height: Some(0.4),
        projection: Some(projection),
        ..lens
    }
}

fn lens(aperture_radius: f64, focus: Focus) -> View {
    View { aperture_radius: Some(aperture_radius), focus: Some(focus), ..View::default() }
}

fn camera(scene: &Scene, view: &View) -> Camera {
    view.resolve(&scenes::posed(scene), SIDE, SIDE).unwrap().0
}

/// The mean radiance of each column of a picture.
fn columns(scene: &Scene, view: &View, samples: u32) -> Vec<f64> {
    let pixels = picture(scene, view, samples, Denoise::Off);
    let column = |x: u32| (0..SIDE).map(|y| pixels[(y * SIDE + x) as usize]).sum::<f64>();
    (0..SIDE).map(|x| column(x) / f64::from(SIDE)).collect()
}

/// The radiance of each pixel of a picture.
fn picture(scene: &Scene, view: &View, samples: u32, denoise: Denoise) -> Vec<f64> {
    let posed = scenes::posed(scene);
    let accel = scenes::build(&posed);
    let (camera, _) = view.resolve(&posed, SIDE, SIDE).unwrap();
    let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    let filter = PixelFilter::Box;
    let settings =
        RenderSettings { width: SIDE, height: SIDE, samples, filter, denoise, ..Default::default() };
    let pixels = render(&frame, &Phong::default(), &settings, &()).unwrap().colors;
    pixels.iter().map(|color| f64::from(color.x)).collect()
}

/// Share of a disc of radius 1 to the right of x = −`t`.
fn share_of_disc(t: f64) -> f64 {
    let t = t.clamp(-1.0, 1.0);
    0.5 + (t.asin() + t * (1.0 - t * t).sqrt()) / PI
}

/// The mean over the pixels of a column of the half-plane's share of the aperture.
fn expected(column: u32, x_at: impl Fn(f64) -> f64, blur: f64) -> f64 {
    const N: u32 = 64;
    let at = |i: u32| (f64::from(column) + (f64::from(i) + 0.5) / f64::from(N)) / f64::from(SIDE) - 0.5;
    (0..N).map(|i| share_of_disc(x_at(0.4 * at(i)) / blur)).sum::<f64>() / f64::from(N)
}

#[test]
fn edges_blur_by_the_circle_of_confusion() {
    let radius = 0.2;
    for (projection, distance, focus) in [
        (Projection::Perspective, 2.0, 4.0),
        (Projection::Perspective, 3.0, 1.5),
        (Projection::Orthographic, 2.0, 3.0),
    ] {
        let scene = half_plane(distance as f32);
        let view = view(projection, lens(radius, Focus::Distance(focus)));
        let blur = radius * (1.0 - distance / focus).abs();
        let x_at = |x: f64| if projection == Projection::Perspective { x * distance } else { x };
        for (x, value) in columns(&scene, &view, 256).into_iter().enumerate() {
            let expected = expected(x as u32, x_at, blur);
            assert!(
                (value - expected).abs() < 0.01,
                "{projection:?} {focus}: column {x}: {value} {expected}"
            );
        }
    }
}

#[test]
fn what_is_in_focus_is_as_sharp_as_without_a_lens() {
    let scene = half_plane(2.0);
    let sharp = columns(&scene, &view(Projection::Perspective, View::default()), 16);
    for focus in [Focus::Distance(2.0), Focus::Point(DVec3::new(3.0, 1.0, -2.0))] {
        let blurred = columns(&scene, &view(Projection::Perspective, lens(0.3, focus)), 16);
        for (x, (a, b)) in sharp.iter().zip(&blurred).enumerate() {
            assert!((a - b).abs() < 0.02, "column {x}: {a} {b}");
        }
    }
    // 0 is a pinhole.
    let pinhole = view(Projection::Perspective, lens(0.0, Focus::Distance(1.0)));
    assert_eq!(sharp, columns(&scene, &pinhole, 16));
    assert_eq!(camera(&scene, &pinhole).lens, None);
}

#[test]
fn without_a_focus_the_point_to_look_at_is_sharp() {
    let scene = half_plane(2.0);
    let aperture = View { aperture_radius: Some(0.1), ..View::default() };
    let look_at = View { look_at: Some(DVec3::new(0.0, 0.0, -7.0)), view_dir: None, ..aperture.clone() };
    let look_at = View { view_dir: None, ..view(Projection::Perspective, look_at) };
    assert_eq!(camera(&scene, &look_at).lens.unwrap().focus_distance, 7.0);
    let centre = camera(&scene, &view(Projection::Perspective, aperture.clone())).lens.unwrap();
    assert_eq!(centre.focus_distance, 2.0);
    let behind = View { focus: Some(Focus::Point(DVec3::Z)), ..aperture };
    let error =
        view(Projection::Perspective, behind).resolve(&scenes::posed(&scene), SIDE, SIDE).unwrap_err();
    assert_eq!(
        error.to_string(),
        "nothing in front of the camera is in focus: the distance is -1; set `focus`"
    );
}

#[test]
fn what_is_out_of_focus_is_smoothed_and_what_is_in_focus_is_not() {
    let scene = half_plane(2.0);
    let error = |focus: f64, denoise: Denoise| {
        let view = view(Projection::Perspective, lens(0.2, Focus::Distance(focus)));
        let exact = picture(&scene, &view, 1024, Denoise::Off);
        let pixels = picture(&scene, &view, 4, denoise);
        pixels.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / f64::from(SIDE)
    };
    let (noisy, smooth) = (error(4.0, Denoise::Off), error(4.0, Denoise::Auto));
    assert!(smooth < 0.6 * noisy, "{smooth} {noisy}");
    assert_eq!(error(2.0, Denoise::Off), error(2.0, Denoise::Auto));
}

#[test]
fn layers_are_sharp() {
    let scene = half_plane(2.0);
    let view = view(Projection::Perspective, lens(0.3, Focus::Distance(9.0)));
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let (camera, _) = view.resolve(&posed, SIDE, SIDE).unwrap();
    let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
    let settings = RenderSettings { width: SIDE, height: SIDE, ..Default::default() };
    let depth = |camera: Camera| {
        let frame = Frame::new(&posed, &accel, camera, &lit);
        render_aovs(&frame, &[Aov::Depth], &settings, &()).unwrap().remove(0).values
    };
    assert_eq!(depth(camera), depth(Camera { lens: None, ..camera }));
}
