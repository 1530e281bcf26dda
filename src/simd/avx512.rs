//! AVX-512: sixteen lanes in a register, and masks of their own.
//!
//! Every function here is inlined into [`run`], which is compiled with these instructions and
//! entered only where the processor has them: that is why each intrinsic below may be used.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

use glam::Vec3;

use crate::simd::avx2::A4;
use crate::simd::{Job, Lanes, Part, Simd};

pub(crate) struct Avx512;

/// Where the components of sixteen vectors are among their 48 numbers, by axis: in the first two
/// registers of them, or, as [`THIRD`] says, in the third.
const COLUMN: [[u32; 16]; 3] = {
    let mut column = [[0; 16]; 3];
    let mut i = 0;
    while i < 48 {
        column[i % 3][i / 3] = (i % 32) as u32;
        i += 1;
    }
    column
};
const THIRD: [__mmask16; 3] = {
    let mut third = [0; 3];
    let mut i = 32;
    while i < 48 {
        third[i % 3] |= 1 << (i / 3);
        i += 1;
    }
    third
};

/// Where sixteen rows of three words come from, by register of rows: from the first two columns, or, as
/// [`LAST`] says, from the third.
const ROW: [[u32; 16]; 3] = {
    let mut row = [[0; 16]; 3];
    let mut i = 0;
    while i < 48 {
        row[i / 16][i % 16] = (i / 3 + i % 3 % 2 * 16) as u32;
        i += 1;
    }
    row
};
const LAST: [__mmask16; 3] = {
    let mut last = [0; 3];
    let mut i = 2;
    while i < 48 {
        last[i / 16] |= 1 << (i % 16);
        i += 3;
    }
    last
};

/// Every fourth lane of two registers, twice.
const FOURTHS: [u32; 16] = [0, 4, 8, 12, 16, 20, 24, 28, 0, 4, 8, 12, 16, 20, 24, 28];

impl Simd for Avx512 {
    type F4 = A4;
    type F8 = Z8;
    type F16 = Z16;

