//! The AVX2 instruction set (with FMA): eight f32 lanes in a register.
//!
//! Safety of intrinsics: every function here is inlined into [`run`] or [`run_outlined`], which are compiled with
//! these instructions and entered only on processors that support them.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

use crate::simd::instruction_set::{OutlinedKernel, Simd, SimdKernel};
use crate::simd::lanes::Lanes;
use crate::simd::pair::Pair;
use crate::simd::x86_lanes::impl_x86_lanes;

pub struct Avx2;

impl Simd for Avx2 {
    type F32x4 = F32x4;
    type F32x8 = F32x8;
    type F32x16 = Pair<F32x8>;

    #[inline(always)]
    fn permute_compress(
        mask: u32,
        order: [u32; 8],
        keys: F32x8,
        ids: &[u32; 8],
        out_keys: &mut [f32; 8],
        out_ids: &mut [u32; 8],
    ) {
        // SAFETY: see the module comment; the arrays have the size of a register, and rows of the table half of it.
        unsafe {
            let order = _mm256_loadu_si256(order.as_ptr().cast());
            let permuted_mask = _mm256_permutevar8x32_ps(mask_to_vector8(mask), order);
            let mask = _mm256_movemask_ps(permuted_mask) as usize & 255;
            let front = _mm256_cvtepu8_epi32(_mm_loadl_epi64(COMPRESS[mask].as_ptr().cast()));
            let order = _mm256_permutevar8x32_epi32(order, front);
            let ids = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(ids.as_ptr().cast()), order);
            _mm256_storeu_ps(out_keys.as_mut_ptr(), _mm256_permutevar8x32_ps(keys.0, order));
            _mm256_storeu_si256(out_ids.as_mut_ptr().cast(), ids);
        }
    }

    #[inline(always)]
    fn transpose16(columns: &[Pair<F32x8>; 16], rows: &mut [[f32; 16]; 16]) {
        for left in [0, 8] {
            let mut low = [columns[0].0.0; 8];
            let mut high = low;
            for i in 0..8 {
                low[i] = columns[left + i].0.0;
                high[i] = columns[left + i].1.0;
            }
            transpose8(&mut low);
            transpose8(&mut high);
            for i in 0..8 {
                // SAFETY: see the module comment; halves of rows have the size of a register.
                unsafe {
                    _mm256_storeu_ps(rows[i].as_mut_ptr().add(left), low[i]);
                    _mm256_storeu_ps(rows[8 + i].as_mut_ptr().add(left), high[i]);
                }
            }
        }
    }

    #[inline(always)]
    fn compress_ids(ids: &[u32; 16], masks: &[u8; 16], bit: usize, out: &mut [u32; 16]) -> usize {
        // SAFETY: see the module comment; `masks` has the size of a register, `ids` of two, and rows of the table half of
        // one. The second store begins at a lane of eight at most, and ends within `out`.
        unsafe {
            // The bit becomes the sign of each byte; bits that cross into the next byte are below it.
            let shift = _mm_cvtsi32_si128(7 - (bit & 7) as i32);
            let masks = _mm_sll_epi16(_mm_loadu_si128(masks.as_ptr().cast()), shift);
            let mask = _mm_movemask_epi8(masks) as u32;
            let mut end = 0;
            for half in 0..2 {
                let mask = (mask >> (8 * half)) as usize & 255;
                let front = _mm256_cvtepu8_epi32(_mm_loadl_epi64(COMPRESS[mask].as_ptr().cast()));
                let ids = _mm256_loadu_si256(ids.as_ptr().add(8 * half).cast());
                let front = _mm256_permutevar8x32_epi32(ids, front);
                _mm256_storeu_si256(out.as_mut_ptr().add(end).cast(), front);
                end += mask.count_ones() as usize;
            }
            end
        }
    }

    #[inline(always)]
    fn broadcast_quad(quad: &[f32; 4]) -> Pair<F32x8> {
        // SAFETY: see the module comment; `quad` has half the size of a register.
        Pair::repeat(F32x8(unsafe {
            let quad = _mm_loadu_ps(quad.as_ptr());
            _mm256_set_m128(quad, quad)
        }))
    }

    #[inline(always)]
    fn reduce_min_each(vectors: [Pair<F32x8>; 4]) -> Pair<F32x8> {
        reduce_each(vectors, F32x8::min)
    }

    #[inline(always)]
    fn reduce_max_each(vectors: [Pair<F32x8>; 4]) -> Pair<F32x8> {
        reduce_each(vectors, F32x8::max)
    }

    #[inline(always)]
    fn call_outlined<K: OutlinedKernel<Self>>(kernel: K) -> K::Output {
        // SAFETY: only kernels that `run` has entered get here, and its caller has checked the processor.
        unsafe { run_outlined(kernel) }
    }
}

