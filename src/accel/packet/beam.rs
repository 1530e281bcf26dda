//! What is shared by the rays of a packet, and what follows from it for boxes and triangles.

use glam::Vec3;

use super::super::block::{Block, CAPACITY};
use super::super::bounds::{Bounds, Slack};
use super::super::lanes::{by_axis, corners, cross, dot, splat, sub};
use super::super::simd::{Lanes, Simd};
use super::super::wide::{GROW, Node, SHRINK, WIDTH, row};
use super::Packet;

/// A box: for each axis the plane that is met first and the one that is met last, as the beam
/// wants them.
pub(super) type Planes = [[f32; 2]; 3];

/// Those of all children of a node: by axis, first and last, child.
pub(super) type Faces = [[[f32; WIDTH]; 2]; 3];

/// What does not depend on the ray, of a triangle: three vectors and a number.
#[repr(C, align(64))]
pub(super) struct Prepared {
    /// By vector, axis, triangle.
    vectors: [[[f32; CAPACITY]; 3]; 4],
    number: [f32; CAPACITY],
}

/// Edge functions, the determinant, and t times it.
#[derive(Clone, Copy)]
pub(super) struct Sides<L> {
    pub u: L,
    pub v: L,
    pub det: L,
    pub depth: L,
}

pub(super) trait Beam<S: Simd> {
    /// The boxes of a node's children, as [`Beam::enters`] takes them one by one.
    fn faces(&self, node: &Node, to: &mut Faces);

    /// The rays of group `g` that enter a box.
    fn enters(&self, packet: &Packet, g: usize, planes: &Planes) -> u32;

    fn prepare(&self, block: &Block) -> Prepared;

    fn slack(&self, block: &Block) -> Slack;

    /// Of triangle `lane` and the rays of group `g`.
    fn sides(&self, packet: &Packet, g: usize, prepared: &Prepared, lane: usize) -> Sides<S::F16>;
}

/// Rays from one origin.
pub(super) struct Origin {
    pub o: Vec3,
    pub bounds: Bounds,
    /// Which end of a box is met first, where all rays agree on it.
    pub near_end: Option<[usize; 3]>,
}

impl<S: Simd> Beam<S> for Origin {
    #[inline(always)]
    fn faces(&self, node: &Node, to: &mut Faces) {
        let ends = self.near_end.unwrap_or([0; 3]);
        let wider = if self.near_end.is_some() { [SHRINK, GROW] } else { [1.0; 2] };
        for axis in 0..3 {
            let o = S::F8::splat(self.o[axis]);
            let at = |end: usize| S::F8::load(&node.rows()[row(axis, end) & 7]);
            ((at(ends[axis]) - o) * S::F8::splat(wider[0])).store(&mut to[axis][0]);
            ((at(1 - ends[axis]) - o) * S::F8::splat(wider[1])).store(&mut to[axis][1]);
        }
    }

    #[inline(always)]
    fn enters(&self, packet: &Packet, g: usize, planes: &Planes) -> u32 {
        let at = |axis: usize, end: usize| {
            S::F16::load(&packet.reciprocal[axis].0[g]) * S::F16::splat(planes[axis][end])
        };
        let (start, upper) = (S::F16::load(&packet.start.0[g]), S::F16::load(&packet.upper.0[g]));
        if self.near_end.is_some() {
            let near = at(0, 0).max(at(1, 0).max(at(2, 0).max(start)));
            let far = at(0, 1).min(at(1, 1).min(at(2, 1).min(upper)));
            near.le(far)
        } else {
            let near = |axis: usize| at(axis, 0).min(at(axis, 1));
            let far = |axis: usize| at(axis, 0).max(at(axis, 1));
            let near = near(0).max(near(1)).max(near(2)) * S::F16::splat(SHRINK);
            let far = far(0).min(far(1)).min(far(2)) * S::F16::splat(GROW);
            near.max(start).le(far.min(upper))
        }
    }

