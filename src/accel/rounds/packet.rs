//! Sixteen rays that visit the BVH of points or lines together.

use glam::Vec3;

use super::box_test::SLACK;
use super::round_bvh::{RoundNode, WIDTH};
use super::size::RoundSize;
use blinn_core::simd::{Lanes, Simd};

/// Rays of a packet.
pub(super) const RAYS: usize = 16;

/// Directions whose largest component is between these make packets; the squares of others may not be normal numbers.
const DIRECTIONS: [f32; 2] = [1e-10, 1e10];
/// Coordinates between these make packets.
const COORDINATES: [f32; 2] = [1e-9, 1e15];
/// Rays in directions that differ by more than this part of them soon go separate ways.
const MAX_SPREAD: f32 = 0.5;
/// Spheres up to this share of the bounds may contain the origins: packets do not skip nodes for that.
const MAX_RADIUS_OVER_EXTENT: f32 = 0.1;

/// The rays of a packet. Tests against bounds may find too many, and miss none.
pub(super) struct RoundPacket<S: Simd> {
    o: [S::F32x16; 3],
    d: [S::F32x16; 3],
    inv: [S::F32x16; 3],
    /// Direction divided by the square of its length: t along the ray.
    t: [S::F32x16; 3],
    inv_length: S::F32x16,
    /// The greatest t at which a hit has an effect; −1 for rays that are done.
    pub limit: [f32; RAYS],
    size: RoundSize,
    slack: f32,
    t_slack: f32,
    /// Least and greatest of all rays.
    o_range: Ranges,
    inv_range: Ranges,
    t_range: Ranges,
}

/// Least and greatest values on the three axes.
type Ranges = [[f32; 2]; 3];

/// The children of a node that rays of a packet may enter.
pub(super) struct NearChildren {
    /// A bit for each of them.
    pub mask: u32,
    /// Not more than the t where any ray enters.
    pub near: [f32; WIDTH],
    /// The greatest radius in each.
    pub radius: [f32; WIDTH],
}

impl<S: Simd> RoundPacket<S> {
    /// `bounds` are those of all boxes. `None` if the rays are better traced one by one.
    #[inline(always)]
    pub fn new(
        origins: &[Vec3; RAYS],
        directions: &[Vec3; RAYS],
        limit: [f32; RAYS],
        size: RoundSize,
        bounds: [Vec3; 2],
    ) -> Option<RoundPacket<S>> {
        let (o, d) = (S::deinterleave3(origins), S::deinterleave3(directions));
        let length = greatest::<S>(&d);
        let extent = bounds[0].abs().max(bounds[1].abs()).max_element() + greatest::<S>(&o).reduce_max();
        let [shortest, longest] = [length.reduce_min(), length.reduce_max()];
        let in_range = shortest >= DIRECTIONS[0]
            && longest <= DIRECTIONS[1]
            && (COORDINATES[0]..=COORDINATES[1]).contains(&extent)
            && are_in_range::<S>(&o)
            && are_in_range::<S>(&d);
        if !in_range {
            return None;
        }
        let one = S::F32x16::splat(1.0);
        let dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let inv_dd = one / dd;
        let t = [d[0] * inv_dd, d[1] * inv_dd, d[2] * inv_dd];
        // A component of 0 is as good as the smallest that has an inverse.
        let tiny = length * S::F32x16::splat(1e-20);
        let mut inv = d;
        for d in &mut inv {
            *d = one / d.select(tiny.lt(d.abs()), tiny.xor_sign(*d));
        }
        let slack = SLACK * extent;
        let greatest_t = greatest::<S>(&t);
        let most_t = greatest_t.reduce_max();
        let t_range = ranges::<S>(&t);
        if spread(&t_range) > MAX_SPREAD * most_t {
            return None;
        }
        let t_slack = slack * most_t * 4.0;
        let packet = RoundPacket {
            o,
            d,
            inv,
            t,
            // No less than the inverse of the length.
            inv_length: greatest_t * S::F32x16::splat(1.7321),
            limit,
            size,
            slack,
            t_slack,
            o_range: ranges::<S>(&o),
            inv_range: ranges::<S>(&inv),
            t_range,
        };
        packet.has_small_spheres(bounds).then_some(packet)
    }

