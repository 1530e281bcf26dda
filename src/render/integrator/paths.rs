//! Paths of light: an eye ray and the reflected and refracted rays that follow it, traced in waves. Each wave has the rays
//! that the surfaces hit by the previous one spawn.

use glam::{DVec3, Vec3};

use crate::integrator::environment_occlusion::{OcclusionEstimate, arriving_light};
use crate::integrator::frame::Frame;
use crate::integrator::media::{MediumStack, Wavelength, beer_lambert};
use crate::integrator::sample::Sample;
use blinn_accel::RayBatch;
use blinn_core::geometry::{HitId, RayDifferential, Rgb};

/// State of a path at its current ray.
///
/// A path has a ray cone (Akenine-Möller et al., “Texture Level of Detail Strategies for Real-Time Ray Tracing”, Ray Tracing
/// Gems, 2019): a width and its growth, which sum up all surfaces met so far. Eye rays have exact ray differentials, whose
/// shape textures are filtered with; behind a rough or curved surface only the size of the footprint is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathState {
    /// Where the current ray starts.
    pub origin: Vec3,
    /// Width of the ray cone at the ray's origin, in metres.
    pub width: f32,
    /// Growth of the ray cone per metre.
    pub spread: f32,
    /// The bodies that the ray is inside of.
    pub media: MediumStack,
    /// The colours that the path carries, which dispersion has split.
    pub wavelength: Wavelength,
    /// Share of the light at the origin that arrives in the picture, in the brightest channel.
    pub importance: f32,
    /// Number of reflections that may still follow at surfaces other than glass.
    pub reflections_left: u8,
    /// Number of reflections and refractions that may still follow at glass.
    pub glass_events_left: u8,
    /// Number of diffuse bounces that may still follow.
    pub diffuse_left: u8,
    /// True behind a diffuse bounce.
    pub is_indirect: bool,
}

impl PathState {
    /// Width of the ray cone at `p`, in metres.
    pub fn width_at(&self, p: Vec3) -> f32 {
        self.width + self.spread * self.origin.distance(p)
    }

    /// The share of light that the medium around the ray leaves between its origin and `p`.
    pub fn medium_transmittance_to(&self, p: Vec3) -> Rgb {
        let sigma = self.media.current().absorption;
        if sigma == Rgb::ZERO {
            return Rgb::ONE;
        }
        beer_lambert(sigma * self.origin.distance(p))
    }

    /// The differential of a ray with unit direction `d` that is as wide as the ray cone.
    pub fn ray_differential(&self, d: Vec3) -> RayDifferential {
        let d = d.as_dvec3();
        let x = d.any_orthonormal_vector();
        let y = d.cross(x);
        let (width, spread) = (f64::from(self.width), f64::from(self.spread));
        RayDifferential { o: [x * width, y * width], d: [x * spread, y * spread] }
    }
}

/// The light from beyond the scene along a ray that escapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Escape {
    /// The environment's radiance.
    Radiance(Rgb),
    /// The background of the picture.
    Background,
}

/// How a secondary ray counts the area lights and glowing surfaces that it meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AreaLightHits {
    /// Not at all: shadow rays find their light.
    Ignored,
    /// In full: nothing else finds their light.
    Counted,
    /// Weighted against shadow rays by the density of the ray's direction, per steradian.
    Weighted(f32),
}

/// The weight of light that is found by directions of a density, and by others of density `other` as well (Veach and Guibas,
/// “Optimally Combining Sampling Techniques for Monte Carlo Rendering”, SIGGRAPH 1995).
#[inline(always)]
pub(crate) fn balance_heuristic(density: f32, other: f32) -> f32 {
    density / (density + other)
}

impl AreaLightHits {
    /// The share of an area light's radiance that counts. `of_shadow_ray` is the density with which shadow rays find it.
    pub fn weight(self, of_shadow_ray: f32) -> f32 {
        match self {
            AreaLightHits::Ignored => 0.0,
            AreaLightHits::Counted => 1.0,
            AreaLightHits::Weighted(density) => balance_heuristic(density, of_shadow_ray),
        }
    }
}

