//! Build, rays and whole frames on a generated sphere. `cargo bench`; ratios within one run are
//! what counts, since machines drift.

use std::hint::black_box;

use blinn::accel::{Accel, BuildSettings, Cutout, HitBatch, RayBatch, Shared};
use blinn::geometry::HitId;
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{Instance, Lighting, Material, Mesh, Node, PoseSettings, PosedScene, Scene, View, pose};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;

/// Nothing is cut out of an opaque scene.
struct Opaque;

impl Cutout for Opaque {
    fn keeps(&self, _: HitId, _: Vec3, _: Vec3) -> bool {
        true
    }

    fn transmits(&self, _: HitId, _: Vec3, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }
}

/// A bumpy sphere of about `2·rings²` triangles.
fn sphere(rings: u32) -> Scene {
    let mut mesh = Mesh::default();
    let columns = rings;
    for i in 0..=rings {
        for j in 0..=columns {
            let (theta, phi) = (
                std::f32::consts::PI * i as f32 / rings as f32,
                std::f32::consts::TAU * j as f32 / columns as f32,
            );
            let r = 1.0 + 0.02 * ((9.0 * theta).sin() * (11.0 * phi).sin());
            mesh.positions.push(Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * r);
        }
    }
    for i in 0..rings {
        for j in 0..columns {
            let a = i * (columns + 1) + j;
            let b = a + columns + 1;
            mesh.triangles.push([a, a + 1, b + 1]);
            mesh.triangles.push([a, b + 1, b]);
        }
    }
    Scene {
        nodes: vec![Node { visible: true, ..Default::default() }],
        meshes: vec![mesh],
        materials: vec![Material { double_sided: true, ..Default::default() }],
        instances: vec![Instance { node: 0, mesh: 0, object: 1, placement: None, skin: None }],
        ..Default::default()
    }
}

fn frame<'a>(posed: &'a PosedScene<'a>, accel: &'a Accel, settings: &RenderSettings) -> Frame<'a> {
    let (camera, _) = View::default().resolve(posed, settings.width, settings.height).unwrap();
    let lit = Lighting::default().resolve(posed, &camera);
    Frame::new(posed, accel, camera, &lit)
}

fn trace(c: &mut Criterion) {
    let scene = sphere(200);
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let settings = RenderSettings { width: 320, height: 180, samples: 1, ..Default::default() };
    let mut group = c.benchmark_group("sphere 80k");
    group.sample_size(10);
    group.bench_function("build", |b| b.iter(|| Accel::build(black_box(&posed), &BuildSettings::default())));

    let (accel, _) = Accel::build(&posed, &BuildSettings::default());
    let frame = frame(&posed, &accel, &settings);
    let mut rays = RayBatch::default();
    for y in 0..settings.height {
        for x in 0..settings.width {
            let at = |v: u32, n: u32| (f64::from(v) + 0.5) / f64::from(n);
            let ray = frame.camera.eye_ray(at(x, settings.width), at(y, settings.height), posed.centre);
            rays.shared = Shared::Origin(ray.o);
            rays.push(ray.o, ray.d, RayBatch::from_near(0.0), f32::INFINITY);
        }
    }
    let mut hits = HitBatch::new();
    group.throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function("eye rays", |b| b.iter(|| accel.intersect(black_box(&rays), &Opaque, &mut hits)));
    group.bench_function("frame, three lights", |b| {
        b.iter(|| render(black_box(&frame), &Phong::default(), &settings, &()).unwrap())
    });
    group.finish();
}

criterion_group!(benches, trace);
criterion_main!(benches);
