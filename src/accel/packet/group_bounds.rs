//! What the groups of a packet see of boxes and triangles: rectangles and lines on a plane across them.
//!
//! Rays from one origin cross such a plane where their tangents say, rays along one direction where
//! their origins are once these are moved along it. A group's rays all cross it within a rectangle, their
//! window, and a box covers no more of it than a rectangle of its own: six comparisons tell which children
//! of a node any ray may meet, and five which groups may meet a child. A side of a triangle is linear in
//! the two coordinates there, so a window also tells on which side of it all rays of a group surely are.

use glam::Vec3;

use crate::accel::bvh::bvh8::WIDTH;
use crate::accel::packet::{FOUR, GROUP, Packet, QUADS};
use crate::accel::traverse::box_test::{FAR_FACTOR, NEAR_FACTOR};
use crate::geometry::EPSILON;
use crate::simd::vec3::per_axis;
use crate::simd::{Lanes, Simd};

/// The axis that rays mostly run along, and the two others.
pub(crate) type Axes = [usize; 3];

/// What the children of a node cover, each a lane.
#[derive(Clone, Copy)]
pub(crate) struct Outlines<L> {
    /// By the two axes across.
    pub low: [L; 2],
    pub high: [L; 2],
    /// Along: where the boxes begin and end.
    pub near: L,
    pub far: L,
}

/// The windows of a packet's groups.
#[derive(Clone, Copy)]
pub(crate) struct Windows<L> {
    /// Around all: low and high by the two axes across, and along what ends before it is of no effect.
    all: ([f32; 2], [f32; 2], f32),
    /// By the two axes across: a group a lane.
    low: [L; 2],
    high: [L; 2],
    width: [L; 2],
    /// Four groups at a time, each in as many lanes as a block has triangles: by the two axes across.
    middle: [[L; 2]; QUADS],
    reach: [[L; 2]; QUADS],
    /// Nothing with t up to some t is farther along than t·scale + shift; of each group, four at a time.
    scale: f32,
    shift: [L; QUADS],
}

/// Along: nothing farther matters to a group.
#[derive(Clone, Copy)]
pub(crate) struct Last<L> {
    /// Four groups at a time, each in four lanes.
    quads: [L; QUADS],
    /// A group a lane.
    groups: L,
    /// Of all.
    all: f32,
}

/// Directions from one origin, in parts of what they are along one axis.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cone {
    pub axes: Axes,
    /// That of every direction along the first axis.
    pub sign: f32,
    /// The ends of both tangents, rounding included.
    tangents: [f32; 4],
    /// The same of each group, four groups at a time, which fill four lanes each.
    each: [[[f32; GROUP]; 4]; QUADS],
    /// The least and the greatest 1/|k|, of directions that are k along the first axis.
    pub slowest: f32,
    fastest: f32,
    pub mean: Vec3,
}

/// The widest that tangents of a packet may spread, and origins, in radii of the tree: beyond it nearly
/// every node is met by some group.
const SPREAD: f32 = 0.8;

/// 1/|k| of directions that are worked with as they are lies between this and its reciprocal.
const LEAST_SPEED: f32 = 1.0 / 65536.0;

