//! The one hit test: does a ray meet a triangle, and where?
//!
//! **Whether** is decided by signs that are never wrong. The f32 edge functions come with a bound
//! on their rounding; where it proves a miss that is the end of it, as it is for almost every
//! triangle. Else the same functions are evaluated in f64, where each is its exact sign or, within
//! 48 ulps of f64, zero, which counts as inside. A ray through a shared edge or vertex of a closed
//! mesh is therefore inside at least one of the triangles there: no cracks, whatever the angle,
//! the distance or the scale, and no other code may decide otherwise.
//!
//! So it may be inside several of them, too. That does no harm where what is met first blocks all
//! else; where light passes, each would count. Whoever has the ray still when it is turned a little,
//! always the same way, owns it ([`TriangleHit::owned`]): one of all that meet there.
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

use crate::accel::build::canonical_triangle::MIN_PADDING;
use crate::accel::bvh::aabb::Aabb;
use crate::geometry::EPSILON;

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    pub t: f32,
    /// True where the ray runs ccw the corners' normal: they go round counter-clockwise as
    /// the ray sees them.
    pub ccw: bool,
    /// False where it goes through an edge or a vertex that another triangle has the better right to.
    pub owned: bool,
}

/// A line that triangles are judged ccw, in their frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    pub o: DVec3,
    pub d: DVec3,
    /// A parameter of this line is this many times the caller's: a power of two.
    pub t_scale: f64,
    /// 1 / size.
    pub inv_t_scale: f64,
    /// True for the way from a light to a surface: t counts from the surface at its end, where it
    /// has to be exact, and ends at the light.
    pub from_light: bool,
}

impl LocalRay {
    /// A ray whose direction is brought to about unit length by a power of two, so that neither
    /// huge nor tiny directions overflow anything. `None` for rays that are nowhere or go nowhere.
    #[inline(always)]
    pub fn new(o: DVec3, d: DVec3) -> Option<LocalRay> {
        let longest = d.x.abs().max(d.y.abs()).max(d.z.abs());
        // Times 0 what is infinite or no number is no number, and so is every sum with it.
        let finite = (o.x + d.x) * 0.0 + (o.y + d.y) * 0.0 + (o.z + d.z) * 0.0 == 0.0;
        if !(finite && longest >= f64::MIN_POSITIVE) {
            return None;
        }
        let size = floor_power_of_two(longest);
        let unit = inverse(size);
        Some(LocalRay { o, d: d * unit, t_scale: size, inv_t_scale: unit, from_light: false })
    }

    /// The way from a light to a surface. Only triangles between the two are on it.
    #[inline(always)]
    pub fn shadow(from: Vec3, light: Vec3) -> Option<LocalRay> {
        let (from, light) = (from.as_dvec3(), light.as_dvec3());
        let mut ray = LocalRay::new(light, from - light)?;
        ray.from_light = true;
        Some(ray)
    }

    /// A caller's t as this ray's parameter; the ends of a from_light ray are both 0 and 1.
    #[inline(always)]
    pub fn to_local_t(&self, t: f32) -> f32 {
        (f64::from(t) * self.t_scale) as f32
    }

    /// Where the line meets the triangle, which it is `sure` to go through or else judged about.
    #[inline(always)]
    pub fn intersect(&self, v: &[Vec3; 3], sure: bool) -> Option<TriangleHit> {
        if sure { self.intersect_certain(v) } else { self.intersect_f64(v) }
    }

