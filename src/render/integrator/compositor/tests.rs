use glam::{DAffine3, DVec2, DVec3, UVec2, Vec3};

use super::*;
use crate::integrator::phong::Phong;
use crate::integrator::{Integrator, LowDiscrepancySampler, Sample, Scratch};
use blinn_accel::{Accel, AccelSettings};
use blinn_scene::{
    ColorInput, Instance, Lighting, LocalTransform, Material, Mesh, Node, PoseSettings, Projection,
    Reflectance, Reflection, Scene, View, pose,
};

/// A polished blue floor, whose normals lean towards a red wall.
fn floor_and_wall() -> Scene {
    let material = |color: Rgb, metallic: f32, roughness: f32| Material {
        base_color: ColorInput::new(color),
        reflectance: Reflectance::metallic_roughness(metallic, roughness),
        reflection: Reflection::Fresnel,
        double_sided: true,
        ..Material::default()
    };
    let mesh = |corners: [[f32; 3]; 4], normal: Vec3, material: u32| Mesh {
        positions: corners.map(Vec3::from).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: vec![normal.normalize(); 4],
        material,
        ..Mesh::default()
    };
    let floor = [[-50.0, -50.0, 0.0], [50.0, -50.0, 0.0], [50.0, 10.0, 0.0], [-50.0, 10.0, 0.0]];
    let wall = [[-500.0, 10.0, -1.0], [500.0, 10.0, -1.0], [500.0, 10.0, 900.0], [-500.0, 10.0, 900.0]];
    let local = LocalTransform::Matrix(DAffine3::IDENTITY);
    let node = Node { local, visible: true, ..Node::default() };
    Scene {
        meshes: vec![mesh(floor, Vec3::new(0.0, 0.03, 1.0), 0), mesh(wall, Vec3::NEG_Y, 1)],
        nodes: vec![node],
        instances: (0..2).map(|mesh| Instance { node: 0, mesh, object: 1, ..Instance::default() }).collect(),
        materials: vec![material(Rgb::Z, 1.0, 0.12), material(Rgb::X, 0.0, 1.0)],
        ..Scene::default()
    }
}

/// Seen at a slope, many of the rays of the floor's lobe end below it.
#[test]
fn a_polished_surface_shows_what_its_rays_find_and_never_itself() {
    let scene = floor_and_wall();
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let accel = Accel::build(&posed, &AccelSettings::default()).0;
    let view = View {
        view_point: Some(DVec3::new(0.0, -5.0, 0.25)),
        view_dir: Some(DVec3::new(0.0, 1.0, -0.05)),
        view_up: Some(DVec3::Z),
        projection: Some(Projection::Perspective),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, 1, 1).unwrap();
    let lit = Lighting { sets: Some(Vec::new()), ..Lighting::default() }.resolve(&posed, &camera);
    let frame = Frame { bounces: 1, indirect: 1, ..Frame::new(&posed, &accel, camera, &lit) };
    let sample = |index: u32| Sample {
        x: 0.5,
        y: 0.5,
        pixel: UVec2::ZERO,
        index,
        footprint: [0.0; 2],
        aperture: DVec2::ZERO,
    };
    let samples: Vec<Sample> = (0..64).map(sample).collect();
    let sampler = LowDiscrepancySampler { seed: 0, count: 64 };
    let mut parts = vec![SampleParts::default(); samples.len()];
    let split = LightSplit::All;
    Phong::default().render_parts(&frame, &samples, &sampler, &mut Scratch::default(), split, &mut parts);
    let (mut unknown, mut red) = (0, 0);
    for SampleParts { surface, .. } in &parts {
        assert_eq!(surface.albedo, Rgb::Z, "the camera sees the floor");
        let seen = surface.seen;
        assert!(seen.albedo.z < 1e-5, "the floor does not show itself: {surface:?}");
        assert!(seen.known.abs() < 1e-5 || (seen.known - 1.0).abs() < 1e-5, "{surface:?}");
        unknown += u32::from(seen.known < 0.5);
        // A few rays of the lobe's tail go back past the camera.
        red += u32::from(seen.albedo.x > 0.99);
    }
    assert!(unknown > 0 && red > 0, "{unknown} of 64 rays end below the floor, {red} at the wall");
}
