//! The exact ray–triangle test: does a ray hit a triangle, and at which t? It is watertight and independent of the
//! BVH.
//!
//! **Whether** a ray hits is decided by signs that are never wrong. The f32 edge functions have a bound on their
//! rounding error; for almost every triangle they prove a miss. Otherwise the same functions are evaluated in f64,
//! where each is either certain or within 48 ulps of zero, which counts as inside. So a ray through a shared edge or
//! vertex of a closed mesh is inside at least one of the triangles there: there are no cracks, whatever the angle,
//! the distance or the scale. No other code may decide whether a triangle is hit.
//!
//! A ray may therefore hit several triangles at a shared edge or vertex. For opaque surfaces that is harmless. At
//! translucent surfaces each of them would attenuate the light, so the tie is broken: only the triangle that still
//! contains the ray after a small fixed rotation owns the hit ([`TriangleHit::owned`]).
//!
//! **Where** it hits is always computed in f64 from the f32 vertices, clamped to the triangle's bounding box and
//! rounded once to f32. So t is accurate to about one ulp, does not depend on the SIMD lane or the BVH that found
//! it, and is never less than the entry distance of a box around the triangle. A traversal that skips boxes strictly
//! beyond the closest t so far, give or take a few ulps, can neither lose nor reorder hits. An f32 t would have a
//! relative error of 1e-3 at grazing angles, and the picture would depend on the BVH.
//!
//! There is no fused multiply-add: it would give different bits on different machines.

#[cfg(test)]
mod tests;

use glam::{DVec3, Vec3};

use crate::bvh::aabb::Aabb;
use crate::bvh::canonical_triangle::MIN_PADDING;
use blinn_core::geometry::EPSILON;

/// An edge function in f64 counts as zero up to this multiple of the product of its factors' magnitudes.
const EDGE_TOLERANCE: f64 = 48.0 * f64::EPSILON;

/// Direction of the small rotation that breaks ties at edges and vertices. An edge function that is zero takes the
/// sign of its change, which is opposite in the two triangles at the edge: the rotated ray is in one of them, and in
/// one of all triangles around a vertex. No model has edges along this direction.
const TIE_BREAK_DIRECTION: DVec3 = DVec3::new(0.347_296_355, 0.618_033_989, -0.705_285_234);

/// Determinants below this multiple of the product of their factors' magnitudes belong to grazing rays, whose t needs
/// clamping. Above it, rounding moves t by less than 2⁻³³ of the triangle's size and distance, far within the slack
/// of BVH boxes. A power of two.
pub(crate) const GRAZING_DETERMINANT: f64 = 1.0 / 65536.0;

/// The intersection of a ray and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    pub t: f32,
    /// True if the vertices are in counter-clockwise order as seen along the ray: d·n < 0.
    pub ccw: bool,
    /// False where the ray passes through an edge or vertex and another triangle there owns the hit.
    pub owned: bool,
}

/// A ray in the local frame of a BVH, in f64.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    pub o: DVec3,
    pub d: DVec3,
    /// A local t is this many times the caller's t. A power of two.
    pub t_scale: f64,
    /// 1 / `t_scale`.
    pub inv_t_scale: f64,
    /// True for shadow rays that are traced from the light. Their hits have t counted from the surface at the far
    /// end, where it has to be exact, to the light.
    pub from_light: bool,
}

impl LocalRay {
    /// Scales the direction to about unit length by a power of two, so that neither huge nor tiny directions
    /// overflow. Returns `None` for rays that are not finite or have no direction.
    #[inline(always)]
    pub fn new(o: DVec3, d: DVec3) -> Option<LocalRay> {
        let max_component = d.x.abs().max(d.y.abs()).max(d.z.abs());
        // Infinity and NaN times 0 are NaN, and so is every sum with NaN.
        let finite = (o.x + d.x) * 0.0 + (o.y + d.y) * 0.0 + (o.z + d.z) * 0.0 == 0.0;
        if !(finite && max_component >= f64::MIN_POSITIVE) {
            return None;
        }
        let t_scale = floor_power_of_two(max_component);
        let inv_t_scale = invert_power_of_two(t_scale);
        Some(LocalRay { o, d: d * inv_t_scale, t_scale, inv_t_scale, from_light: false })
    }

    /// The shadow ray from a light, at t = 0, to a surface point. It hits only triangles between the two, and reports t in
    /// the other direction: 0 at the point, 1 at the light.
    #[inline(always)]
    pub fn from_light_to_point(light: Vec3, point: Vec3) -> Option<LocalRay> {
        let light = light.as_dvec3();
        let mut ray = LocalRay::new(light, point.as_dvec3() - light)?;
        ray.from_light = true;
        Some(ray)
    }

    /// Returns a caller's t as this ray's parameter. The ends of a shadow ray are 0 and 1 either way.
    #[inline(always)]
    pub fn local_t(&self, t: f32) -> f32 {
        (f64::from(t) * self.t_scale) as f32
    }

    /// Intersects the ray with a triangle. If `inside`, its line is known to pass through the triangle.
    #[inline(always)]
    pub fn intersect(&self, v: &[Vec3; 3], inside: bool) -> Option<TriangleHit> {
        if inside { self.intersect_inside(v) } else { self.intersect_f64(v) }
    }

