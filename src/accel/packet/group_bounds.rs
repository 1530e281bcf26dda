//! Culling of boxes and triangles against ray groups, by rectangles on a projection plane.
//!
//! The plane lies across the rays. Rays from one origin cross it at their tangents; rays of one direction at their
//! origins, moved along the direction. The rays of a group cross it within a rectangle, and a box covers at most a
//! rectangle of its own. So six comparisons find the children of a node that any ray may enter, and five the groups
//! that may enter a child. An edge function of a triangle is linear on the plane, so that its range over a rectangle
//! tells where all rays of a group certainly pass on one side of the edge.
//!
//! Distances along the major axis are called depths.

use glam::Vec3;

use crate::bvh::bvh8::WIDTH;
use crate::packet::packet_frustum::{AxisProjection, MAX_SPREAD};
use crate::packet::per_ray::{GROUPS_PER_QUAD, QUADS_PER_PACKET, RAYS_PER_GROUP};
use crate::packet::ray_packet::RayPacket;
use crate::traverse::box_test::{FAR_FACTOR, NEAR_FACTOR};
use blinn_core::geometry::EPSILON;
use blinn_core::simd::vec3::per_axis;
use blinn_core::simd::{Lanes, Simd};

/// Bounds of a node's children on the projection plane, a child in each lane.
#[derive(Clone, Copy)]
pub(super) struct ProjectedBoxes<L> {
    /// Minimum by the two axes of the plane.
    pub min: [L; 2],
    /// Maximum by the two axes of the plane.
    pub max: [L; 2],
    /// Depths where the boxes begin.
    pub near: L,
    /// Depths where the boxes end.
    pub far: L,
}

/// Bounds of one child on the projection plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProjectedBox {
    pub min: [f32; 2],
    pub max: [f32; 2],
    /// The depth where the box begins.
    pub near: f32,
}

/// A linear function on the projection plane, such as an edge function: constant, slope along a, slope along b.
pub(super) type LinearFunction<L> = [L; 3];

/// Bounds of all rays of a packet.
#[derive(Clone, Copy, Debug)]
struct PacketBounds {
    min: [f32; 2],
    max: [f32; 2],
    /// Boxes that end before this depth are behind all rays.
    near: f32,
}

/// Bounds of a packet and of its groups on the projection plane.
#[derive(Clone, Copy)]
pub(super) struct GroupBounds<L> {
    packet: PacketBounds,
    /// Minimum by the two axes, a group in each lane.
    min: [L; 2],
    /// Maximum by the two axes, a group in each lane.
    max: [L; 2],
    /// `max` − `min`.
    size: [L; 2],
    /// Centre by quad and the two axes. Each group of the quad fills four lanes, for the triangles of a block.
    quad_centre: [[L; 2]; QUADS_PER_PACKET],
    /// Half of the size, laid out as `quad_centre`.
    quad_half_size: [[L; 2]; QUADS_PER_PACKET],
    /// A ray is no deeper at t than t·depth_scale + depth_shift.
    depth_scale: f32,
    /// See `depth_scale`; by quad, each group in four lanes.
    depth_shift: [L; QUADS_PER_PACKET],
}

/// The depth beyond which hits have no effect on a group.
#[derive(Clone, Copy)]
pub(super) struct FarLimit<L> {
    /// By quad. Each group fills four lanes.
    quads: [L; QUADS_PER_PACKET],
    /// A group in each lane.
    groups: L,
    packet: f32,
}

impl<L: Lanes<RAYS_PER_GROUP>> GroupBounds<L> {
    /// Bounds of rays from one origin: tangents, and depths relative to the origin.
    #[inline(always)]
    pub fn of_directions<S: Simd<F32x16 = L>>(packet: &RayPacket) -> GroupBounds<L> {
        let frustum = &packet.frustum;
        let [a0, a1, b0, b1] = frustum.tangents;
        let near = packet.min_t_min::<S>() * (NEAR_FACTOR * NEAR_FACTOR / frustum.max_inv_major);
        let packet_bounds = PacketBounds { min: [a0, b0], max: [a1, b1], near };
        let mut bounds = GroupBounds::new(packet_bounds, FAR_FACTOR / frustum.min_inv_major);
        for q in 0..packet.quads {
            let [a0, a1, b0, b1] = &frustum.group_tangents[q];
            bounds.set_quad(q, [L::load(a0), L::load(a1), L::load(b0), L::load(b1)]);
        }
        bounds.pack_groups::<S>(packet.quads);
        bounds
    }

