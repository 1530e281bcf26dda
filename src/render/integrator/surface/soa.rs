//! Structure-of-arrays storage for blocks of shading points.
//!
//! Shading evaluates the same few formulas at every point. Each quantity of a block is therefore one array, and the
//! compiler vectorises loops over it with the widest instructions of the machine. The formulas consist of sums,
//! products, quotients and square roots, each rounded as IEEE 754 requires: the same bits on every machine.

use glam::{DVec3, Vec3};

/// Points of a block.
pub(crate) const LANES: usize = 32;
/// Hits on one triangle that are computed together.
pub(crate) const HIT_LANES: usize = 8;

/// One number for each point of a block, with room behind the last for a group of hits written as a whole.
pub(crate) type LaneArray<T> = [T; LANES + HIT_LANES];
/// One array for each of the axes x, y, z, or for red, green, blue.
pub(crate) type LaneArray3<T> = [LaneArray<T>; 3];

pub(crate) const ZERO3_F32: LaneArray3<f32> = [[0.0; LANES + HIT_LANES]; 3];
pub(crate) const ZERO3_F64: LaneArray3<f64> = [[0.0; LANES + HIT_LANES]; 3];

/// The f64 vector in lane `i`.
#[inline(always)]
pub(crate) fn dvec3<const N: usize>(v: &[[f64; N]; 3], i: usize) -> DVec3 {
    DVec3::new(v[0][i], v[1][i], v[2][i])
}

/// The f32 vector in lane `i`.
#[inline(always)]
pub(crate) fn vec3<const N: usize>(v: &[[f32; N]; 3], i: usize) -> Vec3 {
    Vec3::new(v[0][i], v[1][i], v[2][i])
}

/// Sets the vector in lane `i`.
#[inline(always)]
pub(crate) fn set3<T: Copy, const N: usize>(to: &mut [[T; N]; 3], i: usize, [x, y, z]: [T; 3]) {
    to[0][i] = x;
    to[1][i] = y;
    to[2][i] = z;
}

/// The lanes that are true, as a bit mask.
#[inline(always)]
pub(crate) fn mask(lanes: &[bool; LANES]) -> u32 {
    let mut mask = 0;
    for i in 0..LANES {
        mask |= u32::from(lanes[i]) << i;
    }
    mask
}

/// The lanes of a bit mask.
#[inline(always)]
pub(crate) fn set_lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        if mask == 0 {
            return None;
        }
        // The remainder lets the compiler drop bounds checks.
        let lane = mask.trailing_zeros() as usize % LANES;
        // Clears the lowest bit.
        mask &= mask - 1;
        Some(lane)
    })
}
