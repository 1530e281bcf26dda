//! The AVX-512 instruction set: sixteen f32 lanes in a register, and mask registers.
//!
//! Safety of intrinsics: every function here is inlined into [`run`] or [`run_outlined`], which are compiled with
//! these instructions and entered only on processors that support them.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

use glam::Vec3;

use crate::simd::avx2::{self, F32x4};
use crate::simd::instruction_set::{Intersected, OutlinedKernel, Simd, SimdKernel};
use crate::simd::lanes::Lanes;
use crate::simd::x86_lanes::impl_x86_lanes;

pub struct Avx512;

/// Deinterleaving of sixteen vectors of three: for each axis, the index of each component in the first two of three
/// registers, or in the third where [`DEINTERLEAVE_THIRD`] is set.
const DEINTERLEAVE: [[u32; 16]; 3] = {
    let mut indices = [[0; 16]; 3];
    let mut i = 0;
    while i < 48 {
        indices[i % 3][i / 3] = (i % 32) as u32;
        i += 1;
    }
    indices
};
const DEINTERLEAVE_THIRD: [__mmask16; 3] = {
    let mut masks = [0; 3];
    let mut i = 32;
    while i < 48 {
        masks[i % 3] |= 1 << (i / 3);
        i += 1;
    }
    masks
};

/// Interleaving of three registers: for each output register, the index of each element in the first two inputs, or
/// in the third where [`INTERLEAVE_THIRD`] is set.
const INTERLEAVE: [[u32; 16]; 3] = {
    let mut indices = [[0; 16]; 3];
    let mut i = 0;
    while i < 48 {
        indices[i / 16][i % 16] = (i / 3 + i % 3 % 2 * 16) as u32;
        i += 1;
    }
    indices
};
const INTERLEAVE_THIRD: [__mmask16; 3] = {
    let mut masks = [0; 3];
    let mut i = 2;
    while i < 48 {
        masks[i / 16] |= 1 << (i % 16);
        i += 3;
    }
    masks
};

/// Every fourth lane of two registers, twice.
const EVERY_FOURTH: [u32; 16] = [0, 4, 8, 12, 16, 20, 24, 28, 0, 4, 8, 12, 16, 20, 24, 28];

impl Simd for Avx512 {
    type F32x4 = F32x4;
    type F32x8 = F32x8;
    type F32x16 = F32x16;

