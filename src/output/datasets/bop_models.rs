//! Poses and models of a scene's objects for BOP.
//!
//! An object's pose is rigid: the axes and origin of its node, made orthonormal. The model is the object at the time of the
//! dataset in that frame, so that pose and model together give exactly what images show, also for deformed, scaled and
//! sheared objects.

use std::collections::{BTreeMap, HashMap};

use glam::{DAffine3, DMat3, DVec3, Vec3};

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

/// The objects of a scene that have triangles, by their number.
pub fn posed_objects(posed: &PosedScene) -> BTreeMap<u32, PosedObject> {
    let mut objects: BTreeMap<u32, PosedObject> = BTreeMap::new();
    for (i, instance) in (0u32..).zip(&posed.scene.instances) {
        if posed.mesh(i).triangles.is_empty() {
            continue;
        }
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

/// Significant bits of the transforms of models that scenes share: 32-bit numbers in files have rotations with errors of 2⁻²⁴.
const SHARED_BITS: i32 = 20;

impl PosedObject {
    /// The object's triangles in the space of its pose.
    pub fn model(&self, posed: &PosedScene) -> BopModel {
        let to_model = self.pose.inverse();
        self.placed(posed, |instance| {
            let transform = &posed.instances[instance as usize].transform;
            move |p| to_model.point(transform.point_f64(p) + posed.centre)
        })
    }

    /// The object's triangles in the space of its pose, the same wherever the object is: the transforms of its meshes in that space
    /// are rounded to a millionth.
    pub fn shared_model(&self, posed: &PosedScene) -> BopModel {
        let to_model = self.pose.inverse();
        self.placed(posed, |instance| {
            let DAffine3 { matrix3, translation } = posed.instances[instance as usize].transform.affine;
            let in_model = DAffine3 {
                matrix3: to_model.rotation * matrix3,
                translation: to_model.point(translation + posed.centre),
            };
            let radius = posed.positions(instance).iter().fold(0f32, |r, p| r.max(p.abs().max_element()));
            let in_model = rounded(&in_model, radius.into());
            move |p: Vec3| in_model.transform_point3(p.as_dvec3())
        })
    }

    /// The object's triangles, with the points of each instance where `place` has them.
    fn placed<P: Fn(Vec3) -> DVec3>(&self, posed: &PosedScene, place: impl Fn(u32) -> P) -> BopModel {
        let mut model = BopModel::default();
        for &instance in &self.instances {
            let flips_winding = posed.instances[instance as usize].transform.flips_winding;
            let positions = posed.positions(instance);
            let place = place(instance);
            // Only vertices of triangles.
            let mut indices: HashMap<u32, u32> = HashMap::new();
            for corners in &posed.mesh(instance).triangles {
                let mut add = |corner: u32| {
                    *indices.entry(corner).or_insert_with(|| {
                        model.vertices.push(place(positions[corner as usize]));
                        model.vertices.len() as u32 - 1
                    })
                };
                let [a, b, c] = corners.map(&mut add);
                let triangle = if flips_winding { [a, c, b] } else { [a, b, c] };
                model.triangles.push(triangle);
            }
        }
        model
    }
}

/// Rounds a transform of points whose coordinates are at most `radius`.
fn rounded(affine: &DAffine3, radius: f64) -> DAffine3 {
    let DAffine3 { matrix3, translation } = *affine;
    let largest = matrix3.to_cols_array().iter().fold(0f64, |largest, x| largest.max(x.abs()));
    // A power of two divides and multiplies without rounding. Sizes such as 1 are not next to where the step changes.
    let step = |size: f64| libm::exp2(libm::ceil(libm::log2(size) - 1e-3) - f64::from(SHARED_BITS));
    let round = |x: f64, step: f64| {
        let rounded = libm::rint(x / step) * step;
        if rounded.is_finite() { rounded + 0.0 } else { x }
    };
    let (step, step_of_translation) = (step(largest), step(largest * radius));
    DAffine3 {
        matrix3: DMat3::from_cols_array(&matrix3.to_cols_array().map(|x| round(x, step))),
        translation: DVec3::from_array(translation.to_array().map(|x| round(x, step_of_translation))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// The same node, turned and moved, and rounded as files hold it, has the same model.
    #[test]
    fn transforms_in_the_space_of_the_pose_are_the_same_everywhere() {
        let local = DAffine3::from_scale_rotation_translation(
            DVec3::new(0.5, 0.5, 2.0),
            DQuat::IDENTITY,
            DVec3::new(0.25, 0.0, -3.0),
        );
        let mut all = Vec::new();
        for i in 0..50 {
            let turn = DQuat::from_axis_angle(DVec3::new(1.0, f64::from(i), 2.0).normalize(), f64::from(i));
            let node = DAffine3::from_rotation_translation(turn, DVec3::new(0.1, 7.0, f64::from(i)));
            let in_file = |m: DMat3| DMat3::from_cols_array(&m.to_cols_array().map(|x| f64::from(x as f32)));
            let pose =
                RigidPose { rotation: orthonormal(&in_file(node.matrix3)), translation: node.translation };
            let world = DAffine3 { matrix3: in_file(node.matrix3), ..node } * local;
            let inverse = pose.inverse();
            let in_model = DAffine3 {
                matrix3: inverse.rotation * world.matrix3,
                translation: inverse.point(world.translation),
            };
            let rounded = rounded(&in_model, 1.0);
            assert!(rounded.abs_diff_eq(in_model, 4e-6), "{rounded:?} {in_model:?}");
            all.push(rounded);
        }
        assert!(all.iter().all(|rounded| *rounded == local), "{all:?}");
        // Values without a step stay.
        let none = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::new(1.0, 2.0, 1e300) };
        assert_eq!(rounded(&none, 1.0).translation, none.translation);
    }
}
