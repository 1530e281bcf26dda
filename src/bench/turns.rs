//! Timing by turns: the workload, some work, the workload again.

use std::time::Instant;

use super::calibration::Calibration;
use super::memory;
use super::stats::median;
use super::waiting::waited;

/// Measures on so many threads.
pub struct Turns<'a> {
    calibration: &'a Calibration,
    pool: rayon::ThreadPool,
    threads: usize,
}

/// Least number of turns that count.
const LEAST: usize = 3;
/// Turns go on until they took this long together, in seconds.
const ENOUGH: f64 = 0.1;
/// Turns, at most.
const MOST: usize = 25;
/// The workload takes about this share of what is measured.
const SHARE: f64 = 0.15;

/// What one round said about some work.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Seconds, without the waiting.
    pub seconds: f64,
    /// The same in units of the workload.
    pub relative: f64,
    /// Share of the time that others had the processors.
    pub waited: f64,
    /// The most memory that the process had meanwhile.
    pub peak_bytes: Option<u64>,
}

/// A stretch of time.
#[derive(Clone, Copy)]
struct Span {
    wall: f64,
    waited: f64,
}

impl Span {
    /// The part that this process had the processors.
    fn own(self) -> f64 {
        // A clock too coarse for both leaves something.
        (self.wall - self.waited).max(0.01 * self.wall).max(1e-9)
    }
}

impl<'a> Turns<'a> {
    /// # Errors
    /// Where so many threads cannot be had.
    pub fn new(
        calibration: &'a Calibration,
        threads: usize,
    ) -> Result<Turns<'a>, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        Ok(Turns { calibration, pool, threads })
    }

    /// Does something that is not measured on the same threads.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Does `work` again and again, and tells what it took and what it made at last. A first time, which
    /// does not count, warms up; the memory is that of it.
    pub fn take<T: Send>(&self, work: impl Fn() -> T + Sync) -> (Taken, T) {
        let tells_peak = memory::forget_peak();
        let mut made = self.pool.install(&work);
        let peak_bytes = memory::peak().filter(|_| tells_peak);
        let (mut seconds, mut relative) = (Vec::new(), Vec::new());
        let (mut wall, mut waited) = (0.0, 0.0);
        let mut times = 1;
        let mut before = self.calibrate(times);
        while seconds.len() < LEAST || (wall < ENOUGH && seconds.len() < MOST) {
            // What was made before is let go of before the clock runs.
            drop(made);
            let (span, new) = self.time(|| self.pool.install(&work));
            made = new;
            let after = self.calibrate(times);
            seconds.push(span.own());
            relative.push(span.own() / (0.5 * (before + after)));
            wall += span.wall;
            waited += span.waited;
            let wanted = (SHARE * span.own() / after).clamp(1.0, 64.0) as usize;
            before = if wanted == times { after } else { self.calibrate(wanted) };
            times = wanted;
        }
        let middle = |values: Vec<f64>| median(values).unwrap_or(f64::NAN);
        let share = if wall > 0.0 { (waited / wall).min(1.0) } else { 0.0 };
        let taken = Taken { seconds: middle(seconds), relative: middle(relative), waited: share, peak_bytes };
        (taken, made)
    }

    /// Seconds of the workload done once by every thread: the mean of several.
    fn calibrate(&self, times: usize) -> f64 {
        let work = || self.pool.broadcast(|_| (0..times).for_each(|_| self.calibration.run()));
        self.time(work).0.own() / times as f64
    }

    fn time<T>(&self, work: impl FnOnce() -> T) -> (Span, T) {
        let (before, start) = (waited(), Instant::now());
        let made = work();
        let wall = start.elapsed().as_secs_f64();
        // Threads wait side by side.
        let waited = (waited() - before).max(0.0) / self.threads as f64;
        (Span { wall, waited }, made)
    }
}
