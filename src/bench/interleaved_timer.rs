//! Interleaved timing: calibration loop, workload, calibration loop, … Or one run that measures peak memory instead.

use std::time::Instant;

use crate::calibration::Calibration;
use crate::cpu_wait::CpuTimes;
use crate::energy::EnergyMeter;
use crate::stats::median;
use blinn_session::memory;

/// Fewest samples per measurement.
const MIN_SAMPLES: usize = 3;
/// Work is repeated within a sample until the sample lasts about this many seconds.
const MIN_SAMPLE_SECONDS: f64 = 0.002;
/// Fewest consecutive runs of the calibration loop, whose median counts.
const MIN_CALIBRATION_RUNS: usize = 3;
const MAX_CALIBRATION_RUNS: f64 = 64.0;
/// Target duration of the calibration relative to the sample: a shorter one would be the noisier of the two.
const CALIBRATION_FRACTION: f64 = 0.4;

/// Measures work on a pool of threads.
pub struct InterleavedTimer {
    /// `None` measures peak memory.
    calibration: Option<Calibration>,
    /// `None` where the machine reports no energy.
    energy: Option<EnergyMeter>,
    pool: rayon::ThreadPool,
    threads: usize,
    /// Processors available to this process.
    processors: usize,
    /// Sampling continues until the samples lasted this many seconds.
    min_seconds: f64,
}

/// The measurement of a workload in one round.
#[derive(Clone, Copy, Debug)]
pub struct Timing {
    /// Median of the samples in seconds, without waiting for a processor. NaN if it was not timed.
    pub seconds: f64,
    /// The same in units of the calibration loop.
    pub relative: f64,
    /// Median of the samples in seconds by the clock, with waiting for a processor. NaN if it was not timed.
    pub wall_seconds: f64,
    /// The fastest sample in seconds.
    pub min_seconds: f64,
    /// The fastest run of the calibration loop in seconds.
    pub min_calibration_seconds: f64,
    /// Fraction of the time that other programs had the processors.
    pub wait_fraction: f64,
    /// Energy in joules of the processor packages: the mean of all repetitions. NaN if it was not measured.
    pub joules: f64,
    /// Peak memory in bytes. `None` if it was not measured.
    pub peak_bytes: Option<u64>,
}

impl Timing {
    /// A measurement of memory only.
    pub(super) fn untimed(peak_bytes: Option<u64>) -> Timing {
        Timing {
            seconds: f64::NAN,
            relative: f64::NAN,
            wall_seconds: f64::NAN,
            min_seconds: f64::NAN,
            min_calibration_seconds: f64::NAN,
            wait_fraction: 0.0,
            joules: f64::NAN,
            peak_bytes,
        }
    }
}

/// A time interval in seconds.
#[derive(Clone, Copy)]
struct Interval {
    wall: f64,
    /// Without the time that other programs had the processors.
    net: f64,
    /// Energy in joules; NaN if it was not measured.
    joules: f64,
}

impl Interval {
    /// Threads wait in parallel, so a second of waiting counts as 1 / `threads`. A thread may also wait while it is
    /// not needed, or for another of this process, so the running time, evenly distributed among `processors`, is a lower
    /// bound.
    fn new(wall: f64, times: CpuTimes, threads: usize, processors: usize) -> Interval {
        let least = times.running / threads.min(processors) as f64;
        let net = (wall - times.waiting / threads as f64).max(least).clamp(0.0, wall);
        // A coarse clock may report 0.
        Interval { wall, net: net.max(1e-9), joules: f64::NAN }
    }
}