    #[inline(always)]
    fn arrange(
        mask: u32,
        order: [u32; 8],
        (numbers, words): (Z8, &[u32; 8]),
        to: (&mut [f32; 8], &mut [u32; 8]),
    ) {
        // SAFETY: see the top of the file; arrays are as long as registers.
        unsafe {
            let order = _mm256_loadu_si256(order.as_ptr().cast());
            let mask =
                _mm256_movepi32_mask(_mm256_permutevar8x32_epi32(_mm256_movm_epi32(mask as u8), order));
            let words = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(words.as_ptr().cast()), order);
            let numbers = _mm256_permutevar8x32_ps(numbers.0, order);
            _mm256_storeu_ps(to.0.as_mut_ptr(), _mm256_maskz_compress_ps(mask, numbers));
            _mm256_storeu_si256(to.1.as_mut_ptr().cast(), _mm256_maskz_compress_epi32(mask, words));
        }
    }

    /// Every step waits for the one before to say where it goes. So the nearest child comes out of a
    /// register, by an order of its own, and what is pushed is nobody's concern until it is popped.
    #[inline(always)]
    fn meeting(
        (enters, leaves): (Z8, Z8),
        orders: [[u32; 8]; 2],
        words: &[u32; 8],
        to: (&mut [f32; 8], &mut [u32; 8]),
    ) -> (usize, u32) {
        // SAFETY: see the top of the file; arrays are as long as registers.
        unsafe {
            let words = _mm256_loadu_si256(words.as_ptr().cast());
            let ordered = |order: &[u32; 8]| {
                let order = _mm256_loadu_si256(order.as_ptr().cast());
                let enters = _mm256_permutevar8x32_ps(enters.0, order);
                let leaves = _mm256_permutevar8x32_ps(leaves.0, order);
                let mask = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(enters, leaves);
                let words = _mm256_permutevar8x32_epi32(words, order);
                (mask, enters, _mm256_maskz_compress_epi32(mask, words))
            };
            let (mask, enters, words) = ordered(&orders[0]);
            let (_, _, nearest) = ordered(&orders[1]);
            _mm256_storeu_ps(to.0.as_mut_ptr(), _mm256_maskz_compress_ps(mask, enters));
            _mm256_storeu_si256(to.1.as_mut_ptr().cast(), words);
            (mask.count_ones() as usize, _mm256_cvtsi256_si32(nearest) as u32)
        }
    }

    #[inline(always)]
    fn columns(of: &[Vec3; 16]) -> [Z16; 3] {
        // SAFETY: see the top of the file; vectors are three numbers and nothing else, so there are
        // three registers of them, and tables are as long as a register.
        unsafe {
            let from = of.as_ptr().cast::<f32>();
            let (a, b, c) =
                (_mm512_loadu_ps(from), _mm512_loadu_ps(from.add(16)), _mm512_loadu_ps(from.add(32)));
            let column = |axis: usize| {
                let index = _mm512_loadu_si512(COLUMN[axis].as_ptr().cast());
                let low = _mm512_permutex2var_ps(a, index, b);
                Z16(_mm512_mask_permutexvar_ps(low, THIRD[axis], index, c))
            };
            [column(0), column(1), column(2)]
        }
    }

    #[inline(always)]
    fn pick(table: &[f64; 16], of: &[u32; 16]) -> [f64; 16] {
        // SAFETY: see the top of the file; tables are as long as two registers.
        unsafe {
            let (low, high) = (_mm512_loadu_pd(table.as_ptr()), _mm512_loadu_pd(table.as_ptr().add(8)));
            let mut to = [0.0; 16];
            for half in [0, 8] {
                let of = _mm512_cvtepu32_epi64(_mm256_loadu_si256(of.as_ptr().add(half).cast()));
                _mm512_storeu_pd(to.as_mut_ptr().add(half), _mm512_permutex2var_pd(low, of, high));
            }
            to
        }
    }

    #[inline(always)]
    fn pick_words(table: &[u32; 16], of: &[u32; 16]) -> [u32; 16] {
        // SAFETY: see the top of the file; tables are as long as a register.
        unsafe {
            let mut to = [0; 16];
            let table = _mm512_loadu_si512(table.as_ptr().cast());
            let of = _mm512_loadu_si512(of.as_ptr().cast());
            _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_permutexvar_epi32(of, table));
            to
        }
    }

    #[inline(always)]
    fn rows([a, b, c]: [&[u32; 16]; 3], to: &mut [[u32; 3]; 16]) {
        // SAFETY: see the top of the file; there are three registers of words on either side.
        unsafe {
            let (a, b, c) = (
                _mm512_loadu_si512(a.as_ptr().cast()),
                _mm512_loadu_si512(b.as_ptr().cast()),
                _mm512_loadu_si512(c.as_ptr().cast()),
            );
            for part in 0..3 {
                let from = _mm512_loadu_si512(ROW[part].as_ptr().cast());
                let row = _mm512_permutex2var_epi32(a, from, b);
                let row = _mm512_mask_permutexvar_epi32(row, LAST[part], from, c);
                _mm512_storeu_si512(to.as_mut_ptr().cast::<u32>().add(16 * part).cast(), row);
            }
        }
    }

    #[inline(always)]
    fn four_times(of: &[f32; 4]) -> Z16 {
        // SAFETY: see the top of the file; `of` is as long as a quarter of a register.
        Z16(unsafe { _mm512_broadcast_f32x4(_mm_loadu_ps(of.as_ptr())) })
    }

    #[inline(always)]
    fn least_of_each(of: [Z16; 4]) -> Z16 {
        of_each(of, Z16::min)
    }

    #[inline(always)]
    fn greatest_of_each(of: [Z16; 4]) -> Z16 {
        of_each(of, Z16::max)
    }

    #[inline(always)]
    fn gathered([a, b, c, d]: [Z16; 4]) -> Z16 {
        // SAFETY: see the top of the file; the table is as long as a register.
        unsafe {
            let index = _mm512_loadu_si512(FOURTHS.as_ptr().cast());
            let (ab, cd) = (_mm512_permutex2var_ps(a.0, index, b.0), _mm512_permutex2var_ps(c.0, index, d.0));
            Z16(_mm512_shuffle_f32x4::<0b01_00_01_00>(ab, cd))
        }
    }

    #[inline(always)]
    fn call<J: Part<Self>>(job: J) -> J::Output {
        // SAFETY: this is reached from `run` alone, which the processor was asked for.
        unsafe { part(job) }
    }
}

/// Four registers, each folded to one number in a quarter of a register: halves first, then quarters, then
/// what is within them.
#[inline(always)]
fn of_each([a, b, c, d]: [Z16; 4], pick: impl Fn(Z16, Z16) -> Z16) -> Z16 {
    // SAFETY: see the top of the file.
    unsafe {
        let halves = |a: Z16, b: Z16| {
            let low = Z16(_mm512_shuffle_f32x4::<0b01_00_01_00>(a.0, b.0));
            pick(low, Z16(_mm512_shuffle_f32x4::<0b11_10_11_10>(a.0, b.0)))
        };
        let (a, c) = (halves(a, b), halves(c, d));
        let even = Z16(_mm512_shuffle_f32x4::<0b10_00_10_00>(a.0, c.0));
        let quarters = pick(even, Z16(_mm512_shuffle_f32x4::<0b11_01_11_01>(a.0, c.0)));
        let pairs = pick(quarters, Z16(_mm512_permute_ps::<0b01_00_11_10>(quarters.0)));
        pick(pairs, Z16(_mm512_permute_ps::<0b10_11_00_01>(pairs.0)))
    }
}

