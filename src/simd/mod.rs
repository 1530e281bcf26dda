//! Lanes of f32, by processor.
//!
//! Traversal is written once, over [`Simd`], and compiled for each tier; which one runs is chosen
//! when trees are built. Tiers may round differently (some fuse multiply and add): f32 numbers
//! here only ever prove something within an error bound that covers both, so answers are the same
//! to the bit on all of them.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod pair;
mod portable;

use std::ops::{Add, Mul, Sub};

use glam::Vec3;

/// Has the processor fetch what something begins with, which is to be read or written soon. It changes nothing
/// but the time.
#[inline(always)]
pub(crate) fn prefetch<T: ?Sized>(of: &T) {
    prefetch_at(of, 0);
}

/// Has all of something fetched.
#[inline(always)]
pub(crate) fn prefetch_whole<T>(of: &T) {
    for at in (0..size_of::<T>()).step_by(64) {
        prefetch_at(of, at);
    }
}

#[inline(always)]
fn prefetch_at<T: ?Sized>(of: &T, at: usize) {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    // SAFETY: every processor of the kind has the instruction, which reads nothing and takes any address.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(of).cast::<i8>().wrapping_add(at));
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (of, at);
}

/// N numbers that are worked on at once. Masks are bits, lane 0 the lowest.
pub(crate) trait Lanes<const N: usize>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// The same number in every lane.
    fn splat(x: f32) -> Self;
    fn load(from: &[f32; N]) -> Self;
    fn store(self, to: &mut [f32; N]);
    /// self·b + c, rounded once or twice.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// self·b − c, rounded once or twice.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// The lesser; `other` where `self` is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where `self` is NaN.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// Negated where `sign` has its sign bit set.
    fn flipped_by(self, sign: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// About 1 over it, off by no more than 1.1·2⁻²³ of that: of what neither it nor 1 over it is so small
    /// that digits are lost.
    #[inline(always)]
    fn reciprocal(self) -> Self {
        Self::splat(1.0).div(self)
    }
    /// Where self < other; false where either is NaN.
    fn lt(self, other: Self) -> u32;
    /// Where self ≤ other; false where either is NaN.
    fn le(self, other: Self) -> u32;
    /// `self` where `mask` has a bit, else `other`.
    fn or_else(self, mask: u32, other: Self) -> Self;

    /// The least of the lanes, none of which may be NaN.
    #[inline(always)]
    fn least(self) -> f32 {
        let mut each = [0.0; N];
        self.store(&mut each);
        halved(each, f32::min)
    }

    /// The greatest of the lanes, none of which may be NaN.
    #[inline(always)]
    fn greatest(self) -> f32 {
        let mut each = [0.0; N];
        self.store(&mut each);
        halved(each, f32::max)
    }

    /// The sum of the lanes, rounded in some order.
    #[inline(always)]
    fn sum(self) -> f32 {
        let mut each = [0.0; N];
        self.store(&mut each);
        halved(each, |a, b| a + b)
    }

    /// Where numbers are `x`.
    #[inline(always)]
    fn matching(of: &[u32; N], x: u32) -> u32 {
        (0..N).fold(0, |mask, i| mask | u32::from(of[i] == x) << i)
    }

    /// Where numbers are less than `x`.
    #[inline(always)]
    fn below(of: &[u32; N], x: u32) -> u32 {
        (0..N).fold(0, |mask, i| mask | u32::from(of[i] < x) << i)
    }

    /// Where numbers are among the four from `first` on: those are written to `to` as if the four were
    /// those from `by` on.
    #[inline(always)]
    fn renumber(of: &[u32; N], (first, by): (u32, u32), to: &mut [u32; N]) -> u32 {
        let mut mask = 0;
        for (i, (of, to)) in of.iter().zip(to).enumerate() {
            let nth = of.wrapping_sub(first);
            if nth < 4 {
                *to = by + nth;
                mask |= 1 << i;
            }
        }
        mask
    }

    /// Writes `x` where `mask` has a bit.
    #[inline(always)]
    fn put(mask: u32, to: &mut [u32; N], x: u32) {
        for (i, to) in to.iter_mut().enumerate() {
            *to = if mask >> i & 1 == 1 { x } else { *to };
        }
    }
}