impl Cone {
    /// Around the packet's own directions, in all lanes, whose reciprocals are known; `mean` is
    /// about one of them. False where they spread too far or not all are about as long.
    #[inline(always)]
    pub fn surround<S: Simd>(packet: &mut Packet, mean: Vec3) -> bool {
        let (axes, sign) = axes(mean);
        let [k, a, b] = axes;
        let zero = S::F32x16::splat(0.0);
        let (mut slowest, mut fastest) = (S::F32x16::splat(f32::INFINITY), zero);
        let (mut low, mut high) = ([slowest; 2], [zero - slowest; 2]);
        let mut sum = zero;
        for q in 0..packet.quads {
            let (mut u, mut v) = ([zero; FOUR], [zero; FOUR]);
            for i in 0..FOUR {
                let own = |axis: usize| S::F32x16::load(&packet.own[axis].0[q][i]);
                let along = S::F32x16::load(&packet.reciprocal[k].0[q][i]) * S::F32x16::splat(sign);
                (slowest, fastest) = (slowest.min(along), fastest.max(along));
                (u[i], v[i]) = (own(a) * along, own(b) * along);
                sum = sum + (u[i] + v[i]);
            }
            let [u0, v0] = [S::reduce_min_each(u), S::reduce_min_each(v)];
            let [u1, v1] = [S::reduce_max_each(u), S::reduce_max_each(v)];
            let each = [u0 - wider(u0), u1 + wider(u1), v0 - wider(v0), v1 + wider(v1)];
            for (of, to) in each.into_iter().zip(&mut packet.cone.each[q]) {
                of.store(to);
            }
            (low, high) =
                ([low[0].min(each[0]), low[1].min(each[2])], [high[0].max(each[1]), high[1].max(each[3])]);
        }
        let (slowest, fastest) = (slowest.reduce_min(), fastest.reduce_max());
        // Comparisons lose what is no number; a sum does not.
        let numbers = sum.le(S::F32x16::splat(f32::INFINITY)) == (1 << GROUP) - 1;
        let ordinary = slowest > LEAST_SPEED && fastest < 1.0 / LEAST_SPEED;
        let tangents = [low[0].reduce_min(), high[0].reduce_max(), low[1].reduce_min(), high[1].reduce_max()];
        let [u0, u1, v0, v1] = tangents;
        if !(numbers && ordinary && u1 - u0 <= SPREAD && v1 - v0 <= SPREAD) {
            return false;
        }
        let cone = &mut packet.cone;
        (cone.axes, cone.sign, cone.tangents) = (axes, sign, tangents);
        (cone.slowest, cone.fastest, cone.mean) = (slowest, fastest, mean);
        true
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

    /// The windows: tangents across, and along how far from the origin, by the first axis.
    #[inline(always)]
    pub fn windows<S: Simd>(&self, packet: &Packet) -> Windows<S::F32x16> {
        let [u0, u1, v0, v1] = self.tangents;
        let first = packet.first::<S>() * (NEAR_FACTOR * NEAR_FACTOR / self.fastest);
        let mut windows = Windows::around(([u0, v0], [u1, v1], first), FAR_FACTOR / self.slowest);
        for q in 0..packet.quads {
            let each = &self.each[q];
            let end = |i: usize| S::F32x16::load(&each[i]);
            windows.put(q, [end(0), end(1), end(2), end(3)]);
        }
        windows.gather::<S>(packet.quads);
        windows
    }
}

impl<L: Lanes<GROUP>> Windows<L> {
    /// Without any window yet.
    #[inline(always)]
    fn around(all: ([f32; 2], [f32; 2], f32), scale: f32) -> Windows<L> {
        let zero = L::splat(0.0);
        let none = [[zero; 2]; QUADS];
        Windows {
            all,
            low: [zero; 2],
            high: [zero; 2],
            width: [zero; 2],
            middle: none,
            reach: none,
            scale,
            shift: [zero; QUADS],
        }
    }

    /// Those of four groups, by their ends.
    #[inline(always)]
    fn put(&mut self, q: usize, [a0, a1, b0, b1]: [L; 4]) {
        // What halves and sums are rounded by is within what windows were widened by.
        let half = L::splat(0.5);
        self.middle[q] = [(a0 + a1) * half, (b0 + b1) * half];
        self.reach[q] = [(a1 - a0) * half, (b1 - b0) * half];
    }