pub(crate) fn available() -> bool {
    crate::simd::avx2::available()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
}

/// # Safety
/// As [`run`].
#[inline(never)]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn part<J: Part<Avx512>>(job: J) -> J::Output {
    job.run()
}

/// # Safety
/// The processor has AVX-512 F, VL, DQ and BW, AVX2 and FMA.
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(crate) unsafe fn run<J: Job>(job: J) -> J::Output {
    job.run::<Avx512>()
}

/// Eight lanes.
#[derive(Clone, Copy)]
pub(crate) struct Z8(__m256);

/// Sixteen lanes.
#[derive(Clone, Copy)]
pub(crate) struct Z16(__m512);

macro_rules! lanes {
    ($name:ident, $n:literal, $mask:ident, $set1:ident, $load:ident, $store:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, $fmadd:ident, $fmsub:ident, $min:ident, $max:ident, $and:ident, $andnot:ident,
     $xor:ident, $cmp:ident, $blend:ident, { $($own:tt)* }) => {
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
                u32::from(unsafe { $cmp::<_CMP_LT_OQ>(self.0, o.0) })
            }
            #[inline(always)]
            fn le(self, o: Self) -> u32 {
                u32::from(unsafe { $cmp::<_CMP_LE_OQ>(self.0, o.0) })
            }
            #[inline(always)]
            fn or_else(self, mask: u32, o: Self) -> Self {
                $name(unsafe { $blend(mask as $mask, o.0, self.0) })
            }
            $($own)*
        }
    };
}

lanes!(
    Z8,
    8,
    __mmask8,
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
    _mm256_mask_blend_ps,
    {
        /// As that of sixteen.
        #[inline(always)]
        fn reciprocal(self) -> Self {
            // SAFETY: as above.
            unsafe {
                let guess = _mm256_rcp14_ps(self.0);
                Z8(_mm256_mul_ps(guess, _mm256_fnmadd_ps(self.0, guess, _mm256_set1_ps(2.0))))
            }
        }
    }
);

lanes!(
    Z16,
    16,
    __mmask16,
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
    _mm512_mask_blend_ps,
    {
        /// A guess to 2⁻¹⁴ and one step of Newton's: the square of that is nothing beside the two roundings.
        #[inline(always)]
        fn reciprocal(self) -> Self {
            // SAFETY: as above.
            unsafe {
                let guess = _mm512_rcp14_ps(self.0);
                Z16(_mm512_mul_ps(guess, _mm512_fnmadd_ps(self.0, guess, _mm512_set1_ps(2.0))))
            }
        }
        #[inline(always)]
        fn least(self) -> f32 {
            // SAFETY: as above.
            unsafe { _mm512_reduce_min_ps(self.0) }
        }
        #[inline(always)]
        fn sum(self) -> f32 {
            // SAFETY: as above.
            unsafe { _mm512_reduce_add_ps(self.0) }
        }
        #[inline(always)]
        fn greatest(self) -> f32 {
            // SAFETY: as above.
            unsafe { _mm512_reduce_max_ps(self.0) }
        }
        #[inline(always)]
        fn matching(of: &[u32; 16], x: u32) -> u32 {
            // SAFETY: as above, and `of` is as long as a register.
            u32::from(unsafe {
                _mm512_cmpeq_epi32_mask(_mm512_loadu_si512(of.as_ptr().cast()), _mm512_set1_epi32(x as i32))
            })
        }
        #[inline(always)]
        fn below(of: &[u32; 16], x: u32) -> u32 {
            // SAFETY: as above, and `of` is as long as a register.
            u32::from(unsafe {
                _mm512_cmplt_epu32_mask(_mm512_loadu_si512(of.as_ptr().cast()), _mm512_set1_epi32(x as i32))
            })
        }
        #[inline(always)]
        fn renumber(of: &[u32; 16], (first, by): (u32, u32), to: &mut [u32; 16]) -> u32 {
            // SAFETY: as above, and both are as long as a register.
            unsafe {
                let of = _mm512_loadu_si512(of.as_ptr().cast());
                let nth = _mm512_sub_epi32(of, _mm512_set1_epi32(first as i32));
                let mask = _mm512_cmplt_epu32_mask(nth, _mm512_set1_epi32(4));
                let numbers = _mm512_add_epi32(nth, _mm512_set1_epi32(by as i32));
                _mm512_mask_storeu_epi32(to.as_mut_ptr().cast(), mask, numbers);
                u32::from(mask)
            }
        }
        #[inline(always)]
        fn put(mask: u32, to: &mut [u32; 16], x: u32) {
            // SAFETY: as above, and `to` is as long as a register.
            unsafe {
                _mm512_mask_storeu_epi32(
                    to.as_mut_ptr().cast(),
                    mask as __mmask16,
                    _mm512_set1_epi32(x as i32),
                );
            }
        }
    }
);
