//! What is shared by the rays of a packet, and what follows from it for boxes and triangles.

use glam::Vec3;

use crate::accel::bvh::bvh8::{Bvh8Node, plane_row};
use crate::accel::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::accel::packet::Packet;
use crate::accel::packet::group_bounds::{Axes, Outlines, axes};
use crate::accel::traverse::box_test::{FAR_FACTOR, NEAR_FACTOR, direction_reciprocal};
use crate::accel::traverse::error_bounds::{Bounds, Slack};
use crate::simd::vec3::{cross, dot, per_axis, splat, sub};
use crate::simd::{Lanes, Simd};

/// A box: for each axis the plane that is met first and the one that is met last, as the beam
/// wants them.
pub(crate) type Planes = [[f32; 2]; 3];

/// Below this, what is in front of an origin counts as being there: its reciprocal is finite.
const TINY: f32 = 1e-30;

/// What does not depend on the ray, of a triangle.
#[repr(C, align(64))]
pub(crate) struct Prepared {
    /// By vector, axis, triangle.
    vectors: [[[f32; TRIANGLE_LANES]; 3]; 4],
    number: [f32; TRIANGLE_LANES],
    /// Of sides, where it is not one of the vectors' components.
    constants: [[f32; TRIANGLE_LANES]; 3],
}

/// Edge functions, the determinant, and t times it.
#[derive(Clone, Copy)]
pub(crate) struct Sides<L> {
    pub u: L,
    pub v: L,
    pub det: L,
    pub depth: L,
}

pub(crate) trait Beam<S: Simd> {
    /// What a node's children cover of the plane across the rays.
    fn outlines(&self, node: &Bvh8Node) -> Outlines<S::F32x8>;

    /// The box of a node's child.
    fn planes(&self, node: &Bvh8Node, slot: usize) -> Planes;

    /// The rays of group `g` that enter a box.
    fn enters(&self, packet: &Packet, g: usize, planes: &Planes) -> u32;

    fn prepare(&self, block: &Triangle4) -> Prepared;

    fn slack(&self, block: &Triangle4) -> Slack;

    /// Of the triangles of a block, four times: the three sides on the plane across the rays.
    fn across(&self, prepared: &Prepared) -> [[S::F32x16; 3]; 3];

    /// A bound on the rounding of those.
    fn certain(&self, block: &Triangle4) -> f32;

    /// Of triangle `lane` and the rays of group `g`.
    fn sides(&self, packet: &Packet, g: usize, prepared: &Prepared, lane: usize) -> Sides<S::F32x16>;
}

/// Rays from one origin.
pub(crate) struct Origin {
    pub o: Vec3,
    pub axes: Axes,
    /// That of all directions along the first axis, and the least 1 over those parts of them.
    pub sign: f32,
    pub slowest: f32,
    pub bounds: Bounds,
    /// Which end of a box is met first, where all rays agree on it.
    pub near_end: Option<[usize; 3]>,
}

impl<S: Simd> Beam<S> for Origin {
    #[inline(always)]
    fn outlines(&self, node: &Bvh8Node) -> Outlines<S::F32x8> {
        let rows = node.rows();
        let [k, a, b] = self.axes;
        let first = usize::from(self.sign < 0.0);
        let side = |axis: usize, end: usize| S::F32x8::load(&rows[plane_row(axis, end) & 7]);
        let o = |axis: usize| S::F32x8::splat(self.o[axis]);
        let (sign, from) = (S::F32x8::splat(self.sign), S::F32x8::splat(self.sign * self.o[k]));
        let (near, far) = (side(k, first).mul_sub(sign, from), side(k, 1 - first).mul_sub(sign, from));
        let tiny = S::F32x8::splat(TINY);
        let (soon, late) = (near.max(tiny).rcp(), far.max(tiny).rcp());
        let (a0, a1) = (side(a, 0) - o(a), side(a, 1) - o(a));
        let (b0, b1) = (side(b, 0) - o(b), side(b, 1) - o(b));
        Outlines {
            low: [(a0 * soon).min(a0 * late), (b0 * soon).min(b0 * late)],
            high: [(a1 * soon).max(a1 * late), (b1 * soon).max(b1 * late)],
            near,
            far,
        }
    }

    #[inline(always)]
    fn planes(&self, node: &Bvh8Node, slot: usize) -> Planes {
        let ends = self.near_end.unwrap_or([0; 3]);
        let wider = if self.near_end.is_some() { [NEAR_FACTOR, FAR_FACTOR] } else { [1.0; 2] };
        per_axis(|axis| {
            let at = |end: usize| node.rows()[plane_row(axis, end) & 7][slot] - self.o[axis];
            [at(ends[axis]) * wider[0], at(1 - ends[axis]) * wider[1]]
        })
    }