/// A ray that a surface spawns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SecondaryRay {
    /// Index of the path in the previous wave.
    pub parent: usize,
    /// Factor from this ray's radiance to its parent's.
    pub weight: Rgb,
    /// The same factor where the ray escapes. Under a uniform environment, it leaves the weight of the sampled direction out,
    /// so that there is no noise.
    pub escape_weight: Rgb,
    /// Share of the light from beyond the scene that the bumps of the parent's surface let pass. `weight` includes it.
    pub bump_shadowing: f32,
    /// Upper bound on the light of surfaces that the ray adds to its parent, in the brightest channel.
    pub max_light: f32,
    pub escape: Escape,
    /// The environment's light over the ray's whole lobe without occlusion, as the parent receives it.
    pub unoccluded: Option<Rgb>,
    /// Unit length.
    pub direction: Vec3,
    /// The triangle that the ray starts on.
    pub source: HitId,
    /// True for a ray that a matte surface spawns.
    pub is_diffuse: bool,
    /// True for a ray of a lobe that is wider than a mirror's: one of many.
    pub is_rough: bool,
    /// Share of the features of what the parent sees: of narrow lobes and glass. 0 for wide lobes, which blur what they show.
    pub seen_share: f32,
    /// How the ray meets area lights.
    pub area_lights: AreaLightHits,
    pub state: PathState,
}

/// The rays of one wave, with the samples whose random numbers they use.
#[derive(Default)]
pub(crate) struct Wave {
    pub rays: Vec<SecondaryRay>,
    pub samples: Vec<Sample>,
    /// Paths whose rays are left out by chance, and the shares of what they see: those of narrow lobes and glass.
    pub unseen: Vec<(usize, f32)>,
}

impl Wave {
    /// Removes all rays and keeps the memory.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.samples.clear();
        self.unseen.clear();
    }

    pub fn push(&mut self, ray: SecondaryRay, sample: Sample) {
        self.rays.push(ray);
        self.samples.push(sample);
    }

    /// Leaves out a ray that would show a share of what its parent sees.
    pub fn leave_out(&mut self, parent: usize, seen_share: f32) {
        if seen_share > 0.0 {
            self.unseen.push((parent, seen_share));
        }
    }

    /// Fills `batch` with the rays of the wave. They meet both sides of surfaces.
    pub fn fill(&self, batch: &mut RayBatch) {
        batch.clear();
        *batch = RayBatch {
            origins: std::mem::take(&mut batch.origins),
            directions: std::mem::take(&mut batch.directions),
            after: std::mem::take(&mut batch.after),
            source: std::mem::take(&mut batch.source),
            ..RayBatch::default()
        };
        batch.origins.extend(self.rays.iter().map(|ray| ray.state.origin));
        batch.directions.extend(self.rays.iter().map(|ray| ray.direction));
        batch.source.extend(self.rays.iter().map(|ray| ray.source));
    }
}

/// The light along a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathLight {
    pub radiance: Rgb,
    /// The light of area lights that the path's ray meets.
    pub emitted: Rgb,
    /// Share of the light from behind all surfaces that arrives.
    pub transmittance: Rgb,
}

impl PathLight {
    /// Black.
    pub const NONE: PathLight =
        PathLight { radiance: Rgb::ZERO, emitted: Rgb::ZERO, transmittance: Rgb::ZERO };
}

/// Maximum radiance of surfaces along a secondary ray, as the mean of the channels. Few rays find the brighter highlights of small
/// lights: they would be fireflies.
pub(crate) const MAX_RADIANCE: f32 = 10.0;
/// The same where whole paths are traced, whose light must add up. Reconstruction bounds the spikes that are left.
pub(crate) const MAX_PATH_RADIANCE: f32 = 1000.0;

/// Maximum of a channel, so that the sum of three is finite.
const MAX_CHANNEL: f32 = 1e38;

impl SecondaryRay {
    /// The light of the surfaces along the ray, as the parent receives it. Clamps fireflies.
    fn surface_light(&self, found: PathLight, max_radiance: f32) -> Rgb {
        let radiance = found.radiance.min(Rgb::splat(MAX_CHANNEL));
        let mean = radiance.element_sum() / 3.0;
        let radiance = if mean > max_radiance { radiance * (max_radiance / mean) } else { radiance };
        let light = radiance * self.weight;
        let brightest = light.max_element();
        if brightest > self.max_light { light * (self.max_light / brightest) } else { light }
    }
}

