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
pub(super) fn prefetch<T: ?Sized>(of: &T) {
    prefetch_at(of, 0);
}

/// Has all of something fetched.
#[inline(always)]
pub(super) fn prefetch_whole<T>(of: &T) {
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
pub(super) trait Lanes<const N: usize>:
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
pub(super) trait Simd {
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

    /// Runs a job of this tier as a function of its own, which is not inlined into its caller.
    fn call<J: Part<Self>>(job: J) -> J::Output
    where
        Self: Sized;
}

/// A part of a job that is compiled as a function of its own: it keeps code small.
pub(super) trait Part<S: Simd> {
    type Output;
    /// Must be `#[inline(always)]`, as a [`Job`]'s.
    fn run(self) -> Self::Output;
}

/// Work that is compiled for every tier.
pub(super) trait Job {
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
pub(super) struct Plain<C>(pub C);

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
    pub(super) fn run<J: Job>(self, job: J) -> J::Output {
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
mod tests {
    use super::*;

    /// Every operation on every tier that runs here.
    struct AllOps;

    fn mask_of<const N: usize>() -> u32 {
        (1u64 << N).wrapping_sub(1) as u32
    }

    fn check<const N: usize, L: Lanes<N>>() {
        let a: [f32; N] = std::array::from_fn(|i| i as f32 - 2.5);
        let b: [f32; N] = std::array::from_fn(|i| 1.5 - (i * i % 7) as f32);
        let (x, y) = (L::load(&a), L::load(&b));
        let out = |l: L| {
            let mut to = [0.0; N];
            l.store(&mut to);
            to
        };
        let each = |f: &dyn Fn(usize) -> f32| std::array::from_fn::<f32, N, _>(f);
        let bits = |f: &dyn Fn(usize) -> bool| (0..N).map(|i| u32::from(f(i)) << i).sum::<u32>();
        assert_eq!(out(x + y), each(&|i| a[i] + b[i]));
        assert_eq!(out(x - y), each(&|i| a[i] - b[i]));
        assert_eq!(out(x * y), each(&|i| a[i] * b[i]));
        assert_eq!(out(x.div(y)), each(&|i| a[i] / b[i]));
        assert_eq!(out(x.mul_add(y, x)), each(&|i| a[i] * b[i] + a[i]));
        assert_eq!(out(x.mul_sub(y, x)), each(&|i| a[i] * b[i] - a[i]));
        assert_eq!(out(x.min(y)), each(&|i| a[i].min(b[i])));
        assert_eq!(out(x.max(y)), each(&|i| a[i].max(b[i])));
        assert_eq!(out(x.abs()), each(&|i| a[i].abs()));
        assert_eq!(out(x.flipped_by(y)), each(&|i| if b[i] < 0.0 { -a[i] } else { a[i] }));
        assert_eq!(x.least(), a[0]);
        assert_eq!((x.greatest(), x.sum()), (a[N - 1], a.iter().sum()));
        assert_eq!(x.lt(y), bits(&|i| a[i] < b[i]));
        assert_eq!(x.le(x), mask_of::<N>());
        let mask = 0x5a5a_3c69 & mask_of::<N>();
        assert_eq!(out(x.or_else(mask, y)), each(&|i| if mask >> i & 1 == 1 { a[i] } else { b[i] }));
        let mut ids: [u32; N] = std::array::from_fn(|i| i as u32 % 3);
        assert_eq!(L::matching(&ids, 2), bits(&|i| i % 3 == 2));
        assert_eq!(L::below(&ids, 2), bits(&|i| i % 3 != 2));
        L::put(mask, &mut ids, 9);
        assert!((0..N).all(|i| ids[i] == if mask >> i & 1 == 1 { 9 } else { i as u32 % 3 }));
        let mut numbers = [9; N];
        assert_eq!(
            L::renumber(&std::array::from_fn(|i| i as u32), (2, 5), &mut numbers),
            0x3c & mask_of::<N>()
        );
        assert!((0..N).all(|i| numbers[i] == if (2..6).contains(&i) { 3 + i as u32 } else { 9 }));
        assert!(out(y.reciprocal()).iter().zip(b).all(|(r, b)| (r * b - 1.0).abs() < 3e-7 || b == 0.0));
        let nan = L::splat(f32::NAN);
        assert_eq!((out(nan.min(x)), out(nan.max(x))), (a, a));
        assert_eq!((nan.lt(x), x.lt(nan), nan.le(nan)), (0, 0, 0));
    }

    fn arranged<S: Simd>() {
        let numbers: [f32; 8] = std::array::from_fn(|i| i as f32);
        let words: [u32; 8] = std::array::from_fn(|i| 10 + i as u32);
        // What is above three bits does not count.
        let order = [3, 0, 8 + 7, 1, 2, 16 + 6, 5, 4];
        for mask in 0..256 {
            let (mut some, mut other) = ([f32::NAN; 8], [0; 8]);
            S::arrange(mask, order, (S::F8::load(&numbers), &words), (&mut some, &mut other));
            let expected = order.into_iter().map(|lane| lane & 7).filter(|lane| mask >> lane & 1 == 1);
            let count = mask.count_ones() as usize;
            assert!(expected.clone().map(|lane| lane as f32).eq(some[..count].iter().copied()));
            assert!(expected.map(|lane| 10 + lane).eq(other[..count].iter().copied()));
        }
    }

    fn meetings<S: Simd>() {
        let words: [u32; 8] = std::array::from_fn(|i| 10 + i as u32);
        let order = [3, 0, 8 + 7, 1, 2, 16 + 6, 5, 4];
        let mut back = order;
        back.reverse();
        let enters: [f32; 8] = std::array::from_fn(|i| i as f32);
        for mask in 0..256u32 {
            // Equal counts as meeting, and what is no number does not.
            let leaves = enters
                .map(|x| if mask >> x as u32 & 1 == 1 { x } else { [x - 0.5, f32::NAN][x as usize % 2] });
            let (mut near, mut pushed) = ([f32::NAN; 8], [0; 8]);
            let of = (S::F8::load(&enters), S::F8::load(&leaves));
            let (count, last) = S::meeting(of, [order, back], &words, (&mut near, &mut pushed));
            let expected: Vec<u32> =
                order.map(|lane| lane & 7).into_iter().filter(|l| mask >> l & 1 == 1).collect();
            assert_eq!(count, expected.len());
            assert!(expected.last().is_none_or(|lane| last == 10 + lane), "{mask:b}");
            for (i, &lane) in expected.iter().enumerate().filter(|_| count > 1) {
                assert_eq!((near[i], pushed[i]), (lane as f32, 10 + lane), "{mask:b}");
            }
        }
    }

    fn columns<S: Simd>() {
        let vectors: [Vec3; 16] = std::array::from_fn(|i| Vec3::new(0.5, 1.5, 2.5) + 3.0 * i as f32);
        for (axis, column) in S::columns(&vectors).into_iter().enumerate() {
            let mut out = [0.0; 16];
            column.store(&mut out);
            assert!((0..16).all(|i| out[i] == vectors[i][axis]));
        }
    }

    fn tables<S: Simd>() {
        let of: [u32; 16] = std::array::from_fn(|i| (i * i + 3) as u32 % 16);
        let (numbers, words) =
            (std::array::from_fn(|i| 0.5 + i as f64), std::array::from_fn(|i| 7 + i as u32));
        assert_eq!(S::pick(&numbers, &of), of.map(|i| numbers[i as usize]));
        assert_eq!(S::pick_words(&words, &of), of.map(|i| words[i as usize]));
        let mut rows = [[0; 3]; 16];
        S::rows([&of, &words, &[4; 16]], &mut rows);
        assert!((0..16).all(|i| rows[i] == [of[i], words[i], 4]));
    }

    impl Job for AllOps {
        type Output = ();
        #[inline(always)]
        fn run<S: Simd>(self) {
            check::<4, S::F4>();
            check::<8, S::F8>();
            check::<16, S::F16>();
            arranged::<S>();
            meetings::<S>();
            columns::<S>();
            tables::<S>();
        }
    }

    #[test]
    fn lanes_do_what_numbers_do() {
        for tier in Tier::ALL.into_iter().filter(|tier| tier.available()) {
            tier.run(AllOps);
        }
    }
}
