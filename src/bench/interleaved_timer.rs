//! Timing by turns: the workload, some work, the workload again. Or once, for the memory that it takes.

use std::time::Instant;

use crate::bench::calibration::Calibration;
use crate::bench::cpu_wait::CpuTimes;
use crate::bench::memory;
use crate::bench::stats::median;

/// Measures on so many threads.
pub struct InterleavedTimer {
    /// What work takes turns with; `None` where its memory is measured.
    calibration: Option<Calibration>,
    pool: rayon::ThreadPool,
    threads: usize,
}

/// Least number of turns that count.
const LEAST: usize = 3;
/// InterleavedTimer go on until they took this long together, in seconds.
const ENOUGH: f64 = 0.2;
/// InterleavedTimer, at most.
const MOST: usize = 50;
/// What takes less than this, in seconds, is done several times a turn.
const SHORT: f64 = 0.002;
/// Times that the workload is done in a row, at least: a median has a middle.
const FEWEST: usize = 3;
/// The workload takes about this share of what is measured: less of it would be the noisier of the two.
const SHARE: f64 = 0.4;

/// What one round said about some work.
#[derive(Clone, Copy, Debug)]
pub struct Timing {
    /// Seconds, without the waiting; NaN where it was not timed.
    pub seconds: f64,
    /// The same in units of the workload.
    pub relative: f64,
    /// Seconds of the quickest turn.
    pub least: f64,
    /// Seconds of the workload at its quickest.
    pub least_workload: f64,
    /// Share of the time that others had the processors.
    pub waited: f64,
    /// The most memory that the process had meanwhile; `None` where that was not measured.
    pub peak_bytes: Option<u64>,
}

/// A stretch of time.
#[derive(Clone, Copy)]
struct Span {
    wall: f64,
    /// The same without what others had of the processors.
    own: f64,
}

impl Span {
    /// Of `threads` threads. They wait side by side, so that each waiting second is a share of one; but a
    /// thread may also wait while it is not needed, so the work itself, evenly shared, is the least.
    fn new(wall: f64, shares: CpuTimes, threads: usize) -> Span {
        let threads = threads as f64;
        let own = (wall - shares.waiting / threads).max(shares.running / threads).clamp(0.0, wall);
        // A clock too coarse for it leaves something.
        Span { wall, own: own.max(1e-9) }
    }
}

impl InterleavedTimer {
    /// # Errors
    /// Where so many threads cannot be had.
    pub fn new(
        calibration: Option<Calibration>,
        threads: usize,
    ) -> Result<InterleavedTimer, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        Ok(InterleavedTimer { calibration, pool, threads })
    }

    /// Does something that is not measured on the same threads.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Does `work`, and tells what it took and what it made at last.
    pub fn measure<T: Send>(&self, work: impl Fn() -> T + Sync) -> (Timing, T) {
        match self.calibration {
            Some(calibration) => self.timed(calibration, work),
            None => self.once(work),
        }
    }

    /// Does it once.
    fn once<T: Send>(&self, work: impl Fn() -> T + Sync) -> (Timing, T) {
        let tells_peak = memory::reset_peak();
        let made = self.pool.install(&work);
        let peak_bytes = memory::peak_bytes().filter(|_| tells_peak);
        let none = f64::NAN;
        let untimed = Timing {
            seconds: none,
            relative: none,
            least: none,
            least_workload: none,
            waited: 0.0,
            peak_bytes,
        };
        (untimed, made)
    }

    /// Does it again and again. A first time, which does not count, warms up.
    fn timed<T: Send>(&self, calibration: Calibration, work: impl Fn() -> T + Sync) -> (Timing, T) {
        let (first, mut made) = self.time(|| self.pool.install(&work));
        // What takes hardly any time is done several times a turn.
        let repeats = (SHORT / first.own).clamp(1.0, 1000.0) as usize;
        let (mut seconds, mut relative) = (Vec::new(), Vec::new());
        let (mut wall, mut own, mut least_workload) = (0.0, 0.0, f64::INFINITY);
        let mut times = FEWEST;
        let mut before = self.calibrate(calibration, times);
        while seconds.len() < LEAST || (wall < ENOUGH && seconds.len() < MOST) {
            // What was made before is let go of before the clock runs.
            drop(made);
            let (span, new) = self.time(|| {
                for _ in 1..repeats {
                    self.pool.install(&work);
                }
                self.pool.install(&work)
            });
            made = new;
            let after = self.calibrate(calibration, times);
            let once = span.own / repeats as f64;
            seconds.push(once);
            relative.push(once / (0.5 * (before + after)));
            least_workload = before.min(after).min(least_workload);
            wall += span.wall;
            own += span.own;
            let wanted = (SHARE * span.own / after).clamp(FEWEST as f64, 64.0) as usize;
            before = if wanted == times { after } else { self.calibrate(calibration, wanted) };
            times = wanted;
        }
        let middle = |values: Vec<f64>| median(values).unwrap_or(f64::NAN);
        let waited = if wall > 0.0 { 1.0 - own / wall } else { 0.0 };
        let taken = Timing {
            least: seconds.iter().copied().fold(f64::INFINITY, f64::min),
            least_workload,
            seconds: middle(seconds),
            relative: middle(relative),
            waited: waited.clamp(0.0, 1.0),
            peak_bytes: None,
        };
        (taken, made)
    }

    /// Seconds of the workload done once: the median of several, the mean over all threads. Each times itself,
    /// for work is shared evenly among threads, and waking them up is no part of it; nor is a first time, after
    /// other work.
    fn calibrate(&self, calibration: Calibration, times: usize) -> f64 {
        let medians = self.pool.broadcast(|_| {
            calibration.run();
            let once = || {
                let start = Instant::now();
                calibration.run();
                start.elapsed().as_secs_f64()
            };
            median((0..times).map(|_| once())).unwrap_or(f64::NAN)
        });
        medians.iter().sum::<f64>() / medians.len() as f64
    }

    fn time<T>(&self, work: impl FnOnce() -> T) -> (Span, T) {
        let (before, start) = (CpuTimes::now(), Instant::now());
        let made = work();
        let wall = start.elapsed().as_secs_f64();
        (Span::new(wall, CpuTimes::since(before), self.threads), made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_is_taken_off_and_work_is_not() {
        let own =
            |wall, running, waiting, threads| Span::new(wall, CpuTimes { running, waiting }, threads).own;
        assert_eq!(own(1.0, 0.0, 0.0, 2), 1.0);
        assert_eq!(own(1.0, 0.25, 0.75, 1), 0.25);
        // Two threads that wait at once.
        assert_eq!(own(1.0, 1.0, 1.0, 2), 0.5);
        // Threads that waited although nobody needed them.
        assert_eq!(own(1.0, 0.5, 3.0, 2), 0.25);
        // Counts that are a little ahead of the clock.
        assert_eq!(own(1.0, 2.5, 0.0, 2), 1.0);
    }
}
