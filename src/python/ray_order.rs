//! An order of rays in which neighbours visit the same boxes of a BVH: by the place where they enter the scene's bounds,
//! then by direction.

use glam::Vec3;
use rayon::prelude::*;
use rdst::{RadixKey, RadixSort};

use blinn_core::geometry::{Aabb, morton3};

/// Cells of the bounds along each axis.
const CELLS: f32 = 128.0;
/// Steps of each component of a direction.
const DIRECTION_STEPS: f32 = 8.0;
/// Bits of a direction below those of the cell.
const DIRECTION_BITS: u32 = 9;

/// Rays that are sorted. Fewer stay in the caches in any order.
const MIN_SORTED: usize = 1 << 12;

/// Relative slack of the test against the bounds, far more than the rounding errors of f32.
const SLACK: f32 = 1e-5;

/// Cell and direction of a ray, and its index.
#[derive(Clone, Copy)]
struct OrderKey {
    key: u32,
    index: u32,
}

impl RadixKey for OrderKey {
    const LEVELS: usize = 4;

    fn get_level(&self, level: usize) -> u8 {
        (self.key >> (8 * level)) as u8
    }
}

/// Bounds of a scene, and the grid that sorts rays.
struct RayGrid {
    low: Vec3,
    high: Vec3,
    cells_per_metre: Vec3,
}

impl RayGrid {
    fn new(bounds: &Aabb) -> RayGrid {
        let (low, high) = (bounds.min.as_vec3(), bounds.max.as_vec3());
        // The bounds are rounded to f32 and must hold all triangles.
        let padding = 1e-3 * (high - low).max_element() + SLACK * low.abs().max(high.abs()).max_element();
        let (low, high) = (low - padding, high + padding);
        RayGrid { low, high, cells_per_metre: CELLS / (high - low) }
    }

    /// The key of a ray. `None` if it certainly misses the bounds, is not finite or has no direction.
    fn key(&self, o: Vec3, d: Vec3) -> Option<u32> {
        if !(o.is_finite() && d.is_finite()) || d == Vec3::ZERO {
            return None;
        }
        let (to_low, to_high) = ((self.low - o) / d, (self.high - o) / d);
        let entry = to_low.min(to_high).max_element().max(0.0);
        let exit = to_low.max(to_high).min_element();
        if entry * (1.0 - SLACK) > exit {
            return None;
        }
        // Casts of numbers that are not finite, or out of range, saturate.
        let cell =
            ((o + d * entry - self.low) * self.cells_per_metre).min(Vec3::splat(CELLS - 1.0)).as_uvec3();
        let direction = (d / d.abs().max_element() + 1.0) * (0.5 * DIRECTION_STEPS);
        let direction = direction.min(Vec3::splat(DIRECTION_STEPS - 1.0)).as_uvec3();
        Some((morton3(cell) << DIRECTION_BITS | morton3(direction)) as u32)
    }
}

/// Returns the indices of the rays that may hit something, in the order in which they are traced.
pub fn coherent_order(origins: &[Vec3], directions: &[Vec3], bounds: &Aabb) -> Vec<u32> {
    if bounds.is_empty() {
        return Vec::new();
    }
    let grid = RayGrid::new(bounds);
    let sort = |task: usize| {
        let range = task * MIN_SORTED..origins.len().min((task + 1) * MIN_SORTED);
        let key = |i: usize| Some(OrderKey { key: grid.key(origins[i], directions[i])?, index: i as u32 });
        range.filter_map(key).collect::<Vec<_>>()
    };
    let tasks: Vec<Vec<OrderKey>> =
        (0..origins.len().div_ceil(MIN_SORTED)).into_par_iter().map(sort).collect();
    let mut keys = tasks.concat();
    if keys.len() > MIN_SORTED {
        keys.radix_sort_unstable();
    }
    keys.into_iter().map(|key| key.index).collect()
}
