//! The objects of a scene, as `blinn info --json` lists them.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use blinn_core::geometry::Aabb;
use blinn_scene::PosedScene;

/// Number of triangles, bounds and materials of an object.
#[derive(Clone, Default)]
struct Part {
    triangles: u64,
    bounds: Aabb,
    materials: BTreeSet<u32>,
}

/// Lists the objects by their ids. Bounds are in world coordinates, of what is visible; null if there is nothing.
pub fn parts(posed: &PosedScene) -> Vec<Value> {
    let scene = posed.scene;
    let mut parts = vec![Part::default(); scene.objects.len()];
    for (i, instance) in scene.instances.iter().enumerate() {
        let object = (instance.object as usize).checked_sub(1);
        if let Some(part) = object.and_then(|object| parts.get_mut(object)) {
            part.add(posed, i as u32);
        }
    }
    let describe = |(i, (part, name)): (usize, (&Part, &String))| {
        let corner = |v: glam::DVec3| if part.bounds.is_empty() { Value::Null } else { json!(v.to_array()) };
        let materials = part.materials.iter().filter_map(|material| scene.materials.get(*material as usize));
        json!({
            "id": i + 1,
            "name": name,
            "triangles": part.triangles,
            "bounds": {"min": corner(part.bounds.min), "max": corner(part.bounds.max)},
            "materials": materials.map(|material| material.name.as_str()).collect::<Vec<_>>(),
        })
    };
    parts.iter().zip(&scene.objects).enumerate().map(describe).collect()
}

impl Part {
    fn add(&mut self, posed: &PosedScene, instance: u32) {
        let mesh = posed.mesh(instance);
        self.triangles += mesh.triangles.len() as u64;
        self.materials.insert(mesh.material);
        let posed_instance = &posed.instances[instance as usize];
        if !posed_instance.visible {
            return;
        }
        let positions = posed.positions(instance);
        for primitive in 0..mesh.primitive_count() {
            for corner in mesh.corners(primitive as u32) {
                let local = positions[corner as usize];
                self.bounds.extend(posed_instance.transform.point_f64(local) + posed.centre);
            }
        }
    }
}
