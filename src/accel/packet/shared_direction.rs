//! Packets of rays along one direction: eye rays of an orthographic camera, shadow rays of a directional light.

use glam::Vec3;

use crate::bvh::bvh8::{Bvh8Node, plane_row};
use crate::bvh::triangle4::Triangle4;
use crate::packet::group_bounds::{LinearFunction, ProjectedBoxes};
use crate::packet::packet_frustum::AxisProjection;
use crate::packet::packet_kind::{BoxPlanes, PacketKind};
use crate::packet::prepared_triangles::{EdgeFunctions, PreparedTriangles};
use crate::packet::ray_packet::RayPacket;
use crate::traverse::box_test::{FAR_FACTOR, NEAR_FACTOR, direction_reciprocal};
use crate::traverse::error_bounds::{BlockErrorBounds, EdgeFunctionBounds};
use blinn_core::simd::vec3::{cross, dot, per_axis, splat, sub};
use blinn_core::simd::{Lanes, Simd};

/// The four vectors of a [`PreparedTriangles`]: edge functions and the depth are dot products of the first three with
/// v₀ − o.
const U: usize = 0;
const V: usize = 1;
const N: usize = 2;
const V0: usize = 3;

/// Rays along one direction.
pub(super) struct SharedDirection {
    d: Vec3,
    projection: AxisProjection,
    reciprocal: Vec3,
    bounds: EdgeFunctionBounds,
    /// Bounds for projected edge functions, which are relative to the world's origin instead of a ray's.
    projected_bounds: EdgeFunctionBounds,
}

impl SharedDirection {
    /// Rays along `d` from no farther than `max_distance` to any vertex. No coordinate of origins or vertices is
    /// beyond `max_coordinate`.
    pub fn new(d: Vec3, max_distance: f64, max_coordinate: f32) -> SharedDirection {
        let bounds = |max_distance: f64| EdgeFunctionBounds::new(d.as_dvec3().length(), max_distance, 0.0);
        SharedDirection {
            d,
            projection: AxisProjection::along(d),
            reciprocal: direction_reciprocal(d),
            bounds: bounds(max_distance),
            projected_bounds: bounds(8.0 * (max_distance + f64::from(max_coordinate))),
        }
    }
}

impl<S: Simd> PacketKind<S> for SharedDirection {
    #[inline(always)]
    fn project_children(&self, node: &Bvh8Node) -> ProjectedBoxes<S::F32x8> {
        let [major, a, b] = self.projection.axes;
        let plane = |axis: usize, side: usize| S::F32x8::load(&node.rows()[plane_row(axis, side) & 7]);
        let inv_major = 1.0 / self.d[major];
        let near_side = usize::from(inv_major < 0.0);
        let slope_a = self.d[a] / self.d[major];
        let slope_b = self.d[b] / self.d[major];
        // The side of the box along the major axis that moves the given side the farthest outwards.
        let shear = |slope: f32, side: usize| {
            let side = if slope >= 0.0 { 1 - side } else { side };
            plane(major, side) * S::F32x8::splat(slope)
        };
        ProjectedBoxes {
            min: [plane(a, 0) - shear(slope_a, 0), plane(b, 0) - shear(slope_b, 0)],
            max: [plane(a, 1) - shear(slope_a, 1), plane(b, 1) - shear(slope_b, 1)],
            near: plane(major, near_side) * S::F32x8::splat(inv_major),
            far: plane(major, 1 - near_side) * S::F32x8::splat(inv_major),
        }
    }

    /// Returns the planes with near sides first.
    #[inline(always)]
    fn box_planes(&self, node: &Bvh8Node, slot: usize) -> BoxPlanes {
        per_axis(|axis| {
            let near_side = usize::from(self.reciprocal[axis] < 0.0);
            [node.planes[axis][near_side][slot], node.planes[axis][1 - near_side][slot]]
        })
    }

    #[inline(always)]
    fn intersect_box(&self, packet: &RayPacket, g: usize, planes: &BoxPlanes) -> u32 {
        let t = |axis: usize, side: usize| {
            let r = self.reciprocal[axis] * if side == 0 { NEAR_FACTOR } else { FAR_FACTOR };
            let origin = S::F32x16::load(packet.varying[axis].group(g));
            (S::F32x16::splat(planes[axis][side]) - origin) * S::F32x16::splat(r)
        };
        let t_min = S::F32x16::load(packet.t_min.group(g));
        let t_max = S::F32x16::load(packet.t_max_upper.group(g));
        let near = t(0, 0).max(t(1, 0).max(t(2, 0).max(t_min)));
        let far = t(0, 1).min(t(1, 1).min(t(2, 1).min(t_max)));
        near.le(far)
    }

    /// With the direction fixed, d×e₂, e₁×d and the determinant do not depend on the ray: d·(e₂×c) = c·(d×e₂) and
    /// d·(c×e₁) = c·(e₁×d).
    #[inline(always)]
    fn prepare(&self, block: &Triangle4) -> PreparedTriangles {
        let [v0, v1, v2] = block.load_vertices::<S::F32x4>();
        let d = splat(self.d);
        let e1 = sub(v1, v0);
        let e2 = sub(v2, v0);
        let n = cross(e1, e2);
        let u = cross(d, e2);
        let v = cross(e1, d);
        let det = dot(d, n);
        let u_at_v0 = dot(u, v0);
        let v_at_v0 = dot(v, v0);
        let zero = S::F32x4::splat(0.0);
        let constants = [zero - u_at_v0, zero - v_at_v0, u_at_v0 + v_at_v0 - det];
        PreparedTriangles::new::<S>([u, v, n, v0], det, constants)
    }

    #[inline(always)]
    fn error_bounds(&self, block: &Triangle4) -> BlockErrorBounds {
        self.bounds.for_max_edge(block.max_edge)
    }

    /// Returns −u, −v and −w.
    #[inline(always)]
    fn projected_edge_functions(&self, prepared: &PreparedTriangles) -> [LinearFunction<S::F32x16>; 3] {
        let [_, a, b] = self.projection.axes;
        let component = |i: usize, axis: usize| S::broadcast_quad(&prepared.vectors[i][axis % 3]);
        let constant = |i: usize| S::broadcast_quad(&prepared.constants[i]);
        let u = [component(U, a), component(U, b)];
        let v = [component(V, a), component(V, b)];
        let zero = S::F32x16::splat(0.0);
        [
            [constant(0), u[0], u[1]],
            [constant(1), v[0], v[1]],
            [constant(2), zero - u[0] - v[0], zero - u[1] - v[1]],
        ]
    }

    #[inline(always)]
    fn projected_error(&self, block: &Triangle4) -> f32 {
        self.projected_bounds.for_max_edge(block.max_edge).edge_function
    }

    #[inline(always)]
    fn edge_functions(
        &self,
        packet: &RayPacket,
        g: usize,
        prepared: &PreparedTriangles,
        lane: usize,
    ) -> EdgeFunctions<S::F32x16> {
        let o = per_axis(|axis| S::F32x16::load(packet.varying[axis].group(g)));
        let c = sub(prepared.splat_vector::<S>(V0, lane), o);
        let dot_c = |i: usize| dot(c, prepared.splat_vector::<S>(i, lane));
        EdgeFunctions {
            u: dot_c(U),
            v: dot_c(V),
            det: S::F32x16::splat(prepared.shared_term[lane]),
            depth: dot_c(N),
        }
    }
}
