//! The work of a job by scene and stage.

use std::collections::BTreeMap;

use super::file::{Span, Trace};

/// The stage that holds all others of its scene. Its own time is what no other stage measures.
const SCENE: &str = "scene";
/// The stage in which nothing is done.
const WAITING: &str = "wait for memory";
/// Spans that overlap by less than these seconds follow each other: an end is recorded a little late.
const SLACK: f64 = 20e-6;

/// The seconds of a job on its threads.
pub(super) struct Job {
    pub scenes: BTreeMap<u64, SceneWork>,
    /// From the start of the run to the end of the last span.
    pub seconds: f64,
    /// Seconds in which a thread waited for memory.
    pub waited: f64,
}

/// The work on a scene.
#[derive(Default)]
pub(super) struct SceneWork {
    pub path: String,
    /// Seconds of each run of each stage, in the order of their start.
    pub stages: BTreeMap<String, Vec<f64>>,
}

impl Job {
    pub fn new(trace: &Trace) -> Job {
        let mut job = Job { scenes: BTreeMap::new(), seconds: 0.0, waited: 0.0 };
        let own_seconds = own_seconds(&trace.spans);
        for i in by_start(&trace.spans) {
            let span = &trace.spans[i];
            job.seconds = job.seconds.max(span.end());
            if span.stage == WAITING {
                job.waited += own_seconds[i];
                continue;
            }
            let scene = job.scenes.entry(span.scene).or_default();
            scene.path.clone_from(&span.path);
            scene.stages.entry(span.stage.clone()).or_default().push(own_seconds[i]);
        }
        job
    }

    /// Number and seconds of the runs of each stage of all scenes.
    pub fn stages(&self) -> BTreeMap<&str, (u64, f64)> {
        let mut sums = BTreeMap::new();
        for (stage, seconds) in self.scenes.values().flat_map(|scene| &scene.stages) {
            let (count, sum) = sums.entry(stage.as_str()).or_insert((0, 0.0));
            *count += seconds.len() as u64;
            *sum += seconds.iter().sum::<f64>();
        }
        sums
    }

    /// Seconds of all stages.
    pub fn work(&self) -> f64 {
        self.stages().values().map(|(_, seconds)| seconds).sum()
    }
}

impl SceneWork {
    /// The critical path if all runs of all stages follow each other, and `serial` is the fraction of a stage that cannot
    /// be divided.
    pub fn longest_path(&self, serial: impl Fn(&str) -> f64) -> f64 {
        let path = |(stage, seconds): (&String, &Vec<f64>)| serial_part(stage, &serial) * sum(seconds);
        self.stages.iter().map(path).sum()
    }

    /// The critical path if frames are a pipeline: all stages of the first, then the longest stage of the others.
    pub fn pipelined_path(&self, serial: impl Fn(&str) -> f64) -> f64 {
        let mut first = 0.0;
        let mut longest = 0f64;
        for (stage, seconds) in &self.stages {
            let serial = serial_part(stage, &serial);
            let Some((start, rest)) = seconds.split_first() else { continue };
            first += serial * start;
            longest = longest.max(serial * sum(rest));
        }
        first + longest
    }
}

/// The fraction of a stage that cannot be divided. What is between stages is never divided.
fn serial_part(stage: &str, serial: impl Fn(&str) -> f64) -> f64 {
    if stage == SCENE { 1.0 } else { serial(stage) }
}

fn sum(seconds: &[f64]) -> f64 {
    seconds.iter().sum()
}

/// Indices of spans by their start; of those that start together, the one that holds the others first.
fn by_start(spans: &[Span]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..spans.len()).collect();
    order.sort_by(|&a, &b| {
        let (a, b) = (&spans[a], &spans[b]);
        a.start.total_cmp(&b.start).then(b.seconds.total_cmp(&a.seconds))
    });
    order
}

/// The seconds of each span without the spans inside it on the same thread.
fn own_seconds(spans: &[Span]) -> Vec<f64> {
    let mut own: Vec<f64> = spans.iter().map(|span| span.seconds).collect();
    // For each thread the spans that hold the current one.
    let mut open: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for i in by_start(spans) {
        let open = open.entry(spans[i].thread).or_default();
        while open.pop_if(|last| spans[*last].end() <= spans[i].start + SLACK).is_some() {}
        if let Some(&holder) = open.last() {
            own[holder] = (own[holder] - spans[i].seconds).max(0.0);
        }
        open.push(i);
    }
    own
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(stage: &str, scene: u64, thread: u64, start: f64, seconds: f64) -> Span {
        Span { stage: stage.into(), scene, path: format!("{scene}.glb"), thread, start, seconds }
    }

    /// A thread that waits for parts of its scene works on another scene.
    #[test]
    fn the_time_of_spans_inside_others_counts_once() {
        let spans = vec![
            span("scene", 1, 1, 1.0, 9.0),
            span("load", 1, 1, 1.0, 2.0),
            span("render", 1, 1, 3.00001, 6.0),
            span("scene", 2, 1, 4.0, 3.0),
            span("wait for memory", 2, 1, 4.0, 1.0),
            span("render", 2, 1, 5.0, 2.0),
            span("save", 2, 2, 4.0, 5.0),
        ];
        let job = Job::new(&Trace { threads: 2, spans });
        let seconds = |scene: u64, stage: &str| job.scenes[&scene].stages[stage][0];
        assert_eq!((job.seconds, job.waited), (10.0, 1.0));
        assert_eq!((seconds(1, "scene"), seconds(1, "load"), seconds(1, "render")), (1.0, 2.0, 3.0));
        assert_eq!((seconds(2, "scene"), seconds(2, "render"), seconds(2, "save")), (0.0, 2.0, 5.0));
        assert_eq!(job.work(), 13.0);
        assert_eq!(job.stages()["render"], (2, 5.0));
    }

    #[test]
    fn paths_of_frames_that_follow_each_other_and_of_a_pipeline() {
        let stages = [("load", vec![2.0]), ("render", vec![3.0, 4.0, 5.0]), ("save", vec![1.0, 2.0, 1.0])];
        let stages = stages.map(|(stage, seconds)| (stage.to_string(), seconds)).into();
        let scene = SceneWork { path: String::new(), stages };
        assert_eq!(scene.longest_path(|_| 1.0), 18.0);
        assert_eq!(scene.pipelined_path(|_| 1.0), 2.0 + 3.0 + 1.0 + 9.0);
        assert_eq!(scene.pipelined_path(|stage| if stage == "render" { 0.0 } else { 0.5 }), 1.0 + 0.5 + 1.5);
    }
}
