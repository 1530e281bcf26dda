//! Lights with a radius, ambient occlusion and the ground, against known answers.

mod ambient_occlusion;
mod ground;

use std::f64::consts::PI;

use blinn::accel::Accel;
use blinn::geometry::{Rgb, Rgba};
use blinn::integrator::{AmbientOcclusion, Frame, Phong, Stage};
use blinn::render::{RenderSettings, render};
use blinn::scene::{
    Ground, Material, Mesh, PosedLight, PosedLightKind, PosedScene, Projection, ResolvedLighting, Rig, Scene,
    SpotCone, SurfaceClass, View,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::scenes::{self, add, cube, grid, material};

const ALL: Option<AmbientOcclusion> = Some(AmbientOcclusion { samples: 64, distance: f64::INFINITY });

/// A picture of a scene without lights of its own.
#[derive(Clone)]
struct Shot {
    view: View,
    size: (u32, u32),
    samples: u32,
    lights: Vec<PosedLight>,
    ambient: f32,
    shadows: bool,
    ambient_occlusion: Option<AmbientOcclusion>,
    ground: Option<Ground>,
    stage: Stage,
}

impl Shot {
    fn of(view: View) -> Shot {
        Shot {
            view,
            size: (32, 32),
            samples: 1,
            lights: Vec::new(),
            ambient: 0.0,
            shadows: true,
            ambient_occlusion: None,
            ground: None,
            stage: Stage::Phong,
        }
    }

    fn frame<'a>(&self, posed: &'a PosedScene, accel: &'a Accel) -> Frame<'a> {
        let rig = Rig {
            lights: self.lights.clone(),
            area_lights: Vec::new(),
            ambient: Rgb::splat(self.ambient),
            ..Rig::default()
        };
        let lit = ResolvedLighting {
            rig,
            sets: Vec::new(),
            uses_file_lights: false,
            uses_file_environment: false,
            assumes_blender_world: false,
            description: String::new(),
        };
        let (camera, _) = self.view.resolve(posed, self.size.0, self.size.1).unwrap();
        let mut frame = Frame {
            shadows: self.shadows,
            ambient_occlusion: self.ambient_occlusion,
            ground: self.ground,
            ..Frame::new(posed, accel, camera, &lit)
        };
        frame.overrides.k_d = Some(Rgb::ONE);
        frame.overrides.k_s = Some(Rgb::ZERO);
        frame
    }

    fn settings(&self) -> RenderSettings {
        RenderSettings {
            width: self.size.0,
            height: self.size.1,
            samples: self.samples,
            filter: blinn::render::PixelFilter::Box,
            ..Default::default()
        }
    }

    /// Renders; rows from the top. Light positions are relative to the scene's centre.
    fn render(&self, scene: &Scene) -> Vec<Rgba> {
        let posed = scenes::posed(scene);
        let accel = scenes::build(&posed);
        let phong = Phong { stage: self.stage };
        render(&self.frame(&posed, &accel), &phong, &self.settings(), &()).unwrap().colors
    }
}

fn white() -> Material {
    material(SurfaceClass::Opaque, true)
}

fn scale(mesh: Mesh, by: f32) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|&p| p * by).collect(), ..mesh }
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// A horizontal floor at y = 0 around the origin.
fn floor(half: f32) -> Scene {
    scenes::scene(scale(grid(1, 1), half), &[DAffine3::IDENTITY])
}

/// A view straight down from `from`, `width` wide.
fn down(from: DVec3, width: f64, size: (u32, u32)) -> View {
    View {
        view_point: Some(from),
        view_dir: Some(DVec3::NEG_Y),
        view_up: Some(DVec3::NEG_Z),
        view_width: Some(width),
        view_height: Some(width * f64::from(size.1) / f64::from(size.0)),
        projection: Some(Projection::Orthographic),
        ..View::default()
    }
}

fn point_light(position: Vec3, radius: f32) -> PosedLight {
    PosedLight { radius, ..PosedLight::point(position, Rgb::splat(20.0)) }
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut n, mut sum) = (0.0, 0.0);
    for v in values {
        (n, sum) = (n + 1.0, sum + v);
    }
    assert!(n > 0.0);
    sum / n
}

/// The share of a disc's area beyond a chord at `s` radii from its centre.
fn segment(s: f64) -> f64 {
    let s = s.clamp(-1.0, 1.0);
    (s.acos() - s * (1.0 - s * s).sqrt()) / PI
}

const SIZE: (u32, u32) = (64, 16);

const EDGE_HEIGHT: f64 = 1.0;

const LIGHT_HEIGHT: f64 = 3.0;

const WIDTH: f64 = 1.6;

/// The share of a light of `radius` visible from each pixel of a floor, past the edge of a sheet at height 1
/// that covers x < 0. The light is at height 3 above the edge; or a sun is there.
fn penumbra(radius: f32, samples: u32, sun: bool) -> Vec<f64> {
    let mut scene = floor(50.0);
    add(&mut scene, scale(grid(1, 1), 50.0), white(), &[at(-50.0, EDGE_HEIGHT, 0.0)]);
    let light = if sun {
        PosedLight { radius, ..PosedLight::sun(DVec3::NEG_Y, Rgb::ONE) }
    } else {
        let centre = scenes::posed(&scene).centre;
        point_light((DVec3::new(0.0, LIGHT_HEIGHT, 0.0) - centre).as_vec3(), radius)
    };
    let view = down(DVec3::new(0.0, 0.5, 0.0), WIDTH, SIZE);
    let shot = Shot { size: SIZE, samples, lights: vec![light], ..Shot::of(view) };
    let all = Shot { shadows: false, ..shot.clone() }.render(&scene);
    shot.render(&scene).iter().zip(all).map(|(lit, all)| f64::from(lit.x / all.x)).collect()
}