impl Wave {
    /// The light that each ray adds to its parent. `found` is the light along the rays, of which that of surfaces counts up to
    /// `max_radiance`, the mean of the channels.
    pub fn contributions(&self, found: &[PathLight], max_radiance: f32) -> Vec<PathLight> {
        let mut lights: Vec<PathLight> = Vec::with_capacity(found.len());
        let (mut estimates, mut estimated) = (Vec::new(), Vec::new());
        for (i, (ray, &found)) in self.rays.iter().zip(found).enumerate() {
            let radiance = ray.surface_light(found, max_radiance) + found.emitted * ray.weight;
            let mut light = PathLight { radiance, ..PathLight::NONE };
            let visibility = found.transmittance * ray.bump_shadowing;
            match (ray.escape, ray.unoccluded) {
                (Escape::Background, _) => light.transmittance = ray.escape_weight * visibility,
                (Escape::Radiance(radiance), None) => {
                    light.radiance += radiance * ray.escape_weight * visibility;
                }
                (Escape::Radiance(radiance), Some(unoccluded)) => {
                    let radiance = radiance * ray.escape_weight;
                    estimated.push(i);
                    estimates.push(OcclusionEstimate {
                        pixel: self.samples[i].pixel,
                        unoccluded,
                        visibility,
                        visible: radiance * visibility,
                        hidden: radiance * (Rgb::ONE - visibility),
                    });
                }
            }
            lights.push(light);
        }
        for (i, light) in estimated.into_iter().zip(arriving_light(&estimates)) {
            lights[i].radiance += light;
        }
        lights
    }
}

/// The states of the paths of a batch at their current rays.
#[derive(Clone, Copy)]
pub(crate) enum PathStates<'a> {
    /// No states: surfaces spawn no rays.
    Unused,
    /// The states of eye rays, which their samples determine.
    Eye(&'a Frame<'a>, &'a [Sample]),
    /// The states of the rays of a wave.
    Secondary(&'a [SecondaryRay]),
}

impl PathStates<'_> {
    /// The state of a path; `None` if surfaces spawn no rays.
    pub fn get(&self, path: usize) -> Option<PathState> {
        match self {
            PathStates::Unused => None,
            PathStates::Eye(frame, samples) => Some(frame.eye_state(&samples[path])),
            PathStates::Secondary(rays) => Some(rays[path].state),
        }
    }

    /// [`PathState::importance`].
    #[inline(always)]
    pub fn importance(&self, path: usize) -> f32 {
        match self {
            PathStates::Secondary(rays) => rays[path].state.importance,
            _ => 1.0,
        }
    }

    /// [`PathState::is_indirect`].
    #[inline(always)]
    pub fn is_indirect(&self, path: usize) -> bool {
        self.secondary(path).is_some_and(|ray| ray.state.is_indirect)
    }

    /// The ray of a path, if a surface has spawned it.
    #[inline(always)]
    pub fn secondary(&self, path: usize) -> Option<&SecondaryRay> {
        match self {
            PathStates::Secondary(rays) => Some(&rays[path]),
            _ => None,
        }
    }

    /// True if a path may still be reflected at a surface other than glass.
    #[inline(always)]
    pub fn may_reflect(&self, path: usize) -> bool {
        match self {
            PathStates::Unused => false,
            PathStates::Eye(frame, _) => frame.bounces > 0,
            PathStates::Secondary(rays) => rays[path].state.reflections_left > 0,
        }
    }

    /// True if a path may still bounce off a matte surface.
    #[inline(always)]
    pub fn may_bounce(&self, path: usize) -> bool {
        match self {
            PathStates::Unused => false,
            PathStates::Eye(frame, _) => frame.indirect > 0,
            PathStates::Secondary(rays) => rays[path].state.diffuse_left > 0,
        }
    }

    /// [`PathState::medium_transmittance_to`].
    #[inline(always)]
    pub fn medium_transmittance_to(&self, path: usize, p: Vec3) -> Rgb {
        match self {
            PathStates::Secondary(rays) => rays[path].state.medium_transmittance_to(p),
            // Eye rays start outside of all bodies.
            _ => Rgb::ONE,
        }
    }
}

impl Frame<'_> {
    /// The state of the eye ray of a sample.
    fn eye_state(&self, sample: &Sample) -> PathState {
        let ray = self.eye_ray(sample);
        let [width, spread] = match self.ray_differential(sample.footprint) {
            Some(RayDifferential { o, d }) => {
                let length = |v: [DVec3; 2]| (v[0].length() * v[1].length()).sqrt();
                [length(o) as f32, (length(d) / ray.d.as_dvec3().length()) as f32]
            }
            None => [0.0; 2],
        };
        PathState {
            origin: ray.o,
            width,
            spread,
            media: MediumStack::EMPTY,
            wavelength: Wavelength::White,
            importance: 1.0,
            reflections_left: self.bounces,
            glass_events_left: self.bounces.saturating_mul(3),
            diffuse_left: self.indirect,
            is_indirect: false,
        }
    }
}
