//! Two runs beside each other: what moved beyond the noise.

use super::results::{BenchResults, SceneResults, StageResults};
use super::stats::{log_std_dev, median};

/// Changes below this are never told: what two runs of one program on one machine should agree within
/// once they are calibrated.
const FLOOR: f64 = 0.05;
/// The same of what does not depend on time: trees.
const TREE_FLOOR: f64 = 0.01;
/// So many standard errors are taken for no accident, among hundreds of figures of a few rounds each.
const SURE: f64 = 5.0;
/// The standard error of a median to that of a mean.
const OF_MEDIAN: f64 = 1.2533;

/// What became of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing that is beyond the noise.
    Same,
    /// Less than it was, beyond the noise.
    Less,
    /// More than it was, beyond the noise.
    More,
}

/// A figure in both runs. All are costs: less is better.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The scene's name.
    pub scene: String,
    /// `eye, 1 thread`, or what else it is a figure of.
    pub what: String,
    /// What it is now to what it was.
    pub ratio: f64,
    /// The same by the quickest turns, for times of one thread.
    pub by_least: Option<f64>,
    /// How far from 1 the ratio may lie by accident.
    pub noise: f64,
    /// What follows from both.
    pub verdict: Verdict,
}

/// All figures that two runs share, and what else is to be said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// In the order of the new run.
    pub changes: Vec<Change>,
    /// What is missing or different, in words.
    pub notes: Vec<String>,
}

impl Comparison {
    /// BenchResults that moved.
    pub fn significant(&self) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(|change| change.verdict != Verdict::Same)
    }

    /// True where anything costs more.
    pub fn has_regression(&self) -> bool {
        self.changes.iter().any(|change| change.verdict == Verdict::More)
    }
}

/// What moved from `old` to `new`.
///
/// A figure's noise is how much its rounds differ, in either run; and never less than what is usual over
/// all figures, since a few rounds may agree by accident. It moved where the ratio of the medians is
/// beyond five standard errors of that, and beyond 5 %.
pub fn compare(old: &BenchResults, new: &BenchResults) -> Comparison {
    let mut out = Comparison { changes: Vec::new(), notes: differences(old, new) };
    let calibrated = old.settings.calibration == new.settings.calibration;
    let mut pairs = Vec::new();
    for scene in &new.scenes {
        let Some(then) = old.scenes.iter().find(|then| then.name == scene.name) else {
            out.notes.push(format!("{}: only in the new figures", scene.name));
            continue;
        };
        if then.triangles != scene.triangles {
            let (a, b) = (then.triangles, scene.triangles);
            out.notes.push(format!("{}: another scene, of {a} triangles then and {b} now", scene.name));
            continue;
        }
        pairs.push((then, scene));
    }
    let gone = old.scenes.iter().filter(|then| new.scenes.iter().all(|scene| scene.name != then.name));
    out.notes.extend(gone.map(|then| format!("{}: only in the old figures", then.name)));

    let typical = Typical::of(old, new, calibrated);
    if typical.time.is_none() && !pairs.is_empty() {
        out.notes
            .push("one round shows no noise, so that no time is flagged: take --rounds 2 or more".into());
    }
    for (then, now) in pairs {
        trees(then, now, &mut out.changes);
        for stage in &now.stages {
            let same = |other: &&StageResults| (other.stage, other.threads) == (stage.stage, stage.threads);
            let Some(before) = then.stages.iter().find(same) else { continue };
            let threads = if stage.threads == 1 { "thread" } else { "threads" };
            let what = format!("{}, {} {threads}", stage.stage.name(), stage.threads);
            if before.rays != stage.rays {
                out.notes.push(format!("{}: {what}: other rays, which do not compare", now.name));
                continue;
            }
            let times = [before, stage].map(|s| times(s, calibrated));
            let by_least = by_least(before, stage, calibrated);
            out.changes.extend(
                change(&now.name, &what, times, typical.time).map(|change| Change { by_least, ..change }),
            );
            let peaks = [before, stage].map(peaks);
            out.changes.extend(change(&now.name, &format!("{what}, memory"), peaks, typical.memory));
        }
    }
    out
}

/// What keeps two runs from being comparable, in words.
fn differences(old: &BenchResults, new: &BenchResults) -> Vec<String> {
    let mut notes = Vec::new();
    let (a, b) = (&old.machine, &new.machine);
    if (&a.cpu, a.cores) != (&b.cpu, b.cores) {
        let name = |m: &super::results::Machine| format!("{} ({} cores)", m.cpu, m.cores);
        notes.push(format!("another machine: {} then, {} now", name(a), name(b)));
    }
    let (a, b) = (&old.settings, &new.settings);
    let size =
        |s: &super::results::RecordedSettings| format!("{}x{}, {} samples", s.width, s.height, s.samples);
    if size(a) != size(b) {
        notes.push(format!("other pictures: {} then, {} now", size(a), size(b)));
    }
    if a.simd != b.simd {
        notes.push(format!("other instructions: {} then, {} now", a.simd, b.simd));
    }
    if a.debug_build != b.debug_build {
        notes.push("one of the two is a build without optimisation".into());
    }
    if a.calibration != b.calibration {
        notes.push("another calibration: seconds are compared as they are".into());
    }
    notes
}

