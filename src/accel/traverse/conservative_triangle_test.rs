//! Conservative f32 ray–triangle test: one ray against the four triangles of a block.
//!
//! It rejects the triangles that the ray certainly misses and classifies the others. The exact test
//! ([`LocalRay::intersect`]) decides about those.

use glam::{DVec3, Vec3};

use crate::bvh::triangle4::Triangle4;
use crate::traverse::error_bounds::{EdgeFunctionBounds, W_SCALE};
use crate::traverse::exact_triangle_test::LocalRay;
use blinn_core::geometry::EPSILON;
use blinn_core::simd::vec3::{Vec3Lanes, cross, dot, splat, sub};
use blinn_core::simd::{Lanes, Simd};

/// A fraction of the distance from a light: a hit nearer to the light than this may round to the light itself.
pub(crate) const LIGHT_MARGIN: f32 = 1.0 / (1u32 << 22) as f32;

/// A ray prepared for the blocks of one BVH.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleTestRay {
    o: Vec3,
    d: Vec3,
    bounds: EdgeFunctionBounds,
    /// Certain hits between these, in the ray's own parameter, may end the query early.
    early_exit_t_min: f32,
    early_exit_t_max: f32,
}

/// The triangles of a block that a ray may hit, as lane masks.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Candidates {
    /// Triangles that the ray possibly hits.
    pub possible: u32,
    /// The triangles among them that the line of the ray certainly passes through.
    pub inside: u32,
    /// The hits among them that are certainly within the early-exit interval.
    pub early_exit: u32,
}

impl TriangleTestRay {
    /// Prepares a ray for triangles within `radius` of `centre`. Certain hits before `early_exit_t_max` are marked
    /// in [`Candidates::early_exit`]; none are without it.
    #[inline(always)]
    pub fn new(ray: &LocalRay, centre: DVec3, radius: f64, early_exit_t_max: Option<f32>) -> TriangleTestRay {
        let o = ray.o.as_vec3();
        let d = ray.d.as_vec3();
        let max_distance = ray.o.distance(centre) + radius;
        let rounded_origin = if o.as_dvec3() == ray.o { 0.0 } else { ray.o.length() };
        // A hit so near the light that 1 − t rounds to 1 does not occlude.
        let early_exit_t_min = if ray.from_light { ray.local_t(LIGHT_MARGIN) } else { 0.0 };
        TriangleTestRay {
            o,
            d,
            bounds: EdgeFunctionBounds::new(ray.d.length(), max_distance, rounded_origin),
            early_exit_t_min,
            early_exit_t_max: early_exit_t_max.map_or(-1.0, |t| ray.local_t(t) * (1.0 - 8.0 * EPSILON)),
        }
    }

    /// Returns the triangles of `block` that the ray may hit before `t_max`, in its own parameter.
    #[inline(always)]
    pub fn candidates<S: Simd>(&self, block: &Triangle4, t_max: f32) -> Candidates {
        let o: Vec3Lanes<S::F32x4> = splat(self.o);
        let d: Vec3Lanes<S::F32x4> = splat(self.d);
        let [v0, v1, v2] = block.load_vertices::<S::F32x4>();
        let c = sub(v0, o);
        let e1 = sub(v1, v0);
        let e2 = sub(v2, v0);
        let n = cross(e1, e2);
        let det = dot(d, n);
        let depth = dot(c, n);
        let u = dot(d, cross(e2, c));
        let v = dot(d, cross(c, e1));
        let w = (det - u - v) * S::F32x4::splat(W_SCALE);
        let bounds = self.bounds.for_max_edge(block.max_edge);
        let error = S::F32x4::splat(bounds.edge_function);
        let negative_error = S::F32x4::splat(-bounds.edge_function);
        let min = u.min(v).min(w);
        let max = u.max(v).max(w);
        // NaN compares false and stays a candidate.
        let outside = min.lt(negative_error) & error.lt(max);
        let mut possible = block.lane_mask() & !outside;
        if possible == 0 {
            return Candidates::default();
        }
        let sign_is_certain = S::F32x4::splat(bounds.min_determinant).lt(det.abs());
        let depth = depth.xor_sign(det);
        let det = det.abs();
        let depth_error = S::F32x4::splat(bounds.depth);
        let depth_min = depth - depth_error;
        let depth_max = depth + depth_error;
        let out_of_range = (det * S::F32x4::splat(t_max)).lt(depth_min) | depth_max.lt(S::F32x4::splat(0.0));
        possible &= !(out_of_range & sign_is_certain);
        let inside = possible & sign_is_certain & (error.lt(min) | max.lt(negative_error));
        let early_exit = inside
            & (det * S::F32x4::splat(self.early_exit_t_min)).lt(depth_min)
            & depth_max.lt(det * S::F32x4::splat(self.early_exit_t_max));
        Candidates { possible, inside, early_exit }
    }
}