impl InterleavedTimer {
    /// Makes a timer that samples for at least `min_seconds`.
    ///
    /// # Errors
    /// The threads cannot be created.
    pub fn new(
        calibration: Option<Calibration>,
        threads: usize,
        min_seconds: f64,
    ) -> Result<InterleavedTimer, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let energy = calibration.and_then(|_| EnergyMeter::open());
        let processors = std::thread::available_parallelism().map_or(threads, usize::from);
        Ok(InterleavedTimer { calibration, energy, pool, threads, processors, min_seconds })
    }

    /// Runs `work` on the pool without measuring it.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Measures `work`. Also returns its last result.
    pub fn measure<T: Send>(&self, work: impl Fn() -> T + Sync) -> (Timing, T) {
        match self.calibration {
            Some(calibration) => self.measure_time(calibration, work),
            None => self.measure_memory(work),
        }
    }

    /// Runs `work` once.
    fn measure_memory<T: Send>(&self, work: impl Fn() -> T + Sync) -> (Timing, T) {
        let is_reset = memory::reset_peak();
        let result = self.pool.install(&work);
        let peak_bytes = memory::peak_bytes().filter(|_| is_reset);
        (Timing::untimed(peak_bytes), result)
    }

    /// Runs `work` repeatedly, after one run that warms up.
    fn measure_time<T: Send>(&self, calibration: Calibration, work: impl Fn() -> T + Sync) -> (Timing, T) {
        let (warm_up, mut result) = self.time(|| self.pool.install(&work));
        let repeats = (MIN_SAMPLE_SECONDS / warm_up.net).clamp(1.0, 1000.0) as usize;
        let mut samples = Samples::default();
        let mut calibration_runs = MIN_CALIBRATION_RUNS;
        let mut before = self.calibrate(calibration, calibration_runs);
        while samples.needs_more(self.min_seconds) {
            // Freeing the previous result is not timed.
            drop(result);
            let (interval, new) = self.time(|| {
                for _ in 1..repeats {
                    self.pool.install(&work);
                }
                self.pool.install(&work)
            });
            result = new;
            let after = self.calibrate(calibration, calibration_runs);
            samples.add(interval, repeats, before, after);
            let wanted_runs = (CALIBRATION_FRACTION * interval.net / after)
                .clamp(MIN_CALIBRATION_RUNS as f64, MAX_CALIBRATION_RUNS)
                as usize;
            before = if wanted_runs == calibration_runs {
                after
            } else {
                self.calibrate(calibration, wanted_runs)
            };
            calibration_runs = wanted_runs;
        }
        (samples.timing(), result)
    }

    /// Seconds of one run of the calibration loop: the median of `runs`, then the mean over all threads. Each thread
    /// times itself after a warm-up run, so that waking the threads is not counted.
    fn calibrate(&self, calibration: Calibration, runs: usize) -> f64 {
        let medians = self.pool.broadcast(|_| {
            calibration.run();
            let run = || {
                let start = Instant::now();
                calibration.run();
                start.elapsed().as_secs_f64()
            };
            median((0..runs).map(|_| run())).unwrap_or(f64::NAN)
        });
        medians.iter().sum::<f64>() / medians.len() as f64
    }

    fn time<T>(&self, work: impl FnOnce() -> T) -> (Interval, T) {
        let cpu_start = CpuTimes::now();
        let energy_start = self.energy.as_ref().and_then(EnergyMeter::read);
        let start = Instant::now();
        let result = work();
        let wall = start.elapsed().as_secs_f64();
        let mut interval = Interval::new(wall, CpuTimes::since(cpu_start), self.threads, self.processors);
        if let (Some(meter), Some(start)) = (&self.energy, energy_start)
            && let Some(end) = meter.read()
        {
            interval.joules = meter.joules(&start, &end);
        }
        (interval, result)
    }
}

/// The samples of a measurement.
struct Samples {
    seconds: Vec<f64>,
    relative: Vec<f64>,
    /// By the clock.
    wall_seconds: Vec<f64>,
    total: Interval,
    /// Repetitions of all samples.
    repeats: usize,
    min_calibration_seconds: f64,
}

