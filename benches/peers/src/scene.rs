//! Converts generated scenes to blinn's.

use blinn::scene::{Instance, LocalTransform, Material, Mesh, Node, PoseSettings, PosedScene, Scene, pose};
use glam::{DAffine3, DVec3, Vec3};

/// Converts the meshes and instances. Lights and camera are taken from the generated scene.
pub fn convert(from: &blinn_scenes::GeneratedScene) -> Scene {
    let mesh = |m: &blinn_scenes::GeneratedMesh| Mesh {
        name: m.name.clone(),
        positions: m.positions.iter().map(|&p| Vec3::from(p)).collect(),
        triangles: m.triangles.clone(),
        ..Mesh::default()
    };
    let node = |i: &blinn_scenes::GeneratedInstance| {
        let [x, y, z, o] = i.columns.map(|c| DVec3::from(c.map(f64::from)));
        Node {
            local: LocalTransform::Matrix(DAffine3::from_cols(x, y, z, o)),
            visible: true,
            ..Node::default()
        }
    };
    let instance = |(i, from): (usize, &blinn_scenes::GeneratedInstance)| Instance {
        node: i as u32,
        mesh: from.mesh as u32,
        object: 1 + i as u32,
        ..Instance::default()
    };
    Scene {
        name: from.name.clone(),
        nodes: from.instances.iter().map(node).collect(),
        meshes: from.meshes.iter().map(mesh).collect(),
        materials: vec![Material { double_sided: true, ..Material::default() }],
        instances: from.instances.iter().enumerate().map(instance).collect(),
        ..Scene::default()
    }
}

/// Poses the scene around the origin, so that both engines get the same coordinates.
pub fn posed(scene: &Scene) -> Result<PosedScene<'_>, String> {
    let settings = PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() };
    pose(scene, &settings).map_err(|e| e.to_string())
}
