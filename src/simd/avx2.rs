//! AVX2 and FMA: eight lanes in a register.
//!
//! Every function here is inlined into [`run`], which is compiled with these instructions and
//! entered only where the processor has them: that is why each intrinsic below may be used.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

use crate::simd::pair::Pair;
use crate::simd::{Job, Lanes, Part, Simd};

pub(crate) struct Avx2;

impl Simd for Avx2 {
    type F4 = A4;
    type F8 = A8;
    type F16 = Pair<A8>;

    #[inline(always)]
    fn arrange(
        mask: u32,
        order: [u32; 8],
        (numbers, words): (A8, &[u32; 8]),
        to: (&mut [f32; 8], &mut [u32; 8]),
    ) {
        // SAFETY: see the top of the file; arrays are as long as registers, and rows of the table
        // half as long as one.
        unsafe {
            let order = _mm256_loadu_si256(order.as_ptr().cast());
            let mask = _mm256_movemask_ps(_mm256_permutevar8x32_ps(spread8(mask), order)) as usize & 255;
            let front = _mm256_cvtepu8_epi32(_mm_loadl_epi64(FRONT[mask].as_ptr().cast()));
            let order = _mm256_permutevar8x32_epi32(order, front);
            let words = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(words.as_ptr().cast()), order);
            _mm256_storeu_ps(to.0.as_mut_ptr(), _mm256_permutevar8x32_ps(numbers.0, order));
            _mm256_storeu_si256(to.1.as_mut_ptr().cast(), words);
        }
    }

    #[inline(always)]
    fn four_times(of: &[f32; 4]) -> Pair<A8> {
        // SAFETY: see the top of the file; `of` is as long as half a register.
        Pair::twice(A8(unsafe {
            let of = _mm_loadu_ps(of.as_ptr());
            _mm256_set_m128(of, of)
        }))
    }

    #[inline(always)]
    fn least_of_each(of: [Pair<A8>; 4]) -> Pair<A8> {
        of_each(of, A8::min)
    }

    #[inline(always)]
    fn greatest_of_each(of: [Pair<A8>; 4]) -> Pair<A8> {
        of_each(of, A8::max)
    }

    #[inline(always)]
    fn call<J: Part<Self>>(job: J) -> J::Output {
        // SAFETY: this is reached from `run` alone, which the processor was asked for.
        unsafe { part(job) }
    }
}

/// Four pairs of registers, each folded to one number in half a register.
#[inline(always)]
fn of_each(of: [Pair<A8>; 4], pick: impl Fn(A8, A8) -> A8) -> Pair<A8> {
    let halves = |i: usize| pick(of[i].0, of[i].1);
    let two = |a: A8, b: A8| {
        // SAFETY: see the top of the file.
        unsafe {
            let low = A8(_mm256_permute2f128_ps::<0x20>(a.0, b.0));
            let quarters = pick(low, A8(_mm256_permute2f128_ps::<0x31>(a.0, b.0)));
            let pairs = pick(quarters, A8(_mm256_permute_ps::<0b01_00_11_10>(quarters.0)));
            pick(pairs, A8(_mm256_permute_ps::<0b10_11_00_01>(pairs.0)))
        }
    };
    Pair(two(halves(0), halves(1)), two(halves(2), halves(3)))
}

pub(crate) fn available() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// # Safety
/// As [`run`].
#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn part<J: Part<Avx2>>(job: J) -> J::Output {
    job.run()
}

/// # Safety
/// The processor has AVX2 and FMA.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(crate) unsafe fn run<J: Job>(job: J) -> J::Output {
    job.run::<Avx2>()
}

/// Four lanes. AVX-512 has no better way with as few.
#[derive(Clone, Copy)]
pub(crate) struct A4(__m128);

/// Eight lanes.
#[derive(Clone, Copy)]
pub(crate) struct A8(__m256);

/// For each mask its lanes in a row.
static FRONT: [[u8; 8]; 256] = {
    let mut front = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut end) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                front[mask][end] = lane as u8;
                end += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    front
};

/// Which lanes of `mask` have a bit, as a vector of all ones or zeros.
#[inline(always)]
fn spread4(mask: u32) -> __m128 {
    // SAFETY: see the top of the file.
    unsafe {
        let bit = _mm_setr_epi32(1, 2, 4, 8);
        _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(mask as i32), bit), bit))
    }
}

#[inline(always)]
fn spread8(mask: u32) -> __m256 {
    // SAFETY: see the top of the file.
    unsafe {
        let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bit), bit))
    }
}