impl Default for Samples {
    fn default() -> Samples {
        Samples {
            seconds: Vec::new(),
            relative: Vec::new(),
            wall_seconds: Vec::new(),
            total: Interval { wall: 0.0, net: 0.0, joules: 0.0 },
            repeats: 0,
            min_calibration_seconds: f64::INFINITY,
        }
    }
}

impl Samples {
    fn needs_more(&self, min_seconds: f64) -> bool {
        self.seconds.len() < MIN_SAMPLES || self.total.wall < min_seconds
    }

    /// Adds a sample of `repeats` runs, between two calibrations in seconds.
    fn add(&mut self, interval: Interval, repeats: usize, before: f64, after: f64) {
        let seconds = interval.net / repeats as f64;
        self.seconds.push(seconds);
        self.relative.push(seconds / (0.5 * (before + after)));
        self.wall_seconds.push(interval.wall / repeats as f64);
        self.min_calibration_seconds = before.min(after).min(self.min_calibration_seconds);
        self.total.wall += interval.wall;
        self.total.net += interval.net;
        self.total.joules += interval.joules;
        self.repeats += repeats;
    }

    fn timing(self) -> Timing {
        let Interval { wall, net, joules } = self.total;
        let wait_fraction = if wall > 0.0 { 1.0 - net / wall } else { 0.0 };
        Timing {
            min_seconds: self.seconds.iter().copied().fold(f64::INFINITY, f64::min),
            min_calibration_seconds: self.min_calibration_seconds,
            seconds: median(self.seconds).unwrap_or(f64::NAN),
            relative: median(self.relative).unwrap_or(f64::NAN),
            wall_seconds: median(self.wall_seconds).unwrap_or(f64::NAN),
            wait_fraction: wait_fraction.clamp(0.0, 1.0),
            joules: joules / self.repeats as f64,
            peak_bytes: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Short samples go on until they lasted `min_seconds`, however many there are; long ones are at least three.
    #[test]
    fn samples_last_as_long_as_wanted() {
        let count = |sample_seconds: f64, min_seconds: f64| {
            let mut samples = Samples::default();
            let interval = Interval { wall: sample_seconds, net: sample_seconds, joules: f64::NAN };
            while samples.needs_more(min_seconds) {
                samples.add(interval, 10, 1.0, 1.0);
            }
            samples.seconds.len()
        };
        // Powers of two have exact sums.
        assert_eq!(count(0.001_953_125, 2.0), 1024);
        assert_eq!(count(0.001_953_125, 0.5), 256);
        assert_eq!(count(4.0, 0.5), MIN_SAMPLES);
    }

    /// The time by the clock is kept beside the corrected one, and is that of one repetition.
    #[test]
    fn wall_time_is_kept() {
        let mut samples = Samples::default();
        for wall in [8.0, 4.0, 16.0] {
            samples.add(Interval { wall, net: 0.5 * wall, joules: f64::NAN }, 2, 1.0, 1.0);
        }
        let timing = samples.timing();
        assert_eq!((timing.wall_seconds, timing.seconds), (4.0, 2.0));
        assert_eq!(timing.wait_fraction, 0.5);
    }

    #[test]
    fn waiting_is_subtracted_but_running_is_not() {
        let net = |wall, running, waiting, threads| {
            Interval::new(wall, CpuTimes { running, waiting }, threads, 2).net
        };
        assert_eq!(net(1.0, 0.0, 0.0, 2), 1.0);
        assert_eq!(net(1.0, 0.25, 0.75, 1), 0.25);
        // Two threads wait at the same time.
        assert_eq!(net(1.0, 1.0, 1.0, 2), 0.5);
        // Threads wait although they are not needed.
        assert_eq!(net(1.0, 0.5, 3.0, 2), 0.25);
        // Eight threads on two processors wait for each other.
        assert_eq!(net(1.0, 2.0, 6.0, 8), 1.0);
        // The counts are slightly ahead of the clock.
        assert_eq!(net(1.0, 2.5, 0.0, 2), 1.0);
    }
}
