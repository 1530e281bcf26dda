//! Work, critical path, and the speed-up between the bounds that both set.

use std::collections::BTreeMap;

use serde::Serialize;

use super::file::Trace;
use super::job::{Job, SceneWork};

/// The numbers of cores that speed-ups are given for.
const CORES: [u32; 5] = [2, 4, 8, 16, 32];

/// The format's name and version.
const FORMAT: &str = "blinn trace bound 1";

/// The speed-up that more cores could give a job.
///
/// Scenes do not wait for each other, the stages of a scene do. With the work T₁ and the critical path T∞, N cores need at
/// least T₁/N and at least T∞, and at most T∞ + (T₁ − T∞)/N (Brent 1974) if none is idle while there is something to do. As
/// in Cilkview (He, Leiserson and Leiserson 2010), but from the times of stages instead of counted instructions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TraceBound {
    /// `blinn trace bound 1`.
    pub format: String,
    /// The version of blinn.
    pub version: String,
    /// The threads of the traces that count: one, and the most of the others.
    pub threads: Vec<u32>,
    /// Seconds of all work on one thread.
    pub work_seconds: f64,
    /// Seconds of it that belong to no scene: start and end of the run.
    pub outside_seconds: f64,
    /// Seconds of the critical path.
    pub span_seconds: SpanRange,
    /// The scene that the critical path goes through.
    pub longest_scene: String,
    /// The stages, by the most work.
    pub stages: Vec<TracedStage>,
    /// The speed-ups.
    pub speed_ups: Vec<SpeedUp>,
}

/// The least and the greatest length of a critical path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpanRange {
    /// Stages are divided as far as the traces allow, and frames are a pipeline.
    pub least: f64,
    /// Stages are divided no more than the traces show, and frames follow each other.
    pub most: f64,
}

/// A stage of all scenes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TracedStage {
    /// Its name. `scene` is what no other stage measures.
    pub stage: String,
    /// The number of its runs.
    pub count: u64,
    /// Its seconds on one thread.
    pub work_seconds: f64,
    /// The fraction that does not divide among threads (Karp and Flatt 1990); null without a trace of several threads.
    pub serial_fraction: Option<f64>,
}

/// The speed-up of a number of cores over one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedUp {
    /// The number of cores.
    pub cores: u32,
    /// Reached if no core is idle while there is something to do, and stages divide no better than known.
    pub at_least: f64,
    /// Not exceeded.
    pub at_most: f64,
}

impl TraceBound {
    /// Computes the bounds of a job from traces of it, one of which is of one thread. Of the others the one with the most
    /// threads shows how far stages divide.
    ///
    /// # Errors
    /// No trace is of one thread, or they are of different jobs.
    pub fn new(traces: &[Trace]) -> Result<TraceBound, String> {
        let one = traces.iter().find(|trace| trace.threads == 1);
        let one = Job::new(one.ok_or("no trace is of a run with --threads 1, whose times are the work")?);
        let many = traces.iter().filter(|trace| trace.threads > 1).max_by_key(|trace| trace.threads);
        let threads: Vec<u32> = std::iter::once(1).chain(many.map(|trace| trace.threads)).collect();
        let many = many.map(|trace| (Job::new(trace), f64::from(trace.threads)));
        if many.as_ref().is_some_and(|(many, _)| !is_same_job(&one, many)) {
            return Err("the traces are of different scenes, frames or stages; trace the same command".into());
        }
        let serial = many.map(|(many, threads)| serial_fractions(&one, &many, threads));
        let outside_seconds = (one.seconds - one.waited - one.work()).max(0.0);
        let work_seconds = one.work() + outside_seconds;
        let (span_seconds, longest_scene) = critical_path(&one, outside_seconds, serial.as_ref());
        let stage = |(stage, (count, work_seconds)): (&str, (u64, f64))| TracedStage {
            stage: stage.into(),
            count,
            work_seconds,
            serial_fraction: serial.as_ref().and_then(|serial| serial.get(stage).copied()),
        };
        let mut stages: Vec<TracedStage> = one.stages().into_iter().map(stage).collect();
        stages.sort_by(|a, b| b.work_seconds.total_cmp(&a.work_seconds));
        Ok(TraceBound {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            threads,
            work_seconds,
            outside_seconds,
            span_seconds,
            longest_scene,
            stages,
            speed_ups: CORES.map(|cores| speed_up(work_seconds, span_seconds, cores)).to_vec(),
        })
    }