/// Positive numbers of the rounds.
fn positive(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values.filter(|v| v.is_finite() && *v > 0.0).collect()
}

fn times(stage: &StageResults, calibrated: bool) -> Vec<f64> {
    match calibrated {
        true => positive(stage.relative()),
        false => positive(stage.seconds.iter().copied().flatten()),
    }
}

/// The quickest turn of one thread, now to then.
fn by_least(then: &StageResults, now: &StageResults, calibrated: bool) -> Option<f64> {
    let least = |s: &StageResults| if calibrated { s.least_relative } else { s.least_seconds };
    let ratio = least(now)? / least(then)?;
    Some(ratio).filter(|ratio| now.threads == 1 && ratio.is_finite() && *ratio > 0.0)
}

fn peaks(stage: &StageResults) -> Vec<f64> {
    positive(stage.peak_bytes.iter().flatten().map(|&bytes| bytes as f64))
}

/// How much rounds usually differ.
struct Typical {
    time: Option<f64>,
    memory: Option<f64>,
}

impl Typical {
    fn of(old: &BenchResults, new: &BenchResults, calibrated: bool) -> Typical {
        let stages = || [old, new].into_iter().flat_map(|f| &f.scenes).flat_map(|scene| &scene.stages);
        Typical {
            time: median(stages().filter_map(|s| log_std_dev(times(s, calibrated)))),
            memory: median(stages().filter_map(|s| log_std_dev(peaks(s)))),
        }
    }
}

/// A figure by its rounds then and now. `None` where one has none.
fn change(scene: &str, what: &str, rounds: [Vec<f64>; 2], typical: Option<f64>) -> Option<Change> {
    let [then, now] = &rounds;
    let ratio = median(now.iter().copied())? / median(then.iter().copied())?;
    if !(ratio.is_finite() && ratio > 0.0) {
        return None;
    }
    let squared = |rounds: &Vec<f64>| {
        let own = log_std_dev(rounds.iter().copied());
        let spread = own.unwrap_or(0.0).max(typical?);
        Some(spread * spread / rounds.len() as f64)
    };
    // Logarithms treat twice and half alike.
    let noise = match (squared(then), squared(now)) {
        (Some(a), Some(b)) => (SURE * OF_MEDIAN * (a + b).sqrt()).max(libm::log1p(FLOOR)),
        _ => f64::INFINITY,
    };
    Some(judged(scene, what, ratio, noise))
}

fn judged(scene: &str, what: &str, ratio: f64, noise: f64) -> Change {
    let verdict = match libm::log(ratio) {
        log if log > noise => Verdict::More,
        log if log < -noise => Verdict::Less,
        _ => Verdict::Same,
    };
    Change {
        scene: scene.into(),
        what: what.into(),
        ratio,
        by_least: None,
        noise: libm::expm1(noise),
        verdict,
    }
}