    /// Intersects the ray with a triangle by edge functions in f64. Hits have a positive t.
    ///
    /// An edge from a to b, relative to the ray's origin, has the edge function d·((a + b)×(b − a)), which is
    /// 2d·(a×b) without its cancellation. Both triangles at an edge compute the same value but for the sign.
    #[inline(never)]
    pub fn intersect_f64(&self, v: &[Vec3; 3]) -> Option<TriangleHit> {
        let v64 = v.map(|p| p.as_dvec3());
        let a = v64.map(|p| p - self.o);
        let magnitude = |p: DVec3| p.abs().max_element();
        let tolerance = EDGE_TOLERANCE * magnitude(self.d);
        let mut any_negative = false;
        let mut any_positive = false;
        let mut on_edge = false;
        // Signs of the zero edge functions for the rotated ray.
        let mut any_rotated_negative = false;
        let mut any_rotated_positive = false;
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let edge = v64[j] - v64[i];
            let line = (a[i] + a[j]).cross(edge);
            let edge_function = self.d.dot(line);
            let zero = tolerance * (magnitude(a[i]) + magnitude(a[j])) * magnitude(edge);
            any_negative |= edge_function < -zero;
            any_positive |= edge_function > zero;
            if edge_function.abs() <= zero {
                on_edge = true;
                let rotated = TIE_BREAK_DIRECTION.dot(line);
                any_rotated_negative |= rotated < 0.0;
                any_rotated_positive |= rotated > 0.0;
            }
        }
        if any_negative && any_positive {
            return None;
        }
        let owned = !((any_negative || any_rotated_negative) && (any_positive || any_rotated_positive));
        self.compute_hit(v, on_edge).map(|hit| TriangleHit { owned, ..hit })
    }

    /// Intersects the ray with a triangle that its line is known to pass through.
    #[inline(always)]
    pub fn intersect_inside(&self, v: &[Vec3; 3]) -> Option<TriangleHit> {
        self.compute_hit(v, false)
    }

    /// Computes t. `on_edge` says that an edge function counts as zero.
    #[inline(always)]
    fn compute_hit(&self, v: &[Vec3; 3], on_edge: bool) -> Option<TriangleHit> {
        let v0 = v[0].as_dvec3();
        let e1 = v[1].as_dvec3() - v0;
        let e2 = v[2].as_dvec3() - v0;
        let n = e1.cross(e2);
        let det = n.dot(self.d);
        let magnitude = |p: DVec3| p.x.abs().max(p.y.abs()).max(p.z.abs());
        let det_magnitude = magnitude(self.d) * magnitude(e1) * magnitude(e2);
        let faces_ray = det.abs() > EDGE_TOLERANCE * det_magnitude;
        if !faces_ray {
            // Edge-on or NaN: the neighbouring triangles are hit instead.
            return None;
        }
        let mut local_t = n.dot(v0 - self.o) / det;
        if on_edge || det.abs() < GRAZING_DETERMINANT * det_magnitude {
            local_t = self.clamp_to_box(v, local_t)?;
        }
        let t64 = local_t * self.inv_t_scale;
        let t = if self.from_light { 1.0 - t64 } else { t64 } as f32;
        (t64 > 0.0 && t > 0.0 && t.is_finite()).then_some(TriangleHit { t, ccw: det < 0.0, owned: true })
    }

    /// Clamps `t` to the part of the ray in the triangle's bounding box. That box is larger than the triangle by the
    /// possible rounding of the edge functions, and smaller than its box in the BVH. Only triangles that are very
    /// nearly edge-on have a `t` outside.
    ///
    /// Returns `None` where the ray misses the box. It does not hit the triangle then: from so far away, or so
    /// thin, all its edge functions count as zero. No BVH would find such a hit.
    #[inline(never)]
    fn clamp_to_box(&self, v: &[Vec3; 3], t: f64) -> Option<f64> {
        let bounds = Aabb::of_triangle(v);
        // By axis: the ray may be far out along one axis and exact along the others.
        let rounding = 8.0 * f64::EPSILON * self.o.abs();
        let pad = f64::from(EPSILON * bounds.max_abs_coordinate()) + f64::from(MIN_PADDING) + rounding;
        let min = bounds.min.as_dvec3() - pad - self.o;
        let max = bounds.max.as_dvec3() + pad - self.o;
        let mut near = f64::NEG_INFINITY;
        let mut far = f64::INFINITY;
        for axis in 0..3 {
            if self.d[axis] != 0.0 {
                let t_min = min[axis] / self.d[axis];
                let t_max = max[axis] / self.d[axis];
                near = near.max(t_min.min(t_max));
                far = far.min(t_min.max(t_max));
            } else if min[axis] > 0.0 || max[axis] < 0.0 {
                return None;
            }
        }
        (near <= far).then(|| t.min(far).max(near))
    }
}

/// Returns the largest power of two that is not greater than `x`, which is positive: its exponent alone.
#[inline(always)]
pub(crate) fn floor_power_of_two(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000)
}

/// Returns 1/x for a power of two, by its exponent.
#[inline(always)]
pub(crate) fn invert_power_of_two(x: f64) -> f64 {
    f64::from_bits((2046u64 << 52).wrapping_sub(x.to_bits()))
}
