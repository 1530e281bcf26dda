//! The calibration loop: a fixed amount of work that all times are measured relative to.

use std::hint::black_box;

/// Iterations, about a third of a millisecond.
const ITERATIONS: usize = 12_500;
/// Independent lanes, enough to keep the processor's units busy. With half as many, instructions wait for each other,
/// and the load of a sibling hyper-thread does not show.
const LANES: usize = 16;

/// The calibration loop. Its instructions resemble tracing: integer operations, floating-point products and
/// comparisons, and random boxes hit by a ray. Its time measures the current speed of the machine.
///
/// It does not access memory: read latency depends on what was cached before, and predicts tracing less well
/// (docs/decisions/benchmarks.md).
#[derive(Clone, Copy, Debug, Default)]
pub struct Calibration;

/// A lane: random bits, the number of hits, and a running sum.
#[derive(Clone, Copy)]
struct Lane {
    bits: u32,
    hits: u32,
    sum: f32,
}

impl Calibration {
    /// The version of the loop and of its timing. Relative times compare only within a version.
    pub const VERSION: u32 = 3;

    /// Runs the loop once on the calling thread.
    pub fn run(self) {
        let mut lanes: [Lane; LANES] = std::array::from_fn(|i| {
            let bits = (i as u32).wrapping_mul(0x9e37_79b9).wrapping_add(1);
            Lane { bits, hits: 0, sum: 0.0 }
        });
        for _ in 0..black_box(ITERATIONS) {
            for Lane { bits, hits, sum } in &mut lanes {
                *bits = (*bits ^ (*bits >> 15)).wrapping_mul(0x2c1b_3c6d).wrapping_add(0x297a_2d39);
                let x = (*bits >> 8) as f32 * (1.0 / 16_777_216.0);
                let near = x * 1.7 - 0.4;
                let far = 1.3 - x * 0.9;
                *hits = hits.wrapping_add(u32::from(near.max(0.0) <= far.min(1.0)));
                *sum = *sum * 0.5 + near.min(far);
            }
        }
        black_box(lanes);
    }
}