/// Transposes eight columns into eight rows.
#[inline(always)]
fn transpose8(columns: &mut [__m256; 8]) {
    // SAFETY: see the module comment.
    unsafe {
        let mut pairs = [_mm256_setzero_pd(); 8];
        for i in 0..4 {
            let (a, b) = (columns[2 * i], columns[2 * i + 1]);
            pairs[2 * i] = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
            pairs[2 * i + 1] = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
        }
        // Half h of register 4c + r holds row 4h + r of columns 4c to 4c + 3.
        let mut fours = [_mm256_setzero_ps(); 8];
        for i in 0..4 {
            let (a, b) = (pairs[i / 2 * 4 + i % 2], pairs[i / 2 * 4 + 2 + i % 2]);
            fours[2 * i] = _mm256_castpd_ps(_mm256_unpacklo_pd(a, b));
            fours[2 * i + 1] = _mm256_castpd_ps(_mm256_unpackhi_pd(a, b));
        }
        for i in 0..4 {
            columns[i] = _mm256_permute2f128_ps::<0x20>(fours[i], fours[4 + i]);
            columns[4 + i] = _mm256_permute2f128_ps::<0x31>(fours[i], fours[4 + i]);
        }
    }
}

/// Reduces each of four vectors to one number, which fills four lanes.
#[inline(always)]
fn reduce_each(vectors: [Pair<F32x8>; 4], combine: impl Fn(F32x8, F32x8) -> F32x8) -> Pair<F32x8> {
    let combine_halves = |i: usize| combine(vectors[i].0, vectors[i].1);
    let reduce_two = |a: F32x8, b: F32x8| {
        // SAFETY: see the module comment.
        unsafe {
            let low = F32x8(_mm256_permute2f128_ps::<0x20>(a.0, b.0));
            let quarters = combine(low, F32x8(_mm256_permute2f128_ps::<0x31>(a.0, b.0)));
            let pairs = combine(quarters, F32x8(_mm256_permute_ps::<0b01_00_11_10>(quarters.0)));
            combine(pairs, F32x8(_mm256_permute_ps::<0b10_11_00_01>(pairs.0)))
        }
    };
    Pair(reduce_two(combine_halves(0), combine_halves(1)), reduce_two(combine_halves(2), combine_halves(3)))
}

/// Returns true if this processor supports everything that [`run`] is compiled with.
#[inline]
pub fn is_supported() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// # Safety
/// As for [`run`].
#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_outlined<K: OutlinedKernel<Avx2>>(kernel: K) -> K::Output {
    kernel.run()
}

/// # Safety
/// [`is_supported`] must have returned true.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn run<K: SimdKernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

/// Four lanes. AVX-512 uses this type, too.
#[derive(Clone, Copy)]
pub struct F32x4(__m128);

/// Eight lanes.
#[derive(Clone, Copy)]
pub struct F32x8(__m256);

/// For each mask the lanes whose bit is set, in ascending order: the permutation of a compress instruction.
static COMPRESS: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let mut lane = 0;
        let mut end = 0;
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][end] = lane as u8;
                end += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// Converts a bit mask to a vector mask: all ones where the bit is set, else zero.
#[inline(always)]
fn mask_to_vector4(mask: u32) -> __m128 {
    // SAFETY: see the module comment.
    unsafe {
        let bit = _mm_setr_epi32(1, 2, 4, 8);
        _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(mask as i32), bit), bit))
    }
}

#[inline(always)]
fn mask_to_vector8(mask: u32) -> __m256 {
    // SAFETY: see the module comment.
    unsafe {
        let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask as i32), bit), bit))
    }
}

/// Converts a vector mask to a bit mask.
#[inline(always)]
fn mask_bits4(mask: __m128) -> u32 {
    // SAFETY: see the module comment.
    unsafe { _mm_movemask_ps(mask) as u32 }
}

#[inline(always)]
fn mask_bits8(mask: __m256) -> u32 {
    // SAFETY: see the module comment.
    unsafe { _mm256_movemask_ps(mask) as u32 }
}

#[inline(always)]
fn select4(mask: u32, a: __m128, b: __m128) -> __m128 {
    // SAFETY: see the module comment.
    unsafe { _mm_blendv_ps(b, a, mask_to_vector4(mask)) }
}

#[inline(always)]
fn select8(mask: u32, a: __m256, b: __m256) -> __m256 {
    // SAFETY: see the module comment.
    unsafe { _mm256_blendv_ps(b, a, mask_to_vector8(mask)) }
}

impl_x86_lanes!(
    F32x4,
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
    mask_bits4,
    select4,
    {
        #[inline(always)]
        fn eq_u32(values: &[u32; 4], x: u32) -> u32 {
            // SAFETY: as above; `values` has the size of a register.
            unsafe {
                let values = _mm_loadu_si128(values.as_ptr().cast());
                let equal = _mm_cmpeq_epi32(values, _mm_set1_epi32(x as i32));
                _mm_movemask_ps(_mm_castsi128_ps(equal)) as u32
            }
        }
    }
);

impl_x86_lanes!(
    F32x8,
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
    mask_bits8,
    select8,
    {
        #[inline(always)]
        fn eq_u32(values: &[u32; 8], x: u32) -> u32 {
            // SAFETY: as above; `values` has the size of a register.
            unsafe {
                let values = _mm256_loadu_si256(values.as_ptr().cast());
                let equal = _mm256_cmpeq_epi32(values, _mm256_set1_epi32(x as i32));
                _mm256_movemask_ps(_mm256_castsi256_ps(equal)) as u32
            }
        }
        #[inline(always)]
        fn masked_fill(mask: u32, to: &mut [u32; 8], x: u32) {
            // SAFETY: as above; `to` has the size of a register.
            unsafe {
                let lanes = _mm256_castps_si256(mask_to_vector8(mask));
                _mm256_maskstore_epi32(to.as_mut_ptr().cast(), lanes, _mm256_set1_epi32(x as i32));
            }
        }
    }
);
