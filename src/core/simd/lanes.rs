//! SIMD vectors of f32: the operations that every instruction set implements.

use std::ops::{Add, Div, Mul, Sub};

/// A vector of N f32 lanes. Masks are integers with a bit for each lane, lane 0 the lowest.
pub trait Lanes<const N: usize>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Returns `x` in all lanes.
    fn splat(x: f32) -> Self;
    /// Loads the lanes in order.
    fn load(from: &[f32; N]) -> Self;
    /// Stores the lanes in order.
    fn store(self, to: &mut [f32; N]);
    /// Returns self·b + c, rounded once (fused) or twice.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// Returns self·b − c, rounded once (fused) or twice.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// Returns the lesser value, or `other` where `self` is NaN.
    fn min(self, other: Self) -> Self;
    /// Returns the greater value, or `other` where `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// Returns the absolute value.
    fn abs(self) -> Self;
    /// Flips the sign where the sign bit of `sign` is set.
    fn xor_sign(self, sign: Self) -> Self;
    /// Returns the largest power of two that is not greater than a normal number's absolute value: its exponent alone.
    fn floor_power_of_two(self) -> Self;
    /// Approximates 1/self with a relative error of at most 1.1·2⁻²³, provided that neither operand nor result is
    /// subnormal.
    #[inline(always)]
    fn rcp(self) -> Self {
        Self::splat(1.0) / self
    }
    /// Compares self < other; false where either is NaN.
    fn lt(self, other: Self) -> u32;
    /// Compares self ≤ other; false where either is NaN.
    fn le(self, other: Self) -> u32;
    /// Returns `self` where `mask` is set and `other` elsewhere.
    fn select(self, mask: u32, other: Self) -> Self;

    /// Returns the minimum of all lanes, none of which may be NaN.
    #[inline(always)]
    fn reduce_min(self) -> f32 {
        let mut lanes = [0.0; N];
        self.store(&mut lanes);
        tree_reduce(lanes, f32::min)
    }

    /// Returns the maximum of all lanes, none of which may be NaN.
    #[inline(always)]
    fn reduce_max(self) -> f32 {
        let mut lanes = [0.0; N];
        self.store(&mut lanes);
        tree_reduce(lanes, f32::max)
    }

    /// Returns the sum of all lanes. The order of additions differs between levels.
    #[inline(always)]
    fn reduce_sum(self) -> f32 {
        let mut lanes = [0.0; N];
        self.store(&mut lanes);
        tree_reduce(lanes, |a, b| a + b)
    }

    /// Compares integers: values = x.
    #[inline(always)]
    fn eq_u32(values: &[u32; N], x: u32) -> u32 {
        (0..N).fold(0, |mask, i| mask | u32::from(values[i] == x) << i)
    }

    /// Compares integers: values < x.
    #[inline(always)]
    fn lt_u32(values: &[u32; N], x: u32) -> u32 {
        (0..N).fold(0, |mask, i| mask | u32::from(values[i] < x) << i)
    }

    /// Maps the values first..first + 4 to new_first..new_first + 4. Writes only these lanes to `to` and returns
    /// their mask.
    #[inline(always)]
    fn renumber_quad(values: &[u32; N], first: u32, new_first: u32, to: &mut [u32; N]) -> u32 {
        let mut mask = 0;
        for (i, (value, to)) in values.iter().zip(to).enumerate() {
            let offset = value.wrapping_sub(first);
            if offset < 4 {
                *to = new_first + offset;
                mask |= 1 << i;
            }
        }
        mask
    }

    /// Writes `x` where `mask` is set.
    #[inline(always)]
    fn masked_fill(mask: u32, to: &mut [u32; N], x: u32) {
        for (i, to) in to.iter_mut().enumerate() {
            *to = if mask >> i & 1 == 1 { x } else { *to };
        }
    }
}

/// Combines the upper half of N lanes with the lower half, and so on until one is left. N is a power of two.
#[inline(always)]
fn tree_reduce<const N: usize>(mut lanes: [f32; N], combine: impl Fn(f32, f32) -> f32) -> f32 {
    let mut half = N / 2;
    while half > 0 {
        for i in 0..half {
            lanes[i] = combine(lanes[i], lanes[i + half]);
        }
        half /= 2;
    }
    lanes[0]
}
