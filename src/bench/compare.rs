//! Compares two benchmark runs: which costs changed by more than the noise.

#[cfg(test)]
mod tests;

use super::bootstrap::{Interval, ratio_interval};
use super::results::{BenchResults, Machine, RecordedSettings, SceneResults, StageResults};
use super::stats::{log_std_dev, median};

/// Smaller relative changes of times and memory are never significant: two runs of one program on one machine agree
/// this well once they are calibrated.
const MIN_CHANGE: f64 = 0.05;
/// The same for BVH statistics, which have no noise.
const MIN_BVH_CHANGE: f64 = 0.01;
/// Standard errors of a significant change, among hundreds of measurements of a few rounds each.
const SIGNIFICANT_ERRORS: f64 = 5.0;
/// Standard error of a median relative to that of a mean, √(π/2).
const MEDIAN_ERROR: f64 = 1.2533;

/// The result of comparing a cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No change beyond the noise.
    Same,
    /// Significantly less than before.
    Less,
    /// Significantly more than before.
    More,
}

/// A cost in both runs: less is better.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The scene's name.
    pub scene: String,
    /// The measured cost, such as `eye, 1 thread`.
    pub metric: String,
    /// New cost divided by old.
    pub ratio: f64,
    /// The same from the fastest samples, for times on one thread.
    pub min_ratio: Option<f64>,
    /// The relative change that noise may cause.
    pub noise: f64,
    /// The 95 % bootstrap confidence interval of the ratio; `None` for costs of fewer than two rounds.
    pub interval: Option<Interval>,
    /// Significance and direction of the change.
    pub verdict: Verdict,
}

/// The comparison of two runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// The programs of the old and of the new run: `blinn 0.1.0, x86_64-linux, rustc 1.92.0, executable 01234567`.
    pub programs: [String; 2],
    /// All costs that both runs measured, in the order of the new run.
    pub changes: Vec<Change>,
    /// Differences between the runs that prevent or limit the comparison.
    pub notes: Vec<String>,
    /// Stages whose hashes differ: the runs did different work, and their times do not compare.
    pub different_work: Vec<String>,
    /// Stages of the new run that the old one did not measure in the same way.
    pub without_counterpart: usize,
}

impl Comparison {
    /// The programs of both runs in one line.
    pub fn program_line(&self) -> String {
        match &self.programs {
            [old, new] if old == new => format!("{new} in both runs"),
            [old, new] => format!("old: {old}; new: {new}"),
        }
    }

    /// The significant changes.
    pub fn significant(&self) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(|change| change.verdict != Verdict::Same)
    }

    /// Returns true if any cost is significantly higher.
    pub fn has_regression(&self) -> bool {
        self.changes.iter().any(|change| change.verdict == Verdict::More)
    }
}

/// Compares a run with an older one.
///
/// The noise of a measurement is the spread of its rounds in either run, and at least the median spread of all
/// measurements, since a few rounds may agree by chance. A change is significant if the ratio of the medians is beyond
/// five standard errors and beyond 5 %, and its bootstrap confidence interval excludes 1.
pub fn compare(old: &BenchResults, new: &BenchResults) -> Comparison {
    let programs = [old, new].map(BenchResults::program_name);
    let mut out = Comparison { programs, notes: setup_differences(old, new), ..Comparison::default() };
    let calibrated = old.settings.calibration == new.settings.calibration;
    let pairs = matching_scenes(old, new, &mut out.notes);
    let typical = TypicalSpread::of(old, new, calibrated);
    if typical.time.is_none() && !pairs.is_empty() {
        out.notes.push("one round has no spread, so no time is flagged; measure two rounds or more".into());
    }
    for pair in pairs {
        compare_bvhs(&pair, &mut out.changes);
        let same_samples = old.settings.samples == new.settings.samples;
        compare_stages(&pair, &typical, calibrated, same_samples, &mut out);
    }
    out
}

/// Results of the same scene in both runs.
struct ScenePair<'r> {
    old: &'r SceneResults,
    new: &'r SceneResults,
}

