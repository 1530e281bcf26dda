//! Four planes around a packet, and how far along it boxes begin.

use glam::Vec3;

use super::super::lanes::by_axis;
use super::super::simd::{Lanes, Simd};
use super::super::wide::Node;
use super::{GROUPS, Packet};
use crate::geometry::EPSILON;

/// What all rays of a packet are inside of. With k the axis that they mostly run along, and a and
/// b the two others, each plane is one of −a ≤ …k…, a ≤ …k… and so for b: linear in two axes, and a
/// box is outside of it where its farthest corner is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frustum {
    /// k, a, b.
    axes: [usize; 3],
    /// Of planes a low, a high, b low, b high: the factor of k, and the least that the sum may be.
    slopes: [f32; 4],
    least: [f32; 4],
    /// No ray meets a plane k = x before x·scale − near, nor after x·scale − far.
    scale: f32,
    near: f32,
    far: f32,
    /// Directions of the rays, about.
    mean: Vec3,
}

/// The widest that tangents of a packet may spread: beyond it most of what the planes let through
/// is missed by all rays.
const SPREAD: f32 = 0.1;

impl Frustum {
    /// Around rays from one origin: their directions are the packet's own, in all lanes. `None`
    /// where they spread too far. `size` is the greatest coordinate of the tree.
    #[inline(always)]
    pub fn from_origin<S: Simd>(packet: &Packet, o: Vec3, size: f32) -> Option<Frustum> {
        let mean = sum::<S>(&packet.own);
        let (axes, sign) = axes(mean);
        let [k, a, b] = axes;
        let mut around = Around::<S>::new();
        let mut slowest = S::F16::splat(f32::INFINITY);
        for g in 0..GROUPS {
            let load = |from: &[super::PerRay<f32>; 3], axis: usize| S::F16::load(&from[axis].0[g]);
            let along = load(&packet.reciprocal, k) * S::F16::splat(sign);
            slowest = slowest.min(along);
            around.add(load(&packet.own, a) * along, load(&packet.own, b) * along);
        }
        let (slowest, [u0, u1, v0, v1]) = (slowest.least(), around.ends());
        if !(slowest > 0.0 && u1 - u0 <= SPREAD && v1 - v0 <= SPREAD) {
            return None;
        }
        let wider = |x: f32| 8.0 * EPSILON * (1.0 + x.abs());
        let (u0, u1, v0, v1) = (u0 - wider(u0), u1 + wider(u1), v0 - wider(v0), v1 + wider(v1));
        let slopes = [-u0 * sign, u1 * sign, -v0 * sign, v1 * sign];
        let steepest = u0.abs().max(u1.abs()).max(v0.abs()).max(v1.abs());
        let slack = 8.0 * EPSILON * (1.0 + steepest) * (size + o.abs().max_element());
        let side = [o[a], -o[a], o[b], -o[b]];
        let mut least = [0.0; 4];
        for i in 0..4 {
            least[i] = side[i] + slopes[i] * o[k] - slack;
        }
        let scale = sign * slowest;
        let shift = scale * o[k];
        let late = slack * slowest;
        Some(Frustum { axes, slopes, least, scale, near: shift + late, far: shift - late, mean })
    }

