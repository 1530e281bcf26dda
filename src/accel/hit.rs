//! The one hit test: does a ray meet a triangle, and where?
//!
//! **Whether** is decided by signs that are never wrong. The f32 edge functions come with a bound
//! on their rounding; where it proves a miss that is the end of it, as it is for almost every
//! triangle. Else the same functions are evaluated in f64, where each is its exact sign or, within
//! 48 ulps of f64, zero, which counts as inside. A ray through a shared edge or vertex of a closed
//! mesh is therefore inside at least one of the triangles there: no cracks, whatever the angle,
//! the distance or the scale, and no other code may decide otherwise.
//!
//! **Where** is always computed in f64 from the f32 corners, kept within the triangle's own box
//! and rounded once to f32. So t is right to about one ulp, never depends on which lane or tree
//! found it, and a box around the triangle never begins behind it: a traversal that skips boxes
//! strictly beyond the best t so far, give or take a few ulps, can neither lose nor reorder hits.
//! An f32 t would be off by 1e-3 of itself at grazing angles, and the picture would depend on the
//! tree.
//!
//! No fused multiply-add anywhere: it would give different bits on different machines.

use glam::{DVec3, Vec3};

use crate::geometry::EPSILON;

/// Coordinates beyond this are refused: their products would overflow.
pub(super) const HUGE: f32 = 1e18;

/// The corners of a triangle, as the hit test wants them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    v: [Vec3; 3],
    /// At least the length of the two edges at `v[0]`.
    edge: f32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    pub t: f32,
    /// True where the ray runs against the corners' normal: they go round counter-clockwise as
    /// the ray sees them.
    pub against: bool,
}

/// Why a triangle cannot be hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unfit {
    NonFinite,
    ZeroArea,
}

impl Corners {
    /// Puts the corners into an order that depends on the positions alone, so that triangles in
    /// the same place have bit for bit the same t however they are wound. True comes with them
    /// where that turned the winding round.
    pub fn new(mut v: [Vec3; 3]) -> Result<(Corners, bool), Unfit> {
        if !v.iter().all(|p| p.abs().max_element() <= HUGE && p.is_finite()) {
            return Err(Unfit::NonFinite);
        }
        let (e1, e2) = ((v[1].as_dvec3() - v[0].as_dvec3()), (v[2].as_dvec3() - v[0].as_dvec3()));
        if e1.cross(e2) == DVec3::ZERO {
            return Err(Unfit::ZeroArea);
        }
        let mut turned = false;
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            if v[j].to_array().partial_cmp(&v[i].to_array()) == Some(std::cmp::Ordering::Less) {
                v.swap(i, j);
                turned = !turned;
            }
        }
        // −0 is 0: equal places must have equal bits, for they are compared by them.
        let v = v.map(|p| p + Vec3::ZERO);
        let long = |i: usize| (v[i].as_dvec3() - v[0].as_dvec3()).length();
        let edge = (long(1).max(long(2)) * (1.0 + 4.0 * f64::from(EPSILON))) as f32;
        Ok((Corners { v, edge: edge.max(f32::MIN_POSITIVE) }, turned))
    }

    /// The bits of the nine coordinates.
    pub fn bits(&self) -> [u32; 9] {
        let [a, b, c] = self.v.map(|p| p.to_array().map(f32::to_bits));
        [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
    }

    /// Its box for trees: wider by a few ulps of the greatest coordinate, so that it is flat
    /// nowhere and rays along its faces are not lost.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (lo, hi, size) = self.extent();
        let pad = Vec3::splat(3.0 * EPSILON * size + 4.0 * TINY_LENGTH);
        (lo - pad, hi + pad)
    }

    fn extent(&self) -> (Vec3, Vec3, f32) {
        let [a, b, c] = self.v;
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        (lo, hi, lo.abs().max(hi.abs()).max_element())
    }
}

/// Padding for things at the very origin. Times the largest reciprocal of a direction it is still
/// farther than anything can be.
const TINY_LENGTH: f32 = 1e-20;

/// A ray prepared for the triangles of one tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct TestRay {
    o: Vec3,
    d: Vec3,
    /// Multiplies the parameter along `d` to give the caller's t.
    unit: f64,
    /// The bound on the f32 edge functions' error is `edge·(per_edge + edge·per_area) + least`.
    per_edge: f32,
    per_area: f32,
    least: f32,
}

