//! Every operation on every tier that runs here.

use crate::simd::*;

/// All of them.
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
    assert_eq!(L::renumber(&std::array::from_fn(|i| i as u32), (2, 5), &mut numbers), 0x3c & mask_of::<N>());
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
        let leaves =
            enters.map(|x| if mask >> x as u32 & 1 == 1 { x } else { [x - 0.5, f32::NAN][x as usize % 2] });
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
    let (numbers, words) = (std::array::from_fn(|i| 0.5 + i as f64), std::array::from_fn(|i| 7 + i as u32));
    assert_eq!(S::pick(&numbers, &of), of.map(|i| numbers[i as usize]));
    assert_eq!(S::pick_words(&words, &of), of.map(|i| words[i as usize]));
    let mut rows = [[0; 3]; 16];
    S::rows([&of, &words, &[4; 16]], &mut rows);
    assert!((0..16).all(|i| rows[i] == [of[i], words[i], 4]));
}

/// Numbers by fours.
fn fours<S: Simd>() {
    let out = |x: S::F16| {
        let mut to = [0.0; 16];
        x.store(&mut to);
        to
    };
    let four = [3.0, -1.0, 7.0, 2.0];
    assert_eq!(out(S::four_times(&four)), std::array::from_fn(|i| four[i % 4]));
    // Every lane is the least and the greatest once.
    for lane in 0..16 {
        let each: [[f32; 16]; 4] = std::array::from_fn(|g| {
            std::array::from_fn(|i| if i == (lane + g) % 16 { g as f32 - 9.0 } else { (i % 3) as f32 })
        });
        let (low, high) = (each.map(|x| S::F16::load(&x)), each.map(|x| S::F16::load(&x.map(|x| -x))));
        assert_eq!(out(S::least_of_each(low)), std::array::from_fn(|i| (i / 4) as f32 - 9.0));
        assert_eq!(out(S::greatest_of_each(high)), std::array::from_fn(|i| 9.0 - (i / 4) as f32));
    }
    let fours = [0, 1, 2, 3].map(|q| S::F16::load(&std::array::from_fn(|i| (4 * q + i / 4) as f32)));
    assert_eq!(out(S::gathered(fours)), std::array::from_fn(|i| i as f32));
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
        fours::<S>();
    }
}

#[test]
fn lanes_do_what_numbers_do() {
    for tier in Tier::ALL.into_iter().filter(|tier| tier.available()) {
        tier.run(AllOps);
    }
}
