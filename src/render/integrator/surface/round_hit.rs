//! Hits on points and lines: on spheres and capsules, which have no plane.

use glam::DVec3;

use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use crate::integrator::surface::shading_triangle::ShadingTriangle;
use crate::integrator::surface::surface_hit::SurfaceHit;
use blinn_core::geometry::{Ray, offset_ray_origin};
use blinn_scene::Mesh;

/// Returns the barycentrics and the offset from the axis of `p` at a point or line, whose corners are those of
/// [`Mesh::corners`].
pub fn nearest_on_axis([a, b, _]: [DVec3; 3], p: DVec3) -> ([f32; 3], DVec3) {
    let e = b - a;
    let s = ((p - a).dot(e) / e.length_squared()).clamp(0.0, 1.0);
    // A point, or a line without length.
    let s = if s.is_nan() { 0.0 } else { s };
    ([(1.0 - s) as f32, s as f32, 0.0], p - (a + e * s))
}

/// Returns the barycentrics of the point of a line that is nearest to a ray; those of the first corner for a point.
pub(crate) fn axis_barycentrics([a, b, _]: [DVec3; 3], ray: Ray) -> [f32; 3] {
    let d = ray.d.as_dvec3();
    let across = |v: DVec3| v - d * (v.dot(d) / d.length_squared());
    let (e, v) = (across(b - a), across(ray.o.as_dvec3() - a));
    let s = (v.dot(e) / e.length_squared()).clamp(0.0, 1.0);
    let s = if s.is_nan() { 0.0 } else { s };
    [(1.0 - s) as f32, s as f32, 0.0]
}

impl ShadingTriangle<'_> {
    /// True for a point or a line.
    #[inline(always)]
    pub fn is_round(&self) -> bool {
        self.surface.front_normal.is_none() && self.mesh().has_rounds()
    }

    #[inline(always)]
    fn mesh(&self) -> &Mesh {
        self.surface.triangle.mesh
    }

    /// The hit of `ray` at `t` with the sphere of a point or the capsule of a line. Vertex normals, where there are some,
    /// replace those of the sphere or capsule.
    pub fn round_hit(&self, ray: Ray, t: f32) -> SurfaceHit {
        let d = ray.d.as_dvec3();
        let p = ray.o.as_dvec3() + d * f64::from(t);
        let (b, from_axis) = nearest_on_axis(self.vertices(), p);
        let facing = |n: DVec3| if n.dot(d) > 0.0 { -n } else { n };
        let of_round = from_axis.try_normalize().unwrap_or(-d.normalize_or(DVec3::NEG_Z));
        let [n0, n1, _] = self.vertex_normals();
        let n = n0 * f64::from(b[0]) + n1 * f64::from(b[1]);
        let n = facing(n.try_normalize().unwrap_or(of_round));
        let p = p.as_vec3();
        SurfaceHit {
            p,
            ray_origin: offset_ray_origin(p, self.surface.p_error, n.as_vec3(), n.as_vec3()),
            terminator_offset: glam::Vec3::ZERO,
            n_g: n,
            n_v: n,
            coords: TriangleCoords { b, differentials: BarycentricDifferentials::POINT },
        }
    }
}