/// Pairs the scenes of both runs. Notes those without a partner.
fn matching_scenes<'r>(
    old: &'r BenchResults,
    new: &'r BenchResults,
    notes: &mut Vec<String>,
) -> Vec<ScenePair<'r>> {
    let mut pairs = Vec::new();
    for scene in &new.scenes {
        let Some(old) = old.find_scene(scene) else {
            notes.push(format!("{}: only in the new results", scene.name));
            continue;
        };
        if old.triangles != scene.triangles {
            let (before, now) = (old.triangles, scene.triangles);
            notes.push(format!("{}: different scenes of {before} and {now} triangles", scene.name));
            continue;
        }
        if let (Some(before), Some(now)) = (&old.sha256, &scene.sha256)
            && before != now
        {
            notes.push(format!("{}: different files (SHA-256 {before}, then {now})", scene.name));
        }
        pairs.push(ScenePair { old, new: scene });
    }
    let removed = old.scenes.iter().filter(|scene| new.find_scene(scene).is_none());
    notes.extend(removed.map(|old| format!("{}: only in the old results", old.name)));
    pairs
}

fn compare_stages(
    pair: &ScenePair,
    typical: &TypicalSpread,
    calibrated: bool,
    same_samples: bool,
    out: &mut Comparison,
) {
    let scene = &pair.new.name;
    for new in &pair.new.stages {
        let Some(old) = pair.old.stages.iter().find(|old| old.is_same_stage(new)) else {
            out.without_counterpart += 1;
            continue;
        };
        let metric = new.description();
        // Pictures of other samples take another time; a note says so.
        if new.stage.has_samples() && !same_samples {
            out.without_counterpart += 1;
            continue;
        }
        if old.rays != new.rays {
            out.notes.push(format!("{scene}: {metric}: different rays, which do not compare"));
            continue;
        }
        if let (Some(before), Some(now)) = (&old.hash, &new.hash)
            && before != now
        {
            let text = format!("{scene}: {metric}: hash {before}, then {now}: the runs did different work");
            out.different_work.push(text);
            continue;
        }
        let min_ratio = min_ratio(old, new, calibrated);
        let times = [old, new].map(|s| times(s, calibrated));
        out.changes.extend(
            compare_rounds(scene, &metric, times, typical.time).map(|change| Change { min_ratio, ..change }),
        );
        let peaks = [old, new].map(peaks);
        out.changes.extend(compare_rounds(scene, &format!("{metric}, memory"), peaks, typical.memory));
    }
}

/// Differences of machine and settings that limit the comparison.
fn setup_differences(old: &BenchResults, new: &BenchResults) -> Vec<String> {
    let mut notes = Vec::new();
    if (&old.machine.cpu, old.machine.cores) != (&new.machine.cpu, new.machine.cores) {
        let name = |m: &Machine| format!("{} ({} cores)", m.cpu, m.cores);
        notes.push(format!("different machines: {}, then {}", name(&old.machine), name(&new.machine)));
    }
    let (old, new) = (&old.settings, &new.settings);
    if old.sizes != new.sizes {
        notes.push(format!("different sizes of images: {}, then {}", sizes(old), sizes(new)));
    }
    if old.samples != new.samples {
        notes.push(format!("different samples per pixel: {}, then {}", old.samples, new.samples));
    }
    if old.threads != new.threads {
        notes.push(format!("different numbers of threads: {}, then {}", threads(old), threads(new)));
    }
    if old.simd != new.simd {
        notes.push(format!("different SIMD levels: {}, then {}", old.simd, new.simd));
    }
    if old.debug_build != new.debug_build {
        notes.push("one of the builds is not optimised".into());
    }
    if old.calibration != new.calibration {
        notes.push("different calibrations: seconds are compared instead of relative times".into());
    }
    notes
}

/// The sizes of images in words.
fn sizes(settings: &RecordedSettings) -> String {
    let sizes = settings.sizes.iter().map(|[width, height]| format!("{width}x{height}"));
    sizes.collect::<Vec<_>>().join(", ")
}

/// The numbers of threads in words.
fn threads(settings: &RecordedSettings) -> String {
    settings.threads.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
}

/// The finite, positive values.
fn positive(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values.filter(|v| v.is_finite() && *v > 0.0).collect()
}