    #[inline(always)]
    fn permute_compress(
        mask: u32,
        order: [u32; 8],
        keys: F32x8,
        ids: &[u32; 8],
        out_keys: &mut [f32; 8],
        out_ids: &mut [u32; 8],
    ) {
        // SAFETY: see the module comment; the arrays have the size of a register.
        unsafe {
            let order = _mm256_loadu_si256(order.as_ptr().cast());
            let mask =
                _mm256_movepi32_mask(_mm256_permutevar8x32_epi32(_mm256_movm_epi32(mask as u8), order));
            let ids = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(ids.as_ptr().cast()), order);
            let keys = _mm256_permutevar8x32_ps(keys.0, order);
            _mm256_storeu_ps(out_keys.as_mut_ptr(), _mm256_maskz_compress_ps(mask, keys));
            _mm256_storeu_si256(out_ids.as_mut_ptr().cast(), _mm256_maskz_compress_epi32(mask, ids));
        }
    }

    /// Traversal waits for the nearest child, so it stays in a register: a second compress in the reverse order puts
    /// it into lane 0. The stores of the other children are off the critical path until they are popped.
    #[inline(always)]
    fn compress_intersected(
        near: F32x8,
        far: F32x8,
        orders: [[u32; 8]; 2],
        ids: &[u32; 8],
        out_near: &mut [f32; 8],
        out_ids: &mut [u32; 8],
    ) -> Intersected {
        // SAFETY: see the module comment; the arrays have the size of a register.
        unsafe {
            let ids = _mm256_loadu_si256(ids.as_ptr().cast());
            let compress = |order: &[u32; 8]| {
                let order = _mm256_loadu_si256(order.as_ptr().cast());
                let near = _mm256_permutevar8x32_ps(near.0, order);
                let far = _mm256_permutevar8x32_ps(far.0, order);
                let mask = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, far);
                let ids = _mm256_permutevar8x32_epi32(ids, order);
                (mask, near, _mm256_maskz_compress_epi32(mask, ids))
            };
            let (mask, near, ids) = compress(&orders[0]);
            let (_, _, reversed_ids) = compress(&orders[1]);
            _mm256_storeu_ps(out_near.as_mut_ptr(), _mm256_maskz_compress_ps(mask, near));
            _mm256_storeu_si256(out_ids.as_mut_ptr().cast(), ids);
            Intersected { count: mask.count_ones() as usize, last: _mm256_cvtsi256_si32(reversed_ids) as u32 }
        }
    }

    #[inline(always)]
    fn deinterleave3(vectors: &[Vec3; 16]) -> [F32x16; 3] {
        // SAFETY: see the module comment; a Vec3 is three f32 without padding, so sixteen of them are three
        // registers. The tables have the size of a register.
        unsafe {
            let from = vectors.as_ptr().cast::<f32>();
            let a = _mm512_loadu_ps(from);
            let b = _mm512_loadu_ps(from.add(16));
            let c = _mm512_loadu_ps(from.add(32));
            let column = |axis: usize| {
                let indices = _mm512_loadu_si512(DEINTERLEAVE[axis].as_ptr().cast());
                let low = _mm512_permutex2var_ps(a, indices, b);
                F32x16(_mm512_mask_permutexvar_ps(low, DEINTERLEAVE_THIRD[axis], indices, c))
            };
            [column(0), column(1), column(2)]
        }
    }

    #[inline(always)]
    fn interleave3([a, b, c]: [&[u32; 16]; 3], to: &mut [[u32; 3]; 16]) {
        // SAFETY: see the module comment; there are three registers of integers on either side.
        unsafe {
            let a = _mm512_loadu_si512(a.as_ptr().cast());
            let b = _mm512_loadu_si512(b.as_ptr().cast());
            let c = _mm512_loadu_si512(c.as_ptr().cast());
            for part in 0..3 {
                let indices = _mm512_loadu_si512(INTERLEAVE[part].as_ptr().cast());
                let rows = _mm512_permutex2var_epi32(a, indices, b);
                let rows = _mm512_mask_permutexvar_epi32(rows, INTERLEAVE_THIRD[part], indices, c);
                _mm512_storeu_si512(to.as_mut_ptr().cast::<u32>().add(16 * part).cast(), rows);
            }
        }
    }

    #[inline(always)]
    fn transpose16(columns: &[F32x16; 16], rows: &mut [[f32; 16]; 16]) {
        // SAFETY: see the module comment; rows have the size of a register.
        unsafe {
            let zero = _mm512_setzero_ps();
            // Pairs of columns, then four columns each. Quarter q of register 4c + r holds row 4q + r of columns 4c to 4c + 3.
            let mut pairs = [_mm512_setzero_pd(); 16];
            for i in 0..8 {
                let (a, b) = (columns[2 * i].0, columns[2 * i + 1].0);
                pairs[2 * i] = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
                pairs[2 * i + 1] = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
            }
            let mut fours = [zero; 16];
            for i in 0..8 {
                let (a, b) = (pairs[i / 2 * 4 + i % 2], pairs[i / 2 * 4 + 2 + i % 2]);
                fours[2 * i] = _mm512_castpd_ps(_mm512_unpacklo_pd(a, b));
                fours[2 * i + 1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a, b));
            }
            for i in 0..4 {
                let (a, b, c, d) = (fours[i], fours[4 + i], fours[8 + i], fours[12 + i]);
                // Even quarters, then odd ones.
                let left = _mm512_shuffle_f32x4::<0x88>(a, b);
                let right = _mm512_shuffle_f32x4::<0x88>(c, d);
                _mm512_storeu_ps(rows[i].as_mut_ptr(), _mm512_shuffle_f32x4::<0x88>(left, right));
                _mm512_storeu_ps(rows[8 + i].as_mut_ptr(), _mm512_shuffle_f32x4::<0xdd>(left, right));
                let left = _mm512_shuffle_f32x4::<0xdd>(a, b);
                let right = _mm512_shuffle_f32x4::<0xdd>(c, d);
                _mm512_storeu_ps(rows[4 + i].as_mut_ptr(), _mm512_shuffle_f32x4::<0x88>(left, right));
                _mm512_storeu_ps(rows[12 + i].as_mut_ptr(), _mm512_shuffle_f32x4::<0xdd>(left, right));
            }
        }
    }

    #[inline(always)]
    fn compress_ids(ids: &[u32; 16], masks: &[u8; 16], bit: usize, out: &mut [u32; 16]) -> usize {
        // SAFETY: see the module comment; arrays have the size of a register.
        unsafe {
            let masks = _mm_loadu_si128(masks.as_ptr().cast());
            let mask = _mm_test_epi8_mask(masks, _mm_set1_epi8((1u8 << (bit & 7)) as i8));
            let front = _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(ids.as_ptr().cast()));
            _mm512_storeu_si512(out.as_mut_ptr().cast(), front);
            mask.count_ones() as usize
        }
    }

    #[inline(always)]
    fn lookup_f64(table: &[f64; 16], indices: &[u32; 16]) -> [f64; 16] {
        // SAFETY: see the module comment; tables have the size of two registers.
        unsafe {
            let low = _mm512_loadu_pd(table.as_ptr());
            let high = _mm512_loadu_pd(table.as_ptr().add(8));
            let mut to = [0.0; 16];
            for half in [0, 8] {
                let indices = _mm512_cvtepu32_epi64(_mm256_loadu_si256(indices.as_ptr().add(half).cast()));
                _mm512_storeu_pd(to.as_mut_ptr().add(half), _mm512_permutex2var_pd(low, indices, high));
            }
            to
        }
    }

    #[inline(always)]
    fn lookup_u32(table: &[u32; 16], indices: &[u32; 16]) -> [u32; 16] {
        // SAFETY: see the module comment; tables have the size of a register.
        unsafe {
            let mut to = [0; 16];
            let table = _mm512_loadu_si512(table.as_ptr().cast());
            let indices = _mm512_loadu_si512(indices.as_ptr().cast());
            _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_permutexvar_epi32(indices, table));
            to
        }
    }

    #[inline(always)]
    fn broadcast_quad(quad: &[f32; 4]) -> F32x16 {
        // SAFETY: see the module comment; `quad` has a quarter of the size of a register.
        F32x16(unsafe { _mm512_broadcast_f32x4(_mm_loadu_ps(quad.as_ptr())) })
    }

    #[inline(always)]
    fn reduce_min_each(vectors: [F32x16; 4]) -> F32x16 {
        reduce_each(vectors, F32x16::min)
    }

    #[inline(always)]
    fn reduce_max_each(vectors: [F32x16; 4]) -> F32x16 {
        reduce_each(vectors, F32x16::max)
    }

    #[inline(always)]
    fn pack_quads([a, b, c, d]: [F32x16; 4]) -> F32x16 {
        // SAFETY: see the module comment; the table has the size of a register.
        unsafe {
            let indices = _mm512_loadu_si512(EVERY_FOURTH.as_ptr().cast());
            let ab = _mm512_permutex2var_ps(a.0, indices, b.0);
            let cd = _mm512_permutex2var_ps(c.0, indices, d.0);
            F32x16(_mm512_shuffle_f32x4::<0b01_00_01_00>(ab, cd))
        }
    }

    #[inline(always)]
    fn call_outlined<K: OutlinedKernel<Self>>(kernel: K) -> K::Output {
        // SAFETY: only kernels that `run` has entered get here, and its caller has checked the processor.
        unsafe { run_outlined(kernel) }
    }
}

