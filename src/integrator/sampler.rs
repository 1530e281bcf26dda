//! Where in a pixel its samples lie.

use glam::UVec2;

/// Sample positions, without state: a function of pixel, index and dimension, and of no frame
/// number, so that the noise of a turntable stands still.
pub trait Sampler: Sync {
    /// A number in 0…1, never 1, for a dimension of a sample of a pixel.
    fn get(&self, pixel: UVec2, index: u32, dimension: u32) -> f32;
}

/// Points of low discrepancy, scrambled anew in each pixel. Dimensions go in pairs.
///
/// The first pair, the place on the film, is Hammersley's set: cut into `count` rows and `count`
/// columns, the pixel has one sample in each row and in each column, whatever the count; where the
/// count is a power of two, also one in every other rectangle of area 1/count that halving yields.
/// The pairing of rows and columns is Owen's nested scrambling (“Randomly Permuted (t,m,s)-Nets and
/// (t,s)-Sequences”, 1995). Of what was measured for edges, lines, floors and zone plates, at all
/// counts and filters, this has the least error; docs/explanation/antialiasing.md has the table.
///
/// The other pairs (lights, directions, lens) are Sobol's (0,2)-sequence, each pair scrambled and
/// shuffled on its own by hashes (Burley, “Practical Hash-based Owen Scrambling”, JCGT 9(4), 2020).
/// All pixels share the sequence along Morton's curve (Ahmed and Wonka, “Screen-Space Blue-Noise
/// Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels”, 2020): what light
/// falls on neighbours is much the same, and so their errors cancel to the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LowDiscrepancySampler {
    /// Varies the scrambling.
    pub seed: u32,
    /// Samples for each pixel.
    pub count: u32,
}

impl LowDiscrepancySampler {
    /// What makes a pixel's places on the film other than its neighbour's.
    #[inline(always)]
    pub(crate) fn flips(&self, pixel: UVec2) -> u64 {
        mix(mix(pack(self.seed, 0) ^ mix(0)) ^ pack(pixel.x, pixel.y))
    }

    /// The places of N samples on the film, x and y: what [`Sampler::get`] says of dimensions 0 and 1,
    /// for indices below the count and the flips of their pixels.
    #[inline(always)]
    pub(crate) fn on_film<const N: usize>(&self, flips: &[u64; N], index: &[u32; N]) -> [[f32; N]; 2] {
        on_film(flips, self.count.max(1), index)
    }
}

/// How much of its row and column a film sample wanders over. The middle alone has the least error;
/// a little more costs nothing measurable and keeps samples off lines that scenes are modelled on.
const WANDER: f64 = 0.25;

impl Sampler for LowDiscrepancySampler {
    fn get(&self, pixel: UVec2, index: u32, dimension: u32) -> f32 {
        let count = self.count.max(1);
        // Past the count begins another set. Divisions are slow and seldom needed.
        let (set, index) = if index < count { (0, index) } else { (index / count, index % count) };
        let (pair, axis) = (dimension / 2, dimension % 2);
        let key = mix(pack(self.seed, set) ^ mix(u64::from(pair)));
        match pair {
            0 => on_film(&[mix(key ^ pack(pixel.x, pixel.y))], count, &[index])[axis as usize][0],
            _ => over_screen(key, pixel, count, index, axis),
        }
    }
}

/// Hammersley's set, other in each pixel by `flips`: N places of it at once.
#[inline(always)]
fn on_film<const N: usize>(flips: &[u64; N], count: u32, index: &[u32; N]) -> [[f32; N]; 2] {
    let mut column = [0; N];
    for i in 0..N {
        // Which index has which column differs too, or else one index would lean to one side all over
        // the screen.
        let first = (((flips[i] >> 32) * u64::from(count)) >> 32) as u32;
        let before_end = count - first;
        column[i] = if index[i] < before_end { first.wrapping_add(index[i]) } else { index[i] - before_end };
    }
    let row = scrambled_rows(&column, count, flips);
    let per_count = 1.0 / f64::from(count);
    let mut places = [[0.0; N]; 2];
    for i in 0..N {
        let wander = mix(flips[i] ^ pack(column[i], 0));
        let at = |stratum: u32, wander: u32| {
            let off = f64::from(wander) * (1.0 / (1u64 << 32) as f64) - 0.5;
            let at = (f64::from(stratum) + 0.5 + WANDER * off) * per_count;
            (at as f32).min(1.0f32.next_down())
        };
        let (one, other) = (at(column[i], (wander >> 32) as u32), at(row[i], wander as u32));
        // Bit 0 is free: it lets neither axis be the better one.
        let straight = flips[i] & 1 == 0;
        places[0][i] = if straight { one } else { other };
        places[1][i] = if straight { other } else { one };
    }
    places
}

