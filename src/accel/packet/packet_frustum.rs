//! The frustum of a ray packet from one origin: bounds on the directions of all rays and of each group.

use glam::Vec3;

use crate::packet::per_ray::{GROUPS_PER_QUAD, PerRay, QUADS_PER_PACKET, RAYS_PER_GROUP};
use blinn_core::geometry::EPSILON;
use blinn_core::simd::{Lanes, Simd};

/// The largest spread of a packet: of the tangents of its directions, and of its origins in radii of the BVH. Beyond it,
/// some group meets nearly every node.
pub(super) const MAX_SPREAD: f32 = 0.8;

/// 1/|d_major|, with d_major the component of a direction along the major axis, is between this and its reciprocal.
const MIN_INV_MAJOR: f32 = 1.0 / 65536.0;

/// Axis-aligned projection along a direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AxisProjection {
    /// The major axis, along which the direction is longest, and the two others, a and b.
    pub axes: [usize; 3],
    /// The sign of the direction along the major axis.
    pub sign: f32,
}

impl AxisProjection {
    pub fn along(direction: Vec3) -> AxisProjection {
        let abs = direction.abs();
        let major = if abs.x >= abs.y && abs.x >= abs.z { 0 } else { usize::from(abs.z > abs.y) + 1 };
        let sign = if direction[major] < 0.0 { -1.0 } else { 1.0 };
        AxisProjection { axes: [major, (major + 1) % 3, (major + 2) % 3], sign }
    }
}

/// The frustum of all rays and that of each group, as tangents: the components of directions along a and b divided by
/// the absolute value of that along the major axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PacketFrustum {
    pub projection: AxisProjection,
    /// Bounds of all tangents, rounding included: min and max along a, min and max along b.
    pub tangents: [f32; 4],
    /// The same for each group, by quad. Each group fills four lanes.
    pub group_tangents: [[[f32; RAYS_PER_GROUP]; 4]; QUADS_PER_PACKET],
    /// The least 1/|d_major|, with d_major the component of a direction along the major axis.
    pub min_inv_major: f32,
    /// The greatest 1/|d_major|.
    pub max_inv_major: f32,
    pub mean: Vec3,
}

impl PacketFrustum {
    /// Computes the bounds of `quads` quads of directions with known reciprocals; `mean` is about the mean
    /// direction. Returns false if the directions spread too far, differ too much in length or are not finite.
    #[inline(always)]
    pub fn bound<S: Simd>(
        &mut self,
        directions: &[PerRay<f32>; 3],
        reciprocals: &[PerRay<f32>; 3],
        quads: usize,
        mean: Vec3,
    ) -> bool {
        let projection = AxisProjection::along(mean);
        let [major, a, b] = projection.axes;
        let zero = S::F32x16::splat(0.0);
        let infinity = S::F32x16::splat(f32::INFINITY);
        let mut min_inv_major = infinity;
        let mut max_inv_major = zero;
        let mut min = [infinity; 2];
        let mut max = [zero - infinity; 2];
        let mut sum = zero;
        for q in 0..quads {
            let mut tangents_a = [zero; GROUPS_PER_QUAD];
            let mut tangents_b = [zero; GROUPS_PER_QUAD];
            for i in 0..GROUPS_PER_QUAD {
                let inv_major =
                    S::F32x16::load(&reciprocals[major].quads[q][i]) * S::F32x16::splat(projection.sign);
                min_inv_major = min_inv_major.min(inv_major);
                max_inv_major = max_inv_major.max(inv_major);
                tangents_a[i] = S::F32x16::load(&directions[a].quads[q][i]) * inv_major;
                tangents_b[i] = S::F32x16::load(&directions[b].quads[q][i]) * inv_major;
                sum = sum + (tangents_a[i] + tangents_b[i]);
            }
            let min_a = S::reduce_min_each(tangents_a);
            let min_b = S::reduce_min_each(tangents_b);
            let max_a = S::reduce_max_each(tangents_a);
            let max_b = S::reduce_max_each(tangents_b);
            let group_tangents = [
                min_a - tangent_error(min_a),
                max_a + tangent_error(max_a),
                min_b - tangent_error(min_b),
                max_b + tangent_error(max_b),
            ];
            for (tangents, to) in group_tangents.into_iter().zip(&mut self.group_tangents[q]) {
                tangents.store(to);
            }
            min = [min[0].min(group_tangents[0]), min[1].min(group_tangents[2])];
            max = [max[0].max(group_tangents[1]), max[1].max(group_tangents[3])];
        }
        let min_inv_major = min_inv_major.reduce_min();
        let max_inv_major = max_inv_major.reduce_max();
        // Minima and maxima may lose NaN; a sum does not.
        let finite = sum.le(infinity) == (1 << RAYS_PER_GROUP) - 1;
        let similar_lengths = min_inv_major > MIN_INV_MAJOR && max_inv_major < 1.0 / MIN_INV_MAJOR;
        let tangents = [min[0].reduce_min(), max[0].reduce_max(), min[1].reduce_min(), max[1].reduce_max()];
        let [a0, a1, b0, b1] = tangents;
        if !(finite && similar_lengths && a1 - a0 <= MAX_SPREAD && b1 - b0 <= MAX_SPREAD) {
            return false;
        }
        self.projection = projection;
        self.tangents = tangents;
        self.min_inv_major = min_inv_major;
        self.max_inv_major = max_inv_major;
        self.mean = mean;
        true
    }

    /// Returns an upper bound on the length of all directions.
    #[inline(always)]
    pub fn max_length(&self) -> f64 {
        let [a0, a1, b0, b1] = self.tangents.map(|x| f64::from(x * x));
        (1.0 + 1e-6) / f64::from(self.min_inv_major) * (1.0 + a0.max(a1) + b0.max(b1)).sqrt()
    }

    /// Returns for each axis the side by which rays enter boxes (0 for min, 1 for max), where all rays certainly agree
    /// on it.
    #[inline(always)]
    pub fn near_sides(&self) -> Option<[usize; 3]> {
        let [major, a, b] = self.projection.axes;
        let [a0, a1, b0, b1] = self.tangents;
        let mut sides = [0; 3];
        sides[major] = usize::from(self.projection.sign < 0.0);
        sides[a] = usize::from(a0 < 0.0);
        sides[b] = usize::from(b0 < 0.0);
        ((a0 > 0.0 || a1 < 0.0) && (b0 > 0.0 || b1 < 0.0)).then_some(sides)
    }
}

/// Returns an upper bound on the rounding error of a tangent.
#[inline(always)]
fn tangent_error<L: Lanes<RAYS_PER_GROUP>>(tangent: L) -> L {
    let margin = L::splat(8.0 * EPSILON);
    tangent.abs().mul_add(margin, margin)
}
