//! Ray differentials on a triangle: the change of barycentrics and of the normal from one sample to the next (Igehy,
//! “Tracing Ray Differentials”, SIGGRAPH 1999).

use glam::{DVec3, Vec2};

use crate::integrator::surface::triangle_plane::{BarycentricGradients, PlaneHit};
use blinn_core::geometry::RayDifferential;

/// A point on a triangle and the part of the triangle that its sample covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleCoords {
    /// Barycentrics.
    pub b: [f32; 3],
    pub differentials: BarycentricDifferentials,
}

/// The change of the barycentrics b₁ and b₂ from a path's ray to the rays of its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BarycentricDifferentials {
    /// By the step to the next sample in x and in y; not finite where the triangle is seen edge-on.
    db: [Vec2; 2],
    /// |∂n|² summed over both steps, of the interpolated vertex normal.
    dn_squared: f32,
}

/// A vertex normal interpolated between the corners of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InterpolatedNormal {
    /// The weighted sum of the corners' normals, normalised.
    pub n: DVec3,
    /// 1 over the length of the sum.
    pub inv_length: f64,
    /// False where the normals cancel, as they do in a mesh without normals: `n` is then not usable.
    pub valid: bool,
}

impl InterpolatedNormal {
    #[inline(always)]
    pub fn new(normals: &[DVec3; 3], b: [f64; 3]) -> InterpolatedNormal {
        let sum = normals[0] * b[0] + normals[1] * b[1] + normals[2] * b[2];
        let inv_length = sum.length_recip();
        let valid = (inv_length < f64::INFINITY) & (inv_length > 0.0);
        InterpolatedNormal { n: sum * inv_length, inv_length, valid }
    }
}

/// Share of |∂n|² that is added to α². The increase is twice the variance of the normals: the standard deviation of a
/// position in the footprint is 1/√12 of a sample along each axis (Tokuyoshi and Kaplanyan, “Improved Geometric Specular
/// Antialiasing”, I3D 2019).
const ALPHA2_PER_DN_SQUARED: f32 = 2.0 / 12.0;
/// Maximum increase of α², from the same paper.
const MAX_ALPHA2_INCREASE: f32 = 0.18;

impl BarycentricDifferentials {
    /// A sample without extent.
    pub const POINT: BarycentricDifferentials =
        BarycentricDifferentials { db: [Vec2::ZERO; 2], dn_squared: 0.0 };

    /// Transfers a ray differential to the plane that the ray hits.
    #[inline(always)]
    pub fn new(
        differential: &RayDifferential,
        hit: &PlaneHit,
        gradients: &BarycentricGradients,
    ) -> BarycentricDifferentials {
        let RayDifferential { o: [ox, oy], d: [dx, dy] } = *differential;
        // The neighbours' points at the same t, moved back to the plane along the ray.
        let change = |step: DVec3| {
            let [u, v] = gradients.change(step - hit.d * (step.dot(hit.n) * hit.inv_n_dot_d));
            Vec2::new(u as f32, v as f32)
        };
        let right = ox + dx * hit.t;
        let up = oy + dy * hit.t;
        BarycentricDifferentials { db: [change(right), change(up)], dn_squared: 0.0 }
    }

    /// Length of [`BarycentricDifferentials::to_array`].
    pub const LEN: usize = 5;
    /// Index of |∂n|² in [`BarycentricDifferentials::to_array`].
    pub const DN_SQUARED: usize = 4;

    /// All members, for storage as arrays.
    #[inline(always)]
    pub fn to_array(self) -> [f32; BarycentricDifferentials::LEN] {
        [self.db[0].x, self.db[0].y, self.db[1].x, self.db[1].y, self.dn_squared]
    }

    /// The inverse of [`BarycentricDifferentials::to_array`].
    #[inline(always)]
    pub fn from_array(
        [ux, vx, uy, vy, dn_squared]: [f32; BarycentricDifferentials::LEN],
    ) -> BarycentricDifferentials {
        BarycentricDifferentials { db: [Vec2::new(ux, vx), Vec2::new(uy, vy)], dn_squared }
    }

    /// True for a sample without extent.
    #[inline(always)]
    pub fn is_point(&self) -> bool {
        *self == BarycentricDifferentials::POINT
    }

    /// Computes |∂n|² of the interpolated normal `n` between the corners' `normals`.
    #[inline(always)]
    pub fn set_normal_change(&mut self, normals: &[DVec3; 3], n: &InterpolatedNormal) {
        let edges = [normals[1] - normals[0], normals[2] - normals[0]];
        let mut dn_squared = 0.0;
        for step in self.db {
            let change = edges[0] * f64::from(step.x) + edges[1] * f64::from(step.y);
            dn_squared += ((change - n.n * n.n.dot(change)) * n.inv_length).length_squared();
        }
        self.dn_squared = if n.valid { dn_squared as f32 } else { self.dn_squared };
    }

