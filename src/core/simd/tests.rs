//! Every SIMD operation against scalar code, on every level that this processor supports.

use glam::Vec3;

use crate::simd::instruction_set::Intersected;
use crate::simd::{Lanes, Simd, SimdKernel, SimdLevel};

/// Lanes in a permuted order. Only the lowest three bits of each number count.
const ORDER: [u32; 8] = [3, 0, 8 + 7, 1, 2, 16 + 6, 5, 4];

fn all_lanes<const N: usize>() -> u32 {
    (1u64 << N).wrapping_sub(1) as u32
}

fn to_array<const N: usize, L: Lanes<N>>(lanes: L) -> [f32; N] {
    let mut to = [0.0; N];
    lanes.store(&mut to);
    to
}

/// Lanes of [`ORDER`] whose bit is set in `mask`.
fn ordered_lanes(mask: u32) -> Vec<u32> {
    ORDER.into_iter().map(|lane| lane & 7).filter(|lane| mask >> lane & 1 == 1).collect()
}

fn check_lanes<const N: usize, L: Lanes<N>>() {
    let a: [f32; N] = std::array::from_fn(|i| i as f32 - 2.5);
    let b: [f32; N] = std::array::from_fn(|i| 1.5 - (i * i % 7) as f32);
    let x = L::load(&a);
    let y = L::load(&b);
    let each = |f: &dyn Fn(usize) -> f32| std::array::from_fn::<f32, N, _>(f);
    let bits = |f: &dyn Fn(usize) -> bool| (0..N).map(|i| u32::from(f(i)) << i).sum::<u32>();
    assert_eq!(to_array(x + y), each(&|i| a[i] + b[i]));
    assert_eq!(to_array(x - y), each(&|i| a[i] - b[i]));
    assert_eq!(to_array(x * y), each(&|i| a[i] * b[i]));
    assert_eq!(to_array(x / y), each(&|i| a[i] / b[i]));
    assert_eq!(to_array(x.mul_add(y, x)), each(&|i| a[i] * b[i] + a[i]));
    assert_eq!(to_array(x.mul_sub(y, x)), each(&|i| a[i] * b[i] - a[i]));
    assert_eq!(to_array(x.min(y)), each(&|i| a[i].min(b[i])));
    assert_eq!(to_array(x.max(y)), each(&|i| a[i].max(b[i])));
    assert_eq!(to_array(x.abs()), each(&|i| a[i].abs()));
    assert_eq!(to_array(x.xor_sign(y)), each(&|i| if b[i] < 0.0 { -a[i] } else { a[i] }));
    assert_eq!(x.reduce_min(), a[0]);
    assert_eq!(x.reduce_max(), a[N - 1]);
    assert_eq!(x.reduce_sum(), a.iter().sum::<f32>());
    assert_eq!(x.lt(y), bits(&|i| a[i] < b[i]));
    assert_eq!(x.le(x), all_lanes::<N>());
    let mask = 0x5a5a_3c69 & all_lanes::<N>();
    assert_eq!(to_array(x.select(mask, y)), each(&|i| if mask >> i & 1 == 1 { a[i] } else { b[i] }));
    assert!(to_array(y.rcp()).iter().zip(b).all(|(r, b)| (r * b - 1.0).abs() < 3e-7 || b == 0.0));
    let powers = to_array(y.floor_power_of_two());
    assert!(
        powers.iter().zip(b).all(|(&p, b)| b == 0.0 || (b.abs() >= p && b.abs() < 2.0 * p)),
        "{powers:?}"
    );
    assert!(powers.iter().all(|p| p.to_bits() & 0x007f_ffff == 0));
    let nan = L::splat(f32::NAN);
    assert_eq!(to_array(nan.min(x)), a);
    assert_eq!(to_array(nan.max(x)), a);
    assert_eq!([nan.lt(x), x.lt(nan), nan.le(nan)], [0; 3]);
}

