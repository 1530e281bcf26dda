use super::*;

fn pixels(n: u32) -> impl Iterator<Item = UVec2> {
    (0..n * n).map(move |i| UVec2::new(i % n, i / n))
}

fn points(sampler: LowDiscrepancySampler, pixel: UVec2, pair: u32) -> Vec<[f32; 2]> {
    let at = |i, dimension| sampler.get(pixel, i, dimension);
    (0..sampler.count).map(|i| [at(i, 2 * pair), at(i, 2 * pair + 1)]).collect()
}

/// True if each of `columns` × `rows` equal rectangles has one point.
fn has_one_each(points: &[[f32; 2]], columns: u32, rows: u32) -> bool {
    let mut counts = vec![0; (columns * rows) as usize];
    for p in points {
        let (x, y) =
            ((f64::from(p[0]) * f64::from(columns)) as u32, (f64::from(p[1]) * f64::from(rows)) as u32);
        counts[(y * columns + x) as usize] += 1;
    }
    counts.iter().all(|&n| n == 1)
}

/// True if 2^k points are a (0,k,2)-net: one in each rectangle of area 2^−k that repeated halving yields.
fn is_net(points: &[[f32; 2]]) -> bool {
    let n = points.len() as u32;
    (0..=n.trailing_zeros()).all(|k| has_one_each(points, n >> k, 1 << k))
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
fn numbers_are_in_range_and_reproducible() {
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
fn every_row_and_column_of_a_pixel_has_one_sample() {
    for count in 1..140 {
        for seed in 0..4 {
            let sampler = LowDiscrepancySampler { seed, count };
            for pixel in pixels(4) {
                let points = points(sampler, pixel, 0);
                assert!(
                    has_one_each(&points, count, 1) && has_one_each(&points, 1, count),
                    "{count} {pixel}"
                );
            }
        }
    }
}

#[test]
fn film_positions_are_the_first_pair_of_dimensions() {
    for count in [1, 2, 7, 16, 1000] {
        let sampler = LowDiscrepancySampler { seed: 11, count };
        for pixel in pixels(5) {
            let index: [u32; 16] = std::array::from_fn(|i| i as u32 % count);
            let positions = sampler.film_positions(&[sampler.film_scramble(pixel); 16], &index);
            for (k, &i) in index.iter().enumerate() {
                assert_eq!(positions.map(|p| p[k]), [0, 1].map(|axis| sampler.get(pixel, i, axis)));
            }
        }
    }
}

#[test]
fn points_of_the_sequences_are_the_later_pairs_of_dimensions() {
    for count in [1, 3, 16, 1000, u32::MAX] {
        let sampler = LowDiscrepancySampler { seed: 7, count };
        for pixel in [UVec2::ZERO, UVec2::new(1279, 719), UVec2::MAX] {
            let index: [u32; 16] = std::array::from_fn(|i| i as u32 % count);
            let positions = index.map(|i| sampler.sequence_position(pixel, i).unwrap());
            for pair in [1, 2, 77, u32::MAX / 2] {
                let points = sampler.sequence_points(pair, &positions);
                for (k, &i) in index.iter().enumerate() {
                    let point = [0, 1].map(|axis| sampler.get(pixel, i, 2 * pair + axis));
                    assert_eq!((points.map(|p| p[k]), sampler.get_2d(pixel, i, pair)), (point, point));
                }
            }
            if let Some(i) = count.checked_add(5) {
                assert_eq!(sampler.sequence_position(pixel, i), None);
                assert_eq!(sampler.get_2d(pixel, i, 3), [6, 7].map(|d| sampler.get(pixel, i, d)));
            }
        }
    }
}

#[test]
fn powers_of_two_of_samples_are_nets() {
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
fn powers_of_two_of_any_count_are_nets_in_later_pairs() {
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
fn squares_of_pixels_are_nets_together_in_later_pairs() {
    for (count, side) in [(1, 2), (1, 16), (4, 2), (4, 4), (8, 2), (16, 2)] {
        let sampler = LowDiscrepancySampler { seed: 9, count };
        for corner in pixels(3).map(|p| p * side) {
            let all: Vec<_> = pixels(side).flat_map(|p| points(sampler, corner + p, 1)).collect();
            assert!(is_net(&all), "{count} {side} {corner}");
        }
    }
}

#[test]
fn all_orders_of_rows_are_equally_likely() {
    // Four columns have 3 nodes and so 2³ orders, eight have 7 nodes.
    for (count, orders) in [(4, 8), (8, 128)] {
        let mut found = std::collections::BTreeMap::new();
        for i in 0..100 * orders {
            let row = |column| scrambled_rows(&[column], count, &[hash(i)])[0];
            *found.entry((0..count).map(row).collect::<Vec<_>>()).or_insert(0) += 1;
        }
        assert_eq!(found.len() as u64, orders);
        assert!(found.values().all(|n| (50..150).contains(n)), "{found:?}");
    }
}

#[test]
fn every_dimension_is_uniform_also_past_the_count() {
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
            // Film samples stay near the centres of their strata, so tenths have different numbers of them.
            let even = |&n: &u32| (f64::from(n) / mean - 1.0).abs() < 0.15;
            assert!(dimension < 2 || tenths.iter().all(even), "{count} {dimension} {tenths:?}");
            let sum: f64 = tenths.iter().zip(0u8..).map(|(&n, k)| f64::from(n) * (f64::from(k) - 4.5)).sum();
            assert!(sum.abs() / (10.0 * mean * 10.0) < 0.01, "{count} {dimension} {tenths:?}");
        }
    }
}

#[test]
fn pixels_pairs_seeds_and_sets_are_uncorrelated() {
    for count in [2, 3, 4, 16] {
        let sampler = LowDiscrepancySampler { seed: 1, count };
        let reseeded = LowDiscrepancySampler { seed: 2, count };
        let all = || pixels(128).flat_map(|p| (0..count).map(move |i| (p, i)));
        for a in 0..6 {
            for b in 0..a {
                let r = correlation(all().map(|(p, i)| (sampler.get(p, i, a), sampler.get(p, i, b))));
                // The two axes of a net are nearly independent.
                let most = if a / 2 == b / 2 { 0.06 } else { 0.03 };
                assert!(r.abs() < most, "count {count}, dimensions {a} and {b}: {r}");
            }
            let other = correlation(all().map(|(p, i)| (sampler.get(p, i, a), reseeded.get(p, i, a))));
            let later = correlation(all().map(|(p, i)| (sampler.get(p, i, a), sampler.get(p, i + count, a))));
            assert!(other.abs() < 0.03 && later.abs() < 0.03, "count {count}, dimension {a}");
            for step in [UVec2::X, UVec2::Y, UVec2::ONE, 2 * UVec2::X, 8 * UVec2::Y] {
                let near =
                    correlation(all().map(|(p, i)| (sampler.get(p, i, a), sampler.get(p + step, i, a))));
                // In later pairs neighbours fill each other's gaps: a negative correlation.
                let least = if a < 2 { -0.03 } else { -0.3 };
                assert!((least..0.03).contains(&near), "count {count}, dimension {a}, {step}: {near}");
            }
        }
    }
}