    /// A group a lane, from those that were put.
    #[inline(always)]
    fn gather<S: Simd<F32x16 = L>>(&mut self, quads: usize) {
        for q in quads..QUADS {
            (self.middle[q], self.reach[q]) = (self.middle[0], self.reach[0]);
        }
        for axis in 0..2 {
            let (of, by) = (&self.middle, &self.reach);
            let middle = S::pack_quads([of[0][axis], of[1][axis], of[2][axis], of[3][axis]]);
            let reach = S::pack_quads([by[0][axis], by[1][axis], by[2][axis], by[3][axis]]);
            (self.low[axis], self.high[axis]) = (middle - reach, middle + reach);
            self.width[axis] = reach * L::splat(2.0);
        }
    }

    /// Around rays along `d`: their origins are the packet's own, in all lanes. `None` where they are too far
    /// apart.
    #[inline(always)]
    pub fn along<S: Simd<F32x16 = L>>(
        packet: &Packet,
        d: Vec3,
        size: f32,
        radius: f32,
    ) -> Option<Windows<L>> {
        let (axes, _) = axes(d);
        let [k, a, b] = axes;
        let (u, v, scale) = (d[a] / d[k], d[b] / d[k], 1.0 / d[k]);
        let (zero, infinite) = (L::splat(0.0), L::splat(f32::INFINITY));
        let far_off = packet.greatest;
        let slack = 16.0 * EPSILON * (1.0 + u.abs().max(v.abs())) * (size + far_off);
        let (wider, late) = (L::splat(slack), L::splat(2.0 * slack * scale.abs()));
        let mut windows = Windows::around(([0.0; 2], [0.0; 2], 0.0), 1.0);
        let (mut low, mut high, mut soonest) = ([infinite; 2], [zero - infinite; 2], infinite);
        for q in 0..packet.quads {
            let (mut x, mut y, mut z) = ([zero; FOUR], [zero; FOUR], [zero; FOUR]);
            for i in 0..FOUR {
                let o = per_axis(|axis| L::load(&packet.own[axes[axis]].0[q][i]));
                (x[i], y[i]) = (o[1] - o[0] * L::splat(u), o[2] - o[0] * L::splat(v));
                z[i] = o[0] * L::splat(scale);
            }
            let (a0, a1) = (S::reduce_min_each(x) - wider, S::reduce_max_each(x) + wider);
            let (b0, b1) = (S::reduce_min_each(y) - wider, S::reduce_max_each(y) + wider);
            windows.put(q, [a0, a1, b0, b1]);
            windows.shift[q] = S::reduce_max_each(z) + late;
            soonest = soonest.min(S::reduce_min_each(z) - late);
            low = [low[0].min(a0), low[1].min(b0)];
            high = [high[0].max(a1), high[1].max(b1)];
        }
        let (low, high) =
            ([low[0].reduce_min(), low[1].reduce_min()], [high[0].reduce_max(), high[1].reduce_max()]);
        let most = SPREAD * radius + 2.0 * slack;
        if !(high[0] - low[0] <= most && high[1] - low[1] <= most && scale.is_finite()) {
            return None;
        }
        windows.all = (low, high, packet.first::<S>() * NEAR_FACTOR + soonest.reduce_min());
        windows.gather::<S>(packet.quads);
        Some(windows)
    }

    /// How far along anything matters.
    #[inline(always)]
    pub fn last<S: Simd<F32x16 = L>>(&self, packet: &Packet) -> Last<L> {
        let none = L::splat(f32::NEG_INFINITY);
        let mut last = Last { quads: [none; QUADS], groups: none, all: 0.0 };
        for q in 0..packet.quads {
            last.quads[q] = self.last_of::<S>(packet, q);
        }
        last.gather::<S>();
        last
    }

    #[inline(always)]
    fn last_of<S: Simd<F32x16 = L>>(&self, packet: &Packet, q: usize) -> L {
        let upper = S::reduce_max_each(packet.upper.four::<L>(q));
        let last = upper.mul_add(L::splat(self.scale * FAR_FACTOR), self.shift[q]);
        // Where no ray is left, that is nothing at all.
        L::splat(f32::NEG_INFINITY).select(upper.lt(L::splat(0.0)), last)
    }

