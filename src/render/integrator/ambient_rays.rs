//! The rays of ambient occlusion of a block of points, computed together.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::integrator::environment_occlusion::LOOKUP_SHARE;
use crate::integrator::frame::distance_beyond;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::shadow_terminator::offset_to_smooth_surface;
use crate::integrator::surface::soa::{LANES, dvec3, set3, vec3};
use blinn_core::geometry::{Rgb, cosine_hemisphere};
use blinn_core::simd::AutovecKernel;
use blinn_scene::Environment;

/// Maximum solid angle of a lookup in the environment, in steradians: a hemisphere.
const MAX_SOLID_ANGLE: f64 = 2.0 * PI;

/// A ray from each point of a block, in a direction whose density is the cosine to the shading normal. Lanes behind the
/// last point hold any value.
pub(crate) struct AmbientRays {
    /// Unit directions, not yet mirrored to the side of the geometric normal, so that their mean is that of the whole
    /// hemisphere.
    pub l: [[f32; LANES]; 3],
    /// n·l.
    n_dot_l: [f64; LANES],
    pub from: [[f32; LANES]; 3],
    pub to: [[f32; LANES]; 3],
    /// True if the ray leaves the triangle on the side of the geometric normal, and not only the smooth surface.
    pub in_front: [bool; LANES],
}

impl AmbientRays {
    pub const ZERO: AmbientRays = AmbientRays {
        l: [[0.0; LANES]; 3],
        n_dot_l: [0.0; LANES],
        from: [[0.0; LANES]; 3],
        to: [[0.0; LANES]; 3],
        in_front: [false; LANES],
    };

    pub fn from(&self, i: usize) -> Vec3 {
        vec3(&self.from, i)
    }

    pub fn to(&self, i: usize) -> Vec3 {
        vec3(&self.to, i)
    }
}

/// Computes [`AmbientRays`].
pub(crate) struct ComputeAmbientRays<'a> {
    pub block: &'a PointBlock,
    /// The points in the unit square that directions are made from.
    pub u: &'a [[f32; LANES]; 2],
    /// Maximum length of a ray.
    pub distance: f64,
    /// Radius of a sphere around the origin that contains the scene.
    pub scene_radius: f64,
    pub rays: &'a mut AmbientRays,
}

impl AutovecKernel for ComputeAmbientRays<'_> {
    #[inline(always)]
    fn run(self) {
        let ComputeAmbientRays { block, u, distance, scene_radius, rays } = self;
        let mut directions = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let n = block.n(i);
            let l = cosine_hemisphere(n, [u[0][i], u[1][i]]);
            set3(&mut rays.l, i, l.as_vec3().to_array());
            rays.n_dot_l[i] = n.dot(l);
            // Directions into the triangle, which a tilted shading normal allows, are mirrored out.
            let n_g = dvec3(&block.n_g, i);
            let below = n_g.dot(l);
            let below = if below < 0.0 { below } else { 0.0 };
            set3(&mut directions, i, (l - n_g * (2.0 * below)).to_array());
        }
        for i in 0..LANES {
            let l: DVec3 = dvec3(&directions, i);
            let cos = dvec3(&block.n_g, i).dot(l);
            let from =
                offset_to_smooth_surface(vec3(&block.ray_origin, i), vec3(&block.terminator_offset, i), cos);
            let beyond = distance_beyond(from, scene_radius);
            let length = if distance < beyond { distance } else { beyond };
            set3(&mut rays.from, i, from.to_array());
            set3(&mut rays.to, i, (from.as_dvec3() + l * length).as_vec3().to_array());
            rays.in_front[i] = cos > 0.0;
        }
    }
}

/// Looks up the radiance of the environment along rays, averaged over the directions that each of them stands for.
pub(crate) struct LookUpEnvironment<'a> {
    pub environment: &'a Environment,
    pub rays: &'a AmbientRays,
    /// Number of rays of a pixel.
    pub counts: &'a [u32; LANES],
    pub radiance: &'a mut [Rgb; LANES],
}

impl AutovecKernel for LookUpEnvironment<'_> {
    #[inline(always)]
    fn run(self) {
        let LookUpEnvironment { environment, rays, counts, radiance } = self;
        let mut solid_angle = [0.0; LANES];
        for i in 0..LANES {
            let cos = rays.n_dot_l[i];
            let density = if cos > 0.0 { cos } else { 0.0 } / PI;
            let covered = LOOKUP_SHARE / (f64::from(counts[i]) * density);
            solid_angle[i] = if covered < MAX_SOLID_ANGLE { covered } else { MAX_SOLID_ANGLE } as f32;
        }
        *radiance = environment.radiance_of_lanes(&rays.l, &solid_angle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::simd::SimdLevel;

    /// Shading normals that are tilted against the triangle by different angles.
    #[test]
    fn rays_leave_the_triangle_and_end_at_the_distance_or_beyond_the_scene() {
        let mut block = PointBlock::ZERO;
        let mut u = [[0.0; LANES]; 2];
        for i in 0..LANES {
            let tilt = 0.04 * i as f64;
            set3(&mut block.n, i, [tilt.sin(), 0.0, tilt.cos()]);
            set3(&mut block.n_g, i, [0.0, 0.0, 1.0]);
            set3(&mut block.ray_origin, i, [0.01 * i as f32, 0.2, 0.3]);
            set3(&mut block.terminator_offset, i, [0.0, 0.0, 0.5]);
            (u[0][i], u[1][i]) = ((i % 8) as f32 / 8.0 + 0.01, (i / 8) as f32 / 4.0 + 0.02);
        }
        let mut mirrored = 0;
        for distance in [0.5, f64::INFINITY] {
            let mut all = Vec::new();
            for simd in SimdLevel::ALL.into_iter().filter(|simd| simd.is_supported()) {
                let mut rays = AmbientRays::ZERO;
                let block = &block;
                simd.run(ComputeAmbientRays { block, u: &u, distance, scene_radius: 100.0, rays: &mut rays });
                for i in 0..LANES {
                    let l = cosine_hemisphere(block.n(i), [u[0][i], u[1][i]]);
                    assert_eq!((vec3(&rays.l, i), rays.n_dot_l[i]), (l.as_vec3(), block.n(i).dot(l)));
                    let ray = rays.to(i).as_dvec3() - rays.from(i).as_dvec3();
                    let direction = ray.normalize();
                    assert!(direction.z > 0.0 && rays.in_front[i], "{i}: {direction}");
                    assert!((direction.z - l.z.abs()).abs() < 1e-5 && (direction.x - l.x).abs() < 1e-5);
                    mirrored += u32::from(l.z < 0.0);
                    // Grazing rays start on the smooth surface.
                    assert_eq!(rays.from(i).z > 0.3, l.z.abs() < 0.1, "{i}");
                    let beyond = distance_beyond(rays.from(i), 100.0);
                    assert!((ray.length() / distance.min(beyond) - 1.0).abs() < 1e-5);
                }
                all.push((rays.from, rays.to));
            }
            assert!(all.iter().all(|rays| *rays == all[0]), "all SIMD levels give the same rays");
        }
        assert!(mirrored > 0);
    }
}
