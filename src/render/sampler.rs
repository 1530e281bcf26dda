//! Where in a pixel its samples lie.

use glam::UVec2;

/// Sample positions, without state: a function of pixel, index and dimension, and of no frame
/// number, so that the noise of a turntable stands still.
pub trait Sampler: Sync {
    /// A number in 0…1 for a dimension of a sample of a pixel.
    fn get(&self, pixel: UVec2, index: u32, dimension: u32) -> f32;
}

/// Jittered strata: the pixel is cut into rows, the rows into cells, of one area each, and each
/// sample lies somewhere in its cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stratified {
    /// Varies the jitter.
    pub seed: u32,
    /// Samples for each pixel.
    pub count: u32,
}

impl Sampler for Stratified {
    fn get(&self, pixel: UVec2, index: u32, dimension: u32) -> f32 {
        let jitter = hash(self.seed, pixel, index, dimension);
        if dimension > 1 {
            return jitter as f32;
        }
        let cell = Cell::of(index, self.count.max(1));
        let at = if dimension == 0 { cell.x + jitter * cell.width } else { cell.y + jitter * cell.height };
        (at as f32).min(1.0f32.next_down())
    }
}

/// One stratum of the unit square.
struct Cell {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

impl Cell {
    /// Any count works: rows hold `count / rows` cells, the first ones one more, and a row is as
    /// high as it has cells, so that all areas are 1/count.
    fn of(index: u32, count: u32) -> Cell {
        let rows = f64::from(count).sqrt().round().max(1.0) as u32;
        let (base, longer) = (count / rows, count % rows);
        // The first `longer` rows have base + 1 cells.
        let in_longer = longer * (base + 1);
        let (row, column, cells) = if index < in_longer {
            (index / (base + 1), index % (base + 1), base + 1)
        } else {
            let rest = index - in_longer;
            (longer + rest / base, rest % base, base)
        };
        let before = row * base + row.min(longer);
        let n = f64::from(count);
        Cell {
            x: f64::from(column) / f64::from(cells),
            y: f64::from(before) / n,
            width: 1.0 / f64::from(cells),
            height: f64::from(cells) / n,
        }
    }
}

/// A hash to 0…1 (the finaliser of SplitMix64 over the packed arguments).
fn hash(seed: u32, pixel: UVec2, index: u32, dimension: u32) -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    for word in [seed, pixel.x, pixel.y, index, dimension] {
        state = (state ^ u64::from(word)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state ^= state >> 29;
        state = state.wrapping_mul(0x94d0_49bb_1331_11eb);
        state ^= state >> 32;
    }
    (state >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_of_any_count_share_the_square_evenly() {
        for count in 1..40 {
            let area: f64 = (0..count).map(|i| Cell::of(i, count)).map(|c| c.width * c.height).sum();
            assert!((area - 1.0).abs() < 1e-12, "{count}");
            for i in 0..count {
                let c = Cell::of(i, count);
                assert!((c.width * c.height * f64::from(count) - 1.0).abs() < 1e-12);
                assert!(c.x + c.width < 1.0 + 1e-12 && c.y + c.height < 1.0 + 1e-12);
            }
        }
    }

    #[test]
    fn samples_are_even_and_repeatable() {
        let sampler = Stratified { seed: 1, count: 4 };
        let mut mean = 0.0;
        for i in 0..10_000u32 {
            let v = sampler.get(UVec2::new(i % 100, i / 100), i % 4, 0);
            assert!((0.0..1.0).contains(&v));
            mean += f64::from(v) / 10_000.0;
        }
        assert!((mean - 0.5).abs() < 0.01);
        let again = || sampler.get(UVec2::new(3, 4), 2, 1);
        assert_eq!(again(), again());
    }
}
