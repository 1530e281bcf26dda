//! Limits highlights that are seen in other surfaces: those of small lights would be fireflies.

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::frame::Frame;
use crate::integrator::paths::MAX_RADIANCE;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::points_soa::PointsSoa;
use crate::integrator::surface::soa::{LANES, vec3};
use blinn_core::geometry::Rgb;
use blinn_core::simd::AutovecKernel;
use blinn_scene::PosedLight;

/// Limits the highlights at points that secondary rays have hit: their sum to [`MAX_RADIANCE`], and each in proportion to the
/// irradiance of its light.
pub(crate) fn limit_highlights(frame: &Frame, batch: &mut ShadingBatch) {
    frame.simd().run(LimitHighlights { points: &mut batch.soa, lights: &frame.lights });
}

/// [`limit_highlights`].
struct LimitHighlights<'a> {
    points: &'a mut PointsSoa,
    lights: &'a [PosedLight],
}

impl AutovecKernel for LimitHighlights<'_> {
    #[inline(always)]
    fn run(self) {
        let mut incident = IncidentLight::ZERO;
        for (block, _) in self.points.blocks_mut() {
            if (block.highlights.points | block.layered.mask()) == 0 {
                continue;
            }
            let mut irradiance = [0.0; LANES];
            for light in self.lights {
                incident.evaluate(&light.light_eval(), light.intensity, block);
                for i in 0..LANES {
                    let of_light: Rgb = vec3(&incident.irradiance, i);
                    // 0 where n·l ≤ 0, and n·l may be NaN there.
                    let sum = of_light.element_sum();
                    irradiance[i] += if sum > 0.0 { sum * incident.n_dot_l[i] } else { 0.0 };
                }
            }
            for i in 0..LANES {
                block.highlights.max_share[i] = max_share(irradiance[i] / 3.0);
            }
        }
    }
}

/// The maximum of reflected light divided by irradiance, for a point with the given `irradiance` of all lights. Both are means of
/// the channels.
#[inline(always)]
pub(crate) fn max_share(irradiance: f32) -> f32 {
    MAX_RADIANCE / irradiance.min(f32::MAX)
}
