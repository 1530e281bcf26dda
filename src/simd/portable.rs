//! What every processor of the target has, by the `wide` crate: SSE2, NEON, or plain numbers.

use std::ops::{Add, Mul, Sub};

use wide::f32x4;

use crate::simd::pair::Pair;
use crate::simd::{Lanes, Part, Simd};

pub(crate) struct Portable;

impl Simd for Portable {
    type F4 = P4;
    type F8 = Pair<P4>;
    type F16 = Pair<Pair<P4>>;

    #[inline(always)]
    fn four_times(of: &[f32; 4]) -> Self::F16 {
        Pair::twice(Pair::twice(P4::load(of)))
    }

    #[inline(never)]
    fn call<J: Part<Self>>(job: J) -> J::Output {
        job.run()
    }
}

#[derive(Clone, Copy)]
pub(crate) struct P4(f32x4);

impl Add for P4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        P4(self.0 + o.0)
    }
}

impl Sub for P4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        P4(self.0 - o.0)
    }
}

impl Mul for P4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        P4(self.0 * o.0)
    }
}

impl Lanes<4> for P4 {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        P4(f32x4::splat(x))
    }
    #[inline(always)]
    fn load(from: &[f32; 4]) -> Self {
        P4(f32x4::from(*from))
    }
    #[inline(always)]
    fn store(self, to: &mut [f32; 4]) {
        *to = self.0.to_array();
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        P4(self.0 * b.0 + c.0)
    }
    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        P4(self.0 * b.0 - c.0)
    }
    // SSE's minimum is its second operand where the first is NaN; elsewhere `min` and `max` are.
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        P4(if cfg!(target_feature = "sse") { self.0.fast_min(o.0) } else { self.0.min(o.0) })
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        P4(if cfg!(target_feature = "sse") { self.0.fast_max(o.0) } else { self.0.max(o.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        P4(self.0.abs())
    }
    #[inline(always)]
    fn flipped_by(self, o: Self) -> Self {
        P4(self.0 ^ (o.0 & f32x4::splat(-0.0)))
    }
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        P4(self.0 / o.0)
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
    fn or_else(self, mask: u32, o: Self) -> Self {
        let (a, b) = (self.0.to_array(), o.0.to_array());
        P4(f32x4::from(std::array::from_fn(|i| if mask >> i & 1 == 1 { a[i] } else { b[i] })))
    }
}