fn x_of(column: usize) -> f64 {
    WIDTH * ((column as f64 + 0.5) / f64::from(SIZE.0) - 0.5)
}

/// The visible share by geometry: the disc faces the point, and the plane through the point and the edge cuts it along
/// a chord.
fn penumbra_at(x: f64, radius: f64) -> f64 {
    let l = DVec3::new(-x, LIGHT_HEIGHT, 0.0).normalize();
    let across = DVec3::new(l.y, -l.x, 0.0);
    let to_edge = DVec3::new(-x, EDGE_HEIGHT, 0.0);
    // Extends `to_edge` to the plane of the disc.
    let r = x.hypot(LIGHT_HEIGHT);
    let chord = (to_edge * (r / to_edge.dot(l)) - l * r).dot(across);
    segment(chord / radius)
}

#[test]
fn the_penumbra_of_an_edge_is_that_of_a_disc_light() {
    let radius = 0.3;
    for (samples, most) in [(1, 0.45), (4, 0.13), (16, 0.05), (64, 0.02), (256, 0.01)] {
        let measured = penumbra(radius as f32, samples, false);
        let mut square = Vec::new();
        for (i, &v) in measured.iter().enumerate() {
            let expected = penumbra_at(x_of(i % 64), radius);
            square.push((v - expected).powi(2));
            // Pixels have a width.
            let (a, b) = (x_of(i % 64) - 0.5 * WIDTH / 64.0, x_of(i % 64) + 0.5 * WIDTH / 64.0);
            if penumbra_at(a, radius) == penumbra_at(b, radius) {
                assert_eq!(v, expected, "{samples} samples, pixel {i}");
            }
        }
        let inside = (0..64).filter(|&i| (0.001..0.999).contains(&penumbra_at(x_of(i), radius))).count();
        let error = (square.iter().sum::<f64>() / (inside * 16) as f64).sqrt();
        println!("{samples} samples: error {error:.4} in a penumbra of {inside} pixels");
        assert!(error < most, "{samples} samples: {error}");
    }
    // The penumbra's width: 2 R h/(H − h) for a light at height H and an edge at height h.
    let measured = penumbra(radius as f32, 64, false);
    let partly = (0..64).filter(|&i| measured[i] > 0.0 && measured[i] < 1.0).count() as f64 * WIDTH / 64.0;
    let width = 2.0 * radius * EDGE_HEIGHT / (LIGHT_HEIGHT - EDGE_HEIGHT);
    assert!((partly - width).abs() < 3.0 * WIDTH / 64.0, "{partly} for {width}");
}

#[test]
fn a_sun_is_a_disc_at_a_distance_of_one_metre() {
    // The edge is at a height of 1 m, so the penumbra extends by the radius to both sides.
    let radius = 0.25;
    for (i, column) in penumbra(radius as f32, 256, true).chunks(64).next().unwrap().iter().enumerate() {
        let expected = segment(-x_of(i) / radius);
        assert!((column - expected).abs() < 0.04, "{i}: {column} for {expected}");
    }
}

#[test]
fn a_tiny_radius_equals_a_point_light() {
    let sharp = penumbra(0.0, 4, false);
    assert!(sharp.contains(&0.0) && sharp.contains(&1.0));
    let nearly = penumbra(1e-6, 4, false);
    let other = sharp.iter().zip(&nearly).filter(|(a, b)| a != b).count();
    // Only the column of pixels at the edge.
    assert!(other <= 16, "{other} pixels differ");
}

#[test]
fn a_light_wider_than_its_housing_does_not_leak() {
    let kinds = |position: Vec3| {
        let cone = SpotCone::new(1.0, 1.5);
        [
            PosedLightKind::Point { position },
            PosedLightKind::Spot { position, direction: Vec3::NEG_Y, cone, world_to_cone: None },
        ]
    };
    let view = down(DVec3::new(0.0, 0.5, 0.0), 8.0, (32, 32));
    for housed in [true, false] {
        let mut scene = floor(20.0);
        let transform = at(0.0, 3.0, 0.0);
        if housed {
            add(&mut scene, scale(cube(1), 0.25), white(), &[transform]);
        }
        let centre = scenes::posed(&scene).centre.as_vec3();
        for kind in kinds(Vec3::new(0.01, 3.02, -0.03) - centre) {
            let light = PosedLight { kind: kind.clone(), ..point_light(Vec3::ZERO, 1.5) };
            let lit = Shot { samples: 16, lights: vec![light], ..Shot::of(view.clone()) }.render(&scene);
            let bright = lit.iter().filter(|c| c.x > 0.0).count();
            assert_eq!(bright, if housed { 0 } else { 1024 }, "{kind:?}");
        }
    }
}

#[test]
fn faces_away_from_a_wide_light_stay_dark() {
    let mut mesh = scenes::sphere(8);
    mesh.positions.iter_mut().for_each(|p| *p = p.normalize());
    mesh.normals = mesh.positions.clone();
    let scene = scenes::scene(mesh, &[DAffine3::IDENTITY]);
    let view = View { view_point: Some(DVec3::Z * 5.0), look_at: Some(DVec3::ZERO), ..View::default() };
    for light in [
        point_light(Vec3::new(0.0, 0.0, -3.0), 1.0),
        PosedLight { radius: 0.8, ..PosedLight::sun(DVec3::Z, Rgb::ONE) },
    ] {
        let shot = Shot { samples: 16, lights: vec![light], ..Shot::of(view.clone()) };
        assert!(shot.render(&scene).iter().all(|c| c.x == 0.0));
    }
}
