//! Timing by turns: the workload, some work, the workload again.

use std::time::Instant;

use super::calibration::Calibration;
use super::memory;
use super::stats::median;
use super::waiting::Shares;

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
/// What takes less than this, in seconds, is done several times a turn.
const SHORT: f64 = 0.002;
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
    /// The same without what others had of the processors.
    own: f64,
}

impl Span {
    /// Of `threads` threads. They wait side by side, so that each waiting second is a share of one; but a
    /// thread may also wait while it is not needed, so the work itself, evenly shared, is the least.
    fn new(wall: f64, shares: Shares, threads: usize) -> Span {
        let threads = threads as f64;
        let own = (wall - shares.waiting / threads).max(shares.running / threads).clamp(0.0, wall);
        // A clock too coarse for it leaves something.
        Span { wall, own: own.max(1e-9) }
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
        let (first, mut made) = self.time(|| self.pool.install(&work));
        let peak_bytes = memory::peak().filter(|_| tells_peak);
        // What takes hardly any time is done several times a turn.
        let repeats = (SHORT / first.own).clamp(1.0, 1000.0) as usize;
        let (mut seconds, mut relative) = (Vec::new(), Vec::new());
        let (mut wall, mut own) = (0.0, 0.0);
        let mut times = 1;
        let mut before = self.calibrate(times);
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
            let after = self.calibrate(times);
            let once = span.own / repeats as f64;
            seconds.push(once);
            relative.push(once / (0.5 * (before + after)));
            wall += span.wall;
            own += span.own;
            let wanted = (SHARE * span.own / after).clamp(1.0, 64.0) as usize;
            before = if wanted == times { after } else { self.calibrate(wanted) };
            times = wanted;
        }
        let middle = |values: Vec<f64>| median(values).unwrap_or(f64::NAN);
        let waited = if wall > 0.0 { 1.0 - own / wall } else { 0.0 };
        (
            Taken {
                seconds: middle(seconds),
                relative: middle(relative),
                waited: waited.clamp(0.0, 1.0),
                peak_bytes,
            },
            made,
        )
    }

    /// Seconds of the workload done once by every thread: the mean of several.
    fn calibrate(&self, times: usize) -> f64 {
        let work = || self.pool.broadcast(|_| (0..times).for_each(|_| self.calibration.run()));
        self.time(work).0.own / times as f64
    }

    fn time<T>(&self, work: impl FnOnce() -> T) -> (Span, T) {
        let (before, start) = (Shares::now(), Instant::now());
        let made = work();
        let wall = start.elapsed().as_secs_f64();
        (Span::new(wall, Shares::since(before), self.threads), made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_is_taken_off_and_work_is_not() {
        let own = |wall, running, waiting, threads| Span::new(wall, Shares { running, waiting }, threads).own;
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