    #[inline(always)]
    fn prepare(&self, block: &Block) -> Prepared {
        let [v0, v1, v2] = corners::<S::F4>(block);
        let c = sub(v0, splat(self.o));
        let (e1, e2) = (sub(v1, v0), sub(v2, v0));
        let n = cross(e1, e2);
        Prepared::new::<S>([cross(e2, c), cross(c, e1), n, n], dot(c, n))
    }

    #[inline(always)]
    fn slack(&self, block: &Block) -> Slack {
        self.bounds.of(block.edge)
    }

    #[inline(always)]
    fn sides(&self, packet: &Packet, g: usize, prepared: &Prepared, lane: usize) -> Sides<S::F16> {
        let d = by_axis(|axis| S::F16::load(&packet.own[axis].0[g]));
        let along = |i: usize| dot(d, prepared.vector::<S>(i, lane));
        Sides { u: along(0), v: along(1), det: along(2), depth: S::F16::splat(prepared.number[lane]) }
    }
}

/// Rays along one direction.
pub(super) struct Direction {
    pub d: Vec3,
    pub reciprocal: Vec3,
    pub bounds: Bounds,
}

impl<S: Simd> Beam<S> for Direction {
    #[inline(always)]
    fn faces(&self, node: &Node, to: &mut Faces) {
        for (axis, (to, planes)) in to.iter_mut().zip(&node.planes).enumerate() {
            let first = usize::from(self.reciprocal[axis] < 0.0);
            *to = [planes[first], planes[1 - first]];
        }
    }

    #[inline(always)]
    fn enters(&self, packet: &Packet, g: usize, planes: &Planes) -> u32 {
        let at = |axis: usize, end: usize| {
            let r = self.reciprocal[axis] * if end == 0 { SHRINK } else { GROW };
            (S::F16::splat(planes[axis][end]) - S::F16::load(&packet.own[axis].0[g])) * S::F16::splat(r)
        };
        let (start, upper) = (S::F16::load(&packet.start.0[g]), S::F16::load(&packet.upper.0[g]));
        let near = at(0, 0).max(at(1, 0).max(at(2, 0).max(start)));
        let far = at(0, 1).min(at(1, 1).min(at(2, 1).min(upper)));
        near.le(far)
    }

    #[inline(always)]
    fn prepare(&self, block: &Block) -> Prepared {
        let [v0, v1, v2] = corners::<S::F4>(block);
        let d = splat(self.d);
        let (e1, e2) = (sub(v1, v0), sub(v2, v0));
        let n = cross(e1, e2);
        // d·(e₂×c) = c·(d×e₂), and d·(c×e₁) = c·(e₁×d).
        Prepared::new::<S>([cross(d, e2), cross(e1, d), n, v0], dot(d, n))
    }

    #[inline(always)]
    fn slack(&self, block: &Block) -> Slack {
        self.bounds.of(block.edge)
    }

    #[inline(always)]
    fn sides(&self, packet: &Packet, g: usize, prepared: &Prepared, lane: usize) -> Sides<S::F16> {
        let o = by_axis(|axis| S::F16::load(&packet.own[axis].0[g]));
        let c = sub(prepared.vector::<S>(3, lane), o);
        let along = |i: usize| dot(c, prepared.vector::<S>(i, lane));
        Sides { u: along(0), v: along(1), det: S::F16::splat(prepared.number[lane]), depth: along(2) }
    }
}

impl Prepared {
    #[inline(always)]
    fn new<S: Simd>(vectors: [[S::F4; 3]; 4], number: S::F4) -> Prepared {
        let mut prepared = Prepared { vectors: [[[0.0; CAPACITY]; 3]; 4], number: [0.0; CAPACITY] };
        for (to, from) in prepared.vectors.iter_mut().zip(&vectors) {
            from[0].store(&mut to[0]);
            from[1].store(&mut to[1]);
            from[2].store(&mut to[2]);
        }
        number.store(&mut prepared.number);
        prepared
    }

    #[inline(always)]
    fn vector<S: Simd>(&self, i: usize, lane: usize) -> [S::F16; 3] {
        by_axis(|axis| S::F16::splat(self.vectors[i][axis][lane]))
    }
}