    /// Bounds of rays along `d` from the packet's origins, in a BVH with coordinates up to `max_coordinate` and this
    /// `radius`. `None` where the origins spread too far.
    #[inline(always)]
    pub fn of_origins<S: Simd<F32x16 = L>>(
        packet: &RayPacket,
        d: Vec3,
        max_coordinate: f32,
        radius: f32,
    ) -> Option<GroupBounds<L>> {
        let axes = AxisProjection::along(d).axes;
        let [major, a, b] = axes;
        let slope_a = d[a] / d[major];
        let slope_b = d[b] / d[major];
        let inv_major = 1.0 / d[major];
        let zero = L::splat(0.0);
        let infinity = L::splat(f32::INFINITY);
        let max_slope = slope_a.abs().max(slope_b.abs());
        let error = 16.0 * EPSILON * (1.0 + max_slope) * (max_coordinate + packet.max_coordinate);
        let plane_error = L::splat(error);
        let depth_error = L::splat(2.0 * error * inv_major.abs());
        let no_bounds = PacketBounds { min: [0.0; 2], max: [0.0; 2], near: 0.0 };
        let mut bounds = GroupBounds::new(no_bounds, 1.0);
        let mut min = [infinity; 2];
        let mut max = [zero - infinity; 2];
        let mut near = infinity;
        for q in 0..packet.quads {
            let mut plane_a = [zero; GROUPS_PER_QUAD];
            let mut plane_b = [zero; GROUPS_PER_QUAD];
            let mut depth = [zero; GROUPS_PER_QUAD];
            for i in 0..GROUPS_PER_QUAD {
                let o = per_axis(|axis| L::load(&packet.varying[axes[axis]].quads[q][i]));
                plane_a[i] = o[1] - o[0] * L::splat(slope_a);
                plane_b[i] = o[2] - o[0] * L::splat(slope_b);
                depth[i] = o[0] * L::splat(inv_major);
            }
            let a0 = S::reduce_min_each(plane_a) - plane_error;
            let a1 = S::reduce_max_each(plane_a) + plane_error;
            let b0 = S::reduce_min_each(plane_b) - plane_error;
            let b1 = S::reduce_max_each(plane_b) + plane_error;
            bounds.set_quad(q, [a0, a1, b0, b1]);
            bounds.depth_shift[q] = S::reduce_max_each(depth) + depth_error;
            near = near.min(S::reduce_min_each(depth) - depth_error);
            min = [min[0].min(a0), min[1].min(b0)];
            max = [max[0].max(a1), max[1].max(b1)];
        }
        let min = [min[0].reduce_min(), min[1].reduce_min()];
        let max = [max[0].reduce_max(), max[1].reduce_max()];
        let max_size = MAX_SPREAD * radius + 2.0 * error;
        if !(max[0] - min[0] <= max_size && max[1] - min[1] <= max_size && inv_major.is_finite()) {
            return None;
        }
        let near = packet.min_t_min::<S>() * NEAR_FACTOR + near.reduce_min();
        bounds.packet = PacketBounds { min, max, near };
        bounds.pack_groups::<S>(packet.quads);
        Some(bounds)
    }

    /// Bounds without any group yet.
    #[inline(always)]
    fn new(packet: PacketBounds, depth_scale: f32) -> GroupBounds<L> {
        let zero = L::splat(0.0);
        GroupBounds {
            packet,
            min: [zero; 2],
            max: [zero; 2],
            size: [zero; 2],
            quad_centre: [[zero; 2]; QUADS_PER_PACKET],
            quad_half_size: [[zero; 2]; QUADS_PER_PACKET],
            depth_scale,
            depth_shift: [zero; QUADS_PER_PACKET],
        }
    }

    /// Sets the bounds of the four groups of a quad.
    #[inline(always)]
    fn set_quad(&mut self, q: usize, [a0, a1, b0, b1]: [L; 4]) {
        // The bounds were enlarged by more than these halves and sums are rounded by.
        let half = L::splat(0.5);
        self.quad_centre[q] = [(a0 + a1) * half, (b0 + b1) * half];
        self.quad_half_size[q] = [(a1 - a0) * half, (b1 - b0) * half];
    }

    /// Computes the bounds with a group in each lane from those of quads.
    #[inline(always)]
    fn pack_groups<S: Simd<F32x16 = L>>(&mut self, quads: usize) {
        for q in quads..QUADS_PER_PACKET {
            self.quad_centre[q] = self.quad_centre[0];
            self.quad_half_size[q] = self.quad_half_size[0];
        }
        for axis in 0..2 {
            let [c0, c1, c2, c3] = &self.quad_centre;
            let [h0, h1, h2, h3] = &self.quad_half_size;
            let centre = S::pack_quads([c0[axis], c1[axis], c2[axis], c3[axis]]);
            let half_size = S::pack_quads([h0[axis], h1[axis], h2[axis], h3[axis]]);
            self.min[axis] = centre - half_size;
            self.max[axis] = centre + half_size;
            self.size[axis] = half_size * L::splat(2.0);
        }
    }