    /// The steps in x and in y in texture coordinates, given those of the corners.
    #[inline(always)]
    pub fn uv_steps(&self, [a, b, c]: [Vec2; 3]) -> [Vec2; 2] {
        let [x, y] = self.db;
        let uv_step = |step: Vec2| (b - a) * step.x + (c - a) * step.y;
        [uv_step(x), uv_step(y)]
    }

    /// Returns the increase of a highlight's α² by the curvature of the smooth surface.
    pub fn alpha2_increase(&self) -> f32 {
        alpha2_increase(self.dn_squared)
    }
}

/// Returns the increase of a highlight's α² by |∂n|² over a sample: twice the variance of the normals.
#[inline(always)]
pub(crate) fn alpha2_increase(dn_squared: f32) -> f32 {
    // NaN where the triangle is seen edge-on or the normals cancel.
    if dn_squared.is_nan() {
        MAX_ALPHA2_INCREASE
    } else {
        (ALPHA2_PER_DN_SQUARED * dn_squared).min(MAX_ALPHA2_INCREASE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The square (0, 0)…(1, 1), hit at its corner by a ray of that direction, at distance `t`.
    fn differentials(t: f64, direction: DVec3, o: [DVec3; 2], d: [DVec3; 2]) -> BarycentricDifferentials {
        let hit = PlaneHit {
            t,
            d: direction,
            n: DVec3::Z,
            n_dot_d: direction.z,
            inv_n_dot_d: 1.0 / direction.z,
            b: [1.0, 0.0, 0.0],
        };
        let gradients = BarycentricGradients::new([DVec3::X, DVec3::Y], DVec3::Z);
        BarycentricDifferentials::new(&RayDifferential { o, d }, &hit, &gradients)
    }

    const STEPS: [DVec3; 2] = [DVec3::new(0.01, 0.0, 0.0), DVec3::new(0.0, 0.02, 0.0)];

    #[test]
    fn footprints_grow_with_distance_for_perspective_rays_only() {
        let down = DVec3::new(0.0, 0.0, -8.0);
        let zero = [DVec3::ZERO; 2];
        for s in [differentials(1.0, down, zero, STEPS), differentials(1.0, down, STEPS, zero)] {
            assert_eq!(s.db, [Vec2::new(0.01, 0.0), Vec2::new(0.0, 0.02)]);
        }
        let far = differentials(4.0, down / 4.0, zero, STEPS);
        assert_eq!(far.db, [Vec2::new(0.04, 0.0), Vec2::new(0.0, 0.08)]);
    }

    #[test]
    fn steps_are_differences_of_neighbouring_hits() {
        let direction = DVec3::new(1.0, 2.0, -0.7);
        let h = 1e-6;
        let d = [DVec3::new(0.3, -0.2, 0.1), DVec3::new(0.1, 0.4, 0.5)];
        let s = differentials(1.0, direction, [DVec3::ZERO; 2], d);
        for (step, d) in s.db.iter().zip(d) {
            // The neighbour from (0, 0, 0.7) at z = 0.
            let neighbour = direction + d * h;
            let hit = neighbour * (direction.z / neighbour.z) - direction;
            let expected = Vec2::new((hit.x / h) as f32, (hit.y / h) as f32);
            assert!(step.abs_diff_eq(expected, 1e-4), "{step} {expected}");
        }
    }

    #[test]
    fn normals_of_a_sphere_change_by_step_over_radius() {
        let mut s = differentials(1.0, DVec3::new(0.0, 0.0, -8.0), STEPS, [DVec3::ZERO; 2]);
        let r = 50.0;
        let normals = [DVec3::new(0.0, 0.0, r), DVec3::new(1.0, 0.0, r), DVec3::new(0.0, 1.0, r)];
        let normals = normals.map(DVec3::normalize);
        s.set_normal_change(&normals, &InterpolatedNormal::new(&normals, [1.0, 0.0, 0.0]));
        let expected = (0.01 * 0.01 + 0.02 * 0.02) / (r * r) as f32;
        assert!((s.dn_squared / expected - 1.0).abs() < 1e-2, "{} {expected}", s.dn_squared);
    }

    #[test]
    fn alpha2_increase_is_limited_edge_on_and_where_normals_cancel() {
        let mut s = differentials(1.0, DVec3::X, [DVec3::ZERO; 2], STEPS);
        let normals = [DVec3::Z, DVec3::X, -DVec3::Z];
        let n = InterpolatedNormal::new(&normals, [0.5, 0.0, 0.5]);
        s.set_normal_change(&normals, &InterpolatedNormal { valid: true, ..n });
        assert_eq!(s.alpha2_increase(), MAX_ALPHA2_INCREASE);
        assert_eq!(BarycentricDifferentials::POINT.alpha2_increase(), 0.0);
    }
}
