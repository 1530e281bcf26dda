//! Intersection of a ray with the plane of a triangle that it is known to hit.

use glam::{DVec3, Vec3};

use blinn_core::geometry::Ray;

/// A triangle in the world, relative to the scene's centre, without vertex normals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrianglePlane {
    pub vertices: [DVec3; 3],
    /// Unit normal of the front face; `None` for a degenerate triangle.
    pub front_normal: Option<DVec3>,
    pub gradients: BarycentricGradients,
}

/// Gradients of the barycentrics b₁ and b₂ in the plane of a triangle: the dot product with a step along the plane is the
/// change of the barycentric. From the first vertex, where both are 0, it is the barycentric itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BarycentricGradients([DVec3; 2]);

/// A ray where it crosses a triangle's plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneHit {
    pub t: f64,
    /// Direction of the ray.
    pub d: DVec3,
    /// The normal passed to [`TrianglePlane::intersect`].
    pub n: DVec3,
    pub n_dot_d: f64,
    pub inv_n_dot_d: f64,
    /// Barycentrics, clamped to the triangle.
    pub b: [f64; 3],
}

impl TrianglePlane {
    /// A triangle whose vertices are counter-clockwise seen from the front, or clockwise with `flip_winding`.
    #[inline(always)]
    pub fn new(vertices: [Vec3; 3], flip_winding: bool) -> TrianglePlane {
        let vertices = vertices.map(|v| v.as_dvec3());
        let edges = [vertices[1] - vertices[0], vertices[2] - vertices[0]];
        let normal = edges[0].cross(edges[1]) * if flip_winding { -1.0 } else { 1.0 };
        let front_normal = normal.try_normalize();
        let gradients = BarycentricGradients::new(edges, front_normal.unwrap_or(DVec3::ZERO));
        TrianglePlane { vertices, front_normal, gradients }
    }

    /// The front normal; a degenerate triangle faces the ray.
    #[inline(always)]
    pub fn front_normal_for(&self, ray: Ray) -> DVec3 {
        match self.front_normal {
            Some(n) => n,
            None => -ray.d.as_dvec3().normalize_or(DVec3::NEG_Z),
        }
    }

    /// Intersects the plane with `ray`, which is known to hit the triangle. `n` is [`TrianglePlane::front_normal_for`]
    /// the ray.
    #[inline(always)]
    pub fn intersect(&self, n: DVec3, ray: Ray) -> PlaneHit {
        let v0 = self.vertices[0];
        let o = ray.o.as_dvec3();
        let d = ray.d.as_dvec3();
        let n_dot_d = n.dot(d);
        let inv_n_dot_d = 1.0 / n_dot_d;
        let t = (v0 - o).dot(n) * inv_n_dot_d;
        let b = clamp_to_triangle(self.gradients.change(o - v0 + d * t));
        PlaneHit { t, d, n, n_dot_d, inv_n_dot_d, b }
    }
}

impl BarycentricGradients {
    /// For a triangle with edges `e1` and `e2` and unit normal `n`. Not finite for a degenerate triangle.
    #[inline(always)]
    pub fn new([e1, e2]: [DVec3; 2], n: DVec3) -> BarycentricGradients {
        let inv_area = 1.0 / e1.cross(e2).dot(n);
        BarycentricGradients([e2.cross(n) * inv_area, n.cross(e1) * inv_area])
    }

    /// Change of b₁ and b₂ along `step`.
    #[inline(always)]
    pub fn change(&self, step: DVec3) -> [f64; 2] {
        [step.dot(self.0[0]), step.dot(self.0[1])]
    }
}

/// Barycentrics of the point where `ray` hits the triangle `vertices`, which it is known to hit. They equal those of
/// `TrianglePlane::intersect` up to rounding and cost less where nothing else of the triangle is needed (Möller and
/// Trumbore, “Fast, Minimum Storage Ray/Triangle Intersection”, 1997).
#[inline(always)]
pub fn barycentrics(vertices: [Vec3; 3], ray: Ray) -> [f64; 3] {
    let [v0, v1, v2] = vertices.map(|v| v.as_dvec3());
    let d = ray.d.as_dvec3();
    let e1 = v1 - v0;
    let e2 = v2 - v0;
    let from_v0 = ray.o.as_dvec3() - v0;
    let pvec = d.cross(e2);
    let qvec = from_v0.cross(e1);
    let inv_det = 1.0 / pvec.dot(e1);
    clamp_to_triangle([pvec.dot(from_v0) * inv_det, qvec.dot(d) * inv_det])
}

/// Completes b₁ and b₂ by b₀, and clamps points that rounding put outside the triangle. Barycentrics that are not finite
/// become the centroid's.
#[inline(always)]
fn clamp_to_triangle([b1, b2]: [f64; 2]) -> [f64; 3] {
    let finite = b1.is_finite() & b2.is_finite();
    let b1 = b1.clamp(0.0, 1.0);
    let b2 = b2.clamp(0.0, 1.0);
    let sum = b1 + b2;
    let outside = sum > 1.0;
    let scale = if outside { 1.0 / sum } else { 1.0 };
    let b = [if outside { 0.0 } else { 1.0 - sum }, b1 * scale, b2 * scale];
    let third = 1.0 / 3.0;
    [if finite { b[0] } else { third }, if finite { b[1] } else { third }, if finite { b[2] } else { third }]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of all shapes, hit from all sides, inside and on the border; edge-on and degenerate ones.
    #[test]
    fn plane_and_moller_trumbore_give_the_same_barycentrics() {
        let mut state = 3u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 23) as f32 - 1.0
        };
        let mut compared = 0;
        for i in 0..5000 {
            let mut vector = || Vec3::new(random(), random(), random());
            let v0 = vector();
            let o = vector() * 3.0;
            // Every third triangle is a sliver.
            let e1 = vector();
            let e2 = vector() * if i % 3 == 0 { 1e-3 } else { 1.0 };
            let v = [v0, v0 + e1, v0 + e2 + e1 * if i % 3 == 0 { 0.4 } else { 0.0 }];
            let weights = vector().abs();
            let weights = weights / weights.element_sum();
            let p = v[0] * weights.x + v[1] * weights.y + v[2] * weights.z;
            let ray = Ray { o, d: p - o };
            let plane = TrianglePlane::new(v, i % 2 == 0);
            let n = plane.front_normal_for(ray);
            let a = plane.intersect(n, ray).b;
            let b = barycentrics(v, ray);
            if n.dot(ray.d.as_dvec3().normalize()).abs() > 1e-3 {
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
                compared += 1;
            }
        }
        assert!(compared > 4900, "{compared}");
        let third = [1.0 / 3.0; 3];
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(barycentrics(triangle, Ray { o: Vec3::NEG_X, d: Vec3::X }), third);
        assert_eq!(barycentrics([Vec3::ZERO, Vec3::X, Vec3::X], Ray { o: Vec3::Z, d: Vec3::NEG_Z }), third);
    }
}
