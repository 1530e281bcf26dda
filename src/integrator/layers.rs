//! Transparency: eye rays pass through layers of surfaces, whose light is composited front to back.

use crate::geometry::Rgb;
use crate::integrator::frame::Frame;
use crate::integrator::path_rays::PathRays;
use crate::integrator::paths::{PathLight, Wave};
use crate::integrator::shading_batch::{ShadingBatch, ShadingPoint};
use crate::integrator::surface::soa::vec3;

/// Less transmittance than this counts as none: white behind it would change black by less than half a byte.
const MIN_TRANSMITTANCE: f32 = 1.0 / (1 << 13) as f32;

/// The layers of a batch of samples.
pub(crate) struct Layers<'a> {
    pub rays: PathRays<'a>,
    /// For each sample the t where its eye ray hits the ground, until it is shaded; empty without a ground.
    pub ground_t: Vec<Option<f64>>,
    /// For each sample the light so far.
    radiance: Vec<Rgb>,
    /// For each sample the share of light from behind that still arrives, by colour.
    pub transmittance: Vec<Rgb>,
}

impl<'a> Layers<'a> {
    /// Starts with all rays at the camera.
    pub fn new(frame: &Frame, rays: PathRays<'a>) -> Layers<'a> {
        let samples = rays.batch().len();
        Layers {
            ground_t: frame.intersect_ground(rays.batch(), rays.is_secondary),
            rays,
            radiance: vec![Rgb::ZERO; samples],
            transmittance: vec![Rgb::ONE; samples],
        }
    }

    /// Composites the shaded points of the current layer, and moves the rays of samples that are not opaque yet behind
    /// their hits. False if there are none.
    pub fn composite(&mut self, frame: &Frame, points: &ShadingBatch) -> bool {
        let mut any_transparent = false;
        // The stages without reflections have no states, and glass lets light pass straight.
        let has_paths = !self.rays.states.is_empty();
        for (i, point) in points.points.iter().enumerate() {
            let refracts = has_paths && frame.refracts(point.id);
            let mut layer = Layer::new(points, i, point, refracts);
            if let Some(state) = self.rays.states.get(point.sample) {
                let (block, lane) = points.soa.lane(i);
                layer.radiance *= state.transmittance_to(vec3(&block.p, lane));
            }
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

    /// Adds the light that secondary rays found to the samples that sent them out.
    pub fn add_secondary(&mut self, wave: &Wave, found: &[PathLight]) {
        for (ray, &light) in wave.rays.iter().zip(found) {
            let added = ray.contribution(light);
            self.radiance[ray.parent] += added.radiance;
            self.transmittance[ray.parent] += added.transmittance;
        }
    }

    /// The light of all samples.
    pub fn into_light(self) -> impl Iterator<Item = PathLight> {
        let light = self.radiance.into_iter().zip(self.transmittance);
        light.map(|(radiance, transmittance)| PathLight { radiance, transmittance })
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
    fn new(points: &ShadingBatch, i: usize, point: &ShadingPoint, refracts: bool) -> Layer {
        let k = points.coefficients(i);
        let light = points.radiance(i);
        if point.is_shadow_catcher {
            let lit = lit_share(light, points.unshadowed(i));
            return Layer { radiance: Rgb::ZERO, transmittance: Rgb::ONE - (Rgb::ONE - lit) * k.alpha };
        }
        let transmitted = match k.transmission {
            // Most surfaces transmit nothing.
            Rgb::ZERO => Rgb::ZERO,
            // Refracted rays take this light.
            _ if refracts => Rgb::ZERO,
            transmission => transmission * points.base_share(i),
        };
        Layer { radiance: light * k.alpha, transmittance: Rgb::splat(1.0 - k.alpha) + transmitted * k.alpha }
    }
}

/// The share of light that shadows leave, by colour; 1 where there is no light.
fn lit_share(light: Rgb, unshadowed: Rgb) -> Rgb {
    let share = |light: f32, all: f32| if all > 0.0 { (light / all).clamp(0.0, 1.0) } else { 1.0 };
    Rgb::new(share(light.x, unshadowed.x), share(light.y, unshadowed.y), share(light.z, unshadowed.z))
}
