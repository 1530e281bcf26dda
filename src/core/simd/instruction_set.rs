//! SIMD instruction sets, and the kernels that are compiled for each of them.

use glam::Vec3;

use crate::simd::lanes::Lanes;

/// The lanes of [`Simd::compress_intersected`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Intersected {
    /// Number of intersected lanes.
    pub count: usize,
    /// The id of the last of them, which is the nearest box.
    pub last: u32,
}

/// An instruction set: its vector types and the operations across lanes.
pub trait Simd {
    /// A lane for each triangle of a leaf block.
    type F32x4: Lanes<4>;
    /// A lane for each child of a BVH node.
    type F32x8: Lanes<8>;
    /// A lane for each ray of a ray group.
    type F32x16: Lanes<16>;

    /// Permutes `keys` and `ids` by `order` (a lane number in the lowest three bits of each), then moves the lanes
    /// whose bit is set in `mask` to the front. What follows them in the outputs is unspecified.
    #[inline(always)]
    fn permute_compress(
        mask: u32,
        order: [u32; 8],
        keys: Self::F32x8,
        ids: &[u32; 8],
        out_keys: &mut [f32; 8],
        out_ids: &mut [u32; 8],
    ) {
        let mut key_lanes = [0.0; 8];
        keys.store(&mut key_lanes);
        let mut end = 0;
        for lane in order {
            let lane = lane as usize & 7;
            (out_keys[end & 7], out_ids[end & 7]) = (key_lanes[lane], ids[lane]);
            end += (mask >> lane & 1) as usize;
        }
    }

    /// [`Simd::permute_compress`] for the boxes that a ray intersects: those with `near` ≤ `far`, by `orders[0]`.
    /// `orders[1]` is the reverse order of the lanes in use. The outputs are unspecified where only one lane or
    /// none is intersected.
    #[inline(always)]
    fn compress_intersected(
        near: Self::F32x8,
        far: Self::F32x8,
        orders: [[u32; 8]; 2],
        ids: &[u32; 8],
        out_near: &mut [f32; 8],
        out_ids: &mut [u32; 8],
    ) -> Intersected {
        let mask = near.le(far);
        let count = mask.count_ones() as usize;
        if count <= 1 {
            return Intersected { count, last: ids[mask.trailing_zeros() as usize & 7] };
        }
        Self::permute_compress(mask, orders[0], near, ids, out_near, &mut *out_ids);
        Intersected { count, last: out_ids[(count - 1) & 7] }
    }

    /// Converts sixteen vectors from array of structures to structure of arrays: x, y and z.
    #[inline(always)]
    fn deinterleave3(vectors: &[Vec3; 16]) -> [Self::F32x16; 3] {
        let mut columns = [[0.0; 16]; 3];
        for (i, v) in vectors.iter().enumerate() {
            columns[0][i] = v.x;
            columns[1][i] = v.y;
            columns[2][i] = v.z;
        }
        [Self::F32x16::load(&columns[0]), Self::F32x16::load(&columns[1]), Self::F32x16::load(&columns[2])]
    }

    /// Converts three arrays of integers from structure of arrays to array of structures.
    #[inline(always)]
    fn interleave3(columns: [&[u32; 16]; 3], to: &mut [[u32; 3]; 16]) {
        for (i, row) in to.iter_mut().enumerate() {
            *row = columns.map(|column| column[i]);
        }
    }

    /// Transposes sixteen columns into sixteen rows, whose elements are copied as bits.
    #[inline(always)]
    fn transpose16(columns: &[Self::F32x16; 16], rows: &mut [[f32; 16]; 16]) {
        for (i, column) in columns.iter().enumerate() {
            let mut lanes = [0.0; 16];
            column.store(&mut lanes);
            for (row, x) in rows.iter_mut().zip(lanes) {
                row[i] = x;
            }
        }
    }