    /// Computes the far limit from each ray's upper bound on t.
    #[inline(always)]
    pub fn far_limit<S: Simd<F32x16 = L>>(&self, packet: &RayPacket) -> FarLimit<L> {
        let nothing = L::splat(f32::NEG_INFINITY);
        let mut limit = FarLimit { quads: [nothing; QUADS_PER_PACKET], groups: nothing, packet: 0.0 };
        for q in 0..packet.quads {
            limit.quads[q] = self.quad_far_limit::<S>(packet, q);
        }
        limit.pack_groups::<S>();
        limit
    }

    /// Updates the far limit after hits in some groups.
    #[inline(always)]
    pub fn update_far_limit<S: Simd<F32x16 = L>>(
        &self,
        packet: &RayPacket,
        changed_groups: u32,
        limit: &mut FarLimit<L>,
    ) {
        for q in 0..packet.quads {
            if changed_groups >> (q * GROUPS_PER_QUAD) & ((1 << GROUPS_PER_QUAD) - 1) != 0 {
                limit.quads[q] = self.quad_far_limit::<S>(packet, q);
            }
        }
        limit.pack_groups::<S>();
    }

    #[inline(always)]
    fn quad_far_limit<S: Simd<F32x16 = L>>(&self, packet: &RayPacket, q: usize) -> L {
        let t_max = S::reduce_max_each(packet.t_max_upper.load_quad::<L>(q));
        let depth = t_max.mul_add(L::splat(self.depth_scale * FAR_FACTOR), self.depth_shift[q]);
        // Hits have no effect on a group without active rays.
        L::splat(f32::NEG_INFINITY).select(t_max.lt(L::splat(0.0)), depth)
    }

    /// Returns a bit for each child that any ray may enter before the far limit.
    #[inline(always)]
    pub fn hit_children<L8: Lanes<WIDTH>>(&self, boxes: &ProjectedBoxes<L8>, limit: &FarLimit<L>) -> u32 {
        let PacketBounds { min, max, near } = self.packet;
        boxes.min[0].le(L8::splat(max[0]))
            & L8::splat(min[0]).le(boxes.max[0])
            & boxes.min[1].le(L8::splat(max[1]))
            & L8::splat(min[1]).le(boxes.max[1])
            & boxes.near.le(L8::splat(limit.packet))
            & L8::splat(near).le(boxes.far)
    }

    /// Returns a bit for each group that may enter a child before its far limit.
    #[inline(always)]
    pub fn hit_groups(&self, child: &ProjectedBox, limit: &FarLimit<L>) -> u32 {
        L::splat(child.min[0]).le(self.max[0])
            & self.min[0].le(L::splat(child.max[0]))
            & L::splat(child.min[1]).le(self.max[1])
            & self.min[1].le(L::splat(child.max[1]))
            & L::splat(child.near).le(limit.groups)
    }

    /// Returns a bit for each group whose rectangle is larger than the child's along an axis.
    #[inline(always)]
    pub fn groups_larger_than(&self, child: &ProjectedBox) -> u32 {
        L::splat(child.max[0] - child.min[0]).lt(self.size[0])
            | L::splat(child.max[1] - child.min[1]).lt(self.size[1])
    }

    /// Returns the triangles of a block that all rays of a group certainly miss: a bit for each group of a quad and
    /// each triangle. Edge functions have a certain sign beyond `error`.
    #[inline(always)]
    pub fn missed_triangles(&self, q: usize, edge_functions: &[LinearFunction<L>; 3], error: f32) -> u32 {
        let [u_min, u_max] = self.range(q, edge_functions[0]);
        let [v_min, v_max] = self.range(q, edge_functions[1]);
        let [w_min, w_max] = self.range(q, edge_functions[2]);
        // No ray has three values of one sign: one function is negative everywhere, and another one positive.
        let any_negative = u_max.min(v_max).min(w_max).lt(L::splat(-error));
        any_negative & L::splat(error).lt(u_min.max(v_min).max(w_min))
    }

    /// Returns the minimum and the maximum of a function over the rectangle of each group.
    #[inline(always)]
    fn range(&self, q: usize, [constant, slope_a, slope_b]: LinearFunction<L>) -> [L; 2] {
        let [centre_a, centre_b] = self.quad_centre[q];
        let [half_size_a, half_size_b] = self.quad_half_size[q];
        let centre = slope_a.mul_add(centre_a, slope_b.mul_add(centre_b, constant));
        let half_range = slope_a.abs().mul_add(half_size_a, slope_b.abs() * half_size_b);
        [centre - half_range, centre + half_range]
    }
}

impl<L: Lanes<RAYS_PER_GROUP>> FarLimit<L> {
    /// Computes the limits with a group in each lane, and that of the packet, from those of quads.
    #[inline(always)]
    fn pack_groups<S: Simd<F32x16 = L>>(&mut self) {
        self.groups = S::pack_quads(self.quads);
        self.packet = self.groups.reduce_max();
    }
}
