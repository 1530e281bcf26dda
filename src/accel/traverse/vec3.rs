//! Vectors of lanes.

use glam::Vec3;

use crate::accel::bvh::triangle4::Triangle4;
use crate::simd::Lanes;

/// A vector of lanes.
pub(crate) type Lanes3<L> = [L; 3];

/// Three of something, by axis. Unlike an array's own `map` it is always inlined, without which
/// lanes would pass through memory.
#[inline(always)]
pub(crate) fn by_axis<T>(of: impl Fn(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

/// A vector in all lanes.
#[inline(always)]
pub(crate) fn splat<const N: usize, L: Lanes<N>>(x: Vec3) -> Lanes3<L> {
    [L::splat(x.x), L::splat(x.y), L::splat(x.z)]
}

/// The corners of a block.
#[inline(always)]
pub(crate) fn corners<L: Lanes<4>>(block: &Triangle4) -> [Lanes3<L>; 3] {
    by_axis(|corner| by_axis(|axis| L::load(&block.vertex[corner][axis])))
}

#[inline(always)]
pub(crate) fn sub<const N: usize, L: Lanes<N>>(a: Lanes3<L>, b: Lanes3<L>) -> Lanes3<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot<const N: usize, L: Lanes<N>>(a: Lanes3<L>, b: Lanes3<L>) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
pub(crate) fn cross<const N: usize, L: Lanes<N>>(a: Lanes3<L>, b: Lanes3<L>) -> Lanes3<L> {
    [a[1].mul_sub(b[2], a[2] * b[1]), a[2].mul_sub(b[0], a[0] * b[2]), a[0].mul_sub(b[1], a[1] * b[0])]
}