/// How much larger the bound is for w than for u and v.
const W_SCALE: f32 = 5.0 / 12.0;

impl TestRay {
    /// A ray for triangles that lie within `radius` of `centre`.
    pub fn new(o: Vec3, d: Vec3, unit: f64, centre: DVec3, radius: f64) -> TestRay {
        // |c| ≤ far for every corner c relative to the ray's origin: one bound serves all.
        let far = o.as_dvec3().distance(centre) + radius;
        let length = d.as_dvec3().length();
        // Where f32 products could overflow nothing is proven in f32, and all is left to f64.
        let safe = length.max(1.0) * far * far < 1e36;
        let k = 5.0 * f64::from(EPSILON) * (1.0 + 1e-5) * length;
        let per_edge = if safe { (k * far) as f32 } else { f32::INFINITY };
        TestRay { o, d, unit, per_edge, per_area: (0.5 * k) as f32, least: 1e-34 * (length as f32).max(1.0) }
    }

    /// False where the ray misses `tri` beyond doubt.
    ///
    /// With c = v₀ − o: u = d·(e₂×c), v = d·(c×e₁), w = d·(e₁×e₂) − u − v. A hit has them all of
    /// one sign. Edge-relative forms such as these are uncertain over a far thinner strip than
    /// the textbook's d·(a×b) with both corners relative to the origin. With ε = 2⁻²³ and 2-norms
    /// |δu|, |δv| ≤ 5ε|d||e||c| and |δw| ≤ 12ε|d||e|(|c| + |e|/2).
    #[inline(always)]
    pub fn may_hit(&self, tri: &Corners) -> bool {
        let [v0, v1, v2] = tri.v;
        let c = v0 - self.o;
        let e1 = v1 - v0;
        let e2 = v2 - v0;
        let u = self.d.dot(e2.cross(c));
        let v = self.d.dot(c.cross(e1));
        let w = (self.d.dot(e1.cross(e2)) - u - v) * W_SCALE;
        let bound = tri.edge * (self.per_edge + tri.edge * self.per_area) + self.least;
        // Written so that NaN stays a candidate.
        let negative = (u < -bound) | (v < -bound) | (w < -bound);
        let positive = (u > bound) | (v > bound) | (w > bound);
        !(negative & positive)
    }

