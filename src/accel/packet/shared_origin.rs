//! Packets of rays from one origin: eye rays of a perspective camera, shadow rays of a point light.

use glam::Vec3;

use crate::bvh::bvh8::{Bvh8Node, plane_row};
use crate::bvh::triangle4::Triangle4;
use crate::packet::group_bounds::{LinearFunction, ProjectedBoxes};
use crate::packet::packet_frustum::AxisProjection;
use crate::packet::packet_kind::{BoxPlanes, PacketKind};
use crate::packet::prepared_triangles::{EdgeFunctions, PreparedTriangles};
use crate::packet::ray_packet::RayPacket;
use crate::traverse::box_test::{FAR_FACTOR, NEAR_FACTOR};
use crate::traverse::error_bounds::{BlockErrorBounds, EdgeFunctionBounds};
use blinn_core::simd::vec3::{cross, dot, per_axis, splat, sub};
use blinn_core::simd::{Lanes, Simd};

/// Depths below this count as this, so that their reciprocals are finite.
const MIN_DEPTH: f32 = 1e-30;

/// The four vectors of a [`PreparedTriangles`]: edge functions and the determinant are their dot products with the
/// direction.
const U: usize = 0;
const V: usize = 1;
const N: usize = 2;
const W: usize = 3;

/// Rays from one origin.
pub(super) struct SharedOrigin {
    pub o: Vec3,
    pub projection: AxisProjection,
    /// The least 1/|d_major|, with d_major the component of a direction along the major axis.
    pub min_inv_major: f32,
    pub bounds: EdgeFunctionBounds,
    /// The side by which rays enter boxes, by axis, where all rays agree on it.
    pub near_sides: Option<[usize; 3]>,
}

impl<S: Simd> PacketKind<S> for SharedOrigin {
    #[inline(always)]
    fn project_children(&self, node: &Bvh8Node) -> ProjectedBoxes<S::F32x8> {
        let rows = node.rows();
        let [major, a, b] = self.projection.axes;
        let sign = self.projection.sign;
        let near_side = usize::from(sign < 0.0);
        let plane = |axis: usize, side: usize| S::F32x8::load(&rows[plane_row(axis, side) & 7]);
        let origin = |axis: usize| S::F32x8::splat(self.o[axis]);
        let origin_depth = S::F32x8::splat(sign * self.o[major]);
        let sign = S::F32x8::splat(sign);
        let near = plane(major, near_side).mul_sub(sign, origin_depth);
        let far = plane(major, 1 - near_side).mul_sub(sign, origin_depth);
        let min_depth = S::F32x8::splat(MIN_DEPTH);
        let inv_near = near.max(min_depth).rcp();
        let inv_far = far.max(min_depth).rcp();
        let a0 = plane(a, 0) - origin(a);
        let a1 = plane(a, 1) - origin(a);
        let b0 = plane(b, 0) - origin(b);
        let b1 = plane(b, 1) - origin(b);
        ProjectedBoxes {
            min: [(a0 * inv_near).min(a0 * inv_far), (b0 * inv_near).min(b0 * inv_far)],
            max: [(a1 * inv_near).max(a1 * inv_far), (b1 * inv_near).max(b1 * inv_far)],
            near,
            far,
        }
    }

    /// Returns the planes relative to the origin. Where the near sides are known, they come first, with slack.
    #[inline(always)]
    fn box_planes(&self, node: &Bvh8Node, slot: usize) -> BoxPlanes {
        let near_sides = self.near_sides.unwrap_or([0; 3]);
        let slack = if self.near_sides.is_some() { [NEAR_FACTOR, FAR_FACTOR] } else { [1.0; 2] };
        per_axis(|axis| {
            let plane = |side: usize| node.rows()[plane_row(axis, side) & 7][slot] - self.o[axis];
            [plane(near_sides[axis]) * slack[0], plane(1 - near_sides[axis]) * slack[1]]
        })
    }

    #[inline(always)]
    fn intersect_box(&self, packet: &RayPacket, g: usize, planes: &BoxPlanes) -> u32 {
        let t = |axis: usize, side: usize| {
            S::F32x16::load(packet.reciprocal[axis].group(g)) * S::F32x16::splat(planes[axis][side])
        };
        let t_min = S::F32x16::load(packet.t_min.group(g));
        let t_max = S::F32x16::load(packet.t_max_upper.group(g));
        if self.near_sides.is_some() {
            let near = t(0, 0).max(t(1, 0).max(t(2, 0).max(t_min)));
            let far = t(0, 1).min(t(1, 1).min(t(2, 1).min(t_max)));
            near.le(far)
        } else {
            let near = |axis: usize| t(axis, 0).min(t(axis, 1));
            let far = |axis: usize| t(axis, 0).max(t(axis, 1));
            let near = near(0).max(near(1)).max(near(2)) * S::F32x16::splat(NEAR_FACTOR);
            let far = far(0).min(far(1)).min(far(2)) * S::F32x16::splat(FAR_FACTOR);
            near.max(t_min).le(far.min(t_max))
        }
    }

    /// With the origin fixed, e₂×c, c×e₁ and the depth do not depend on the ray.
    #[inline(always)]
    fn prepare(&self, block: &Triangle4) -> PreparedTriangles {
        let [v0, v1, v2] = block.load_vertices::<S::F32x4>();
        let c = sub(v0, splat(self.o));
        let e1 = sub(v1, v0);
        let e2 = sub(v2, v0);
        let n = cross(e1, e2);
        let u = cross(e2, c);
        let v = cross(c, e1);
        let w = sub(sub(n, u), v);
        PreparedTriangles::new::<S>([u, v, n, w], dot(c, n), [dot(c, n); 3])
    }

    #[inline(always)]
    fn error_bounds(&self, block: &Triangle4) -> BlockErrorBounds {
        self.bounds.for_max_edge(block.max_edge)
    }

    #[inline(always)]
    fn projected_edge_functions(&self, prepared: &PreparedTriangles) -> [LinearFunction<S::F32x16>; 3] {
        let [major, a, b] = self.projection.axes;
        let sign = S::F32x16::splat(self.projection.sign);
        let component = |i: usize, axis: usize| S::broadcast_quad(&prepared.vectors[i][axis % 3]);
        [
            [component(U, major) * sign, component(U, a), component(U, b)],
            [component(V, major) * sign, component(V, a), component(V, b)],
            [component(W, major) * sign, component(W, a), component(W, b)],
        ]
    }

    #[inline(always)]
    fn projected_error(&self, block: &Triangle4) -> f32 {
        // Directions are scaled to 1 along the major axis.
        4.0 * self.min_inv_major * self.bounds.for_max_edge(block.max_edge).edge_function
    }

    #[inline(always)]
    fn edge_functions(
        &self,
        packet: &RayPacket,
        g: usize,
        prepared: &PreparedTriangles,
        lane: usize,
    ) -> EdgeFunctions<S::F32x16> {
        let d = per_axis(|axis| S::F32x16::load(packet.varying[axis].group(g)));
        let dot_d = |i: usize| dot(d, prepared.splat_vector::<S>(i, lane));
        EdgeFunctions {
            u: dot_d(U),
            v: dot_d(V),
            det: dot_d(N),
            depth: S::F32x16::splat(prepared.shared_term[lane]),
        }
    }
}