    /// Where the line meets the triangle, judged beyond doubt; only at a positive t.
    ///
    /// An edge from a to b (relative to the ray's origin) has the side d·((a + b)×(b − a)),
    /// which is 2d·(a×b) without its cancellation. Both triangles at an edge compute it alike
    /// but for the sign.
    #[inline(never)]
    pub fn intersect_f64(&self, v: &[Vec3; 3]) -> Option<TriangleHit> {
        let v64 = v.map(|p| p.as_dvec3());
        let a = v64.map(|p| p - self.o);
        let max = |p: DVec3| p.abs().max_element();
        let tolerance = TOLERANCE * max(self.d);
        let (mut negative, mut positive, mut doubtful) = (false, false, false);
        // The same of a ray that is turned a little.
        let (mut below, mut above) = (false, false);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let e = v64[j] - v64[i];
            let line = (a[i] + a[j]).cross(e);
            let side = self.d.dot(line);
            let zero = tolerance * (max(a[i]) + max(a[j])) * max(e);
            negative |= side < -zero;
            positive |= side > zero;
            if side.abs() <= zero {
                doubtful = true;
                let turned = TURN.dot(line);
                (below, above) = (below || turned < 0.0, above || turned > 0.0);
            }
        }
        if negative && positive {
            return None;
        }
        let owned = !((negative || below) && (positive || above));
        self.place_on(v, doubtful).map(|met| TriangleHit { owned, ..met })
    }

    /// Where the line meets a triangle that it is known to go through.
    #[inline(always)]
    pub fn intersect_certain(&self, v: &[Vec3; 3]) -> Option<TriangleHit> {
        self.place_on(v, false)
    }

    /// The same; `doubtful` where a side counted as zero.
    #[inline(always)]
    fn place_on(&self, v: &[Vec3; 3], doubtful: bool) -> Option<TriangleHit> {
        let v0 = v[0].as_dvec3();
        let (e1, e2) = (v[1].as_dvec3() - v0, v[2].as_dvec3() - v0);
        let n = e1.cross(e2);
        let det = n.dot(self.d);
        let max = |p: DVec3| p.x.abs().max(p.y.abs()).max(p.z.abs());
        let size = max(self.d) * max(e1) * max(e2);
        // Edge-on or NaN: its neighbours own the ray.
        let faces = det.abs() > TOLERANCE * size;
        if !faces {
            return None;
        }
        let mut t = n.dot(v0 - self.o) / det;
        if doubtful || det.abs() < FACING * size {
            t = self.within(v, t)?;
        }
        let along = t * self.inv_t_scale;
        let t = if self.from_light { 1.0 - along } else { along } as f32;
        (along > 0.0 && t > 0.0 && t.is_finite()).then_some(TriangleHit { t, ccw: det < 0.0, owned: true })
    }

    /// `t` moved into the part of the ray that is in the triangle's box (which is wider than the
    /// triangle by what rounding may have done to the judgement, and narrower than its box in
    /// the tree). Only triangles that are very nearly edge-on have a `t` that needs it.
    ///
    /// `None` where the ray passes the box by. It goes through no triangle there: it was taken to, since
    /// seen from so far or along so thin a triangle all its sides are less than f64 can tell from zero.
    /// No tree would find such a hit.
    #[inline(never)]
    fn within(&self, v: &[Vec3; 3], t: f64) -> Option<f64> {
        let bounds = Aabb::of_triangle(v);
        let size = bounds.max_abs_coordinate();
        // Axis by axis: far out along one of them, the others may be exact.
        let rounding = 8.0 * f64::EPSILON * self.o.abs();
        let pad = f64::from(EPSILON * size) + f64::from(MIN_PADDING) + rounding;
        let (lo, hi) = (bounds.min.as_dvec3() - pad - self.o, bounds.max.as_dvec3() + pad - self.o);
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            if self.d[k] != 0.0 {
                let (x, y) = (lo[k] / self.d[k], hi[k] / self.d[k]);
                near = near.max(x.min(y));
                far = far.min(x.max(y));
            } else if lo[k] > 0.0 || hi[k] < 0.0 {
                return None;
            }
        }
        (near <= far).then(|| t.min(far).max(near))
    }
}

/// The power of two below a positive number: its exponent alone.
#[inline(always)]
pub(crate) fn floor_power_of_two(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000)
}