    /// The judgement: where the ray meets `tri`, if it does, at a positive t.
    ///
    /// An edge from a to b (relative to the ray's origin) has the side d·((a + b)×(b − a)),
    /// which is 2d·(a×b) without its cancellation. Both triangles at an edge compute it alike
    /// but for the sign.
    #[inline(never)]
    pub fn meet(&self, tri: &Corners) -> Option<Met> {
        let (o, d) = (self.o.as_dvec3(), self.d.as_dvec3());
        let v = tri.v.map(|p| p.as_dvec3());
        let a = v.map(|p| p - o);
        let max = |p: DVec3| p.abs().max_element();
        let tolerance = 48.0 * f64::EPSILON * max(d);
        let (mut negative, mut positive) = (false, false);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let e = v[j] - v[i];
            let side = d.dot((a[i] + a[j]).cross(e));
            let zero = tolerance * (max(a[i]) + max(a[j])) * max(e);
            negative |= side < -zero;
            positive |= side > zero;
        }
        if negative && positive {
            return None;
        }
        let (e1, e2) = (v[1] - v[0], v[2] - v[0]);
        let n = e1.cross(e2);
        let det = n.dot(d);
        // Edge-on or NaN: its neighbours own the ray.
        let faces = det.abs() > tolerance * max(e1) * max(e2);
        if !faces {
            return None;
        }
        let t = (self.within(tri, n.dot(a[0]) / det) * self.unit) as f32;
        (t > 0.0 && t.is_finite()).then_some(Met { t, against: det < 0.0 })
    }

    /// `t` moved into the part of the ray that is in the triangle's box (which is wider than the
    /// triangle by what rounding may have done to the judgement, and narrower than its box in
    /// the tree). Only triangles that are very nearly edge-on have a `t` that needs it.
    fn within(&self, tri: &Corners, t: f64) -> f64 {
        let (lo, hi, size) = tri.extent();
        let pad = DVec3::splat(f64::from(EPSILON * size) + f64::from(TINY_LENGTH));
        let (o, d) = (self.o.as_dvec3(), self.d.as_dvec3());
        let (lo, hi) = (lo.as_dvec3() - pad - o, hi.as_dvec3() + pad - o);
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            if d[k] != 0.0 {
                let (x, y) = (lo[k] / d[k], hi[k] / d[k]);
                near = near.max(x.min(y));
                far = far.min(x.max(y));
            }
        }
        t.min(far).max(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole numbers from −`n` to `n`.
    struct Whole(u64);

    impl Whole {
        fn next(&mut self, n: i64) -> i64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as i64 % (2 * n + 1) - n
        }

        fn point(&mut self, n: i64) -> [i64; 3] {
            [self.next(n), self.next(n), self.next(n)]
        }
    }

    fn to_vec3(p: [i64; 3]) -> Vec3 {
        Vec3::from(p.map(|x| x as f32))
    }

    fn sub(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    /// a·(b×c), exactly.
    fn triple(a: [i64; 3], b: [i64; 3], c: [i64; 3]) -> i64 {
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    }

    /// Small whole coordinates put many rays exactly on edges and vertices, and there are exact
    /// answers to compare with.
    #[test]
    fn the_judgement_is_exact() {
        let mut whole = Whole(1);
        let (mut hits, mut on_edges) = (0, 0);
        for i in 0..1_000_000 {
            let n = if i % 2 == 0 { 4 } else { 1000 };
            let (v, o) = ([whole.point(n), whole.point(n), whole.point(n)], whole.point(n));
            let d = if i % 3 == 0 { whole.point(n) } else { sub(v[i % 2], o) };
            let Ok((tri, _)) = Corners::new(v.map(to_vec3)) else { continue };
            let [a, b, c] = v.map(|p| sub(p, o));
            let sides = [triple(d, a, b), triple(d, b, c), triple(d, c, a)];
            let inside = sides.iter().all(|&s| s >= 0) || sides.iter().all(|&s| s <= 0);
            let (det, num) = (sides.iter().sum::<i64>(), triple(a, b, c));
            let expected = (inside && det != 0 && num.signum() * det.signum() > 0)
                .then(|| (num as f64 / det as f64) as f32);
            let ray = TestRay::new(to_vec3(o), to_vec3(d), 1.0, DVec3::ZERO, 2.0 * n as f64);
            let met = ray.meet(&tri);
            assert_eq!(met.map(|m| m.t), expected, "{v:?} {o:?} {d:?}");
            assert!(met.is_none() || ray.may_hit(&tri));
            hits += usize::from(met.is_some());
            on_edges += usize::from(met.is_some() && sides.contains(&0));
        }
        assert!(hits > 200_000 && on_edges > 100_000, "{hits} {on_edges}");
    }

    /// Corners in any order give the same bits, and the side seen turns with the winding.
    #[test]
    fn the_order_of_corners_does_not_show() {
        let v = [Vec3::new(0.1, -0.0, 0.3), Vec3::new(1.7, 0.2, 0.1), Vec3::new(0.3, 1.1, -0.4)];
        let ray = TestRay::new(Vec3::new(0.5, 0.3, 7.3), Vec3::new(0.01, 0.02, -1.3), 1.0, DVec3::ZERO, 3.0);
        let (tri, turned) = Corners::new(v).unwrap();
        let met = ray.meet(&tri).unwrap();
        for (order, odd) in [([1, 2, 0], false), ([2, 0, 1], false), ([1, 0, 2], true), ([2, 1, 0], true)] {
            let (other, also_turned) = Corners::new(order.map(|i| v[i])).unwrap();
            assert_eq!(other.bits(), tri.bits());
            assert_eq!(also_turned, turned ^ odd);
            assert_eq!(ray.meet(&other), Some(met));
        }
        assert_eq!(Corners::new([v[0], v[0], v[1]]).unwrap_err(), Unfit::ZeroArea);
        assert_eq!(Corners::new([v[0], v[2], v[1] * f32::NAN]).unwrap_err(), Unfit::NonFinite);
        assert_eq!(Corners::new([v[0], v[2], v[1] * 1e19]).unwrap_err(), Unfit::NonFinite);
    }
}
