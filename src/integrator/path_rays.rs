//! The rays of a batch of paths, traced from surface to surface: eye rays, or a wave of secondary rays.

use crate::accel::{HitBatch, RayBatch};
use crate::geometry::{Hit, Ray};
use crate::integrator::frame::Frame;
use crate::integrator::material::hit_filter::MaterialHitFilter;
use crate::integrator::paths::{PathState, Wave};
use crate::integrator::sample::Sample;

/// Most surfaces along one eye ray; the rest is dropped.
pub(crate) const MAX_LAYERS: usize = 4096;

/// The rays of paths, one for each sample at first. Rays whose sample is finished are removed.
pub(crate) struct PathRays<'a> {
    rays: &'a mut RayBatch,
    hits: &'a mut HitBatch,
    /// The sample of each ray.
    ray_sample: Vec<usize>,
    /// The state of each sample's path, if surfaces of the scene send out rays.
    pub states: Vec<PathState>,
    /// True for rays that surfaces have sent out.
    pub is_secondary: bool,
}

/// A ray of a batch with its closest hit.
#[derive(Clone, Copy)]
pub(crate) struct PathRayHit {
    /// Index of the sample.
    pub sample: usize,
    pub ray: Ray,
    /// A miss if there is nothing along the ray.
    pub hit: Hit,
}

impl<'a> PathRays<'a> {
    /// The eye rays of `samples`. `rays` and `hits` lend memory.
    pub fn new(
        frame: &Frame,
        samples: &[Sample],
        rays: &'a mut RayBatch,
        hits: &'a mut HitBatch,
    ) -> PathRays<'a> {
        frame.generate_eye_rays(samples, rays);
        let ray_sample = (0..samples.len()).collect();
        PathRays { rays, hits, ray_sample, states: Vec::new(), is_secondary: false }
    }

    /// The rays of a wave, in place of eye rays.
    pub fn secondary(wave: &Wave, rays: &'a mut RayBatch, hits: &'a mut HitBatch) -> PathRays<'a> {
        wave.fill(rays);
        let states = wave.rays.iter().map(|ray| ray.state).collect();
        PathRays { rays, hits, ray_sample: (0..wave.rays.len()).collect(), states, is_secondary: true }
    }

    pub fn is_empty(&self) -> bool {
        self.ray_sample.is_empty()
    }

    pub fn batch(&self) -> &RayBatch {
        self.rays
    }

    /// The hits of all rays, as [`PathRays::intersect`] found them.
    pub fn hits(&self) -> &[Hit] {
        self.hits
    }

    /// Finds the closest hit of every ray.
    pub fn intersect(&mut self, frame: &Frame) {
        frame.accel.intersect(self.rays, &MaterialHitFilter(frame.posed), self.hits);
    }

    /// Ray number `i`.
    #[inline(always)]
    pub fn ray(&self, i: usize) -> Ray {
        Ray { o: self.rays.origins[i], d: self.rays.directions[i] }
    }

    /// The sample of ray number `i`.
    #[inline(always)]
    pub fn sample(&self, i: usize) -> usize {
        self.ray_sample[i]
    }

    /// All rays with their hits and misses.
    pub fn iter(&self) -> impl Iterator<Item = PathRayHit> {
        (0..self.hits.len()).map(|i| PathRayHit {
            sample: self.sample(i),
            ray: self.ray(i),
            hit: self.hits[i],
        })
    }

    /// Keeps the rays that hit a surface and whose sample `continues`. They start again behind their hits.
    pub fn continue_behind(&mut self, continues: impl Fn(usize) -> bool) {
        let keep = |i: &usize| !self.hits[*i].is_miss() && continues(self.ray_sample[*i]);
        let kept: Vec<usize> = (0..self.hits.len()).filter(keep).collect();
        self.rays.continue_behind(&kept, self.hits);
        self.ray_sample = kept.iter().map(|&i| self.ray_sample[i]).collect();
    }
}