    #[inline(always)]
    fn enters(&self, packet: &Packet, g: usize, planes: &Planes) -> u32 {
        let at = |axis: usize, end: usize| {
            S::F32x16::load(packet.reciprocal[axis].group(g)) * S::F32x16::splat(planes[axis][end])
        };
        let (start, upper) = (S::F32x16::load(packet.start.group(g)), S::F32x16::load(packet.upper.group(g)));
        if self.near_end.is_some() {
            let near = at(0, 0).max(at(1, 0).max(at(2, 0).max(start)));
            let far = at(0, 1).min(at(1, 1).min(at(2, 1).min(upper)));
            near.le(far)
        } else {
            let near = |axis: usize| at(axis, 0).min(at(axis, 1));
            let far = |axis: usize| at(axis, 0).max(at(axis, 1));
            let near = near(0).max(near(1)).max(near(2)) * S::F32x16::splat(NEAR_FACTOR);
            let far = far(0).min(far(1)).min(far(2)) * S::F32x16::splat(FAR_FACTOR);
            near.max(start).le(far.min(upper))
        }
    }

    #[inline(always)]
    fn prepare(&self, block: &Triangle4) -> Prepared {
        let [v0, v1, v2] = block.load_vertices::<S::F32x4>();
        let c = sub(v0, splat(self.o));
        let (e1, e2) = (sub(v1, v0), sub(v2, v0));
        let n = cross(e1, e2);
        let (u, v) = (cross(e2, c), cross(c, e1));
        let w = sub(sub(n, u), v);
        Prepared::new::<S>([u, v, n, w], dot(c, n), [dot(c, n); 3])
    }

    #[inline(always)]
    fn across(&self, prepared: &Prepared) -> [[S::F32x16; 3]; 3] {
        let [k, a, b] = self.axes;
        let sign = S::F32x16::splat(self.sign);
        let part = |i: usize, axis: usize| S::broadcast_quad(&prepared.vectors[i][axis % 3]);
        [
            [part(0, k) * sign, part(0, a), part(0, b)],
            [part(1, k) * sign, part(1, a), part(1, b)],
            [part(3, k) * sign, part(3, a), part(3, b)],
        ]
    }

    #[inline(always)]
    fn certain(&self, block: &Triangle4) -> f32 {
        // Directions are 1 along the first axis there.
        4.0 * self.slowest * self.bounds.of(block.max_edge).side
    }

    #[inline(always)]
    fn slack(&self, block: &Triangle4) -> Slack {
        self.bounds.of(block.max_edge)
    }

    #[inline(always)]
    fn sides(&self, packet: &Packet, g: usize, prepared: &Prepared, lane: usize) -> Sides<S::F32x16> {
        let d = per_axis(|axis| S::F32x16::load(packet.own[axis].group(g)));
        let along = |i: usize| dot(d, prepared.vector::<S>(i, lane));
        Sides { u: along(0), v: along(1), det: along(2), depth: S::F32x16::splat(prepared.number[lane]) }
    }
}

/// Rays along one direction.
pub(crate) struct Direction {
    d: Vec3,
    axes: Axes,
    reciprocal: Vec3,
    bounds: Bounds,
    /// Of sides that are reckoned from 0 and not from an origin.
    wider: Bounds,
}

impl Direction {
    /// Along `d`, from no farther than `far` to any corner; no coordinate of either is beyond `most`.
    pub fn new(d: Vec3, far: f64, most: f32) -> Direction {
        let bounds = |far: f64| Bounds::new(d.as_dvec3().length(), far, 0.0);
        let wider = bounds(8.0 * (far + f64::from(most)));
        Direction { d, axes: axes(d).0, reciprocal: direction_reciprocal(d), bounds: bounds(far), wider }
    }
}

impl<S: Simd> Beam<S> for Direction {
    #[inline(always)]
    fn outlines(&self, node: &Bvh8Node) -> Outlines<S::F32x8> {
        let [k, a, b] = self.axes;
        let side = |axis: usize, end: usize| S::F32x8::load(&node.rows()[plane_row(axis, end) & 7]);
        let scale = 1.0 / self.d[k];
        let first = usize::from(scale < 0.0);
        let slope = |axis: usize| self.d[axis] / self.d[k];
        let [u, v] = [slope(a), slope(b)];
        // The end of k that makes the most of a difference.
        let lean = |slope: f32, end: usize| {
            let end = if slope >= 0.0 { 1 - end } else { end };
            side(k, end) * S::F32x8::splat(slope)
        };
        Outlines {
            low: [side(a, 0) - lean(u, 0), side(b, 0) - lean(v, 0)],
            high: [side(a, 1) - lean(u, 1), side(b, 1) - lean(v, 1)],
            near: side(k, first) * S::F32x8::splat(scale),
            far: side(k, 1 - first) * S::F32x8::splat(scale),
        }
    }

