//! The rays of a batch of paths, traced from surface to surface: eye rays, or a wave of secondary rays.

use glam::Vec3;

use crate::integrator::area_light_hits::AreaLightHit;
use crate::integrator::frame::Frame;
use crate::integrator::material::hit_filter::MaterialHitFilter;
use crate::integrator::paths::{PathStates, Wave};
use crate::integrator::sample::Sample;
use blinn_accel::{HitBatch, RayBatch};
use blinn_core::geometry::{Hit, Ray};

/// Maximum number of surfaces that a ray passes; the rest is dropped.
pub(crate) const MAX_SURFACES_PER_RAY: usize = 4096;

/// Rays that [`PathRays::merge_equal`] remembers.
const MERGE_SLOTS: usize = 2048;

/// The rays of a batch of paths, one for each path at first. Rays of finished paths are removed.
///
/// The index of a path is that of its sample among eye rays, and that of its ray in a [`Wave`].
pub(crate) struct PathRays<'a> {
    rays: &'a mut RayBatch,
    hits: &'a mut HitBatch,
    /// Index of the path of each ray.
    ray_path: Vec<usize>,
    /// The state of each path.
    pub states: PathStates<'a>,
    /// True for the rays of a [`Wave`].
    pub is_secondary: bool,
}

/// A ray of a batch with its closest hit.
#[derive(Clone, Copy)]
pub(crate) struct PathRayHit {
    /// Index of the path.
    pub path: usize,
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
        let ray_path = (0..samples.len()).collect();
        PathRays { rays, hits, ray_path, states: PathStates::Unused, is_secondary: false }
    }

    /// Keeps one of equal eye rays, as far as a small table remembers the last ones, and numbers their paths anew. Returns the
    /// new path of each sample.
    pub fn merge_equal(&mut self) -> Vec<usize> {
        let mut last = [0; MERGE_SLOTS];
        let mut paths = Vec::with_capacity(self.rays.len());
        let mut count = 0;
        for i in 0..self.rays.len() {
            let Ray { o, d } = self.ray(i);
            let slot = &mut last[merge_slot(o, d)];
            // Kept rays are at the front.
            if *slot < count && has_same_bits(self.ray(*slot), Ray { o, d }) {
                paths.push(*slot);
                continue;
            }
            *slot = count;
            self.rays.origins[count] = o;
            self.rays.directions[count] = d;
            paths.push(count);
            count += 1;
        }
        self.rays.origins.truncate(count);
        self.rays.directions.truncate(count);
        self.ray_path.truncate(count);
        paths
    }

    /// The rays of a wave, in place of eye rays.
    pub fn secondary(wave: &'a Wave, rays: &'a mut RayBatch, hits: &'a mut HitBatch) -> PathRays<'a> {
        wave.fill(rays);
        let states = PathStates::Secondary(&wave.rays);
        PathRays { rays, hits, ray_path: (0..wave.rays.len()).collect(), states, is_secondary: true }
    }

    /// The area lights along the rays of a wave, sorted by path.
    pub fn area_light_hits(&self, frame: &Frame) -> Vec<AreaLightHit> {
        let mut hits = Vec::new();
        if let PathStates::Secondary(rays) = self.states
            && !frame.area_lights.is_empty()
        {
            for (path, ray) in rays.iter().enumerate() {
                let o = ray.state.origin;
                frame.intersect_area_lights(path, o, ray.direction, ray.area_lights, &mut hits);
            }
        }
        hits
    }

    pub fn is_empty(&self) -> bool {
        self.ray_path.is_empty()
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

    /// Index of the path of ray number `i`.
    #[inline(always)]
    pub fn path(&self, i: usize) -> usize {
        self.ray_path[i]
    }

    /// All rays with their hits and misses.
    pub fn iter(&self) -> impl Iterator<Item = PathRayHit> {
        (0..self.hits.len()).map(|i| PathRayHit { path: self.path(i), ray: self.ray(i), hit: self.hits[i] })
    }

    /// Keeps the rays that hit a surface and whose path `continues`. They start again behind their hits.
    pub fn continue_behind(&mut self, continues: impl Fn(usize) -> bool) {
        let keep = |i: &usize| !self.hits[*i].is_miss() && continues(self.ray_path[*i]);
        let kept: Vec<usize> = (0..self.hits.len()).filter(keep).collect();
        self.rays.continue_behind(&kept, self.hits);
        self.ray_path = kept.iter().map(|&i| self.ray_path[i]).collect();
    }
}

/// Returns the place of a ray in the table of [`PathRays::merge_equal`].
#[inline(always)]
fn merge_slot(o: Vec3, d: Vec3) -> usize {
    let mix = |hash: u32, x: f32| (hash ^ x.to_bits()).wrapping_mul(0x9e37_79b1).rotate_left(15);
    let hash = o.to_array().into_iter().chain(d.to_array()).fold(0, mix);
    (hash.wrapping_mul(0x85eb_ca6b) >> 16) as usize % MERGE_SLOTS
}

/// Returns true if rays are the same, also in the signs of zeros.
#[inline(always)]
fn has_same_bits(a: Ray, b: Ray) -> bool {
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    bits(a.o) == bits(b.o) && bits(a.d) == bits(b.d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_rays_are_merged() {
        let mut rays = RayBatch::default();
        let directions = [Vec3::X, Vec3::Y, Vec3::X, Vec3::new(1.0, -0.0, 0.0), Vec3::Y];
        directions.into_iter().for_each(|d| rays.push(Vec3::ZERO, d));
        rays.push(Vec3::ONE, Vec3::X);
        let mut hits = Vec::new();
        let mut paths = PathRays {
            ray_path: (0..rays.len()).collect(),
            rays: &mut rays,
            hits: &mut hits,
            states: PathStates::Unused,
            is_secondary: false,
        };
        assert_eq!(paths.merge_equal(), [0, 1, 0, 2, 1, 3]);
        assert_eq!(paths.ray_path, [0, 1, 2, 3]);
        assert_eq!(rays.directions, [Vec3::X, Vec3::Y, Vec3::X, Vec3::X]);
        assert_eq!(rays.origins, [Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::ONE]);
    }
}
