//! The portable instruction set: the baseline of the target (SSE2, NEON or scalar code) by the `wide` crate.

use std::ops::{Add, Div, Mul, Sub};

use wide::f32x4;

use crate::simd::instruction_set::{OutlinedKernel, Simd};
use crate::simd::lanes::Lanes;
use crate::simd::pair::Pair;

pub struct Portable;

impl Simd for Portable {
    type F32x4 = F32x4;
    type F32x8 = Pair<F32x4>;
    type F32x16 = Pair<Pair<F32x4>>;

    #[inline(always)]
    fn broadcast_quad(quad: &[f32; 4]) -> Self::F32x16 {
        Pair::repeat(Pair::repeat(F32x4::load(quad)))
    }

    #[inline(never)]
    fn call_outlined<K: OutlinedKernel<Self>>(kernel: K) -> K::Output {
        kernel.run()
    }
}

#[derive(Clone, Copy)]
pub struct F32x4(f32x4);

impl Add for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        F32x4(self.0 + o.0)
    }
}

impl Sub for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        F32x4(self.0 - o.0)
    }
}

impl Mul for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        F32x4(self.0 * o.0)
    }
}

impl Div for F32x4 {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        F32x4(self.0 / o.0)
    }
}

impl Lanes<4> for F32x4 {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        F32x4(f32x4::splat(x))
    }
    #[inline(always)]
    fn load(from: &[f32; 4]) -> Self {
        F32x4(f32x4::from(*from))
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; 4]) {
        *to = self.0.to_array();
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        F32x4(self.0 * b.0 + c.0)
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        F32x4(self.0 * b.0 - c.0)
    }
    // `fast_min` is SSE's minps, which returns its second operand if either is NaN. On other targets, `min` and
    // `max` have the required NaN behaviour.
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        F32x4(if cfg!(target_feature = "sse") { self.0.fast_min(o.0) } else { self.0.min(o.0) })
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        F32x4(if cfg!(target_feature = "sse") { self.0.fast_max(o.0) } else { self.0.max(o.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        F32x4(self.0.abs())
    }
    #[inline(always)]
    fn xor_sign(self, o: Self) -> Self {
        F32x4(self.0 ^ (o.0 & f32x4::splat(-0.0)))
    }
    #[inline(always)]
    fn floor_power_of_two(self) -> Self {
        F32x4(self.0 & f32x4::splat(f32::INFINITY))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> u32 {
        self.0.simd_lt(o.0).to_bitmask()
    }
    #[inline(always)]
    fn le(self, o: Self) -> u32 {
        self.0.simd_le(o.0).to_bitmask()
    }
    #[inline(always)]
    fn select(self, mask: u32, o: Self) -> Self {
        let a = self.0.to_array();
        let b = o.0.to_array();
        F32x4(f32x4::from(std::array::from_fn(|i| if mask >> i & 1 == 1 { a[i] } else { b[i] })))
    }
}
