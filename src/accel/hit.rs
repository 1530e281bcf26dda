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

use super::block::Block;
use super::simd::{Lanes, Simd};
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

    /// The corners.
    pub fn v(&self) -> &[Vec3; 3] {
        &self.v
    }

    /// At least the length of the two edges at the first corner.
    pub fn edge(&self) -> f32 {
        self.edge
    }

    /// The bits of the nine coordinates.
    pub fn bits(&self) -> [u32; 9] {
        let [a, b, c] = self.v.map(|p| p.to_array().map(f32::to_bits));
        [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
    }

    /// Its box for trees: wider by a few ulps of the greatest coordinate, so that it is flat
    /// nowhere and rays along its faces are not lost.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (lo, hi, size) = extent(&self.v);
        let pad = Vec3::splat(3.0 * EPSILON * size + 4.0 * TINY_LENGTH);
        (lo - pad, hi + pad)
    }
}

/// The box of three corners, unpadded, and its greatest coordinate.
fn extent([a, b, c]: &[Vec3; 3]) -> (Vec3, Vec3, f32) {
    let (lo, hi) = (a.min(*b).min(*c), a.max(*b).max(*c));
    (lo, hi, lo.abs().max(hi.abs()).max_element())
}

/// Padding for things at the very origin. Times the largest reciprocal of a direction it is still
/// farther than anything can be.
const TINY_LENGTH: f32 = 1e-20;

/// A line that triangles are judged against, in their frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameRay {
    pub o: DVec3,
    pub d: DVec3,
    /// Times this, a parameter counts in the direction that the caller gave.
    pub unit: f64,
    /// True for the way from a light to a surface: t counts from the surface at its end, where it
    /// has to be exact, and ends at the light.
    pub backward: bool,
}

impl FrameRay {
    /// A ray whose direction is brought to about unit length by a power of two, so that neither
    /// huge nor tiny directions overflow anything. `None` for rays that are nowhere or go nowhere.
    pub fn new(o: DVec3, d: DVec3) -> Option<FrameRay> {
        let size = d.abs().max_element();
        if !(o.is_finite() && d.is_finite() && size >= f64::MIN_POSITIVE) {
            return None;
        }
        let unit = 1.0 / power_of_two(size);
        Some(FrameRay { o, d: d * unit, unit, backward: false })
    }

    /// The way from a light to a surface. Only triangles between the two are on it.
    pub fn backward(from: Vec3, light: Vec3) -> Option<FrameRay> {
        let (from, light) = (from.as_dvec3(), light.as_dvec3());
        FrameRay::new(light, from - light).map(|ray| FrameRay { backward: true, ..ray })
    }

    /// A caller's t as this ray's parameter; the ends of a backward ray are both 0 and 1.
    pub fn parameter(&self, t: f32) -> f32 {
        (f64::from(t) / self.unit) as f32
    }

    /// Where the line meets the triangle, judged beyond doubt; only at a positive t.
    ///
    /// An edge from a to b (relative to the ray's origin) has the side d·((a + b)×(b − a)),
    /// which is 2d·(a×b) without its cancellation. Both triangles at an edge compute it alike
    /// but for the sign.
    #[inline(never)]
    pub fn judge(&self, v: &[Vec3; 3]) -> Option<Met> {
        let v64 = v.map(|p| p.as_dvec3());
        let a = v64.map(|p| p - self.o);
        let max = |p: DVec3| p.abs().max_element();
        let tolerance = TOLERANCE * max(self.d);
        let (mut negative, mut positive) = (false, false);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let e = v64[j] - v64[i];
            let side = self.d.dot((a[i] + a[j]).cross(e));
            let zero = tolerance * (max(a[i]) + max(a[j])) * max(e);
            negative |= side < -zero;
            positive |= side > zero;
        }
        if negative && positive { None } else { self.place(v) }
    }

    /// Where the line meets a triangle that it is known to go through.
    pub fn place(&self, v: &[Vec3; 3]) -> Option<Met> {
        let v64 = v.map(|p| p.as_dvec3());
        let (e1, e2) = (v64[1] - v64[0], v64[2] - v64[0]);
        let n = e1.cross(e2);
        let det = n.dot(self.d);
        let max = |p: DVec3| p.abs().max_element();
        let size = max(self.d) * max(e1) * max(e2);
        // Edge-on or NaN: its neighbours own the ray.
        let faces = det.abs() > TOLERANCE * size;
        if !faces {
            return None;
        }
        let mut t = n.dot(v64[0] - self.o) / det;
        if det.abs() < FACING * size {
            t = self.within(v, t);
        }
        let along = t * self.unit;
        let t = if self.backward { 1.0 - along } else { along } as f32;
        (along > 0.0 && t > 0.0 && t.is_finite()).then_some(Met { t, against: det < 0.0 })
    }

    /// `t` moved into the part of the ray that is in the triangle's box (which is wider than the
    /// triangle by what rounding may have done to the judgement, and narrower than its box in
    /// the tree). Only triangles that are very nearly edge-on have a `t` that needs it.
    #[inline(never)]
    fn within(&self, v: &[Vec3; 3], t: f64) -> f64 {
        let (lo, hi, size) = extent(v);
        let pad = DVec3::splat(f64::from(EPSILON * size) + f64::from(TINY_LENGTH));
        let (lo, hi) = (lo.as_dvec3() - pad - self.o, hi.as_dvec3() + pad - self.o);
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            if self.d[k] != 0.0 {
                let (x, y) = (lo[k] / self.d[k], hi[k] / self.d[k]);
                near = near.max(x.min(y));
                far = far.min(x.max(y));
            }
        }
        t.min(far).max(near)
    }
}