macro_rules! lanes {
    ($name:ident, $n:literal, $set1:ident, $load:ident, $store:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, $fmadd:ident, $fmsub:ident, $min:ident, $max:ident, $and:ident, $andnot:ident,
     $xor:ident, $cmp:ident, $movemask:ident, $blendv:ident, $spread:ident, { $($own:tt)* }) => {
        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                // SAFETY: see the top of the file; so for all below.
                $name(unsafe { $add(self.0, o.0) })
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                $name(unsafe { $sub(self.0, o.0) })
            }
        }
        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, o: Self) -> Self {
                $name(unsafe { $mul(self.0, o.0) })
            }
        }
        impl Lanes<$n> for $name {
            #[inline(always)]
            fn splat(x: f32) -> Self {
                $name(unsafe { $set1(x) })
            }
            #[inline(always)]
            fn load(from: &[f32; $n]) -> Self {
                // SAFETY: as above, and `from` is as long as a register.
                $name(unsafe { $load(from.as_ptr()) })
            }
            #[inline(always)]
            fn store(self, to: &mut [f32; $n]) {
                // SAFETY: as above, and `to` is as long as a register.
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                $name(unsafe { $fmadd(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn mul_sub(self, b: Self, c: Self) -> Self {
                $name(unsafe { $fmsub(self.0, b.0, c.0) })
            }
            // The instruction gives its second operand where either is NaN.
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                $name(unsafe { $min(self.0, o.0) })
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                $name(unsafe { $max(self.0, o.0) })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $name(unsafe { $andnot($set1(-0.0), self.0) })
            }
            #[inline(always)]
            fn flipped_by(self, o: Self) -> Self {
                $name(unsafe { $xor(self.0, $and($set1(-0.0), o.0)) })
            }
            #[inline(always)]
            fn div(self, o: Self) -> Self {
                $name(unsafe { $div(self.0, o.0) })
            }
            #[inline(always)]
            fn lt(self, o: Self) -> u32 {
                unsafe { $movemask($cmp::<_CMP_LT_OQ>(self.0, o.0)) as u32 }
            }
            #[inline(always)]
            fn le(self, o: Self) -> u32 {
                unsafe { $movemask($cmp::<_CMP_LE_OQ>(self.0, o.0)) as u32 }
            }
            #[inline(always)]
            fn or_else(self, mask: u32, o: Self) -> Self {
                $name(unsafe { $blendv(o.0, self.0, $spread(mask)) })
            }
            $($own)*
        }
    };
}

lanes!(
    A4,
    4,
    _mm_set1_ps,
    _mm_loadu_ps,
    _mm_storeu_ps,
    _mm_add_ps,
    _mm_sub_ps,
    _mm_mul_ps,
    _mm_div_ps,
    _mm_fmadd_ps,
    _mm_fmsub_ps,
    _mm_min_ps,
    _mm_max_ps,
    _mm_and_ps,
    _mm_andnot_ps,
    _mm_xor_ps,
    _mm_cmp_ps,
    _mm_movemask_ps,
    _mm_blendv_ps,
    spread4,
    {}
);

lanes!(
    A8,
    8,
    _mm256_set1_ps,
    _mm256_loadu_ps,
    _mm256_storeu_ps,
    _mm256_add_ps,
    _mm256_sub_ps,
    _mm256_mul_ps,
    _mm256_div_ps,
    _mm256_fmadd_ps,
    _mm256_fmsub_ps,
    _mm256_min_ps,
    _mm256_max_ps,
    _mm256_and_ps,
    _mm256_andnot_ps,
    _mm256_xor_ps,
    _mm256_cmp_ps,
    _mm256_movemask_ps,
    _mm256_blendv_ps,
    spread8,
    {
        #[inline(always)]
        fn matching(of: &[u32; 8], x: u32) -> u32 {
            // SAFETY: as above, and `of` is as long as a register.
            unsafe {
                let same =
                    _mm256_cmpeq_epi32(_mm256_loadu_si256(of.as_ptr().cast()), _mm256_set1_epi32(x as i32));
                _mm256_movemask_ps(_mm256_castsi256_ps(same)) as u32
            }
        }
        #[inline(always)]
        fn put(mask: u32, to: &mut [u32; 8], x: u32) {
            // SAFETY: as above, and `to` is as long as a register.
            unsafe {
                let lanes = _mm256_castps_si256(spread8(mask));
                _mm256_maskstore_epi32(to.as_mut_ptr().cast(), lanes, _mm256_set1_epi32(x as i32));
            }
        }
    }
);
