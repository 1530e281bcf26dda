//! Vectors of 2N lanes as pairs of vectors of N lanes.

use std::ops::{Add, Div, Mul, Sub};

use crate::simd::lanes::Lanes;

/// The lower and the upper half of a vector.
#[derive(Clone, Copy)]
pub struct Pair<L>(pub L, pub L);

impl<L: Copy> Pair<L> {
    #[inline(always)]
    pub fn repeat(half: L) -> Self {
        Pair(half, half)
    }
}

impl<L: Add<Output = L>> Add for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Pair(self.0 + o.0, self.1 + o.1)
    }
}

impl<L: Sub<Output = L>> Sub for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Pair(self.0 - o.0, self.1 - o.1)
    }
}

impl<L: Mul<Output = L>> Mul for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Pair(self.0 * o.0, self.1 * o.1)
    }
}

impl<L: Div<Output = L>> Div for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        Pair(self.0 / o.0, self.1 / o.1)
    }
}

macro_rules! impl_lanes_for_pair {
    ($half:literal, $full:literal) => {
        impl<L: Lanes<$half>> Lanes<$full> for Pair<L> {
            #[inline(always)]
            fn splat(x: f32) -> Self {
                Pair(L::splat(x), L::splat(x))
            }
            #[inline(always)]
            fn load(from: &[f32; $full]) -> Self {
                let (halves, _) = from.as_chunks::<$half>();
                Pair(L::load(&halves[0]), L::load(&halves[1]))
            }
            #[inline(always)]
            fn store(self, to: &mut [f32; $full]) {
                let (halves, _) = to.as_chunks_mut::<$half>();
                self.0.store(&mut halves[0]);
                self.1.store(&mut halves[1]);
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                Pair(self.0.mul_add(b.0, c.0), self.1.mul_add(b.1, c.1))
            }
            #[inline(always)]
            fn mul_sub(self, b: Self, c: Self) -> Self {
                Pair(self.0.mul_sub(b.0, c.0), self.1.mul_sub(b.1, c.1))
            }
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                Pair(self.0.min(o.0), self.1.min(o.1))
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                Pair(self.0.max(o.0), self.1.max(o.1))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Pair(self.0.abs(), self.1.abs())
            }
            #[inline(always)]
            fn xor_sign(self, o: Self) -> Self {
                Pair(self.0.xor_sign(o.0), self.1.xor_sign(o.1))
            }
            #[inline(always)]
            fn floor_power_of_two(self) -> Self {
                Pair(self.0.floor_power_of_two(), self.1.floor_power_of_two())
            }
            #[inline(always)]
            fn lt(self, o: Self) -> u32 {
                self.0.lt(o.0) | self.1.lt(o.1) << $half
            }
            #[inline(always)]
            fn le(self, o: Self) -> u32 {
                self.0.le(o.0) | self.1.le(o.1) << $half
            }
            #[inline(always)]
            fn select(self, mask: u32, o: Self) -> Self {
                Pair(self.0.select(mask & ((1 << $half) - 1), o.0), self.1.select(mask >> $half, o.1))
            }
            #[inline(always)]
            fn reduce_min(self) -> f32 {
                self.0.min(self.1).reduce_min()
            }
            #[inline(always)]
            fn reduce_sum(self) -> f32 {
                (self.0 + self.1).reduce_sum()
            }
            #[inline(always)]
            fn reduce_max(self) -> f32 {
                self.0.max(self.1).reduce_max()
            }
            #[inline(always)]
            fn eq_u32(values: &[u32; $full], x: u32) -> u32 {
                let (halves, _) = values.as_chunks::<$half>();
                L::eq_u32(&halves[0], x) | L::eq_u32(&halves[1], x) << $half
            }
            #[inline(always)]
            fn masked_fill(mask: u32, to: &mut [u32; $full], x: u32) {
                let (halves, _) = to.as_chunks_mut::<$half>();
                L::masked_fill(mask & ((1 << $half) - 1), &mut halves[0], x);
                L::masked_fill(mask >> $half, &mut halves[1], x);
            }
        }
    };
}

impl_lanes_for_pair!(4, 8);
impl_lanes_for_pair!(8, 16);
