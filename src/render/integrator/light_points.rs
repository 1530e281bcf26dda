//! Random points of light sources with an extent, in structure of arrays.

use glam::Vec3;

use crate::integrator::emitters::{EmitterPoint, Emitters};
use crate::integrator::frame::distance_beyond;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, set3, vec3};
use blinn_core::geometry::concentric_disc;
use blinn_core::simd::AutovecKernel;
use blinn_scene::{AreaLightShape, Environment, PosedAreaLight, PosedScene, SourceDirection};

/// A random point of a light source for each point of a block.
pub(crate) struct LightPoints {
    pub p: [[f32; LANES]; 3],
    /// Unit normals of the side that emits.
    pub normal: [[f32; LANES]; 3],
    pub radiance: [[f32; LANES]; 3],
    /// 1 over the density of the point per square metre.
    pub area: [f32; LANES],
}

impl LightPoints {
    pub const ZERO: LightPoints = LightPoints {
        p: [[0.0; LANES]; 3],
        normal: [[0.0; LANES]; 3],
        radiance: [[0.0; LANES]; 3],
        area: [0.0; LANES],
    };

    /// Samples the glowing surfaces for the first `count` points of a block.
    pub fn sample_emitters(
        &mut self,
        posed: &PosedScene,
        emitters: &Emitters,
        block: &PointBlock,
        count: usize,
        choice: &[f32; LANES],
        u: &[[f32; LANES]; 2],
    ) {
        for i in 0..LANES {
            let sampled = (i < count)
                .then(|| emitters.sample(posed, vec3(&block.p, i), choice[i], [u[0][i], u[1][i]]))
                .flatten();
            let Some(EmitterPoint { p, normal, radiance, area }) = sampled else {
                set3(&mut self.radiance, i, [0.0; 3]);
                continue;
            };
            set3(&mut self.p, i, p.to_array());
            set3(&mut self.normal, i, normal.to_array());
            set3(&mut self.radiance, i, radiance.to_array());
            self.area[i] = area;
        }
    }

    /// Samples the light sources of an environment for the first `count` points of a block: points beyond the scene.
    pub fn sample_environment(
        &mut self,
        posed: &PosedScene,
        environment: &Environment,
        block: &PointBlock,
        count: usize,
        u: &[[f32; LANES]; 2],
    ) {
        for i in 0..LANES {
            let sampled = (i < count).then(|| environment.sample_light_sources([u[0][i], u[1][i]])).flatten();
            let Some(SourceDirection { direction, radiance, density }) = sampled else {
                set3(&mut self.radiance, i, [0.0; 3]);
                continue;
            };
            let from: Vec3 = vec3(&block.p, i);
            let distance = distance_beyond(from, posed.bounding_radius()) as f32;
            set3(&mut self.p, i, (from + direction * distance).to_array());
            set3(&mut self.normal, i, (-direction).to_array());
            set3(&mut self.radiance, i, radiance.to_array());
            self.area[i] = distance * distance / density;
        }
    }
}

/// Samples the points of an area light uniformly.
pub(crate) struct SampleAreaLight<'a> {
    pub light: &'a PosedAreaLight,
    pub u: &'a [[f32; LANES]; 2],
    pub points: &'a mut LightPoints,
}

impl AutovecKernel for SampleAreaLight<'_> {
    #[inline(always)]
    fn run(self) {
        let SampleAreaLight { light, u, points } = self;
        let area = light.area();
        for i in 0..LANES {
            let at = point_of_shape(light.shape, [u[0][i], u[1][i]]);
            let p = light.centre + light.half_x * at[0] + light.half_y * at[1];
            set3(&mut points.p, i, p.to_array());
            set3(&mut points.normal, i, light.normal.to_array());
            set3(&mut points.radiance, i, light.radiance.to_array());
            points.area[i] = area;
        }
    }
}

/// The point of a light's shape, from −1 to 1 along both of its axes, for a point of the unit square.
#[inline(always)]
fn point_of_shape(shape: AreaLightShape, u: [f32; 2]) -> [f32; 2] {
    match shape {
        AreaLightShape::Rect => [2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0],
        AreaLightShape::Disk => concentric_disc(u).as_vec2().to_array(),
    }
}