/// The rows of columns: each one's place among all when these are ordered by their binary digits
/// from the lowest up, and at each node of that tree a random bit says which half comes first.
/// Halves of a count that is no power of two are uneven, and rows stay one for each column.
#[inline(always)]
fn scrambled_rows<const N: usize>(column: &[u32; N], count: u32, flips: &[u64; N]) -> [u32; N] {
    let (mut flips, mut rest) = (*flips, *column);
    let (mut row, mut node, mut left) = ([0; N], [1u32; N], [count; N]);
    let levels = u32::BITS - (count - 1).leading_zeros();
    for level in 0..levels {
        // A word has the bits of six levels.
        if level > 0 && level % 6 == 0 {
            for i in 0..N {
                flips[i] = mix(flips[i] ^ u64::from(node[i]));
                node[i] = 1;
            }
        }
        for i in 0..N {
            let odd = rest[i] & 1;
            let flip = (flips[i] >> node[i]) as u32 & 1;
            // The even half has one more when they differ. One alone has no halves.
            let own = if left[i] > 1 { left[i] / 2 + (left[i] & (odd ^ 1)) } else { left[i] };
            row[i] += (odd ^ flip) * (left[i] - own);
            (left[i], rest[i], node[i]) = (own, rest[i] / 2, 2 * node[i] + odd);
        }
    }
    row
}

/// One Sobol' sequence for all pixels.
fn over_screen(key: u64, pixel: UVec2, count: u32, index: u32, axis: u32) -> f32 {
    let bits = u32::BITS - (count - 1).leading_zeros();
    let place = (morton(pixel) << bits) | u64::from(index);
    // Shuffled from the highest digit down: pixels that share a quad, a quad of quads, and so on,
    // still share a whole stretch of the sequence.
    let index = scramble(place.reverse_bits(), key).reverse_bits();
    // From here the lowest bit is the first binary place.
    let digits = if axis == 0 { index } else { pascal(index) };
    let places = (scramble(digits, mix(key ^ u64::from(axis))) as u32).reverse_bits();
    (places >> 8) as f32 / (1u32 << 24) as f32
}

/// Owen's scrambling, nearly: each bit is flipped or not depending on the seed and on the bits
/// below it, for no step carries anything downwards. The constants are random and even or odd as
/// each step needs to stay invertible.
fn scramble(mut x: u64, seed: u64) -> u64 {
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c_2e1a_9d3e);
    x = x.wrapping_mul((seed >> 32) | 1);
    x ^= x.wrapping_mul(0xb823_10d5_94c6_e672);
    x = x.wrapping_mul(0xe9b5_dba5_8189_dbbd);
    x ^ x.wrapping_mul(0x4d1a_7f36_c722_d91a)
}

/// The second Sobol' dimension: its matrix is Pascal's triangle modulo 2, and an entry is 1 where
/// the bits of the one index contain those of the other, so each bit of the index is one step.
fn pascal(mut v: u64) -> u64 {
    v ^= v >> 32;
    v ^= (v >> 16) & 0x0000_ffff_0000_ffff;
    v ^= (v >> 8) & 0x00ff_00ff_00ff_00ff;
    v ^= (v >> 4) & 0x0f0f_0f0f_0f0f_0f0f;
    v ^= (v >> 2) & 0x3333_3333_3333_3333;
    v ^ ((v >> 1) & 0x5555_5555_5555_5555)
}

/// The pixel's number along Morton's curve: the bits of x and y in turn.
pub(crate) fn morton(pixel: UVec2) -> u64 {
    let spread = |v: u32| {
        let mut v = u64::from(v);
        v = (v | (v << 16)) & 0x0000_ffff_0000_ffff;
        v = (v | (v << 8)) & 0x00ff_00ff_00ff_00ff;
        v = (v | (v << 4)) & 0x0f0f_0f0f_0f0f_0f0f;
        v = (v | (v << 2)) & 0x3333_3333_3333_3333;
        (v | (v << 1)) & 0x5555_5555_5555_5555
    };
    spread(pixel.x) | (spread(pixel.y) << 1)
}