/// Reduces each of four vectors to one number, which fills four lanes: halves first, then quarters, then lanes
/// within quarters.
#[inline(always)]
fn reduce_each([a, b, c, d]: [F32x16; 4], combine: impl Fn(F32x16, F32x16) -> F32x16) -> F32x16 {
    // SAFETY: see the module comment.
    unsafe {
        let combine_halves = |a: F32x16, b: F32x16| {
            let low = F32x16(_mm512_shuffle_f32x4::<0b01_00_01_00>(a.0, b.0));
            combine(low, F32x16(_mm512_shuffle_f32x4::<0b11_10_11_10>(a.0, b.0)))
        };
        let ab = combine_halves(a, b);
        let cd = combine_halves(c, d);
        let even = F32x16(_mm512_shuffle_f32x4::<0b10_00_10_00>(ab.0, cd.0));
        let quarters = combine(even, F32x16(_mm512_shuffle_f32x4::<0b11_01_11_01>(ab.0, cd.0)));
        let pairs = combine(quarters, F32x16(_mm512_permute_ps::<0b01_00_11_10>(quarters.0)));
        combine(pairs, F32x16(_mm512_permute_ps::<0b10_11_00_01>(pairs.0)))
    }
}

/// Returns true if this processor supports everything that [`run`] is compiled with.
#[inline]
pub fn is_supported() -> bool {
    avx2::is_supported()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
}

/// # Safety
/// As for [`run`].
#[inline(never)]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_outlined<K: OutlinedKernel<Avx512>>(kernel: K) -> K::Output {
    kernel.run()
}

/// # Safety
/// [`is_supported`] must have returned true.
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn run<K: SimdKernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

/// Eight lanes.
#[derive(Clone, Copy)]
pub struct F32x8(__m256);

