//! Transparency: rays pass through surfaces, whose light is composited front to back.

use crate::integrator::frame::Frame;
use crate::integrator::path_rays::PathRays;
use crate::integrator::paths::{PathLight, Wave};
use crate::integrator::shading_batch::{ShadingBatch, ShadingPoint};
use crate::integrator::surface::soa::vec3;
use blinn_core::geometry::Rgb;

/// Less transmittance than this counts as none: white behind it would change black by less than half a byte.
const OPAQUE_TRANSMITTANCE: f32 = 1.0 / (1 << 13) as f32;

/// Composites the light of a batch of paths, surface by surface.
pub(crate) struct Compositor<'a> {
    pub rays: PathRays<'a>,
    /// For each path the t where its ray hits the ground, until it is shaded; empty without a ground.
    pub ground_t: Vec<Option<f64>>,
    /// For each path the light so far, and the share of light from behind that still arrives.
    light: Vec<PathLight>,
}

impl<'a> Compositor<'a> {
    /// Starts with all rays at their origins.
    pub fn new(frame: &Frame, rays: PathRays<'a>) -> Compositor<'a> {
        let paths = rays.batch().len();
        Compositor {
            ground_t: frame.intersect_ground(rays.batch(), rays.is_secondary),
            rays,
            light: vec![PathLight { radiance: Rgb::ZERO, transmittance: Rgb::ONE }; paths],
        }
    }

    /// The share of the light of point `i` of `batch` that arrives at the origin of its path's current ray.
    #[inline(always)]
    pub fn throughput(&self, batch: &ShadingBatch, i: usize) -> Rgb {
        let path = batch.points[i].path;
        let (block, lane) = batch.soa.lane(i);
        let medium = self.rays.states.medium_transmittance_to(path, vec3(&block.p, lane));
        self.light[path].transmittance * medium * batch.coefficients(i).opacity
    }

    /// Composites the shaded points of the current surfaces, and moves the rays of paths that are not opaque yet behind
    /// their hits. False if there are none.
    pub fn composite(&mut self, frame: &Frame, batch: &ShadingBatch) -> bool {
        let mut any_transparent = false;
        for (i, point) in batch.points.iter().enumerate() {
            let mut surface = CompositedPoint::new(frame, batch, i, point);
            if self.rays.is_secondary {
                let (block, lane) = batch.soa.lane(i);
                let p = vec3(&block.p, lane);
                surface.radiance *= self.rays.states.medium_transmittance_to(point.path, p);
            }
            let PathLight { radiance, transmittance } = &mut self.light[point.path];
            *radiance += *transmittance * surface.radiance;
            *transmittance *= surface.transmittance;
            if transmittance.max_element() < OPAQUE_TRANSMITTANCE {
                *transmittance = Rgb::ZERO;
            } else {
                any_transparent = true;
            }
        }
        if !any_transparent {
            return false;
        }
        let light = &self.light;
        self.rays.continue_behind(|path| light[path].transmittance.max_element() > 0.0);
        !self.rays.is_empty()
    }

    /// Adds the light that secondary rays found to the paths that spawned them.
    pub fn add_secondary(&mut self, wave: &Wave, found: &[PathLight]) {
        for (ray, added) in wave.rays.iter().zip(wave.contributions(found)) {
            let light = &mut self.light[ray.parent];
            light.radiance += added.radiance;
            light.transmittance += added.transmittance;
        }
    }

    /// The light of all paths.
    pub fn into_light(self) -> Vec<PathLight> {
        self.light
    }
}

/// A surface point as it is composited.
struct CompositedPoint {
    /// Light from the point.
    radiance: Rgb,
    /// Share of the light from behind that passes.
    transmittance: Rgb,
}

impl CompositedPoint {
    #[inline(always)]
    fn new(frame: &Frame, batch: &ShadingBatch, i: usize, point: &ShadingPoint) -> CompositedPoint {
        let k = batch.coefficients(i);
        let light = batch.radiance(i);
        let uncovered = Rgb::splat(1.0 - k.opacity);
        if point.is_shadow_catcher {
            let lit = lit_share(light, batch.unshadowed(i));
            let transmittance = Rgb::ONE - (Rgb::ONE - lit) * k.opacity;
            return CompositedPoint { radiance: Rgb::ZERO, transmittance };
        }
        let transmitted = match k.k_t {
            // Most surfaces transmit nothing.
            Rgb::ZERO => Rgb::ZERO,
            // Refracted rays carry this light.
            _ if frame.refracts(point.id, &k) => Rgb::ZERO,
            k_t => k_t * batch.base_share(i),
        };
        CompositedPoint { radiance: light * k.opacity, transmittance: uncovered + transmitted * k.opacity }
    }
}

/// The share of light that shadows leave, by colour; 1 where there is no light.
fn lit_share(light: Rgb, unshadowed: Rgb) -> Rgb {
    let share = |light: f32, all: f32| if all > 0.0 { (light / all).clamp(0.0, 1.0) } else { 1.0 };
    Rgb::new(share(light.x, unshadowed.x), share(light.y, unshadowed.y), share(light.z, unshadowed.z))
}