    /// Moves the ids whose mask has bit number `bit` set to the front of `out`, in order, and returns how many there are.
    /// The lanes behind them in `out` are unspecified.
    #[inline(always)]
    fn compress_ids(ids: &[u32; 16], masks: &[u8; 16], bit: usize, out: &mut [u32; 16]) -> usize {
        let mut end = 0;
        for i in 0..16 {
            out[end & 15] = ids[i];
            end += usize::from(masks[i] >> bit & 1);
        }
        end
    }

    /// Looks up `table[index]` for each index modulo 16.
    #[inline(always)]
    fn lookup_f64(table: &[f64; 16], indices: &[u32; 16]) -> [f64; 16] {
        indices.map(|i| table[i as usize & 15])
    }

    /// Looks up `table[index]` for each index modulo 16.
    #[inline(always)]
    fn lookup_u32(table: &[u32; 16], indices: &[u32; 16]) -> [u32; 16] {
        indices.map(|i| table[i as usize & 15])
    }

    /// Repeats four numbers four times: a b c d a b c d …
    #[inline(always)]
    fn broadcast_quad(quad: &[f32; 4]) -> Self::F32x16 {
        Self::F32x16::load(&std::array::from_fn(|i| quad[i & 3]))
    }

    /// Returns the minimum of each of four vectors, each in four lanes: a a a a b b b b … No lane may be NaN.
    #[inline(always)]
    fn reduce_min_each(vectors: [Self::F32x16; 4]) -> Self::F32x16 {
        let [a, b, c, d] = vectors;
        let min = [a.reduce_min(), b.reduce_min(), c.reduce_min(), d.reduce_min()];
        Self::F32x16::load(&std::array::from_fn(|i| min[i / 4]))
    }

    /// Returns the maximum of each of four vectors, laid out as by [`Simd::reduce_min_each`].
    #[inline(always)]
    fn reduce_max_each(vectors: [Self::F32x16; 4]) -> Self::F32x16 {
        let [a, b, c, d] = vectors;
        let max = [a.reduce_max(), b.reduce_max(), c.reduce_max(), d.reduce_max()];
        Self::F32x16::load(&std::array::from_fn(|i| max[i / 4]))
    }

    /// Packs four vectors of [`Simd::reduce_min_each`]'s layout into one: a lane for each of the sixteen numbers.
    #[inline(always)]
    fn pack_quads(vectors: [Self::F32x16; 4]) -> Self::F32x16 {
        let mut lanes = [[0.0; 16]; 4];
        for (vector, lanes) in vectors.into_iter().zip(&mut lanes) {
            vector.store(lanes);
        }
        Self::F32x16::load(&std::array::from_fn(|i| lanes[i / 4][i % 4 * 4]))
    }

    /// Runs a kernel as a function of its own that is not inlined into its caller.
    fn call_outlined<K: OutlinedKernel<Self>>(kernel: K) -> K::Output
    where
        Self: Sized;
}

/// A kernel that is compiled for every instruction set. [`SimdLevel::run`] selects one at run time.
///
/// [`SimdLevel::run`]: crate::simd::SimdLevel::run
pub trait SimdKernel {
    /// The kernel's result.
    type Output;

    /// Runs the kernel. Must be `#[inline(always)]`, as everything generic over [`Simd`] that it calls: only what
    /// is inlined into the entry function of an instruction set is compiled with its instructions.
    fn run<S: Simd>(self) -> Self::Output;
}

/// A part of a [`SimdKernel`] that is compiled as a function of its own ([`Simd::call_outlined`]) to keep code
/// small.
pub trait OutlinedKernel<S: Simd> {
    /// The kernel's result.
    type Output;

    /// Runs the kernel. Must be `#[inline(always)]`, as [`SimdKernel::run`].
    fn run(self) -> Self::Output;
}

/// A kernel in scalar code over arrays (structure of arrays), which the compiler vectorises for every instruction
/// set.
pub trait AutovecKernel {
    /// Runs the kernel. Must be `#[inline(always)]`, as everything that it calls.
    fn run(self);
}

impl<K: AutovecKernel> SimdKernel for K {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        AutovecKernel::run(self);
    }
}