    /// Returns the greatest limit of all rays.
    #[inline(always)]
    pub fn greatest_limit(&self) -> f32 {
        S::F32x16::load(&self.limit).reduce_max()
    }

    /// Returns true if no sphere contains the origin of a ray, or if spheres are small beside the bounds of all.
    #[inline(always)]
    fn has_small_spheres(&self, bounds: [Vec3; 2]) -> bool {
        let (mut far_t, mut distance2) = (0.0, 0.0);
        for axis in 0..3 {
            let [low, high] =
                [bounds[0][axis] - self.o_range[axis][1], bounds[1][axis] - self.o_range[axis][0]];
            let [least, most] = self.t_range[axis];
            far_t += (low * least).max(low * most).max(high * least).max(high * most);
            let distance = low.max(-high).max(0.0);
            distance2 += distance * distance;
        }
        let radius = self.size.up_to((far_t + self.t_slack).max(0.0)) * 1.0001 + self.slack;
        let is_small = radius < MAX_RADIUS_OVER_EXTENT * (bounds[1] - bounds[0]).max_element();
        is_small || radius < 0.999 * distance2.sqrt() - self.slack
    }

    /// Returns the children of a node that the packet may enter as a whole: by the ranges of origins and directions.
    #[inline(always)]
    pub fn near_children(&self, node: &RoundNode, limit: f32) -> NearChildren {
        let splat = S::F32x8::splat;
        let (mut low, mut high) = ([splat(0.0); 3], [splat(0.0); 3]);
        let mut far_t = splat(0.0);
        for axis in 0..3 {
            low[axis] = S::F32x8::load(&node.min[axis]) - splat(self.o_range[axis][1]);
            high[axis] = S::F32x8::load(&node.max[axis]) - splat(self.o_range[axis][0]);
            let [least, most] = self.t_range[axis].map(splat);
            far_t = far_t
                + (low[axis] * least).max(low[axis] * most).max((high[axis] * least).max(high[axis] * most));
        }
        let radius = self.radius_up_to::<8, S::F32x8>(far_t);
        let (mut near, mut far) = (splat(0.0), splat(f32::INFINITY));
        for axis in 0..3 {
            let [least, most] = self.inv_range[axis];
            let (low, high) = (low[axis] - radius, high[axis] + radius);
            let (enter, leave) = if most < 0.0 { (high, low) } else { (low, high) };
            // Rays in both directions have no common bounds.
            if most < 0.0 || least > 0.0 {
                near = (enter * splat(least)).min(enter * splat(most)).max(near);
                far = (leave * splat(least)).max(leave * splat(most)).min(far);
            }
        }
        let is_used = S::F32x8::load(&node.min[0]).le(S::F32x8::load(&node.max[0]));
        let near = near * splat(0.999_999);
        let mask = is_used & near.le(far * splat(1.000_001)) & near.le(splat(limit));
        let mut children = NearChildren { mask, near: [0.0; WIDTH], radius: [0.0; WIDTH] };
        near.store(&mut children.near);
        radius.store(&mut children.radius);
        children
    }

    /// Returns a bit for each ray that may enter a child's box, enlarged by a radius.
    #[inline(always)]
    pub fn near_box(&self, node: &RoundNode, child: usize, radius: f32) -> u32 {
        let splat = S::F32x16::splat;
        let (mut near, mut far) = (splat(0.0), splat(f32::INFINITY));
        for axis in 0..3 {
            let a = (splat(node.min[axis][child] - radius) - self.o[axis]) * self.inv[axis];
            let b = (splat(node.max[axis][child] + radius) - self.o[axis]) * self.inv[axis];
            near = a.min(b).max(near);
            far = a.max(b).min(far);
        }
        let near = near * splat(0.999_999);
        near.le(far * splat(1.000_001)) & near.le(S::F32x16::load(&self.limit))
    }

    /// Returns a bit for each ray that may enter the sphere about a point.
    #[inline(always)]
    pub fn near_point(&self, p: Vec3) -> u32 {
        let v = self.relative(p);
        let t = dot::<S>(&v, &self.t);
        let w = self.off_ray(&v, t);
        self.near_spheres(dot::<S>(&w, &w), t, t)
    }