    /// Around rays along `d`: their origins are the packet's own, in all lanes. `None` where they
    /// are too far apart.
    #[inline(always)]
    pub fn along<S: Simd>(packet: &Packet, d: Vec3, size: f32, radius: f32) -> Option<Frustum> {
        let (axes, _) = axes(d);
        let [k, a, b] = axes;
        let (u, v, scale) = (d[a] / d[k], d[b] / d[k], 1.0 / d[k]);
        let (mut around, mut along) = (Around::<S>::new(), Around::<S>::new());
        let mut most = S::F16::splat(0.0);
        for g in 0..GROUPS {
            let o = by_axis(|i| S::F16::load(&packet.own[axes[i]].0[g]));
            around.add(o[1] - o[0] * S::F16::splat(u), o[2] - o[0] * S::F16::splat(v));
            along.add(o[0] * S::F16::splat(scale), o[0]);
            most = most.max(o[0].abs()).max(o[1].abs()).max(o[2].abs());
        }
        let [u0, u1, v0, v1] = around.ends();
        let [first, last, _, _] = along.ends();
        if !(u1 - u0 <= 0.1 * radius && v1 - v0 <= 0.1 * radius && scale.is_finite()) {
            return None;
        }
        let far_off = most.greatest();
        let slack = 16.0 * EPSILON * (1.0 + u.abs().max(v.abs())) * (size + far_off);
        let least = [u0 - slack, -u1 - slack, v0 - slack, -v1 - slack];
        let late = slack * scale.abs();
        Some(Frustum {
            axes,
            slopes: [-u, u, -v, v],
            least,
            scale,
            near: last + late,
            far: first - late,
            mean: d,
        })
    }

    pub fn mean(&self) -> Vec3 {
        self.mean
    }

    /// The children of a node that rays may meet before `farthest`, and before what they cannot.
    #[inline(always)]
    pub fn meets<S: Simd>(&self, node: &Node, farthest: f32) -> (u32, S::F8) {
        let [k, a, b] = self.axes;
        let plane = |axis: usize, end: usize| S::F8::load(&node.planes[axis][end]);
        let splat = S::F8::splat;
        let first = usize::from(self.scale < 0.0);
        let near = plane(k, first).mul_sub(splat(self.scale), splat(self.near));
        let far = plane(k, 1 - first).mul_sub(splat(self.scale), splat(self.far));
        let mut hit = near.le(splat(farthest)) & splat(0.0).le(far);
        for i in 0..4 {
            let axis = if i < 2 { a } else { b };
            let along = plane(k, usize::from(self.slopes[i] >= 0.0)) * splat(self.slopes[i]);
            let sum = if i % 2 == 0 { along + plane(axis, 1) } else { along - plane(axis, 0) };
            hit &= splat(self.least[i]).le(sum);
        }
        (hit & node.used(), near)
    }
}

/// The axis that `mean` is longest along, the two others, and its sign there.
fn axes(mean: Vec3) -> ([usize; 3], f32) {
    let size = mean.abs();
    let k = if size.x >= size.y && size.x >= size.z { 0 } else { usize::from(size.z > size.y) + 1 };
    ([k, (k + 1) % 3, (k + 2) % 3], if mean[k] < 0.0 { -1.0 } else { 1.0 })
}

/// The range of two numbers over all rays.
struct Around<S: Simd>([S::F16; 4]);

impl<S: Simd> Around<S> {
    #[inline(always)]
    fn new() -> Self {
        let (most, least) = (S::F16::splat(f32::INFINITY), S::F16::splat(f32::NEG_INFINITY));
        Around([most, least, most, least])
    }

    #[inline(always)]
    fn add(&mut self, u: S::F16, v: S::F16) {
        let [u0, u1, v0, v1] = self.0;
        self.0 = [u0.min(u), u1.max(u), v0.min(v), v1.max(v)];
    }

    #[inline(always)]
    fn ends(self) -> [f32; 4] {
        let [u0, u1, v0, v1] = self.0;
        [u0.least(), u1.greatest(), v0.least(), v1.greatest()]
    }
}

/// The sum of what rays do not share.
#[inline(always)]
fn sum<S: Simd>(of: &[super::PerRay<f32>; 3]) -> Vec3 {
    let mut sums = Vec3::ZERO;
    for axis in 0..3 {
        let [a, b, c, d] = &of[axis].0;
        let (a, b, c, d) = (S::F16::load(a), S::F16::load(b), S::F16::load(c), S::F16::load(d));
        sums[axis] = ((a + b) + (c + d)).sum();
    }
    sums
}
