//! The shadow terminator: facets of a smooth surface cast no shadows on it.

use blinn::accel::{Accel, AccelSettings};
use blinn::geometry::Rgb;
use blinn::integrator::{Aov, Frame, Phong, Stage};
use blinn::render::{RenderSettings, render, render_aovs};
use blinn::scene::{Lighting, Mesh, PoseSettings, UserLight, View, pose};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::scenes;

/// Radiance and vertex normal of each pixel of a sphere that a sun lights.
fn render_lit(mesh: Mesh, to_light: DVec3) -> Vec<(f32, Vec3)> {
    let scene = scenes::scene(mesh, &[DAffine3::IDENTITY]);
    let posed = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let view = View {
        view_point: Some(DVec3::new(0.0, 0.0, 6.0)),
        view_dir: Some(DVec3::NEG_Z),
        view_up: Some(DVec3::Y),
        view_height: Some(2.2),
        projection: Some(blinn::scene::Projection::Orthographic),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, 96, 96).unwrap();
    let sun = UserLight::Sun { direction: -to_light, intensity: Rgb::ONE };
    let lighting = Lighting { sets: Some(Vec::new()), user_lights: vec![sun], ..Lighting::default() };
    let lit = lighting.resolve(&posed, &camera);
    let mut frame = Frame::new(&posed, &accel, camera, &lit);
    frame.overrides.k_d = Some(Rgb::ONE);
    let settings = RenderSettings { width: 96, height: 96, samples: 1, ..Default::default() };
    let picture = render(&frame, &Phong { stage: Stage::Shadow }, &settings, &()).unwrap();
    let normals = render_aovs(&frame, &[Aov::VertexNormal], &settings, &()).unwrap().remove(0).values;
    let normals = normals.as_chunks::<3>().0.iter().map(|&n| Vec3::from(n));
    picture.colors.iter().map(|c| c.x).zip(normals).filter(|(_, n)| *n != Vec3::ZERO).collect()
}

/// A coarse sphere with the normals of a sphere, or without normals.
fn sphere(smooth: bool) -> Mesh {
    let mut mesh = scenes::sphere(4);
    mesh.positions.iter_mut().for_each(|p| *p = p.normalize());
    if smooth {
        mesh.normals = mesh.positions.clone();
    }
    mesh
}

#[test]
fn a_coarse_sphere_is_lit_as_a_smooth_one() {
    for degrees in [50.0f64, 70.0, 90.0] {
        let to_light = DVec3::new(degrees.to_radians().sin(), 0.3, degrees.to_radians().cos()).normalize();
        let pixels = render_lit(sphere(true), to_light);
        assert!(pixels.len() > 3000);
        let mut wrong = 0;
        let mut facing = 0;
        for (light, n) in pixels {
            let lambert = n.as_dvec3().dot(to_light);
            if lambert > 0.05 {
                facing += 1;
                wrong += usize::from((f64::from(light) - lambert).abs() > 1e-4);
            } else if lambert < -0.05 {
                assert_eq!(light, 0.0, "the far side is unlit");
            }
        }
        assert!(
            facing > 500 && wrong * 200 < facing,
            "{degrees} degrees: {wrong} of {facing} pixels wrongly shadowed"
        );
    }
}

#[test]
fn a_sphere_without_normals_is_lit_by_facet() {
    let to_light = DVec3::new(1.0, 0.2, 0.3).normalize();
    for (light, n) in render_lit(sphere(false), to_light) {
        let lambert = n.as_dvec3().dot(to_light);
        assert!((f64::from(light) - lambert.max(0.0)).abs() < 1e-4 || lambert.abs() < 1e-3);
    }
}