    #[inline(always)]
    fn planes(&self, node: &Bvh8Node, slot: usize) -> Planes {
        per_axis(|axis| {
            let first = usize::from(self.reciprocal[axis] < 0.0);
            [node.planes[axis][first][slot], node.planes[axis][1 - first][slot]]
        })
    }

    #[inline(always)]
    fn enters(&self, packet: &Packet, g: usize, planes: &Planes) -> u32 {
        let at = |axis: usize, end: usize| {
            let r = self.reciprocal[axis] * if end == 0 { NEAR_FACTOR } else { FAR_FACTOR };
            (S::F32x16::splat(planes[axis][end]) - S::F32x16::load(packet.own[axis].group(g)))
                * S::F32x16::splat(r)
        };
        let (start, upper) = (S::F32x16::load(packet.start.group(g)), S::F32x16::load(packet.upper.group(g)));
        let near = at(0, 0).max(at(1, 0).max(at(2, 0).max(start)));
        let far = at(0, 1).min(at(1, 1).min(at(2, 1).min(upper)));
        near.le(far)
    }

    #[inline(always)]
    fn prepare(&self, block: &Triangle4) -> Prepared {
        let [v0, v1, v2] = block.load_vertices::<S::F32x4>();
        let d = splat(self.d);
        let (e1, e2) = (sub(v1, v0), sub(v2, v0));
        let n = cross(e1, e2);
        // d·(e₂×c) = c·(d×e₂), and d·(c×e₁) = c·(e₁×d).
        let (u, v, det) = (cross(d, e2), cross(e1, d), dot(d, n));
        let (from_u, from_v) = (dot(u, v0), dot(v, v0));
        let zero = S::F32x4::splat(0.0);
        let constants = [zero - from_u, zero - from_v, from_u + from_v - det];
        Prepared::new::<S>([u, v, n, v0], det, constants)
    }

    /// All three the other way round, which makes no difference to what is on one side of all.
    #[inline(always)]
    fn across(&self, prepared: &Prepared) -> [[S::F32x16; 3]; 3] {
        let [_, a, b] = self.axes;
        let part = |i: usize, axis: usize| S::broadcast_quad(&prepared.vectors[i][axis % 3]);
        let constant = |i: usize| S::broadcast_quad(&prepared.constants[i]);
        let (u, v, zero) = ([part(0, a), part(0, b)], [part(1, a), part(1, b)], S::F32x16::splat(0.0));
        [
            [constant(0), u[0], u[1]],
            [constant(1), v[0], v[1]],
            [constant(2), zero - u[0] - v[0], zero - u[1] - v[1]],
        ]
    }

    #[inline(always)]
    fn certain(&self, block: &Triangle4) -> f32 {
        self.wider.of(block.max_edge).side
    }

    #[inline(always)]
    fn slack(&self, block: &Triangle4) -> Slack {
        self.bounds.of(block.max_edge)
    }

    #[inline(always)]
    fn sides(&self, packet: &Packet, g: usize, prepared: &Prepared, lane: usize) -> Sides<S::F32x16> {
        let o = per_axis(|axis| S::F32x16::load(packet.own[axis].group(g)));
        let c = sub(prepared.vector::<S>(3, lane), o);
        let along = |i: usize| dot(c, prepared.vector::<S>(i, lane));
        Sides { u: along(0), v: along(1), det: S::F32x16::splat(prepared.number[lane]), depth: along(2) }
    }
}

impl Prepared {
    #[inline(always)]
    fn new<S: Simd>(vectors: [[S::F32x4; 3]; 4], number: S::F32x4, constants: [S::F32x4; 3]) -> Prepared {
        let zero = [0.0; TRIANGLE_LANES];
        let mut prepared = Prepared { vectors: [[zero; 3]; 4], number: zero, constants: [zero; 3] };
        for (to, from) in prepared.vectors.iter_mut().zip(&vectors) {
            from[0].store(&mut to[0]);
            from[1].store(&mut to[1]);
            from[2].store(&mut to[2]);
        }
        number.store(&mut prepared.number);
        constants.into_iter().zip(&mut prepared.constants).for_each(|(of, to)| of.store(to));
        prepared
    }

    #[inline(always)]
    fn vector<S: Simd>(&self, i: usize, lane: usize) -> [S::F32x16; 3] {
        per_axis(|axis| S::F32x16::splat(self.vectors[i][axis][lane]))
    }
}
