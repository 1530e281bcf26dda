//! Instances of a mesh's BLAS in the world, and the transform of rays into their frames.

use glam::{DAffine3, DMat3, DVec3};

use crate::bvh::canonical_triangle::MAX_COORDINATE;
use crate::traverse::exact_triangle_test::{LocalRay, floor_power_of_two};

/// An instance of a BLAS.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlasInstance {
    /// Index of the instance in the scene.
    pub instance: u32,
    /// Index of the BLAS.
    pub blas: u32,
    pub transform: InstanceTransform,
}

/// The transform of rays from the world into an instance's local frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceTransform {
    /// The origin of the local frame in the world.
    pub origin: DVec3,
    pub to_local: DMat3,
}

impl InstanceTransform {
    /// Inverts `to_world`. Returns `None` for transforms that flatten, that shear or stretch so much that f32
    /// would lose precision, or that have huge numbers: such instances belong in a world BVH.
    pub fn new(to_world: DAffine3) -> Option<InstanceTransform> {
        let DAffine3 { matrix3, translation: origin } = to_world;
        let to_local = matrix3.inverse();
        let largest = |m: DMat3| abs_rows(m).into_iter().map(DVec3::max_element).fold(0.0, f64::max);
        let well_conditioned = condition_number(matrix3, to_local) < 1e4
            && largest(matrix3) < 1e12
            && largest(to_local) < 1e12
            && origin.abs().max_element() < f64::from(MAX_COORDINATE);
        // NaN fails the comparisons.
        well_conditioned.then_some(InstanceTransform { origin, to_local })
    }

    /// Transforms a ray into the local frame. All triangles of the mesh see the same local ray, so no cracks
    /// can open between them.
    pub fn ray(&self, ray: &LocalRay) -> LocalRay {
        let o = self.to_local * (ray.o - self.origin);
        let d = self.to_local * ray.d;
        let power = floor_power_of_two(d.abs().max_element().max(f64::MIN_POSITIVE));
        LocalRay {
            o,
            d: d / power,
            t_scale: ray.t_scale * power,
            inv_t_scale: ray.inv_t_scale / power,
            ..*ray
        }
    }
}

/// The absolute values of a matrix's rows.
fn abs_rows(m: DMat3) -> [DVec3; 3] {
    [m.row(0).abs(), m.row(1).abs(), m.row(2).abs()]
}

/// Condition number: how many times larger than its terms a sum of products with `to_local` and then with its
/// inverse `to_world` may become. 1 for scaling, up to 3 for rotations, more for shears.
pub(crate) fn condition_number(to_world: DMat3, to_local: DMat3) -> f64 {
    let row_sums = DVec3::from(abs_rows(to_local).map(|row| row.element_sum()));
    abs_rows(to_world).into_iter().map(|row| row.dot(row_sums)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene may have millions of instances.
    #[test]
    fn instances_are_small() {
        assert!(size_of::<BlasInstance>() <= 104);
    }
}
