//! Vectors of three SIMD vectors: N points or directions as structure of arrays.

use glam::Vec3;

use crate::simd::lanes::Lanes;

/// The x, y and z components of N vectors.
pub type Vec3Lanes<L> = [L; 3];

/// Returns `[f(0), f(1), f(2)]`, inlined always: with `std::array::from_fn`, lanes would pass through memory.
#[inline(always)]
pub fn per_axis<T>(f: impl Fn(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

/// Returns `v` in all lanes.
#[inline(always)]
pub fn splat<const N: usize, L: Lanes<N>>(v: Vec3) -> Vec3Lanes<L> {
    [L::splat(v.x), L::splat(v.y), L::splat(v.z)]
}

/// Returns a − b.
#[inline(always)]
pub fn sub<const N: usize, L: Lanes<N>>(a: Vec3Lanes<L>, b: Vec3Lanes<L>) -> Vec3Lanes<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Returns the dot product a·b.
#[inline(always)]
pub fn dot<const N: usize, L: Lanes<N>>(a: Vec3Lanes<L>, b: Vec3Lanes<L>) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// Returns the cross product a×b.
#[inline(always)]
pub fn cross<const N: usize, L: Lanes<N>>(a: Vec3Lanes<L>, b: Vec3Lanes<L>) -> Vec3Lanes<L> {
    [a[1].mul_sub(b[2], a[2] * b[1]), a[2].mul_sub(b[0], a[0] * b[2]), a[0].mul_sub(b[1], a[1] * b[0])]
}