/// Times of the rounds, relative if the calibrations agree.
fn times(stage: &StageResults, calibrated: bool) -> Vec<f64> {
    match calibrated {
        true => positive(stage.relative()),
        false => positive(stage.seconds.iter().copied().flatten()),
    }
}

/// Peak memory of the rounds.
fn peaks(stage: &StageResults) -> Vec<f64> {
    positive(stage.peak_bytes.iter().flatten().map(|&bytes| bytes as f64))
}

/// The ratio of the fastest samples, on one thread.
fn min_ratio(old: &StageResults, new: &StageResults, calibrated: bool) -> Option<f64> {
    let min = |s: &StageResults| if calibrated { s.least_relative } else { s.least_seconds };
    let ratio = min(new)? / min(old)?;
    Some(ratio).filter(|ratio| new.threads == 1 && ratio.is_finite() && *ratio > 0.0)
}

/// The median spread over all measurements of both runs.
struct TypicalSpread {
    time: Option<f64>,
    memory: Option<f64>,
}

impl TypicalSpread {
    fn of(old: &BenchResults, new: &BenchResults, calibrated: bool) -> TypicalSpread {
        let stages = || [old, new].into_iter().flat_map(|r| &r.scenes).flat_map(|scene| &scene.stages);
        TypicalSpread {
            time: median(stages().filter_map(|s| log_std_dev(times(s, calibrated)))),
            memory: median(stages().filter_map(|s| log_std_dev(peaks(s)))),
        }
    }
}

/// Compares the medians of the old and the new rounds. `None` if there are none.
fn compare_rounds(
    scene: &str,
    metric: &str,
    rounds: [Vec<f64>; 2],
    typical_spread: Option<f64>,
) -> Option<Change> {
    let [old, new] = &rounds;
    let ratio = median(new.iter().copied())? / median(old.iter().copied())?;
    if !(ratio.is_finite() && ratio > 0.0) {
        return None;
    }
    let squared_error = |rounds: &Vec<f64>| {
        let own = log_std_dev(rounds.iter().copied());
        let spread = own.unwrap_or(0.0).max(typical_spread?);
        Some(spread * spread / rounds.len() as f64)
    };
    // Logarithms treat twice and half alike.
    let log_noise = match (squared_error(old), squared_error(new)) {
        (Some(a), Some(b)) => {
            (SIGNIFICANT_ERRORS * MEDIAN_ERROR * (a + b).sqrt()).max(libm::log1p(MIN_CHANGE))
        }
        _ => f64::INFINITY,
    };
    let change = Change::new(scene, metric, ratio, log_noise);
    let interval = ratio_interval(old, new);
    let verdict = match interval {
        Some(interval) if interval.contains(1.0) => Verdict::Same,
        _ => change.verdict,
    };
    Some(Change { interval, verdict, ..change })
}

impl Change {
    fn new(scene: &str, metric: &str, ratio: f64, log_noise: f64) -> Change {
        let verdict = match libm::log(ratio) {
            log if log > log_noise => Verdict::More,
            log if log < -log_noise => Verdict::Less,
            _ => Verdict::Same,
        };
        let noise = libm::expm1(log_noise);
        Change {
            scene: scene.into(),
            metric: metric.into(),
            ratio,
            min_ratio: None,
            noise,
            interval: None,
            verdict,
        }
    }
}

/// Compares statistics of the BVHs.
fn compare_bvhs(pair: &ScenePair, out: &mut Vec<Change>) {
    let (Some(old), Some(new)) = (&pair.old.tree, &pair.new.tree) else { return };
    for (metric, old, new) in [
        ("nodes", Some(old.nodes as f64), Some(new.nodes as f64)),
        ("bytes a triangle", old.bytes_per_triangle, new.bytes_per_triangle),
        ("SAH cost", old.sah_cost, new.sah_cost),
    ] {
        if let (Some(old), Some(new)) = (old, new)
            && (new / old).is_finite()
            && new / old > 0.0
        {
            out.push(Change::new(&pair.new.name, metric, new / old, libm::log1p(MIN_BVH_CHANGE)));
        }
    }
}