fn check_integers<const N: usize, L: Lanes<N>>() {
    let bits = |f: &dyn Fn(usize) -> bool| (0..N).map(|i| u32::from(f(i)) << i).sum::<u32>();
    let mut ids: [u32; N] = std::array::from_fn(|i| i as u32 % 3);
    assert_eq!(L::eq_u32(&ids, 2), bits(&|i| i % 3 == 2));
    assert_eq!(L::lt_u32(&ids, 2), bits(&|i| i % 3 != 2));
    let mask = 0x5a5a_3c69 & all_lanes::<N>();
    L::masked_fill(mask, &mut ids, 9);
    assert!((0..N).all(|i| ids[i] == if mask >> i & 1 == 1 { 9 } else { i as u32 % 3 }));
    let mut numbers = [9; N];
    let ascending = std::array::from_fn(|i| i as u32);
    assert_eq!(L::renumber_quad(&ascending, 2, 5, &mut numbers), 0x3c & all_lanes::<N>());
    assert!((0..N).all(|i| numbers[i] == if (2..6).contains(&i) { 3 + i as u32 } else { 9 }));
}

fn check_permute_compress<S: Simd>() {
    let keys: [f32; 8] = std::array::from_fn(|i| i as f32);
    let ids: [u32; 8] = std::array::from_fn(|i| 10 + i as u32);
    for mask in 0..256 {
        let mut out_keys = [f32::NAN; 8];
        let mut out_ids = [0; 8];
        S::permute_compress(mask, ORDER, S::F32x8::load(&keys), &ids, &mut out_keys, &mut out_ids);
        for (i, lane) in ordered_lanes(mask).into_iter().enumerate() {
            assert_eq!((out_keys[i], out_ids[i]), (lane as f32, 10 + lane), "{mask:b}");
        }
    }
}

fn check_compress_intersected<S: Simd>() {
    let ids: [u32; 8] = std::array::from_fn(|i| 10 + i as u32);
    let mut reverse = ORDER;
    reverse.reverse();
    let near: [f32; 8] = std::array::from_fn(|i| i as f32);
    for mask in 0..256u32 {
        // near = far counts as intersected, NaN does not.
        let far =
            near.map(|x| if mask >> x as u32 & 1 == 1 { x } else { [x - 0.5, f32::NAN][x as usize % 2] });
        let mut out_near = [f32::NAN; 8];
        let mut out_ids = [0; 8];
        let near = S::F32x8::load(&near);
        let far = S::F32x8::load(&far);
        let Intersected { count, last } =
            S::compress_intersected(near, far, [ORDER, reverse], &ids, &mut out_near, &mut out_ids);
        let expected = ordered_lanes(mask);
        assert_eq!(count, expected.len());
        assert!(expected.last().is_none_or(|lane| last == 10 + lane), "{mask:b}");
        for (i, &lane) in expected.iter().enumerate().filter(|_| count > 1) {
            assert_eq!((out_near[i], out_ids[i]), (lane as f32, 10 + lane), "{mask:b}");
        }
    }
}

fn check_interleaving<S: Simd>() {
    let vectors: [Vec3; 16] = std::array::from_fn(|i| Vec3::new(0.5, 1.5, 2.5) + 3.0 * i as f32);
    for (axis, column) in S::deinterleave3(&vectors).into_iter().enumerate() {
        let column = to_array(column);
        assert!((0..16).all(|i| column[i] == vectors[i][axis]));
    }
    let a: [u32; 16] = std::array::from_fn(|i| (i * i + 3) as u32 % 16);
    let b = std::array::from_fn(|i| 7 + i as u32);
    let mut rows = [[0; 3]; 16];
    S::interleave3([&a, &b, &[4; 16]], &mut rows);
    assert!((0..16).all(|i| rows[i] == [a[i], b[i], 4]));
}

