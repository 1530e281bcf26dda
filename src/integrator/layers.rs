//! Transparency: eye rays pass through layers of surfaces, whose light is composited front to back.

use crate::geometry::{Rgb, Rgba};
use crate::integrator::eye_rays::EyeRays;
use crate::integrator::frame::Frame;
use crate::integrator::shading_batch::{ShadingBatch, ShadingPoint};

/// Less transmittance than this counts as none: white behind it would change black by less than half a byte.
const MIN_TRANSMITTANCE: f32 = 1.0 / (1 << 13) as f32;

/// The layers of a batch of samples.
pub(crate) struct Layers<'a> {
    pub rays: EyeRays<'a>,
    /// For each sample the t where its eye ray hits the ground, until it is shaded; empty without a ground.
    pub ground_t: Vec<Option<f64>>,
    /// For each sample the light so far.
    radiance: Vec<Rgb>,
    /// For each sample the share of light from behind that still arrives, by colour.
    transmittance: Vec<Rgb>,
}

impl<'a> Layers<'a> {
    /// Starts with all rays at the camera.
    pub fn new(frame: &Frame, rays: EyeRays<'a>) -> Layers<'a> {
        let samples = rays.batch().len();
        Layers {
            ground_t: frame.intersect_ground(rays.batch()),
            rays,
            radiance: vec![Rgb::ZERO; samples],
            transmittance: vec![Rgb::ONE; samples],
        }
    }

    /// Composites the shaded points of the current layer, and moves the rays of samples that are not opaque yet behind
    /// their hits. False if there are none.
    pub fn composite(&mut self, points: &ShadingBatch) -> bool {
        let mut any_transparent = false;
        for (i, point) in points.points.iter().enumerate() {
            let layer = Layer::new(points, i, point);
            let transmittance = &mut self.transmittance[point.sample];
            self.radiance[point.sample] += *transmittance * layer.radiance;
            *transmittance *= layer.transmittance;
            if transmittance.max_element() < MIN_TRANSMITTANCE {
                *transmittance = Rgb::ZERO;
            } else {
                any_transparent = true;
            }
        }
        if !any_transparent {
            return false;
        }
        let transmittance = &self.transmittance;
        self.rays.continue_behind(|sample| transmittance[sample].max_element() > 0.0);
        !self.rays.is_empty()
    }

    /// Writes the samples' colours, premultiplied by alpha.
    pub fn write(&self, out: &mut [Rgba]) {
        for ((out, radiance), t) in out.iter_mut().zip(&self.radiance).zip(&self.transmittance) {
            *out = radiance.extend(1.0 - (t.x + t.y + t.z) / 3.0);
        }
    }
}

/// A surface point as a layer.
struct Layer {
    /// Light from the point.
    radiance: Rgb,
    /// Share of the light from behind that passes.
    transmittance: Rgb,
}

impl Layer {
    #[inline(always)]
    fn new(points: &ShadingBatch, i: usize, point: &ShadingPoint) -> Layer {
        let k = points.coefficients(i);
        let light = points.radiance(i);
        if point.is_shadow_catcher {
            let lit = lit_share(light, points.unshadowed(i));
            return Layer { radiance: Rgb::ZERO, transmittance: Rgb::ONE - (Rgb::ONE - lit) * k.alpha };
        }
        Layer {
            radiance: light * k.alpha,
            transmittance: Rgb::splat(1.0 - k.alpha) + k.transmission * k.alpha,
        }
    }
}

/// The share of light that shadows leave, by colour; 1 where there is no light.
fn lit_share(light: Rgb, unshadowed: Rgb) -> Rgb {
    let share = |light: f32, all: f32| if all > 0.0 { (light / all).clamp(0.0, 1.0) } else { 1.0 };
    Rgb::new(share(light.x, unshadowed.x), share(light.y, unshadowed.y), share(light.z, unshadowed.z))
}
