//! Hits of rays with one triangle: alone, and eight at a time as structure of arrays.

use glam::{DVec3, Vec3};

use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use crate::integrator::surface::soa::{HIT_LANES, set3, vec3};
use blinn_core::geometry::Ray;

/// A point where a ray hits a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceHit {
    pub p: Vec3,
    /// Origin of all rays that leave the point and do not graze the triangle.
    pub ray_origin: Vec3,
    /// Offset from there to the smooth surface.
    pub terminator_offset: Vec3,
    /// Geometric normal, unit length, on the ray's side.
    pub n_g: DVec3,
    /// Interpolated vertex normal, unit length, on the side of `n_g` unless the mesh keeps the side of its normals.
    pub n_v: DVec3,
    pub coords: TriangleCoords,
}

/// Up to eight rays that hit one triangle.
#[derive(Clone, Copy)]
pub(crate) struct Ray8 {
    pub o: [[f32; HIT_LANES]; 3],
    pub d: [[f32; HIT_LANES]; 3],
}

impl Ray8 {
    pub const ZERO: Ray8 = Ray8 { o: [[0.0; HIT_LANES]; 3], d: [[0.0; HIT_LANES]; 3] };

    #[inline(always)]
    pub fn set(&mut self, i: usize, Ray { o, d }: Ray) {
        set3(&mut self.o, i, o.to_array());
        set3(&mut self.d, i, d.to_array());
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        Ray { o: vec3(&self.o, i), d: vec3(&self.d, i) }
    }
}

/// Eight [`SurfaceHit`]s.
pub(crate) struct SurfaceHit8 {
    pub p: [[f32; HIT_LANES]; 3],
    pub ray_origin: [[f32; HIT_LANES]; 3],
    pub terminator_offset: [[f32; HIT_LANES]; 3],
    pub b: [[f32; HIT_LANES]; 3],
    pub differentials: [[f32; HIT_LANES]; BarycentricDifferentials::LEN],
    pub n_g: [[f64; HIT_LANES]; 3],
    pub n_v: [[f64; HIT_LANES]; 3],
}

impl SurfaceHit8 {
    pub const ZERO: SurfaceHit8 = SurfaceHit8 {
        p: [[0.0; HIT_LANES]; 3],
        ray_origin: [[0.0; HIT_LANES]; 3],
        terminator_offset: [[0.0; HIT_LANES]; 3],
        b: [[0.0; HIT_LANES]; 3],
        differentials: [[0.0; HIT_LANES]; BarycentricDifferentials::LEN],
        n_g: [[0.0; HIT_LANES]; 3],
        n_v: [[0.0; HIT_LANES]; 3],
    };

    #[inline(always)]
    pub fn set(&mut self, i: usize, hit: &SurfaceHit) {
        for axis in 0..3 {
            self.p[axis][i] = hit.p[axis];
            self.ray_origin[axis][i] = hit.ray_origin[axis];
            self.terminator_offset[axis][i] = hit.terminator_offset[axis];
            self.b[axis][i] = hit.coords.b[axis];
            self.n_g[axis][i] = hit.n_g[axis];
            self.n_v[axis][i] = hit.n_v[axis];
        }
        let s = &mut self.differentials;
        [s[0][i], s[1][i], s[2][i], s[3][i], s[4][i]] = hit.coords.differentials.to_array();
    }
}
