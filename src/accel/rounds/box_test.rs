//! Tests of a ray against bounds of points and lines, eight at a time. They may find too many, and miss none.

use glam::Vec3;

use super::round_bvh::{RoundNode, WIDTH};
use super::size::RoundSize;

/// Boxes are enlarged by this fraction of the coordinates of box and ray: more than rounding errs by.
pub(super) const SLACK: f32 = 4e-6;

/// The test of a ray against several boxes, each enlarged by the greatest radius in it, or against several points.
pub(super) struct BoxTest {
    o: [f32; 3],
    d: [f32; 3],
    inv: [f32; 3],
    /// Direction, and the same without signs, divided by the square of its length: t along the ray.
    t: [f32; 3],
    abs_t: [f32; 3],
    size: RoundSize,
    slack: f32,
    /// False for directions so long that `t` has subnormal products.
    has_exact_t: bool,
    /// False if no sphere contains the origin, as for cameras beside a cloud: the test for that is left out.
    may_contain_origin: bool,
}

impl BoxTest {
    /// `bounds` are those of all boxes.
    #[inline(always)]
    pub fn new(o: Vec3, d: Vec3, size: RoundSize, bounds: [Vec3; 2]) -> BoxTest {
        let dd = d.as_dvec3().length_squared();
        let t = (d.as_dvec3() / dd).as_vec3();
        // A component of 0 is as good as the smallest that has an inverse.
        let tiny = d.abs().max_element() * 1e-20;
        let inv = |d: f32| 1.0 / if d.abs() > tiny { d } else { tiny.copysign(d) };
        let extent = bounds[0].abs().max(bounds[1].abs()).max_element();
        let test = BoxTest {
            o: o.to_array(),
            d: d.to_array(),
            inv: d.to_array().map(inv),
            t: t.to_array(),
            abs_t: t.abs().to_array(),
            size,
            slack: SLACK * (o.abs().max_element() + extent),
            has_exact_t: t.abs().max_element() >= 1e6 * f32::MIN_POSITIVE,
            may_contain_origin: true,
        };
        let [low, high] = bounds.map(|corner| corner - o);
        let distance = low.max(-high).max(Vec3::ZERO).length();
        let greatest = test.radius_up_to((low * t).max(high * t).element_sum());
        BoxTest { may_contain_origin: !(greatest < 0.999 * distance - test.slack), ..test }
    }

    /// Returns the t where the ray enters each child's box; NaN where it misses.
    #[inline(always)]
    pub fn near(&self, node: &RoundNode) -> [f32; WIDTH] {
        if self.may_contain_origin { self.near_of::<true>(node) } else { self.near_of::<false>(node) }
    }

    /// [`BoxTest::near`] with or without the test if all spheres of a box contain the origin.
    #[inline(always)]
    fn near_of<const MAY_CONTAIN_ORIGIN: bool>(&self, node: &RoundNode) -> [f32; WIDTH] {
        let mut out = [f32::NAN; WIDTH];
        for i in 0..WIDTH {
            // The least and the greatest t of the box's points, and the square of their greatest distance.
            let (mut near_t, mut far_t, mut distance2) = (0.0, 0.0, 0.0);
            for axis in 0..3 {
                let (low, high) = (node.min[axis][i] - self.o[axis], node.max[axis][i] - self.o[axis]);
                let (middle, half) =
                    (0.5 * (low + high) * self.t[axis], 0.5 * (high - low) * self.abs_t[axis]);
                near_t += middle - half;
                far_t += middle + half;
                let reach = low.abs().max(high.abs());
                distance2 += reach * reach;
            }
            let t_slack = self.t_slack();
            let r = self.radius_up_to(far_t);
            let (mut near, mut far) = (0.0f32, f32::INFINITY);
            for axis in 0..3 {
                let a = (node.min[axis][i] - self.o[axis] - r) * self.inv[axis];
                let b = (node.max[axis][i] - self.o[axis] + r) * self.inv[axis];
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
            // All spheres that contain the origin are behind the ray: it has left their surfaces.
            let inside = self.size.up_to((near_t - t_slack).max(0.0)) * 0.999 - self.slack;
            let contain_origin = MAY_CONTAIN_ORIGIN && inside > 0.0 && distance2 < inside * inside;
            let hits = near <= far * 1.000_001 && node.min[0][i] <= node.max[0][i] && !contain_origin;
            out[i] = if hits { near * 0.999_999 } else { f32::NAN };
        }
        out
    }

    /// Returns a bit for each point whose sphere the ray may enter. Points are given by their coordinates.
    #[inline(always)]
    pub fn near_points(&self, p: &[[f32; WIDTH]; 3]) -> u32 {
        let mut near = [0; WIDTH];
        for i in 0..WIDTH {
            let v = [p[0][i] - self.o[0], p[1][i] - self.o[1], p[2][i] - self.o[2]];
            let t = v[0] * self.t[0] + v[1] * self.t[1] + v[2] * self.t[2];
            // From the point of the ray that is nearest to the centre.
            let w = [v[0] - self.d[0] * t, v[1] - self.d[1] * t, v[2] - self.d[2] * t];
            let w2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
            let r = self.radius_up_to(t);
            // Also true for NaN.
            near[i] = u32::from(!(w2 > r * r)) << i;
        }
        let near = near.iter().fold(0u32, |mask, bit| mask | bit);
        if self.has_exact_t { near } else { (1 << WIDTH) - 1 }
    }

    /// More than rounding of a t errs by.
    #[inline(always)]
    fn t_slack(&self) -> f32 {
        self.slack * self.abs_t[0].max(self.abs_t[1]).max(self.abs_t[2]) * 4.0
    }

    /// Returns a radius that is greater than any up to `t`, by more than rounding errs by.
    #[inline(always)]
    fn radius_up_to(&self, t: f32) -> f32 {
        self.size.up_to((t + self.t_slack()).max(0.0)) * 1.0001 + self.slack
    }
}