/// N numbers, a power of two, folded to one by halves.
#[inline(always)]
fn halved<const N: usize>(mut each: [f32; N], of: impl Fn(f32, f32) -> f32) -> f32 {
    let mut half = N / 2;
    while half > 0 {
        for i in 0..half {
            each[i] = of(each[i], each[i + half]);
        }
        half /= 2;
    }
    each[0]
}

/// A tier: the widths that traversal works in.
pub(crate) trait Simd {
    /// The triangles of a block.
    type F4: Lanes<4>;
    /// The children of a node.
    type F8: Lanes<8>;
    /// A group of rays.
    type F16: Lanes<16>;

    /// Moves the numbers and words of the lanes in `mask` to the front of `to`, in the order that
    /// lanes have in `order` (the lowest three bits of each). What is behind them is of no value.
    #[inline(always)]
    fn arrange(
        mask: u32,
        order: [u32; 8],
        (numbers, words): (Self::F8, &[u32; 8]),
        to: (&mut [f32; 8], &mut [u32; 8]),
    ) {
        let mut each = [0.0; 8];
        numbers.store(&mut each);
        let mut end = 0;
        for lane in order {
            let lane = lane as usize & 7;
            (to.0[end & 7], to.1[end & 7]) = (each[lane], words[lane]);
            end += (mask >> lane & 1) as usize;
        }
    }

    /// Where `enters` ≤ `leaves`: [`Simd::arrange`]s those lanes by the first of `orders`, of which the
    /// second is the reverse as far as such lanes go. How many they are, and the last one's word.
    #[inline(always)]
    fn meeting(
        (enters, leaves): (Self::F8, Self::F8),
        orders: [[u32; 8]; 2],
        words: &[u32; 8],
        to: (&mut [f32; 8], &mut [u32; 8]),
    ) -> (usize, u32) {
        let mask = enters.le(leaves);
        let count = mask.count_ones() as usize;
        if count <= 1 {
            return (count, words[mask.trailing_zeros() as usize & 7]);
        }
        Self::arrange(mask, orders[0], (enters, words), (to.0, &mut *to.1));
        (count, to.1[(count - 1) & 7])
    }

    /// The components of vectors, by axis.
    #[inline(always)]
    fn columns(of: &[Vec3; 16]) -> [Self::F16; 3] {
        let mut columns = [[0.0; 16]; 3];
        for (i, v) in of.iter().enumerate() {
            columns[0][i] = v.x;
            columns[1][i] = v.y;
            columns[2][i] = v.z;
        }
        [Self::F16::load(&columns[0]), Self::F16::load(&columns[1]), Self::F16::load(&columns[2])]
    }

    /// Numbers of a table.
    #[inline(always)]
    fn pick(table: &[f64; 16], of: &[u32; 16]) -> [f64; 16] {
        of.map(|i| table[i as usize & 15])
    }

    /// Words of a table.
    #[inline(always)]
    fn pick_words(table: &[u32; 16], of: &[u32; 16]) -> [u32; 16] {
        of.map(|i| table[i as usize & 15])
    }

    /// Columns of words as rows of them.
    #[inline(always)]
    fn rows(columns: [&[u32; 16]; 3], to: &mut [[u32; 3]; 16]) {
        for (i, row) in to.iter_mut().enumerate() {
            *row = columns.map(|column| column[i]);
        }
    }

    /// The same four numbers four times.
    #[inline(always)]
    fn four_times(of: &[f32; 4]) -> Self::F16 {
        Self::F16::load(&std::array::from_fn(|i| of[i & 3]))
    }

