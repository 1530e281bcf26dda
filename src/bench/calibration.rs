//! The workload that everything is measured against.

use std::hint::black_box;

/// Rounds of arithmetic, about a third of a millisecond's worth.
const ROUNDS: usize = 12_500;
/// Numbers worked on side by side: enough to keep the processor's units busy. With half as many, one instruction
/// waits for another, and whoever else is at work on the same core costs nothing that shows.
const LANES: usize = 16;

/// A fixed amount of work of the kind that tracing is, as far as the processor goes: integers, products and
/// comparisons of floats, random boxes met by a ray. What it takes tells how fast the machine is at the
/// moment. It leaves memory alone: how long reads take depends on what was in the caches before, and follows
/// what tracing takes less well (docs/decisions/0096-measure-relative-to-a-calibration-loop.md).
#[derive(Clone, Copy, Debug, Default)]
pub struct Calibration;

impl Calibration {
    /// Which workload it is, and how it is timed: figures by different ones do not compare.
    pub const VERSION: u32 = 3;

    /// Does the work once, on the calling thread.
    pub fn run(self) {
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
}