fn trees(then: &SceneResults, now: &SceneResults, out: &mut Vec<Change>) {
    let (Some(then), Some(tree)) = (&then.tree, &now.tree) else { return };
    for (what, then, now_) in [
        ("nodes", Some(then.nodes as f64), Some(tree.nodes as f64)),
        ("bytes a triangle", then.bytes_per_triangle, tree.bytes_per_triangle),
        ("SAH cost", then.sah_cost, tree.sah_cost),
    ] {
        if let (Some(then), Some(value)) = (then, now_)
            && (value / then).is_finite()
            && value / then > 0.0
        {
            out.push(judged(&now.name, what, value / then, libm::log1p(TREE_FLOOR)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::results::{BenchStage, Machine, RecordedSettings};
    use super::*;
    use crate::bench::interleaved_timer::Timing;

    /// A run of `scenes` scenes whose rounds scatter by about 1 %, all times multiplied by `factor` and
    /// the scattering's beginning at `seed`.
    fn run(factor: f64, rounds: usize, seed: usize) -> BenchResults {
        let stages = |scene: usize| {
            BenchStage::ALL.into_iter().enumerate().map(move |(i, stage)| {
                let taken = |round: usize| {
                    let shift = ((seed + 7 * scene + 3 * i + 5 * round) % 11) as f64 / 5.0 - 1.0;
                    let relative = factor * (1.0 + 0.01 * shift);
                    let seconds = relative * 0.001;
                    let (least, least_workload) = (0.9 * seconds, 0.0009);
                    Timing {
                        seconds,
                        relative,
                        least,
                        least_workload,
                        waited: 0.1,
                        peak_bytes: Some(1 << 20),
                    }
                };
                StageResults::of(stage, 1, None, &(0..rounds).map(taken).collect::<Vec<_>>())
            })
        };
        let scene = |i: usize| SceneResults {
            name: format!("scene {i}"),
            triangles: 10,
            tree: None,
            stages: stages(i).collect(),
        };
        let mut figures = BenchResults::new(RecordedSettings::default(), (0..5).map(scene).collect());
        figures.machine = Machine::default();
        figures
    }

    #[test]
    fn what_did_not_move_is_not_flagged_and_what_did_is() {
        for seed in 0..11 {
            let same = compare(&run(1.0, 5, 0), &run(1.0, 5, seed));
            assert_eq!(same.changes.len(), 5 * 7 * 2);
            assert!(same.notes.is_empty(), "{:?}", same.notes);
            assert_eq!(same.significant().count(), 0, "{same:?}");
            let (slower, faster) =
                (compare(&run(1.0, 5, 0), &run(1.2, 5, seed)), compare(&run(1.2, 5, 0), &run(1.0, 5, seed)));
            assert!(slower.has_regression() && slower.significant().count() == 35);
            assert!(!faster.has_regression() && faster.significant().all(|c| c.verdict == Verdict::Less));
            assert_eq!(faster.significant().count(), 35);
        }
    }

    #[test]
    fn quickest_turns_are_a_second_opinion_on_one_thread() {
        let (mut old, mut new) = (run(1.0, 5, 0), run(1.5, 5, 0));
        new.scenes[1].stages[0].least_relative = None;
        new.scenes[2].stages[0].threads = 2;
        old.scenes[2].stages[0].threads = 2;
        for change in compare(&old, &new).changes {
            let told = match (change.scene.as_str(), change.what.as_str()) {
                (_, what) if what.ends_with("memory") => None,
                ("scene 1", "load, 1 thread") | ("scene 2", "load, 2 threads") => None,
                _ => Some(1.5),
            };
            let by_least = change.by_least.map(|ratio| (ratio * 1000.0).round() / 1000.0);
            assert_eq!(by_least, told, "{change:?}");
        }
    }

    /// 20 % is a change where rounds agree, and none where they differ by as much.
    #[test]
    fn noise_is_what_was_seen() {
        let (old, mut new) = (run(1.0, 5, 0), run(1.2, 5, 1));
        for stage in new.scenes.iter_mut().flat_map(|scene| &mut scene.stages) {
            stage.relative = [0.9, 1.5, 1.2, 1.0, 1.4].map(Some).to_vec();
        }
        let compared = compare(&old, &new);
        assert_eq!(compared.significant().count(), 0, "{compared:?}");
        assert!(compared.changes.iter().any(|c| c.ratio > 1.19 && c.noise > 0.3));
    }

    #[test]
    fn a_few_rounds_that_agree_by_accident_do_not_make_noise_vanish() {
        let (mut old, mut new) = (run(1.0, 3, 0), run(1.0, 3, 1));
        for (i, stage) in old.scenes.iter_mut().chain(&mut new.scenes).flat_map(|s| &mut s.stages).enumerate()
        {
            let scatter = if i == 0 || i == 35 { 0.0 } else { 0.05 };
            let middle = if i == 0 { 1.1 } else { 1.0 };
            stage.relative = [1.0 - scatter, 1.0, 1.0 + scatter].map(|v| Some(v * middle)).to_vec();
        }
        assert_eq!(compare(&old, &new).significant().count(), 0);
    }

    #[test]
    fn what_is_missing_is_told_or_passed_over() {
        let (old, mut new) = (run(1.0, 5, 0), run(2.0, 5, 0));
        new.scenes[0].name = "new".into();
        new.scenes[1].triangles = 11;
        new.scenes[2].stages[2].rays = Some(5);
        new.scenes[3].stages[0].relative = vec![None, None];
        new.scenes[3].stages[1].relative = vec![Some(f64::NAN), Some(-1.0), Some(0.0), None];
        new.scenes[4].stages.clear();
        new.machine.cores = 64;
        let compared = compare(&old, &new);
        for told in
            ["new: only in the new", "scene 0: only in the old", "scene 1: another scene", "other rays"]
        {
            assert!(compared.notes.iter().any(|note| note.contains(told)), "{told}: {:?}", compared.notes);
        }
        assert!(compared.notes[0].contains("another machine"));
        let times = compared.changes.iter().filter(|c| !c.what.contains("memory"));
        assert_eq!(times.count(), 6 + 5);
        let single = compare(&run(1.0, 1, 0), &run(3.0, 1, 0));
        assert!(single.significant().count() == 0 && single.notes[0].contains("--rounds"), "{single:?}");
        new.settings.calibration += 1;
        assert!(compare(&old, &new).notes.iter().any(|note| note.contains("seconds are compared")));
        assert!(compare(&new, &old).changes.iter().all(|c| c.ratio.is_finite()));
    }

    #[test]
    fn trees_have_no_noise() {
        let (mut old, mut new) = (run(1.0, 5, 0), run(1.0, 5, 0));
        let tree =
            super::super::results::BvhResults { nodes: 100, sah_cost: Some(50.0), ..Default::default() };
        old.scenes[0].tree = Some(tree.clone());
        new.scenes[0].tree = Some(super::super::results::BvhResults {
            sah_cost: Some(51.0),
            bytes_per_triangle: Some(3.0),
            ..tree
        });
        let compared = compare(&old, &new);
        let moved: Vec<&str> = compared.significant().map(|c| c.what.as_str()).collect();
        assert_eq!(moved, ["SAH cost"]);
    }
}