    /// The text of a file of bounds: a JSON object.
    pub fn to_json(&self) -> String {
        // Fails only for maps whose keys are not strings; there are none.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// Returns true if all stages of all scenes ran as often.
fn is_same_job(one: &Job, many: &Job) -> bool {
    let counts = |scene: &SceneWork| -> Vec<(String, usize)> {
        scene.stages.iter().map(|(stage, seconds)| (stage.clone(), seconds.len())).collect()
    };
    let is_same = |((i, a), (j, b)): ((&u64, &SceneWork), (&u64, &SceneWork))| {
        i == j && a.path == b.path && counts(a) == counts(b)
    };
    one.scenes.len() == many.scenes.len() && one.scenes.iter().zip(&many.scenes).all(is_same)
}

/// The fraction of each stage that does not divide, from its times on one and on several threads (Karp and Flatt 1990).
fn serial_fractions(one: &Job, many: &Job, threads: f64) -> BTreeMap<String, f64> {
    let many = many.stages();
    let fraction = |(stage, (_, seconds)): (&str, (u64, f64))| {
        let parallel = many.get(stage).map_or(0.0, |(_, seconds)| *seconds);
        let ratio = if seconds > 0.0 { parallel / seconds } else { 1.0 };
        (stage.to_string(), ((ratio - 1.0 / threads) / (1.0 - 1.0 / threads)).clamp(0.0, 1.0))
    };
    one.stages().into_iter().map(fraction).collect()
}

/// The critical path and the scene that it goes through. Without known fractions, stages may divide fully or not at all.
fn critical_path(
    job: &Job,
    outside_seconds: f64,
    serial: Option<&BTreeMap<String, f64>>,
) -> (SpanRange, String) {
    let fraction = |stage: &str, unknown: f64| {
        serial.map_or(unknown, |serial| serial.get(stage).copied().unwrap_or(unknown))
    };
    let mut span = SpanRange { least: 0.0, most: 0.0 };
    let mut longest = String::new();
    for scene in job.scenes.values() {
        span.least = span.least.max(scene.pipelined_path(|stage| fraction(stage, 0.0)));
        let most = scene.longest_path(|stage| fraction(stage, 1.0));
        if most >= span.most {
            span.most = most;
            longest.clone_from(&scene.path);
        }
    }
    (SpanRange { least: span.least + outside_seconds, most: span.most + outside_seconds }, longest)
}

/// The bounds of the speed-up by work and critical path.
fn speed_up(work: f64, span: SpanRange, cores: u32) -> SpeedUp {
    let n = f64::from(cores);
    let ratio = |seconds: f64| if seconds > 0.0 { work / seconds } else { n };
    SpeedUp {
        cores,
        at_least: ratio(span.most + (work - span.most).max(0.0) / n).min(n),
        at_most: ratio(span.least).min(n),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::file::Span;

    /// A run of scenes that follow each other on one thread, each a list of stages, after a second of start.
    fn run(threads: u32, scenes: &[&[(&str, f64)]]) -> Trace {
        let mut spans = Vec::new();
        let mut at = 1.0;
        for (scene, stages) in (1..).zip(scenes) {
            let path = format!("{scene}.glb");
            let start = at;
            for &(stage, seconds) in *stages {
                let (stage, path) = (stage.to_string(), path.clone());
                spans.push(Span { stage, scene, path, thread: 1, start: at, seconds });
                at += seconds;
            }
            spans.push(Span { stage: "scene".into(), scene, path, thread: 1, start, seconds: at - start });
        }
        Trace { threads, spans }
    }

    fn speed_ups(bound: &TraceBound, cores: u32) -> (f64, f64) {
        let found = bound.speed_ups.iter().find(|speed_up| speed_up.cores == cores).unwrap();
        (found.at_least, found.at_most)
    }

    /// Eight scenes of 3 seconds, of which 1 is not divided, and a second before them: T₁ = 25, T∞ = 2.
    #[test]
    fn speed_ups_are_between_brents_bounds() {
        let one = run(1, &[&[("load", 1.0), ("render", 2.0)][..]; 8]);
        let many = run(4, &[&[("load", 1.0), ("render", 0.5)][..]; 8]);
        let bound = TraceBound::new(&[many, one.clone()]).unwrap();
        assert_eq!((bound.threads.as_slice(), bound.outside_seconds), (&[1, 4][..], 1.0));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * b;
        assert!(close(bound.work_seconds, 25.0), "{bound:?}");
        assert!(close(bound.span_seconds.least, 2.0) && close(bound.span_seconds.most, 2.0), "{bound:?}");
        assert_eq!((bound.stages[0].stage.as_str(), bound.stages[0].count), ("render", 8));
        assert!(bound.stages[0].serial_fraction.unwrap() < 1e-9);
        assert!(close(bound.stages[1].serial_fraction.unwrap(), 1.0));
        let (least, most) = speed_ups(&bound, 8);
        assert!(close(least, 25.0 / (2.0 + 23.0 / 8.0)) && close(most, 8.0), "{bound:?}");
        let (least, most) = speed_ups(&bound, 32);
        assert!(close(least, 25.0 / (2.0 + 23.0 / 32.0)) && close(most, 12.5), "{bound:?}");

        // One thread does not show how far stages divide.
        let bound = TraceBound::new(&[one]).unwrap();
        assert!(close(bound.span_seconds.least, 1.0) && close(bound.span_seconds.most, 4.0), "{bound:?}");
        assert_eq!(bound.stages[0].serial_fraction, None);
        for SpeedUp { cores, at_least, at_most } in bound.speed_ups {
            assert!(1.0 <= at_least && at_least <= at_most && at_most <= f64::from(cores));
        }
    }

    #[test]
    fn the_critical_path_goes_through_the_longest_scene() {
        let bound =
            TraceBound::new(&[run(1, &[&[("load", 1.0)], &[("load", 7.0)], &[("load", 2.0)]])]).unwrap();
        assert_eq!((bound.longest_scene.as_str(), bound.span_seconds.most), ("2.glb", 8.0));
    }

    #[test]
    fn traces_without_one_thread_or_of_other_jobs_are_errors() {
        let one = run(1, &[&[("load", 1.0)]]);
        assert!(TraceBound::new(&[run(2, &[&[("load", 1.0)]])]).unwrap_err().contains("--threads 1"));
        for other in [run(2, &[&[("load", 1.0)][..]; 2]), run(2, &[&[("load", 1.0), ("load", 1.0)]])] {
            assert!(TraceBound::new(&[one.clone(), other]).unwrap_err().contains("different scenes"));
        }
    }
}
