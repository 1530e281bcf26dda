//! Four planes around a packet, and how far along it boxes begin.

use glam::Vec3;

use super::super::lanes::by_axis;
use super::super::simd::{Lanes, Simd};
use super::super::wide::{Node, row};
use super::{GROUP, GROUPS, Packet};
use crate::geometry::EPSILON;

/// What all rays of a packet are inside of. With k the axis that they mostly run along, and a and
/// b the two others, each plane is one of −a ≤ …k…, a ≤ …k… and so for b: linear in two axes, and a
/// box is outside of it where its farthest corner is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frustum {
    /// Rows of a node: for each plane that of k whose corner is the farthest.
    rows: [usize; 4],
    /// Those of a's and b's ends, as planes ask for them.
    ends: [usize; 4],
    /// Of k where boxes begin and where they end.
    along: [usize; 2],
    /// Of planes a low, a high, b low, b high: the factor of k, and the least that the sum may be.
    slopes: [f32; 4],
    least: [f32; 4],
    /// No ray meets a plane k = x before x·scale − near, nor after x·scale − far.
    scale: f32,
    near: f32,
    far: f32,
    /// The direction of a ray, about.
    mean: Vec3,
}

/// Directions from one origin, in parts of what they are along one axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cone {
    /// k, a, b.
    axes: [usize; 3],
    /// That of every direction along k.
    sign: f32,
    /// The ends of a/|k| and of b/|k|, rounding included.
    tangents: [f32; 4],
    /// The least 1/|k|.
    slowest: f32,
    mean: Vec3,
}

/// The widest that tangents of a packet may spread: beyond it most of what the planes let through
/// is missed by all rays.
const SPREAD: f32 = 0.1;

impl Cone {
    /// Around the packet's own directions, in all lanes, whose reciprocals are known; `mean` is
    /// about one of them. `None` where they spread too far or not all are about as long.
    #[inline(always)]
    pub fn around<S: Simd>(packet: &Packet, mean: Vec3) -> Option<Cone> {
        let (axes, sign) = axes(mean);
        let [k, a, b] = axes;
        let mut around = Around::<S>::new();
        let (mut slowest, mut fastest) = (S::F16::splat(f32::INFINITY), S::F16::splat(0.0));
        let own = |axis: usize, g: usize| S::F16::load(&packet.own[axis].0[g]);
        let mut sum = S::F16::splat(0.0);
        for g in 0..GROUPS {
            let along = S::F16::load(&packet.reciprocal[k].0[g]) * S::F16::splat(sign);
            (slowest, fastest) = (slowest.min(along), fastest.max(along));
            let (u, v) = (own(a, g) * along, own(b, g) * along);
            around.add(u, v);
            sum = sum + (u + v);
        }
        let (slowest, fastest) = (slowest.least(), fastest.greatest());
        let [u0, u1, v0, v1] = around.ends();
        // Comparisons lose what is no number; a sum does not.
        let numbers = sum.le(S::F16::splat(f32::INFINITY)) == (1 << GROUP) - 1;
        let ordinary = slowest > LEAST_SPEED && fastest < 1.0 / LEAST_SPEED;
        if !(numbers && ordinary && u1 - u0 <= SPREAD && v1 - v0 <= SPREAD) {
            return None;
        }
        let wider = |x: f32| 8.0 * EPSILON * (1.0 + x.abs());
        let tangents = [u0 - wider(u0), u1 + wider(u1), v0 - wider(v0), v1 + wider(v1)];
        Some(Cone { axes, sign, tangents, slowest, mean })
    }

    /// At least the length of every direction.
    #[inline(always)]
    pub fn length(&self) -> f64 {
        let [u0, u1, v0, v1] = self.tangents.map(|x| f64::from(x * x));
        (1.0 + 1e-6) / f64::from(self.slowest) * (1.0 + u0.max(u1) + v0.max(v1)).sqrt()
    }

    /// Which end of boxes comes first on each axis, where all rays surely agree on it.
    #[inline(always)]
    pub fn near_end(&self) -> Option<[usize; 3]> {
        let [k, a, b] = self.axes;
        let [u0, u1, v0, v1] = self.tangents;
        let mut ends = [0; 3];
        ends[k] = usize::from(self.sign < 0.0);
        ends[a] = usize::from(u0 < 0.0);
        ends[b] = usize::from(v0 < 0.0);
        ((u0 > 0.0 || u1 < 0.0) && (v0 > 0.0 || v1 < 0.0)).then_some(ends)
    }
}

/// 1/|k| of directions that are worked with as they are lies between this and its reciprocal.
const LEAST_SPEED: f32 = 1.0 / 65536.0;

impl Frustum {
    /// Of rays from `o`. `size` is the greatest coordinate of the tree.
    #[inline(always)]
    pub fn from_origin(cone: &Cone, o: Vec3, size: f32) -> Frustum {
        let &Cone { axes: [k, a, b], sign, tangents: [u0, u1, v0, v1], slowest, mean } = cone;
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
        Frustum::new([k, a, b], (slopes, least), (scale, shift + late, shift - late), mean)
    }

    #[inline(always)]
    fn new(
        [k, a, b]: [usize; 3],
        (slopes, least): ([f32; 4], [f32; 4]),
        (scale, near, far): (f32, f32, f32),
        mean: Vec3,
    ) -> Frustum {
        let first = usize::from(scale < 0.0);
        Frustum {
            rows: slopes.map(|slope| row(k, usize::from(slope >= 0.0))),
            ends: [row(a, 1), row(a, 0), row(b, 1), row(b, 0)],
            along: [row(k, first), row(k, 1 - first)],
            slopes,
            least,
            scale,
            near,
            far,
            mean,
        }
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
        Some(Frustum::new(axes, ([-u, u, -v, v], least), (scale, last + late, first - late), d))
    }

    pub fn mean(&self) -> Vec3 {
        self.mean
    }

    /// The children of a node that rays may meet before `farthest`, and before what they cannot.
    #[inline(always)]
    pub fn meets<S: Simd>(&self, node: &Node, farthest: f32) -> (u32, S::F8) {
        let rows = node.rows();
        let sides = |row: usize| S::F8::load(&rows[row & 7]);
        let splat = S::F8::splat;
        let near = sides(self.along[0]).mul_sub(splat(self.scale), splat(self.near));
        let far = sides(self.along[1]).mul_sub(splat(self.scale), splat(self.far));
        let mut hit = near.le(splat(farthest)) & splat(0.0).le(far);
        for i in 0..4 {
            let (along, end) = (sides(self.rows[i]), sides(self.ends[i]));
            let slope = splat(self.slopes[i]);
            let sum = if i % 2 == 0 { along.mul_add(slope, end) } else { along.mul_sub(slope, end) };
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
