use glam::{DAffine3, UVec2};

use super::*;
use crate::integrator::gather::gather_points;
use crate::integrator::media::Medium;
use crate::integrator::path_rays::PathRays;
use crate::integrator::sample::Sample;
use crate::integrator::sampler::LowDiscrepancySampler;
use crate::integrator::scratch::Scratch;
use blinn_accel::{Accel, AccelSettings};
use blinn_core::geometry::HitId;
use blinn_scene::{
    ColorInput, Dielectric, Instance, Lighting, LocalTransform, Material, Mesh, Node, PoseSettings,
    Projection, Reflectance, Reflection, ScalarInput, Scene, View, pose,
};

#[test]
fn refraction_follows_snells_law() {
    let n = DVec3::Y;
    for (angle, eta) in [(0.0f64, 1.5), (0.7, 1.5), (1.2, 1.33), (0.4, 1.0 / 1.5), (0.5, 1.0)] {
        let v = DVec3::new(angle.sin(), angle.cos(), 0.0);
        let l = refract(v, n, angle.cos(), eta);
        assert!((l.length() - 1.0).abs() < 1e-12);
        assert!((-l.x * eta - angle.sin()).abs() < 1e-12 && l.y < 0.0, "{angle} {eta}: {l}");
    }
}

/// Two large parallel walls, the faces of a slab of clear glass.
fn slab() -> Scene {
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x * 100.0, y * 100.0, z);
    let mut mesh = Mesh { is_body: true, ..Mesh::default() };
    for z in [0.0, 1.0] {
        mesh.positions.extend([corner(-1.0, -1.0, z), corner(1.0, -1.0, z), corner(0.0, 1.0, z)]);
    }
    mesh.triangles = vec![[0, 2, 1], [3, 4, 5]];
    let glass = Material {
        base_color: ColorInput::new(Rgb::ONE),
        reflectance: Reflectance::MetallicRoughness {
            metallic: ScalarInput::new(0.0),
            roughness: ScalarInput::new(0.0),
            dielectric: Dielectric::default(),
        },
        transmission: ScalarInput::new(1.0),
        reflection: Reflection::Fresnel,
        double_sided: true,
        ..Material::default()
    };
    let local = LocalTransform::Matrix(DAffine3::IDENTITY);
    Scene {
        meshes: vec![mesh],
        nodes: vec![Node { local, visible: true, ..Node::default() }],
        instances: vec![Instance { node: 0, mesh: 0, object: 1, ..Instance::default() }],
        materials: vec![glass],
        ..Scene::default()
    }
}

/// The number of rays in each wave of 256 samples that look at the slab.
fn rays_by_wave(waves: u32) -> Vec<usize> {
    let scene = slab();
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let accel = Accel::build(&posed, &AccelSettings::default()).0;
    let view = View {
        view_point: Some(DVec3::new(0.1, 0.2, 5.0)),
        view_dir: Some(DVec3::new(0.3, 0.1, -1.0)),
        projection: Some(Projection::Perspective),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, 16, 16).unwrap();
    let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
    let frame = Frame { bounces: 80, ..Frame::new(&posed, &accel, camera, &lit) };
    let sample = |i: u32| Sample {
        x: 0.45 + 0.1 * f64::from(i % 16) / 16.0,
        y: 0.45 + 0.1 * f64::from(i / 16) / 16.0,
        pixel: UVec2::new(i % 16, i / 16),
        index: 0,
        footprint: [0.0; 2],
        aperture: glam::DVec2::ZERO,
    };
    let samples: Vec<Sample> = (0..256).map(sample).collect();
    let sampler = LowDiscrepancySampler { seed: 0, count: 1 };
    let Scratch { mut rays, mut hits, mut points, .. } = Scratch::default();
    let mut path_rays = PathRays::new(&frame, &samples, &mut rays, &mut hits);
    path_rays.states = PathStates::Eye(&frame, &samples);
    let mut compositor = Compositor::new(&frame, path_rays);
    let mut wave = Wave { samples: samples.clone(), ..Wave::default() };
    let mut counts = Vec::new();
    for depth in 0..waves {
        compositor.rays.intersect(&frame);
        let mut next = Wave::default();
        let stream = SampleStream { samples: &wave.samples, sampler: &sampler, wave: depth };
        let mut batch =
            gather_points(&frame, &mut compositor, &wave.samples, &mut points, true, |_, _| Rgb::ZERO);
        batch.soa.compute_view_dirs(frame.simd(), false);
        spawn_rays(&frame, &compositor, &mut batch, stream, &mut next);
        batch.recycle(&mut points);
        counts.push(next.rays.len());
        wave = next;
        compositor = Compositor::new(&frame, PathRays::secondary(&wave, &mut rays, &mut hits));
    }
    counts
}

/// Light that is reflected to and fro between the faces carries less and less, and rays become fewer.
#[test]
fn rays_inside_glass_become_fewer() {
    let counts = rays_by_wave(8);
    assert!(counts[0] > 256, "eye rays are reflected and refracted: {counts:?}");
    assert!(counts[4] < counts[0] / 8 && counts[7] < counts[0] / 32, "{counts:?}");
}

/// A liquid in its glass: elsewhere it refracts between the two, and in Blender's files as if it stood alone.
#[test]
fn bodies_of_blenders_files_refract_alone() {
    let crossing = |generator: &str| {
        let mut scene = slab();
        scene.source.generator = generator.into();
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let accel = Accel::build(&posed, &AccelSettings::default()).0;
        let (camera, _) = View::default().resolve(&posed, 16, 16).unwrap();
        let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
        let frame = Frame::new(&posed, &accel, camera, &lit);
        let around = Medium { body: 9, ior: 2.0, half_spread: 0.0, absorption: Rgb::ZERO };
        let inside = MediumStack::EMPTY.cross(around, true, Wavelength::White).behind;
        let id = HitId { instance: 0, triangle: 0 };
        [true, false].map(|entering| frame.cross(&inside, id, entering, Wavelength::White).eta)
    };
    assert_eq!(crossing(""), [0.75, 2.0 / 1.5]);
    assert_eq!(crossing("Khronos glTF Blender I/O v5.0.21"), [1.5, 1.0 / 1.5]);
}