#[inline(always)]
fn pack(high: u32, low: u32) -> u64 {
    (u64::from(high) << 32) | u64::from(low)
}

/// A hash (a step of SplitMix64).
#[inline(always)]
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(n: u32) -> impl Iterator<Item = UVec2> {
        (0..n * n).map(move |i| UVec2::new(i % n, i / n))
    }

    fn points(sampler: LowDiscrepancySampler, pixel: UVec2, pair: u32) -> Vec<[f32; 2]> {
        let at = |i, dimension| sampler.get(pixel, i, dimension);
        (0..sampler.count).map(|i| [at(i, 2 * pair), at(i, 2 * pair + 1)]).collect()
    }

    /// Whether each of `columns` × `rows` equal rectangles has one point.
    fn one_each(points: &[[f32; 2]], columns: u32, rows: u32) -> bool {
        let mut seen = vec![0; (columns * rows) as usize];
        for p in points {
            let (x, y) =
                ((f64::from(p[0]) * f64::from(columns)) as u32, (f64::from(p[1]) * f64::from(rows)) as u32);
            seen[(y * columns + x) as usize] += 1;
        }
        seen.iter().all(|&n| n == 1)
    }

    /// Whether the points, 2^k of them, are one in each rectangle of their share of the area that
    /// halving yields.
    fn is_net(points: &[[f32; 2]]) -> bool {
        let n = points.len() as u32;
        (0..=n.trailing_zeros()).all(|k| one_each(points, n >> k, 1 << k))
    }

    fn correlation(pairs: impl Iterator<Item = (f32, f32)>) -> f64 {
        let (mut n, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0);
        for (x, y) in pairs {
            let (x, y) = (f64::from(x) - 0.5, f64::from(y) - 0.5);
            (n, xx, yy, xy) = (n + 1.0, xx + x * x, yy + y * y, xy + x * y);
        }
        assert!(n > 10_000.0);
        xy / (xx * yy).sqrt()
    }

    #[test]
    fn numbers_are_in_range_and_repeatable() {
        for count in [0, 1, 2, 3, 7, 64, 1000, u32::MAX] {
            let sampler = LowDiscrepancySampler { seed: 5, count };
            for pixel in [UVec2::ZERO, UVec2::new(1279, 719), UVec2::new(70_000, 3), UVec2::MAX] {
                for index in (0..40).chain([1000, u32::MAX]) {
                    for dimension in (0..8).chain([u32::MAX]) {
                        let v = sampler.get(pixel, index, dimension);
                        assert!((0.0..1.0).contains(&v), "{count} {pixel} {index} {dimension}");
                        assert_eq!(v, sampler.get(pixel, index, dimension));
                    }
                }
            }
        }
    }

    #[test]
    fn on_the_film_each_row_and_column_has_one_sample_for_any_count() {
        for count in 1..140 {
            for seed in 0..4 {
                let sampler = LowDiscrepancySampler { seed, count };
                for pixel in pixels(4) {
                    let points = points(sampler, pixel, 0);
                    assert!(one_each(&points, count, 1) && one_each(&points, 1, count), "{count} {pixel}");
                }
            }
        }
    }

    #[test]
    fn places_on_the_film_are_the_first_pair() {
        for count in [1, 2, 7, 16, 1000] {
            let sampler = LowDiscrepancySampler { seed: 11, count };
            for pixel in pixels(5) {
                let index: [u32; 16] = std::array::from_fn(|i| i as u32 % count);
                let places = sampler.on_film(&[sampler.flips(pixel); 16], &index);
                for (k, &i) in index.iter().enumerate() {
                    assert_eq!(places.map(|p| p[k]), [0, 1].map(|axis| sampler.get(pixel, i, axis)));
                }
            }
        }
    }

    #[test]
    fn powers_of_two_are_nets() {
        for count in [1, 2, 4, 8, 16, 64, 256, 1024] {
            let sampler = LowDiscrepancySampler { seed: 3, count };
            for pixel in pixels(5) {
                for pair in 0..4 {
                    assert!(is_net(&points(sampler, pixel, pair)), "{count} {pixel} {pair}");
                }
            }
        }
    }

    #[test]
    fn after_the_film_powers_of_two_of_any_count_are_nets() {
        for count in [5, 6, 7, 13, 100] {
            let sampler = LowDiscrepancySampler { seed: 3, count };
            for pixel in pixels(5) {
                for n in (0..7).map(|k| 1 << k).filter(|&n| n <= count) {
                    assert!(is_net(&points(sampler, pixel, 2)[..n as usize]), "{count} {pixel} {n}");
                }
            }
        }
    }

    #[test]
    fn after_the_film_squares_of_pixels_are_nets_together() {
        for (count, side) in [(1, 2), (1, 16), (4, 2), (4, 4), (8, 2), (16, 2)] {
            let sampler = LowDiscrepancySampler { seed: 9, count };
            for corner in pixels(3).map(|p| p * side) {
                let all: Vec<_> = pixels(side).flat_map(|p| points(sampler, corner + p, 1)).collect();
                assert!(is_net(&all), "{count} {side} {corner}");
            }
        }
    }

    #[test]
    fn every_scrambling_of_the_film_is_as_likely() {
        // Four columns have 3 nodes and 8 orders, eight have 7 and 128.
        for (count, orders) in [(4, 8), (8, 128)] {
            let mut found = std::collections::BTreeMap::new();
            for i in 0..100 * orders {
                let row = |column| scrambled_rows(&[column], count, &[mix(i)])[0];
                *found.entry((0..count).map(row).collect::<Vec<_>>()).or_insert(0) += 1;
            }
            assert_eq!(found.len() as u64, orders);
            assert!(found.values().all(|n| (50..150).contains(n)), "{found:?}");
        }
    }

    #[test]
    fn means_are_even_in_every_dimension_and_past_the_count() {
        for (count, first) in [(1, 0), (3, 0), (4, 0), (5, 5), (6, 12)] {
            let sampler = LowDiscrepancySampler { seed: 1, count };
            for dimension in 0..8 {
                let mut tenths = [0u32; 10];
                for pixel in pixels(64) {
                    for i in first..first + count {
                        tenths[(sampler.get(pixel, i, dimension) * 10.0) as usize] += 1;
                    }
                }
                let mean = 409.6 * f64::from(count);
                // On the film the samples stay about the middles of strata, which tenths are not.
                let even = |&n: &u32| (f64::from(n) / mean - 1.0).abs() < 0.15;
                assert!(dimension < 2 || tenths.iter().all(even), "{count} {dimension} {tenths:?}");
                let sum: f64 =
                    tenths.iter().zip(0u8..).map(|(&n, k)| f64::from(n) * (f64::from(k) - 4.5)).sum();
                assert!(sum.abs() / (10.0 * mean * 10.0) < 0.01, "{count} {dimension} {tenths:?}");
            }
        }
    }

    #[test]
    fn pixels_pairs_seeds_and_sets_have_nothing_in_common() {
        for count in [2, 3, 4, 16] {
            let sampler = LowDiscrepancySampler { seed: 1, count };
            let reseeded = LowDiscrepancySampler { seed: 2, count };
            let all = || pixels(128).flat_map(|p| (0..count).map(move |i| (p, i)));
            for a in 0..6 {
                for b in 0..a {
                    let r = correlation(all().map(|(p, i)| (sampler.get(p, i, a), sampler.get(p, i, b))));
                    // The axes of one net are not independent, but nearly.
                    let most = if a / 2 == b / 2 { 0.06 } else { 0.03 };
                    assert!(r.abs() < most, "count {count}, dimensions {a} and {b}: {r}");
                }
                let other = correlation(all().map(|(p, i)| (sampler.get(p, i, a), reseeded.get(p, i, a))));
                let later =
                    correlation(all().map(|(p, i)| (sampler.get(p, i, a), sampler.get(p, i + count, a))));
                assert!(other.abs() < 0.03 && later.abs() < 0.03, "count {count}, dimension {a}");
                for step in [UVec2::X, UVec2::Y, UVec2::ONE, 2 * UVec2::X, 8 * UVec2::Y] {
                    let near =
                        correlation(all().map(|(p, i)| (sampler.get(p, i, a), sampler.get(p + step, i, a))));
                    // After the film, neighbours fill each other's gaps, and so lean apart.
                    let least = if a < 2 { -0.03 } else { -0.3 };
                    assert!((least..0.03).contains(&near), "count {count}, dimension {a}, {step}: {near}");
                }
            }
        }
    }
}
