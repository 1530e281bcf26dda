//! One light at a block of points: directions, irradiance and the shadow rays that decide what arrives.

use glam::{DVec3, Vec3};

use crate::integrator::shadow_rays::ShadowRay;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::shadow_terminator::offset_to_smooth_surface;
use crate::integrator::surface::soa::{LANES, dvec3, set3, vec3};
use blinn_core::geometry::Rgb;
use blinn_scene::{LightEval, LightSample};

/// A light at the points of a [`PointBlock`].
pub(crate) struct IncidentLight {
    /// Unit directions to the light. In f64, because narrow highlights magnify rounding errors.
    pub l: [[f64; LANES]; 3],
    /// I/r² (E for directional lights) by colour, with the light's cone and range, before the factor n·l; 0 where the light
    /// does not face the surface.
    pub irradiance: [[f32; LANES]; 3],
    /// n·l, not clamped: where it is not positive, `irradiance` is 0.
    pub n_dot_l: [f32; LANES],
    /// n_g·l.
    pub n_g_dot_l: [f64; LANES],
    shadow_ray_origin: [[f32; LANES]; 3],
}

impl IncidentLight {
    pub const ZERO: IncidentLight = IncidentLight {
        l: [[0.0; LANES]; 3],
        irradiance: [[0.0; LANES]; 3],
        n_dot_l: [0.0; LANES],
        n_g_dot_l: [0.0; LANES],
        shadow_ray_origin: [[0.0; LANES]; 3],
    };

    /// Unit direction from point `i` to the light.
    #[inline(always)]
    pub fn l(&self, i: usize) -> DVec3 {
        dvec3(&self.l, i)
    }

    /// Evaluates a light with the given `intensity` at the points of a block. Each type of light has its own branch-free
    /// loop, which the compiler vectorises: a match inside the loop, or a closure that all types share, prevents that.
    #[inline(always)]
    pub fn evaluate(&mut self, light: &LightEval<'_>, intensity: Rgb, block: &PointBlock) {
        match *light {
            LightEval::Directional(l) => {
                self.sample_points(intensity, block, |_| LightSample { l, attenuation: 1.0 });
            }
            LightEval::Local(light) => self.sample_points(intensity, block, |p| light.sample(p)),
            LightEval::ScaledSpot(light, world_to_cone) => {
                self.sample_points(intensity, block, |p| light.sample_in_cone_frame(p, &world_to_cone));
            }
            LightEval::Photometric(light, world_to_light, profile) => {
                self.sample_points(intensity, block, |p| light.sample_profile(p, &world_to_light, profile));
            }
        }
    }

    #[inline(always)]
    fn sample_points(&mut self, intensity: Rgb, block: &PointBlock, sample: impl Fn(Vec3) -> LightSample) {
        for i in 0..LANES {
            let LightSample { l, attenuation } = sample(vec3(&block.p, i));
            self.set(block, i, l, intensity * attenuation);
        }
    }

    /// Stores a light at point `i`, given its direction and its irradiance.
    #[inline(always)]
    pub fn set(&mut self, block: &PointBlock, i: usize, l: DVec3, irradiance: Rgb) {
        // Both the shading and the vertex normal must face the light. This is the max of max(0, n·l).
        let faces_vertex_normal = dvec3(&block.n_v, i).dot(l) > 0.0;
        self.set_if(faces_vertex_normal, block, i, l, irradiance);
    }

    /// Stores a light that the shading normal at point `i` faces, if `is_above`.
    #[inline(always)]
    pub fn set_if(&mut self, is_above: bool, block: &PointBlock, i: usize, l: DVec3, irradiance: Rgb) {
        let n_dot_l = block.n(i).dot(l);
        let is_facing = n_dot_l > 0.0 && is_above;
        // Also turns NaN, as ∞ · 0 is, into 0.
        let is_lit = is_facing && irradiance.max_element() > 0.0;
        let irradiance = if is_lit { irradiance } else { Rgb::ZERO };
        let n_g_dot_l = dvec3(&block.n_g, i).dot(l);
        let origin = vec3(&block.ray_origin, i);
        let offset = vec3(&block.terminator_offset, i);
        set3(&mut self.l, i, l.to_array());
        set3(&mut self.irradiance, i, irradiance.to_array());
        self.n_dot_l[i] = n_dot_l as f32;
        self.n_g_dot_l[i] = n_g_dot_l;
        set3(&mut self.shadow_ray_origin, i, offset_to_smooth_surface(origin, offset, n_g_dot_l).to_array());
    }

    /// Multiplies the irradiance at each point by a factor.
    #[inline(always)]
    pub fn scale(&mut self, factors: &[f32; LANES]) {
        for channel in &mut self.irradiance {
            for (irradiance, factor) in channel.iter_mut().zip(factors) {
                *irradiance *= factor;
            }
        }
    }

    /// The lit points among the first `count`, as a bit mask.
    #[inline(always)]
    pub fn lit_mask(&self, count: usize) -> u32 {
        let mut mask = 0;
        for i in 0..LANES {
            let [r, g, b] = self.irradiance.each_ref().map(|c| c[i] > 0.0);
            mask |= u32::from(r | g | b) << i;
        }
        mask & (u32::MAX >> (LANES - count))
    }

    /// Appends a shadow ray for each point of `lit_mask`. `first` is the index of the block's first point.
    #[inline(always)]
    pub fn push_shadow_rays(&self, first: usize, mut lit_mask: u32, rays: &mut Vec<ShadowRay>) {
        while lit_mask != 0 {
            // The remainder lets the compiler drop the bounds checks.
            let i = lit_mask.trailing_zeros() as usize % LANES;
            lit_mask &= lit_mask - 1;
            rays.push(ShadowRay {
                point: first + i,
                l_centre: self.l(i),
                origin: vec3(&self.shadow_ray_origin, i),
                light_in_front: self.n_g_dot_l[i] > 0.0,
            });
        }
    }
}