    /// The same once more, where only some groups' rays found anything.
    #[inline(always)]
    pub fn shorten<S: Simd<F32x16 = L>>(&self, packet: &Packet, groups: u32, last: &mut Last<L>) {
        for q in 0..packet.quads {
            if groups >> (q * FOUR) & ((1 << FOUR) - 1) != 0 {
                last.quads[q] = self.last_of::<S>(packet, q);
            }
        }
        last.gather::<S>();
    }

    /// The children that any ray may meet, before `last`.
    #[inline(always)]
    pub fn meet<L8: Lanes<WIDTH>>(&self, of: &Outlines<L8>, last: &Last<L>) -> u32 {
        let (low, high, first) = self.all;
        of.low[0].le(L8::splat(high[0]))
            & L8::splat(low[0]).le(of.high[0])
            & of.low[1].le(L8::splat(high[1]))
            & L8::splat(low[1]).le(of.high[1])
            & of.near.le(L8::splat(last.all))
            & L8::splat(first).le(of.far)
    }

    /// The groups that may meet a child before `last`: low and high by the two axes across, and along
    /// where it begins.
    #[inline(always)]
    pub fn groups(&self, low: [f32; 2], high: [f32; 2], near: f32, last: &Last<L>) -> u32 {
        L::splat(low[0]).le(self.high[0])
            & self.low[0].le(L::splat(high[0]))
            & L::splat(low[1]).le(self.high[1])
            & self.low[1].le(L::splat(high[1]))
            & L::splat(near).le(last.groups)
    }

    /// The groups whose windows are wider than this by one of the axes across.
    #[inline(always)]
    pub fn wider_than(&self, [a, b]: [f32; 2]) -> u32 {
        L::splat(a).lt(self.width[0]) | L::splat(b).lt(self.width[1])
    }

    /// The triangles of a block that all rays of each of four groups surely pass by: a bit for each group and
    /// triangle. A side is a constant and what it grows by across; its sign is certain beyond `certain`.
    #[inline(always)]
    pub fn pass_by(&self, q: usize, sides: &[[L; 3]; 3], certain: f32) -> u32 {
        let [u, v, w] = [self.ends(q, sides[0]), self.ends(q, sides[1]), self.ends(q, sides[2])];
        // Not all of one sign anywhere: one is below everywhere, and another above.
        let below = u.1.min(v.1).min(w.1).lt(L::splat(-certain));
        below & L::splat(certain).lt(u.0.max(v.0).max(w.0))
    }

    /// The least and the greatest of a side over each window.
    #[inline(always)]
    fn ends(&self, q: usize, [at, a, b]: [L; 3]) -> (L, L) {
        let middle = a.mul_add(self.middle[q][0], b.mul_add(self.middle[q][1], at));
        let reach = a.abs().mul_add(self.reach[q][0], b.abs() * self.reach[q][1]);
        (middle - reach, middle + reach)
    }
}

impl<L: Lanes<GROUP>> Last<L> {
    #[inline(always)]
    fn gather<S: Simd<F32x16 = L>>(&mut self) {
        self.groups = S::pack_quads(self.quads);
        self.all = self.groups.reduce_max();
    }
}

/// More than rounding may have done to a tangent.
#[inline(always)]
fn wider<L: Lanes<GROUP>>(tangent: L) -> L {
    let margin = L::splat(8.0 * EPSILON);
    tangent.abs().mul_add(margin, margin)
}

/// The axis that `mean` is longest along, the two others, and its sign there.
pub(crate) fn axes(mean: Vec3) -> (Axes, f32) {
    let size = mean.abs();
    let k = if size.x >= size.y && size.x >= size.z { 0 } else { usize::from(size.z > size.y) + 1 };
    ([k, (k + 1) % 3, (k + 2) % 3], if mean[k] < 0.0 { -1.0 } else { 1.0 })
}