fn check_transpose<S: Simd>() {
    // Also bits that are no numbers.
    let element = |row: usize, column: usize| f32::from_bits(0x7fa0_0000 + (16 * row + column) as u32);
    let columns: [S::F32x16; 16] =
        std::array::from_fn(|column| S::F32x16::load(&std::array::from_fn(|row| element(row, column))));
    let mut rows = [[0.0; 16]; 16];
    S::transpose16(&columns, &mut rows);
    for (row, elements) in rows.iter().enumerate() {
        for (column, x) in elements.iter().enumerate() {
            assert_eq!(x.to_bits(), element(row, column).to_bits(), "row {row}, column {column}");
        }
    }
}

fn check_compress_ids<S: Simd>() {
    let ids: [u32; 16] = std::array::from_fn(|i| 100 + i as u32);
    for n in 0..2000u32 {
        let masks: [u8; 16] = std::array::from_fn(|i| (n.wrapping_mul(0x9e37_79b9) >> i) as u8);
        for bit in 0..8 {
            let expected: Vec<u32> = (0..16).filter(|&i| masks[i] >> bit & 1 == 1).map(|i| ids[i]).collect();
            let mut out = [0; 16];
            let count = S::compress_ids(&ids, &masks, bit, &mut out);
            assert_eq!(out[..count], expected, "{masks:?} {bit}");
        }
    }
}

fn check_table_lookup<S: Simd>() {
    let indices: [u32; 16] = std::array::from_fn(|i| (i * i + 3) as u32 % 16);
    let numbers = std::array::from_fn(|i| 0.5 + i as f64);
    let words = std::array::from_fn(|i| 7 + i as u32);
    assert_eq!(S::lookup_f64(&numbers, &indices), indices.map(|i| numbers[i as usize]));
    assert_eq!(S::lookup_u32(&words, &indices), indices.map(|i| words[i as usize]));
}

fn check_quads<S: Simd>() {
    let quad = [3.0, -1.0, 7.0, 2.0];
    assert_eq!(to_array(S::broadcast_quad(&quad)), std::array::from_fn(|i| quad[i % 4]));
    // Every lane is the minimum and the maximum once.
    for lane in 0..16 {
        let vectors: [[f32; 16]; 4] = std::array::from_fn(|g| {
            std::array::from_fn(|i| if i == (lane + g) % 16 { g as f32 - 9.0 } else { (i % 3) as f32 })
        });
        let low = vectors.map(|x| S::F32x16::load(&x));
        let high = vectors.map(|x| S::F32x16::load(&x.map(|x| -x)));
        assert_eq!(to_array(S::reduce_min_each(low)), std::array::from_fn(|i| (i / 4) as f32 - 9.0));
        assert_eq!(to_array(S::reduce_max_each(high)), std::array::from_fn(|i| 9.0 - (i / 4) as f32));
    }
    let quads = [0, 1, 2, 3].map(|q| S::F32x16::load(&std::array::from_fn(|i| (4 * q + i / 4) as f32)));
    assert_eq!(to_array(S::pack_quads(quads)), std::array::from_fn(|i| i as f32));
}

struct CheckAllKernel;

impl SimdKernel for CheckAllKernel {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        check_lanes::<4, S::F32x4>();
        check_lanes::<8, S::F32x8>();
        check_lanes::<16, S::F32x16>();
        check_integers::<4, S::F32x4>();
        check_integers::<8, S::F32x8>();
        check_integers::<16, S::F32x16>();
        check_permute_compress::<S>();
        check_compress_intersected::<S>();
        check_interleaving::<S>();
        check_transpose::<S>();
        check_compress_ids::<S>();
        check_table_lookup::<S>();
        check_quads::<S>();
    }
}

#[test]
fn all_levels_agree_with_scalar_code() {
    for level in SimdLevel::ALL.into_iter().filter(|level| level.is_supported()) {
        level.run(CheckAllKernel);
    }
}
