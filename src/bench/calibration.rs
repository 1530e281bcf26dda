//! The workload that everything is measured against.

use std::hint::black_box;

use super::scenes::noise::Random;

/// Words that memory is read from: 8 MiB, more than a processor's second cache and about what the trees
/// of a hundred thousand triangles take.
const WORDS: usize = 1 << 21;
/// Rounds of arithmetic, about a millisecond's worth.
const ROUNDS: usize = 25_000;
/// Reads of each chain, about half a millisecond's worth.
const READS: usize = 5_000;
/// Chains of reads that go on side by side, as rays leave several in flight.
const CHAINS: usize = 4;
/// Numbers worked on side by side.
const LANES: usize = 8;

/// A fixed amount of work of the kind that tracing is: integers, products and comparisons of floats, and
/// reads that wait for one another. What it takes tells how fast the machine is at the moment.
#[derive(Debug)]
pub struct Calibration {
    /// Each word is the index of the next, all in one ring.
    ring: Vec<u32>,
}

impl Calibration {
    /// Which workload it is: figures by different ones do not compare.
    pub const VERSION: u32 = 1;

    /// Prepares it.
    pub fn new() -> Calibration {
        // Sattolo's shuffle makes one ring of all words.
        let mut ring: Vec<u32> = (0..WORDS as u32).collect();
        let mut random = Random::new(1);
        for i in (1..WORDS).rev() {
            ring.swap(i, (random.bits() % i as u64) as usize);
        }
        Calibration { ring }
    }

    /// Does the work once, on the calling thread.
    pub fn run(&self) {
        self.compute();
        self.read();
    }

    /// Arithmetic that stays within the processor: random boxes met by a ray.
    pub fn compute(&self) {
        // (random bits, hits, a sum)
        let mut lanes: [(u32, u32, f32); LANES] =
            std::array::from_fn(|i| ((i as u32).wrapping_mul(0x9e37_79b9).wrapping_add(1), 0, 0.0));
        for _ in 0..black_box(ROUNDS) {
            for (bits, hits, sum) in &mut lanes {
                *bits = (*bits ^ (*bits >> 15)).wrapping_mul(0x2c1b_3c6d).wrapping_add(0x297a_2d39);
                let x = (*bits >> 8) as f32 * (1.0 / 16_777_216.0);
                let (near, far) = (x * 1.7 - 0.4, 1.3 - x * 0.9);
                *hits = hits.wrapping_add(u32::from(near.max(0.0) <= far.min(1.0)));
                *sum = *sum * 0.5 + near.min(far);
            }
        }
        black_box(lanes);
    }

    /// Reads that each wait for the one before.
    pub fn read(&self) {
        let mut at: [u32; CHAINS] = std::array::from_fn(|i| (i * WORDS / CHAINS) as u32);
        for _ in 0..black_box(READS) {
            for i in &mut at {
                *i = self.ring[*i as usize];
            }
        }
        black_box(at);
    }
}

impl Default for Calibration {
    fn default() -> Calibration {
        Calibration::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ring_goes_through_all_words() {
        let ring = Calibration::new().ring;
        let (mut at, mut length) = (0u32, 0);
        loop {
            at = ring[at as usize];
            length += 1;
            if at == 0 {
                break;
            }
        }
        assert_eq!(length, WORDS);
    }
}
