//! Shadow rays to random points of a light with a radius, computed together.

use glam::DVec3;

use crate::integrator::frame::distance_beyond;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::shadow_terminator::offset_to_smooth_surface;
use crate::integrator::surface::soa::{LANES, dvec3, set3, vec3};
use blinn_core::simd::AutovecKernel;
use blinn_scene::PosedLight;

/// Points that a light with a radius shines on, in structure of arrays, and the rays from them to the light. Lanes behind the
/// last point hold any value.
pub(crate) struct AreaLightRays {
    p: [[f32; LANES]; 3],
    ray_origin: [[f32; LANES]; 3],
    terminator_offset: [[f32; LANES]; 3],
    n_g: [[f64; LANES]; 3],
    n_v: [[f64; LANES]; 3],
    /// Unit directions to the light's centre.
    l_centre: [[f64; LANES]; 3],
    pub from: [[f32; LANES]; 3],
    pub to: [[f32; LANES]; 3],
    /// True if the ray leaves the triangle on the side of the geometric normal, and not only the smooth surface.
    pub in_front: [bool; LANES],
    /// True above the horizon of the smooth surface.
    pub is_facing: [bool; LANES],
}

impl AreaLightRays {
    pub const ZERO: AreaLightRays = AreaLightRays {
        p: [[0.0; LANES]; 3],
        ray_origin: [[0.0; LANES]; 3],
        terminator_offset: [[0.0; LANES]; 3],
        n_g: [[0.0; LANES]; 3],
        n_v: [[0.0; LANES]; 3],
        l_centre: [[0.0; LANES]; 3],
        from: [[0.0; LANES]; 3],
        to: [[0.0; LANES]; 3],
        in_front: [false; LANES],
        is_facing: [false; LANES],
    };

    /// Loads point `from` of a block into lane `i`.
    #[inline(always)]
    pub fn load(&mut self, i: usize, block: &PointBlock, from: usize, l_centre: DVec3) {
        set3(&mut self.p, i, vec3(&block.p, from).to_array());
        set3(&mut self.ray_origin, i, vec3(&block.ray_origin, from).to_array());
        set3(&mut self.terminator_offset, i, vec3(&block.terminator_offset, from).to_array());
        set3(&mut self.n_g, i, dvec3(&block.n_g, from).to_array());
        set3(&mut self.n_v, i, dvec3(&block.n_v, from).to_array());
        set3(&mut self.l_centre, i, l_centre.to_array());
    }
}

/// Computes the rays of [`AreaLightRays`].
pub(crate) struct ComputeAreaLightRays<'a> {
    pub light: &'a PosedLight,
    /// The points of the unit square that become points on the light.
    pub u: &'a [[f32; LANES]; 2],
    /// Radius of a sphere around the origin that contains the scene.
    pub scene_radius: f64,
    pub rays: &'a mut AreaLightRays,
}

impl AutovecKernel for ComputeAreaLightRays<'_> {
    #[inline(always)]
    fn run(self) {
        let ComputeAreaLightRays { light, u, scene_radius, rays } = self;
        let centre = light.position().map(|centre| centre.as_dvec3());
        for i in 0..LANES {
            let (p, l_centre) = (vec3(&rays.p, i).as_dvec3(), dvec3(&rays.l_centre, i));
            let on_disc = centre.unwrap_or(l_centre) + light.disc_offset(l_centre, [u[0][i], u[1][i]]);
            let to_emitter = if centre.is_some() { on_disc - p } else { on_disc };
            let inv_length = to_emitter.length_recip();
            let has_direction = (inv_length > 0.0) & (inv_length < f64::INFINITY);
            let l = if has_direction { to_emitter * inv_length } else { l_centre };
            let cos = dvec3(&rays.n_g, i).dot(l);
            let origin = vec3(&rays.ray_origin, i);
            let from = offset_to_smooth_surface(origin, vec3(&rays.terminator_offset, i), cos);
            let beyond = from.as_dvec3() + l * distance_beyond(from, scene_radius);
            let to = if centre.is_some() { p + to_emitter } else { beyond };
            set3(&mut rays.from, i, from.to_array());
            set3(&mut rays.to, i, to.as_vec3().to_array());
            rays.in_front[i] = cos > 0.0;
            rays.is_facing[i] = dvec3(&rays.n_v, i).dot(l) > 0.0;
        }
    }
}
