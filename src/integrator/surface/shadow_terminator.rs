//! From a triangle to the smooth surface that its normals stand for, as shadow rays need it (Hanika, Hacking the
//! Shadow Terminator, Ray Tracing Gems II, chapter 4).

use glam::{DVec3, Vec3};

/// What raises points of a triangle to the surface that bulges from its corners along their normals: a point goes
/// up to each corner's tangent plane where it lies below, weighted as the corners are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lift {
    /// Of unit length, or 0.
    n: [DVec3; 3],
    /// By corner: how far the next one, and the one after that, is above its tangent plane.
    above: [[f64; 2]; 3],
}

impl Lift {
    /// For corners `v` with normals `n`: of any length where they are not `unit` ones, 0 where there are none.
    #[inline(always)]
    pub fn new(v: &[DVec3; 3], n: &[DVec3; 3], unit: bool) -> Lift {
        let n = if unit { *n } else { n.map(DVec3::normalize_or_zero) };
        let above = |i: usize, other: usize| (v[(i + other) % 3] - v[i]).dot(n[i]);
        Lift { n, above: [0, 1, 2].map(|i| [above(i, 1), above(i, 2)]) }
    }

    /// The way up from barycentrics `b`; the surface is the one on the normals' other side where they are taken
    /// `against` their direction.
    #[inline(always)]
    pub fn up(&self, b: [f64; 3], against: bool) -> Vec3 {
        let side = if against { -1.0 } else { 1.0 };
        let by = |i: usize| {
            let above = self.above[i][0] * b[(i + 1) % 3] + self.above[i][1] * b[(i + 2) % 3];
            let below = -above * side;
            side * b[i] * if below > 0.0 { below } else { 0.0 }
        };
        (self.n[0] * by(0) + self.n[1] * by(1) + self.n[2] * by(2)).as_vec3()
    }
}

/// How far up shadow rays start that leave at an angle of this cosine to the triangle's normal: 0…1. Steeper
/// light starts at the triangle: coarse surfaces would lose the shadows of what stands on them.
#[inline(always)]
fn lifted(cos: f64) -> f32 {
    /// One over the cosine from which on light does not graze; Cycles' default is .1.
    const PER_GRAZING: f64 = 10.0;
    (1.0 - cos * PER_GRAZING).clamp(0.0, 1.0) as f32
}

/// Where a shadow ray starts: at the place that is `clear` of the triangle, moved `up` where light grazes; `cos` is
/// that of its angle to the triangle's normal.
#[inline(always)]
pub(crate) fn start(clear: Vec3, up: Vec3, cos: f64) -> Vec3 {
    clear + up * lifted(cos)
}