/// The power of two below a positive number: its exponent alone.
pub(super) fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000)
}

/// In units of a product's factors, below what an f64 triple product counts as zero.
const TOLERANCE: f64 = 48.0 * f64::EPSILON;

/// In units of its factors, from what determinant on a triangle faces the ray enough for t to need
/// no care: rounding moves it by less than 2⁻³³ of the triangle's size and distance then, far
/// within the slack of boxes. A power of two.
const FACING: f64 = 1.0 / 65536.0;

/// f32 bounds for the lines of one or more rays and the triangles of one tree.
///
/// With c = v₀ − o, e₁ = v₁ − v₀, e₂ = v₂ − v₀: u = d·(e₂×c), v = d·(c×e₁), det = d·(e₁×e₂),
/// w = det − u − v. A hit has u, v, w all of one sign. Edge-relative forms such as these are
/// uncertain over a far thinner strip than the textbook's d·(a×b) with both corners relative to
/// the origin. With ε = 2⁻²³ and 2-norms |δu|, |δv| ≤ 5ε|d||e||c| and |δw| ≤ 12ε|d||e|(|c| + |e|/2);
/// one ε more is for o and d, which may have been rounded to f32 themselves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// The bound on u, v and scaled w is `edge·(per_edge + edge·per_area) + least`.
    per_edge: f32,
    per_area: f32,
    least: f32,
    /// The bound on t·|det| is `edge²·(depth + edge·16ε) + least`.
    depth: f32,
    /// Signs of determinants beyond `edge²·facing` are certain, and [`FrameRay::place`] takes no
    /// care of their t.
    facing: f32,
}

/// How much larger the bound is for w than for u and v.
pub(super) const W_SCALE: f32 = 5.0 / 12.0;

/// What [`Bounds`] say of one block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slack {
    /// Of u, v and scaled w.
    pub side: f32,
    /// Of t·|det|.
    pub depth: f32,
    /// Least |det| that is certain.
    pub facing: f32,
}

impl Bounds {
    /// For directions no longer than `length`, and corners no farther from the origins than `far`;
    /// `rounded` is the size of origins that were rounded to f32, else 0.
    pub fn new(length: f64, far: f64, rounded: f64) -> Bounds {
        // Where f32 products could overflow nothing is proven in f32, and all is left to f64.
        let safe = length.max(1.0) * far.max(1e-6) * far < 1e36;
        let epsilon = f64::from(EPSILON) * (1.0 + 1e-5);
        let k = 6.0 * epsilon * length;
        let or_infinite = |x: f64| if safe { x as f32 } else { f32::INFINITY };
        Bounds {
            per_edge: or_infinite(k * (far + rounded)),
            per_area: (0.5 * k) as f32,
            least: (1e-34 * length.max(1.0)) as f32,
            depth: or_infinite(16.0 * epsilon * (far + rounded)),
            facing: or_infinite(1.1 * FACING * length),
        }
    }

    /// For triangles whose edges are no longer than `edge`.
    #[inline(always)]
    pub fn of(&self, edge: f32) -> Slack {
        Slack {
            side: edge * (self.per_edge + edge * self.per_area) + self.least,
            depth: edge * edge * (self.depth + edge * (16.0 * EPSILON)) + self.least,
            facing: edge * edge * self.facing + self.least,
        }
    }
}

/// A ray prepared for the blocks of one tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct TestRay {
    o: Vec3,
    d: Vec3,
    bounds: Bounds,
}

/// Which triangles of a block a ray meets, as bits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Candidates {
    /// Perhaps.
    pub possible: u32,
    /// Of those, surely.
    pub sure: u32,
}

impl TestRay {
    /// A ray for triangles that lie within `radius` of `centre`.
    pub fn new(ray: &FrameRay, centre: DVec3, radius: f64) -> TestRay {
        let (o, d) = (ray.o.as_vec3(), ray.d.as_vec3());
        let far = ray.o.distance(centre) + radius;
        let rounded = if o.as_dvec3() == ray.o { 0.0 } else { ray.o.length() };
        TestRay { o, d, bounds: Bounds::new(ray.d.length(), far, rounded) }
    }

