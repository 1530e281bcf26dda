//! Poses and models of a scene's objects for BOP.
//!
//! An object's pose is rigid: the axes and origin of its node, made orthonormal. The model is the object at the time of the
//! dataset in that frame, so that pose and model together give exactly what images show, also for deformed, scaled and
//! sheared objects.

use std::collections::{BTreeMap, HashMap};

use glam::{DAffine3, DMat3};

use super::bop::BopModel;
use super::pinhole::RigidPose;
use blinn_scene::{Instance, PosedScene};

/// An object with its pose.
#[derive(Clone, Debug)]
pub struct PosedObject {
    /// From the model to the world.
    pub pose: RigidPose,
    instances: Vec<u32>,
}

/// The objects of a scene that have instances, by their number.
pub fn posed_objects(posed: &PosedScene) -> BTreeMap<u32, PosedObject> {
    let mut objects: BTreeMap<u32, PosedObject> = BTreeMap::new();
    for (i, instance) in (0u32..).zip(&posed.scene.instances) {
        let object = objects
            .entry(instance.object)
            .or_insert_with(|| PosedObject { pose: rigid_pose(posed, instance), instances: Vec::new() });
        object.instances.push(i);
    }
    objects
}

/// The pose of the object of an instance.
fn rigid_pose(posed: &PosedScene, instance: &Instance) -> RigidPose {
    let node = posed.node_to_world(instance.node);
    let to_world = instance.trs.map_or(node, |trs| node * trs.affine());
    let DAffine3 { matrix3, translation } = to_world;
    RigidPose { rotation: orthonormal(&matrix3), translation }
}

/// The rotation with the first axis of `m` and the second in the plane of its first two; the identity if there is none.
fn orthonormal(m: &DMat3) -> DMat3 {
    let axes = || {
        let x = m.x_axis.try_normalize()?;
        let y = (m.y_axis - x * x.dot(m.y_axis)).try_normalize()?;
        Some(DMat3::from_cols(x, y, x.cross(y)))
    };
    axes().unwrap_or(DMat3::IDENTITY)
}

impl PosedObject {
    /// The object's triangles in the space of its pose.
    pub fn model(&self, posed: &PosedScene) -> BopModel {
        let to_model = self.pose.inverse();
        let mut model = BopModel::default();
        for &instance in &self.instances {
            let PosedScene { centre, instances, .. } = posed;
            let transform = &instances[instance as usize].transform;
            let positions = posed.positions(instance);
            // Only vertices of triangles.
            let mut indices: HashMap<u32, u32> = HashMap::new();
            for corners in &posed.mesh(instance).triangles {
                let mut add = |corner: u32| {
                    *indices.entry(corner).or_insert_with(|| {
                        let p = transform.point_f64(positions[corner as usize]) + *centre;
                        model.vertices.push(to_model.point(p));
                        model.vertices.len() as u32 - 1
                    })
                };
                let [a, b, c] = corners.map(&mut add);
                let triangle = if transform.flips_winding { [a, c, b] } else { [a, b, c] };
                model.triangles.push(triangle);
            }
        }
        model
    }
}
