//! Distance between the rays of a batch, in triangles.
//!
//! Where many triangles lie between neighbouring rays, hardly two rays of a packet visit the same leaf: its groups are nearly
//! empty below the upper nodes, and a ray stream is faster.

use std::ops::Range;

use glam::Vec3;

use crate::bvh::aabb::Aabb;
use crate::bvh::blas::Blas;
use crate::bvh::scene_bvh::SceneBvh;
use crate::ray_batch::{Coherence, RayBatch, ShadowRayBatch};

/// Rays with more triangles for each of them than this are faster as streams.
const MAX_SPREAD: f32 = 4.0;

/// Fewer rays are too few for a stream.
const MIN_RAYS: usize = 64;

/// Parts of a range. The spread is that of the densest one: others may reach over a silhouette.
const PARTS: usize = 4;

/// Rays that a part is judged by.
const SAMPLES: usize = 8;

/// The triangles of the world BVHs, as if they covered the faces of their bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleDensity {
    triangles_per_area: f32,
    /// Centre of the larger BVH.
    centre: Vec3,
}

impl TriangleDensity {
    /// Computes the density of a scene.
    pub fn new(bvh: &SceneBvh) -> TriangleDensity {
        let worlds = bvh.worlds();
        let of_world = |world: &Blas| {
            world.bounds.map_or(0.0, |bounds| world.triangle_count as f32 / (6.0 * largest_face(bounds)))
        };
        let larger = worlds[usize::from(worlds[1].triangle_count > worlds[0].triangle_count)];
        TriangleDensity {
            triangles_per_area: of_world(worlds[0]) + of_world(worlds[1]),
            centre: larger.centre.as_vec3(),
        }
    }

    /// Returns true if the rays `range` of a batch are so far apart that a stream is faster than a packet.
    #[inline(always)]
    pub fn are_spread(&self, rays: &RayBatch, range: Range<usize>) -> bool {
        let spread = match rays.coherence {
            Coherence::Origin(o) => {
                // Where they pass the scene.
                let distance = o.distance(self.centre);
                self.spread(range, |ray| rays.directions[ray].normalize() * distance)
            }
            _ => self.spread(range, |ray| rays.origins[ray]),
        };
        spread > MAX_SPREAD
    }

    /// Returns true if the shadow rays `range` of a batch are so far apart that a stream is faster than a packet.
    #[inline(always)]
    pub fn are_shadow_rays_spread(&self, rays: &ShadowRayBatch, range: Range<usize>) -> bool {
        self.spread(range, |ray| rays.from[ray]) > MAX_SPREAD
    }

    /// Estimates the number of triangles for each ray of a range, from points that the rays pass. Any number where points
    /// are not finite; 0 for few rays.
    #[inline(always)]
    fn spread(&self, range: Range<usize>, point: impl Fn(usize) -> Vec3) -> f32 {
        if range.len() < MIN_RAYS {
            return 0.0;
        }
        let size = range.len() / PARTS;
        let mut least = f32::INFINITY;
        for part in 0..PARTS {
            let first = range.start + part * size;
            let mut bounds = Aabb::EMPTY;
            for sample in 0..SAMPLES {
                let p = point(first + sample * size / SAMPLES);
                bounds = Aabb { min: bounds.min.min(p), max: bounds.max.max(p) };
            }
            least = least.min(largest_face(bounds));
        }
        least * self.triangles_per_area / size as f32
    }
}

/// The area of the largest face of a box.
#[inline(always)]
fn largest_face(bounds: Aabb) -> f32 {
    let size = bounds.max - bounds.min;
    (size.x * size.y).max(size.y * size.z).max(size.z * size.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles on a square of 10 × 10 units, two for each unit of area.
    const DENSITY: TriangleDensity = TriangleDensity { triangles_per_area: 2.0, centre: Vec3::ZERO };

    /// Rays straight down from a grid of 16 × 16 points, `distance` apart.
    fn grid(distance: f32) -> RayBatch {
        let mut rays = RayBatch { coherence: Coherence::Direction(Vec3::NEG_Y), ..RayBatch::default() };
        for i in 0..256 {
            let (x, z) = ((i % 16) as f32, (i / 16) as f32);
            rays.push(Vec3::new(x, 5.0, z) * distance, Vec3::NEG_Y);
        }
        rays
    }

    #[test]
    fn rays_are_spread_where_many_triangles_lie_between_them() {
        assert!(!DENSITY.are_spread(&grid(0.1), 0..256));
        assert!(!DENSITY.are_spread(&grid(1.0), 0..256));
        assert!(DENSITY.are_spread(&grid(4.0), 0..256));
        assert!(!DENSITY.are_spread(&grid(4.0), 0..32), "too few for a stream");
    }

    /// A quarter of the rays far away, as behind a silhouette, does not matter.
    #[test]
    fn the_densest_part_counts() {
        let mut rays = grid(0.5);
        for o in &mut rays.origins[128..192] {
            *o *= 1000.0;
        }
        assert!(!DENSITY.are_spread(&rays, 0..256));
    }

    #[test]
    fn points_that_are_not_finite_do_no_harm() {
        for x in [f32::NAN, f32::INFINITY, f32::MAX] {
            let mut rays = grid(1.0);
            rays.origins[5..100].fill(Vec3::splat(x));
            let _ = DENSITY.are_spread(&rays, 0..256);
            rays.coherence = Coherence::Origin(Vec3::splat(x));
            let _ = DENSITY.are_spread(&rays, 0..256);
        }
    }
}