/// 1 over a power of two, by its exponent.
#[inline(always)]
pub(crate) fn inverse(power: f64) -> f64 {
    f64::from_bits((2046u64 << 52).wrapping_sub(power.to_bits()))
}

/// In units of a product's factors, below what an f64 triple product counts as zero.
const TOLERANCE: f64 = 48.0 * f64::EPSILON;

/// Which way a ray through an edge or a vertex is turned to tell whose it is. The sign of a side that is
/// zero becomes that of its change, which is opposite in the two triangles at an edge: so the ray is in
/// one of them, as in one of all around a vertex. No model's edges lie along this.
const TURN: DVec3 = DVec3::new(0.347_296_355, 0.618_033_989, -0.705_285_234);

/// In units of its factors, from what determinant on a triangle faces the ray enough for t to need
/// no care: rounding moves it by less than 2⁻³³ of the triangle's size and distance then, far
/// within the slack of boxes. A power of two.
pub(crate) const FACING: f64 = 1.0 / 65536.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::build::canonical_triangle::{CanonicalTriangle, Degeneracy};

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
            let Ok((tri, _)) = CanonicalTriangle::new(v.map(to_vec3)) else { continue };
            let [a, b, c] = v.map(|p| sub(p, o));
            let sides = [triple(d, a, b), triple(d, b, c), triple(d, c, a)];
            let inside = sides.iter().all(|&s| s >= 0) || sides.iter().all(|&s| s <= 0);
            let (det, num) = (sides.iter().sum::<i64>(), triple(a, b, c));
            let expected = (inside && det != 0 && num.signum() * det.signum() > 0)
                .then(|| (num as f64 / det as f64) as f32);
            let ray = LocalRay {
                o: to_vec3(o).as_dvec3(),
                d: to_vec3(d).as_dvec3(),
                t_scale: 1.0,
                inv_t_scale: 1.0,
                from_light: false,
            };
            let met = ray.intersect_f64(tri.vertices());
            assert_eq!(met.map(|m| m.t), expected, "{v:?} {o:?} {d:?}");
            hits += usize::from(met.is_some());
            on_edges += usize::from(met.is_some() && sides.contains(&0));
        }
        assert!(hits > 200_000 && on_edges > 100_000, "{hits} {on_edges}");
    }

    /// CanonicalTriangle in any order give the same bits, and the side seen turns with the winding.
    #[test]
    fn the_order_of_corners_does_not_show() {
        let v = [Vec3::new(0.1, -0.0, 0.3), Vec3::new(1.7, 0.2, 0.1), Vec3::new(0.3, 1.1, -0.4)];
        let (o, d) = (DVec3::new(0.5, 0.3, 7.3), DVec3::new(0.01, 0.02, -1.3));
        let ray = LocalRay { o, d, t_scale: 1.0, inv_t_scale: 1.0, from_light: false };
        let (tri, turned) = CanonicalTriangle::new(v).unwrap();
        let met = ray.intersect_f64(tri.vertices()).unwrap();
        for (order, odd) in [([1, 2, 0], false), ([2, 0, 1], false), ([1, 0, 2], true), ([2, 1, 0], true)] {
            let (other, also_turned) = CanonicalTriangle::new(order.map(|i| v[i])).unwrap();
            assert_eq!(other.to_bits(), tri.to_bits());
            assert_eq!(also_turned, turned ^ odd);
            assert_eq!(ray.intersect_f64(other.vertices()), Some(met));
        }
        assert_eq!(CanonicalTriangle::new([v[0], v[0], v[1]]).unwrap_err(), Degeneracy::ZeroArea);
        assert_eq!(CanonicalTriangle::new([v[0], v[2], v[1] * f32::NAN]).unwrap_err(), Degeneracy::NonFinite);
        assert_eq!(CanonicalTriangle::new([v[0], v[2], v[1] * 1e19]).unwrap_err(), Degeneracy::NonFinite);
    }
}