/// Sixteen lanes.
#[derive(Clone, Copy)]
pub struct F32x16(__m512);

#[inline(always)]
fn select8(mask: u32, a: __m256, b: __m256) -> __m256 {
    // SAFETY: see the module comment.
    unsafe { _mm256_mask_blend_ps(mask as __mmask8, b, a) }
}

#[inline(always)]
fn select16(mask: u32, a: __m512, b: __m512) -> __m512 {
    // SAFETY: see the module comment.
    unsafe { _mm512_mask_blend_ps(mask as __mmask16, b, a) }
}

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
    _mm256_cmp_ps_mask,
    u32::from,
    select8,
    {
        /// As for sixteen lanes.
        #[inline(always)]
        fn rcp(self) -> Self {
            // SAFETY: as above.
            unsafe {
                let estimate = _mm256_rcp14_ps(self.0);
                F32x8(_mm256_mul_ps(estimate, _mm256_fnmadd_ps(self.0, estimate, _mm256_set1_ps(2.0))))
            }
        }
    }
);

impl_x86_lanes!(
    F32x16,
    16,
    _mm512_set1_ps,
    _mm512_loadu_ps,
    _mm512_storeu_ps,
    _mm512_add_ps,
    _mm512_sub_ps,
    _mm512_mul_ps,
    _mm512_div_ps,
    _mm512_fmadd_ps,
    _mm512_fmsub_ps,
    _mm512_min_ps,
    _mm512_max_ps,
    _mm512_and_ps,
    _mm512_andnot_ps,
    _mm512_xor_ps,
    _mm512_cmp_ps_mask,
    u32::from,
    select16,
    {
        /// One Newton–Raphson step on an estimate that is accurate to 2⁻¹⁴. The error that remains, 2⁻²⁸, is
        /// negligible beside the two roundings.
        #[inline(always)]
        fn rcp(self) -> Self {
            // SAFETY: as above.
            unsafe {
                let estimate = _mm512_rcp14_ps(self.0);
                F32x16(_mm512_mul_ps(estimate, _mm512_fnmadd_ps(self.0, estimate, _mm512_set1_ps(2.0))))
            }
        }
        #[inline(always)]
        fn reduce_min(self) -> f32 {
            // SAFETY: as above.
            unsafe { _mm512_reduce_min_ps(self.0) }
        }
        #[inline(always)]
        fn reduce_sum(self) -> f32 {
            // SAFETY: as above.
            unsafe { _mm512_reduce_add_ps(self.0) }
        }
        #[inline(always)]
        fn reduce_max(self) -> f32 {
            // SAFETY: as above.
            unsafe { _mm512_reduce_max_ps(self.0) }
        }
        #[inline(always)]
        fn eq_u32(values: &[u32; 16], x: u32) -> u32 {
            // SAFETY: as above; `values` has the size of a register.
            u32::from(unsafe {
                let values = _mm512_loadu_si512(values.as_ptr().cast());
                _mm512_cmpeq_epi32_mask(values, _mm512_set1_epi32(x as i32))
            })
        }
        #[inline(always)]
        fn lt_u32(values: &[u32; 16], x: u32) -> u32 {
            // SAFETY: as above; `values` has the size of a register.
            u32::from(unsafe {
                let values = _mm512_loadu_si512(values.as_ptr().cast());
                _mm512_cmplt_epu32_mask(values, _mm512_set1_epi32(x as i32))
            })
        }
        #[inline(always)]
        fn renumber_quad(values: &[u32; 16], first: u32, new_first: u32, to: &mut [u32; 16]) -> u32 {
            // SAFETY: as above; both arrays have the size of a register.
            unsafe {
                let values = _mm512_loadu_si512(values.as_ptr().cast());
                let offset = _mm512_sub_epi32(values, _mm512_set1_epi32(first as i32));
                let mask = _mm512_cmplt_epu32_mask(offset, _mm512_set1_epi32(4));
                let numbers = _mm512_add_epi32(offset, _mm512_set1_epi32(new_first as i32));
                _mm512_mask_storeu_epi32(to.as_mut_ptr().cast(), mask, numbers);
                u32::from(mask)
            }
        }
        #[inline(always)]
        fn masked_fill(mask: u32, to: &mut [u32; 16], x: u32) {
            // SAFETY: as above; `to` has the size of a register.
            unsafe {
                let x = _mm512_set1_epi32(x as i32);
                _mm512_mask_storeu_epi32(to.as_mut_ptr().cast(), mask as __mmask16, x);
            }
        }
    }
);