    /// The triangles of `block` that the ray may meet before `limit`.
    #[inline(always)]
    pub fn candidates<S: Simd>(&self, block: &Block, limit: f32) -> Candidates {
        let (o, d): (Lanes3<S::F4>, Lanes3<S::F4>) = (splat(self.o), splat(self.d));
        let [v0, v1, v2] = corners::<S::F4>(block);
        let (c, e1, e2) = (sub(v0, o), sub(v1, v0), sub(v2, v0));
        let n = cross(e1, e2);
        let (det, depth) = (dot(d, n), dot(c, n));
        let (u, v) = (dot(d, cross(e2, c)), dot(d, cross(c, e1)));
        let w = (det - u - v) * S::F4::splat(W_SCALE);
        let slack = self.bounds.of(block.edge);
        let (side, minus) = (S::F4::splat(slack.side), S::F4::splat(-slack.side));
        let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
        // Written so that NaN stays a candidate.
        let outside = least.lt(minus) & side.lt(greatest);
        let mut possible = block.used() & !outside;
        if possible == 0 {
            return Candidates::default();
        }
        let facing = S::F4::splat(slack.facing).lt(det.abs());
        let (det, depth) = (det.abs(), depth.flipped_by(det));
        let unsure = S::F4::splat(slack.depth);
        let beyond = (det * S::F4::splat(limit)).lt(depth - unsure) | (depth + unsure).lt(S::F4::splat(0.0));
        possible &= !(beyond & facing);
        Candidates { possible, sure: possible & facing & (side.lt(least) | greatest.lt(minus)) }
    }
}

/// A vector of lanes.
pub(super) type Lanes3<L> = [L; 3];

/// Three of something, by axis. Unlike an array's own `map` it is always inlined, without which
/// lanes would pass through memory.
#[inline(always)]
pub(super) fn by_axis<T>(of: impl Fn(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

/// A vector in all lanes.
#[inline(always)]
pub(super) fn splat<const N: usize, L: Lanes<N>>(x: Vec3) -> Lanes3<L> {
    [L::splat(x.x), L::splat(x.y), L::splat(x.z)]
}

/// The corners of a block.
#[inline(always)]
pub(super) fn corners<L: Lanes<4>>(block: &Block) -> [Lanes3<L>; 3] {
    by_axis(|corner| by_axis(|axis| L::load(&block.v[corner][axis])))
}

#[inline(always)]
pub(super) fn sub<const N: usize, L: Lanes<N>>(a: Lanes3<L>, b: Lanes3<L>) -> Lanes3<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn dot<const N: usize, L: Lanes<N>>(a: Lanes3<L>, b: Lanes3<L>) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
pub(super) fn cross<const N: usize, L: Lanes<N>>(a: Lanes3<L>, b: Lanes3<L>) -> Lanes3<L> {
    [a[1].mul_sub(b[2], a[2] * b[1]), a[2].mul_sub(b[0], a[0] * b[2]), a[0].mul_sub(b[1], a[1] * b[0])]
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
            let ray =
                FrameRay { o: to_vec3(o).as_dvec3(), d: to_vec3(d).as_dvec3(), unit: 1.0, backward: false };
            let met = ray.judge(tri.v());
            assert_eq!(met.map(|m| m.t), expected, "{v:?} {o:?} {d:?}");
            hits += usize::from(met.is_some());
            on_edges += usize::from(met.is_some() && sides.contains(&0));
        }
        assert!(hits > 200_000 && on_edges > 100_000, "{hits} {on_edges}");
    }

    /// Corners in any order give the same bits, and the side seen turns with the winding.
    #[test]
    fn the_order_of_corners_does_not_show() {
        let v = [Vec3::new(0.1, -0.0, 0.3), Vec3::new(1.7, 0.2, 0.1), Vec3::new(0.3, 1.1, -0.4)];
        let (o, d) = (DVec3::new(0.5, 0.3, 7.3), DVec3::new(0.01, 0.02, -1.3));
        let ray = FrameRay { o, d, unit: 1.0, backward: false };
        let (tri, turned) = Corners::new(v).unwrap();
        let met = ray.judge(tri.v()).unwrap();
        for (order, odd) in [([1, 2, 0], false), ([2, 0, 1], false), ([1, 0, 2], true), ([2, 1, 0], true)] {
            let (other, also_turned) = Corners::new(order.map(|i| v[i])).unwrap();
            assert_eq!(other.bits(), tri.bits());
            assert_eq!(also_turned, turned ^ odd);
            assert_eq!(ray.judge(other.v()), Some(met));
        }
        assert_eq!(Corners::new([v[0], v[0], v[1]]).unwrap_err(), Unfit::ZeroArea);
        assert_eq!(Corners::new([v[0], v[2], v[1] * f32::NAN]).unwrap_err(), Unfit::NonFinite);
        assert_eq!(Corners::new([v[0], v[2], v[1] * 1e19]).unwrap_err(), Unfit::NonFinite);
    }
}