    /// Returns a bit for each ray that may enter the capsule about a segment.
    #[inline(always)]
    pub fn near_segment(&self, a: Vec3, b: Vec3) -> u32 {
        let splat = S::F32x16::splat;
        let e = (b - a).to_array().map(splat);
        let a = self.relative(a);
        let (t_a, t_e) = (dot::<S>(&a, &self.t), dot::<S>(&e, &self.t));
        let (w_a, w_e) = (self.off_ray(&a, t_a), self.off_ray(&e, t_e));
        // The point a + s e is nearest to the ray, as `min` and `max` pass over NaN.
        let s = (dot::<S>(&w_a, &w_e) / dot::<S>(&w_e, &w_e)).min(splat(0.0)).max(splat(-1.0));
        let w = [w_a[0] - w_e[0] * s, w_a[1] - w_e[1] * s, w_a[2] - w_e[2] * s];
        let t_b = t_a + t_e;
        self.near_spheres(dot::<S>(&w, &w), t_a.min(t_b), t_a.max(t_b))
    }

    /// Returns a bit for each ray with spheres in reach: at a distance of which `w2` is the square, and at t between the two.
    #[inline(always)]
    fn near_spheres(&self, w2: S::F32x16, least_t: S::F32x16, most_t: S::F32x16) -> u32 {
        let radius = self.radius_up_to::<16, S::F32x16>(most_t);
        let near = least_t - radius * self.inv_length - S::F32x16::splat(self.t_slack);
        let limit = S::F32x16::load(&self.limit);
        let is_searching = S::F32x16::splat(0.0).le(limit);
        // Also true for NaN.
        is_searching & !((radius * radius).lt(w2) | limit.lt(near))
    }

    /// Returns a point relative to each origin.
    #[inline(always)]
    fn relative(&self, p: Vec3) -> [S::F32x16; 3] {
        let splat = S::F32x16::splat;
        [splat(p.x) - self.o[0], splat(p.y) - self.o[1], splat(p.z) - self.o[2]]
    }

    /// Returns v − t d.
    #[inline(always)]
    fn off_ray(&self, v: &[S::F32x16; 3], t: S::F32x16) -> [S::F32x16; 3] {
        [v[0] - self.d[0] * t, v[1] - self.d[1] * t, v[2] - self.d[2] * t]
    }

    /// Returns a radius that is greater than any up to `t`, by more than rounding errs by.
    #[inline(always)]
    fn radius_up_to<const N: usize, L: Lanes<N>>(&self, t: L) -> L {
        let splat = |x: f32| L::splat(x);
        let t = (t + splat(self.t_slack)).max(splat(0.0));
        // 0 · ∞ is NaN, which `min` passes over.
        let radius =
            (splat(self.size.max) * t).min((splat(self.size.min) * t).max(splat(self.size.in_scene)));
        radius.mul_add(splat(1.0001), splat(self.slack))
    }
}

#[inline(always)]
fn dot<S: Simd>(a: &[S::F32x16; 3], b: &[S::F32x16; 3]) -> S::F32x16 {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
fn ranges<S: Simd>(v: &[S::F32x16; 3]) -> Ranges {
    let [x, y, z] = v;
    [[x.reduce_min(), x.reduce_max()], [y.reduce_min(), y.reduce_max()], [z.reduce_min(), z.reduce_max()]]
}

/// Returns the greatest difference on any axis.
#[inline(always)]
fn spread(ranges: &Ranges) -> f32 {
    let [x, y, z] = ranges;
    (x[1] - x[0]).max(y[1] - y[0]).max(z[1] - z[0])
}

/// Returns the greatest absolute value on any axis.
#[inline(always)]
fn greatest<S: Simd>(v: &[S::F32x16; 3]) -> S::F32x16 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

/// Returns false for NaN, which [`greatest`] may pass over, and for large coordinates.
#[inline(always)]
fn are_in_range<S: Simd>(v: &[S::F32x16; 3]) -> bool {
    let most = S::F32x16::splat(COORDINATES[1]);
    v[0].abs().le(most) & v[1].abs().le(most) & v[2].abs().le(most) == u32::from(u16::MAX)
}
