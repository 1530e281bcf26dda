//! What f32 proves of rays and triangles: bounds on its rounding, and a ray with them.

use glam::{DVec3, Vec3};

use crate::accel::bvh::triangle4::Triangle4;
use crate::accel::traverse::hit::{FACING, LocalRay};
use crate::geometry::EPSILON;
use crate::simd::vec3::{Vec3Lanes, cross, dot, splat, sub};
use crate::simd::{Lanes, Simd};

/// In parts of the way from a light: what is nearer to it may count as being there.
pub(crate) const LIGHT: f32 = 1.0 / (1u32 << 22) as f32;

/// f32 bounds for the lines of one or more rays and the triangles of one tree.
///
/// With c = v₀ − o, e₁ = v₁ − v₀, e₂ = v₂ − v₀: u = d·(e₂×c), v = d·(c×e₁), det = d·(e₁×e₂),
/// w = det − u − v. A hit has u, v, w all of one sign. Edge-relative forms such as these are
/// uncertain over a far thinner strip than the textbook's d·(a×b) with both corners relative to
/// the origin. With ε = 2⁻²³ and 2-norms |δu|, |δv| ≤ 5ε|d||e||c| and |δw| ≤ 12ε|d||e|(|c| + |e|/2);
/// one ε more is for o and d, which may have been rounded to f32 themselves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// The bound on u, v and scaled w is `edge·(per_edge + edge·per_area) + least`.
    per_edge: f32,
    per_area: f32,
    least: f32,
    /// The bound on t·|det| is `edge²·(depth + edge·16ε) + least`.
    depth: f32,
    /// Signs of determinants beyond `edge²·facing` are certain, and [`LocalRay::intersect_certain`] takes no
    /// care of their t.
    facing: f32,
}

/// How much larger the bound is for w than for u and v.
pub(crate) const W_SCALE: f32 = 5.0 / 12.0;

/// What [`Bounds`] say of one block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slack {
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
    #[inline(always)]
    pub fn new(length: f64, far: f64, rounded: f64) -> Bounds {
        // Where f32 products could overflow nothing is proven in f32, and all is left to f64. Sides are
        // products of two lengths, t·det is one of three: c·n is no more than 12·far³ on the way. It
        // counts only where the determinant is certain.
        let sides = length.max(1.0) * far.max(1e-6) * far < 1e36;
        let depths = sides && far * far * far < 1e37;
        let epsilon = f64::from(EPSILON) * (1.0 + 1e-5);
        let k = 6.0 * epsilon * length;
        let or_infinite = |x: f64, safe: bool| if safe { x as f32 } else { f32::INFINITY };
        Bounds {
            per_edge: or_infinite(k * (far + rounded), sides),
            per_area: (0.5 * k) as f32,
            least: (1e-34 * length.max(1.0)) as f32,
            depth: or_infinite(16.0 * epsilon * (far + rounded), depths),
            facing: or_infinite(1.1 * FACING * length, depths),
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
pub(crate) struct TriangleTestRay {
    o: Vec3,
    d: Vec3,
    bounds: Bounds,
    /// Between these, in the ray's own parameter, t surely is where the caller wants it.
    between: (f32, f32),
}

/// Which triangles of a block a ray meets, as bits.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Candidates {
    /// Perhaps.
    pub possible: u32,
    /// Of those, surely, as far as they are inside the triangle.
    pub sure: u32,
    /// Of those, surely before the end.
    pub between: u32,
}

impl TriangleTestRay {
    /// A ray for triangles that lie within `radius` of `centre`. What it surely meets before `end`
    /// is told; nothing is where there is none.
    #[inline(always)]
    pub fn new(ray: &LocalRay, centre: DVec3, radius: f64, end: Option<f32>) -> TriangleTestRay {
        let (o, d) = (ray.o.as_vec3(), ray.d.as_vec3());
        let far = ray.o.distance(centre) + radius;
        let rounded = if o.as_dvec3() == ray.o { 0.0 } else { ray.o.length() };
        // What is so near a light that 1 less it rounds to 1 does not block it.
        let start = if ray.from_light { ray.to_local_t(LIGHT) } else { 0.0 };
        let between = (start, end.map_or(-1.0, |end| ray.to_local_t(end) * (1.0 - 8.0 * EPSILON)));
        TriangleTestRay { o, d, bounds: Bounds::new(ray.d.length(), far, rounded), between }
    }

    /// The triangles of `block` that the ray may meet before `limit`.
    #[inline(always)]
    pub fn candidates<S: Simd>(&self, block: &Triangle4, limit: f32) -> Candidates {
        let (o, d): (Vec3Lanes<S::F32x4>, Vec3Lanes<S::F32x4>) = (splat(self.o), splat(self.d));
        let [v0, v1, v2] = block.load_vertices::<S::F32x4>();
        let (c, e1, e2) = (sub(v0, o), sub(v1, v0), sub(v2, v0));
        let n = cross(e1, e2);
        let (det, depth) = (dot(d, n), dot(c, n));
        let (u, v) = (dot(d, cross(e2, c)), dot(d, cross(c, e1)));
        let w = (det - u - v) * S::F32x4::splat(W_SCALE);
        let slack = self.bounds.of(block.max_edge);
        let (side, minus) = (S::F32x4::splat(slack.side), S::F32x4::splat(-slack.side));
        let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
        // Written so that NaN stays a candidate.
        let outside = least.lt(minus) & side.lt(greatest);
        let mut possible = block.lane_mask() & !outside;
        if possible == 0 {
            return Candidates::default();
        }
        let facing = S::F32x4::splat(slack.facing).lt(det.abs());
        let (det, depth) = (det.abs(), depth.xor_sign(det));
        let unsure = S::F32x4::splat(slack.depth);
        let (before, behind) = (depth - unsure, depth + unsure);
        let beyond = (det * S::F32x4::splat(limit)).lt(before) | behind.lt(S::F32x4::splat(0.0));
        possible &= !(beyond & facing);
        let sure = possible & facing & (side.lt(least) | greatest.lt(minus));
        let (start, end) = self.between;
        let between =
            sure & (det * S::F32x4::splat(start)).lt(before) & behind.lt(det * S::F32x4::splat(end));
        Candidates { possible, sure, between }
    }
}