    /// The least of each, which fills four lanes: that of the first one the lowest. None may be NaN.
    #[inline(always)]
    fn least_of_each(of: [Self::F16; 4]) -> Self::F16 {
        let least = [of[0].least(), of[1].least(), of[2].least(), of[3].least()];
        Self::F16::load(&std::array::from_fn(|i| least[i / 4]))
    }

    /// The greatest of each, as [`Simd::least_of_each`].
    #[inline(always)]
    fn greatest_of_each(of: [Self::F16; 4]) -> Self::F16 {
        let greatest = [of[0].greatest(), of[1].greatest(), of[2].greatest(), of[3].greatest()];
        Self::F16::load(&std::array::from_fn(|i| greatest[i / 4]))
    }

    /// Numbers that each fill four lanes, so that each fills one.
    #[inline(always)]
    fn gathered(of: [Self::F16; 4]) -> Self::F16 {
        let mut each = [[0.0; 16]; 4];
        for (of, to) in of.into_iter().zip(&mut each) {
            of.store(to);
        }
        Self::F16::load(&std::array::from_fn(|i| each[i / 4][i % 4 * 4]))
    }

    /// Runs a job of this tier as a function of its own, which is not inlined into its caller.
    fn call<J: Part<Self>>(job: J) -> J::Output
    where
        Self: Sized;
}

/// A part of a job that is compiled as a function of its own: it keeps code small.
pub(crate) trait Part<S: Simd> {
    type Output;
    /// Must be `#[inline(always)]`, as a [`Job`]'s.
    fn run(self) -> Self::Output;
}

/// Work that is compiled for every tier.
pub(crate) trait Job {
    type Output;
    /// Must be `#[inline(always)]`, as everything generic over [`Simd`] that it calls: only what is
    /// inlined into a tier's entry is compiled with that tier's instructions.
    fn run<S: Simd>(self) -> Self::Output;
}

/// Plain arithmetic over columns of numbers, which is compiled for every tier: what of it can be done
/// to many at once, is. It must be `#[inline(always)]`, as all that it calls.
pub(crate) trait Columnwise {
    /// Does it.
    fn run(self);
}

/// [`Columnwise`] as a job.
pub(crate) struct Plain<C>(pub C);

impl<C: Columnwise> Job for Plain<C> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        self.0.run();
    }
}

/// Instructions that traversal may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Tier {
    /// What every processor of the target has: SSE2 on x86-64, NEON on AArch64.
    Portable,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 F, VL, DQ and BW.
    Avx512,
}

impl Tier {
    /// All tiers, the plainest first.
    pub const ALL: [Tier; 3] = [Tier::Portable, Tier::Avx2, Tier::Avx512];

    /// The name that `BLINN_SIMD` takes.
    pub fn name(self) -> &'static str {
        match self {
            Tier::Portable => "portable",
            Tier::Avx2 => "avx2",
            Tier::Avx512 => "avx512",
        }
    }

    /// True where this processor can run it.
    pub fn available(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        match self {
            Tier::Portable => true,
            Tier::Avx2 => avx2::available(),
            Tier::Avx512 => avx512::available(),
        }
        #[cfg(not(target_arch = "x86_64"))]
        (self == Tier::Portable)
    }

    /// The best that this processor can run.
    pub fn best() -> Tier {
        Tier::ALL.into_iter().rev().find(|tier| tier.available()).unwrap_or(Tier::Portable)
    }

    /// Runs `job` with this tier's instructions, or with the portable ones where this processor
    /// lacks them.
    #[allow(unsafe_code)]
    pub(crate) fn run<J: Job>(self, job: J) -> J::Output {
        #[cfg(target_arch = "x86_64")]
        match self {
            // SAFETY: the processor was just seen to have the instructions.
            Tier::Avx512 if self.available() => return unsafe { avx512::run(job) },
            // SAFETY: as above.
            Tier::Avx2 if self.available() => return unsafe { avx2::run(job) },
            _ => {}
        }
        job.run::<portable::Portable>()
    }
}

impl Default for Tier {
    fn default() -> Self {
        Tier::best()
    }
}

#[cfg(test)]
mod tests;
