use super::*;
use crate::interleaved_timer::Timing;
use crate::results::{BvhResults, Program};
use crate::stage::BenchStage;
use crate::stage_record::{StageKey, StageRecord, StageWork};

/// A run of five scenes whose rounds scatter by about 1 %. All times are multiplied by `factor`.
fn run(factor: f64, rounds: usize, seed: usize) -> BenchResults {
    let stages = |scene: usize| {
        BenchStage::ALL.into_iter().enumerate().map(move |(i, stage)| {
            let timing = |round: usize| {
                let shift = ((seed + 7 * scene + 3 * i + 5 * round) % 11) as f64 / 5.0 - 1.0;
                let relative = factor * (1.0 + 0.01 * shift);
                let seconds = relative * 0.001;
                Timing {
                    seconds,
                    relative,
                    wall_seconds: seconds / 0.9,
                    min_seconds: 0.9 * seconds,
                    min_calibration_seconds: 0.0009,
                    wait_fraction: 0.1,
                    joules: f64::NAN,
                    peak_bytes: Some(1 << 20),
                }
            };
            let key =
                StageKey { threads: 1, camera: None, size: stage.has_size().then_some((64, 36)), stage };
            let rounds = (0..rounds).map(timing).collect();
            StageResults::new(&StageRecord { key, work: StageWork::default(), rounds }, None)
        })
    };
    let scene = |i: usize| SceneResults {
        name: format!("scene {i}"),
        sha256: None,
        triangles: 10,
        tree: None,
        stages: stages(i).collect(),
    };
    let mut results = BenchResults::new(RecordedSettings::default(), (0..5).map(scene).collect());
    results.machine = Machine::default();
    results
}

#[test]
fn only_real_changes_are_significant() {
    for seed in 0..11 {
        let same = compare(&run(1.0, 5, 0), &run(1.0, 5, seed));
        assert_eq!(same.changes.len(), 5 * 14 * 2);
        assert!(same.notes.is_empty(), "{:?}", same.notes);
        assert_eq!(same.significant().count(), 0, "{same:?}");
        let slower = compare(&run(1.0, 5, 0), &run(1.2, 5, seed));
        let faster = compare(&run(1.2, 5, 0), &run(1.0, 5, seed));
        assert!(slower.has_regression() && slower.significant().count() == 70);
        assert!(!faster.has_regression() && faster.significant().all(|c| c.verdict == Verdict::Less));
        assert_eq!(faster.significant().count(), 70);
    }
}

#[test]
fn the_ratio_of_minima_exists_on_one_thread_only() {
    let (mut old, mut new) = (run(1.0, 5, 0), run(1.5, 5, 0));
    new.scenes[1].stages[0].least_relative = None;
    new.scenes[2].stages[0].threads = 2;
    old.scenes[2].stages[0].threads = 2;
    for change in compare(&old, &new).changes {
        let expected = match (change.scene.as_str(), change.metric.as_str()) {
            (_, metric) if metric.ends_with("memory") => None,
            ("scene 1", "load, 1 thread") | ("scene 2", "load, 2 threads") => None,
            _ => Some(1.5),
        };
        let min_ratio = change.min_ratio.map(|ratio| (ratio * 1000.0).round() / 1000.0);
        assert_eq!(min_ratio, expected, "{change:?}");
    }
}

/// A change by 20 % is significant if the rounds agree, but not if they differ as much.
#[test]
fn noise_follows_the_spread_of_the_rounds() {
    let (old, mut new) = (run(1.0, 5, 0), run(1.2, 5, 1));
    for stage in new.scenes.iter_mut().flat_map(|scene| &mut scene.stages) {
        stage.relative = [0.9, 1.5, 1.2, 1.0, 1.4].map(Some).to_vec();
    }
    let compared = compare(&old, &new);
    assert_eq!(compared.significant().count(), 0, "{compared:?}");
    assert!(compared.changes.iter().any(|c| c.ratio > 1.19 && c.noise > 0.3));
}

#[test]
fn rounds_that_agree_by_chance_do_not_lower_the_noise() {
    let (mut old, mut new) = (run(1.0, 3, 0), run(1.0, 3, 1));
    for (i, stage) in old.scenes.iter_mut().chain(&mut new.scenes).flat_map(|s| &mut s.stages).enumerate() {
        let scatter = if i == 0 || i == 65 { 0.0 } else { 0.05 };
        let middle = if i == 0 { 1.1 } else { 1.0 };
        stage.relative = [1.0 - scatter, 1.0, 1.0 + scatter].map(|v| Some(v * middle)).to_vec();
    }
    assert_eq!(compare(&old, &new).significant().count(), 0);
}

#[test]
fn missing_results_are_noted_or_skipped() {
    let (old, mut new) = (run(1.0, 5, 0), run(2.0, 5, 0));
    new.scenes[0].name = "new".into();
    new.scenes[1].triangles = 11;
    new.scenes[2].stages[2].rays = Some(5);
    new.scenes[3].stages[0].relative = vec![None, None];
    new.scenes[3].stages[1].relative = vec![Some(f64::NAN), Some(-1.0), Some(0.0), None];
    new.scenes[4].stages.clear();
    new.machine.cores = 64;
    let compared = compare(&old, &new);
    for text in
        ["new: only in the new", "scene 0: only in the old", "scene 1: different scenes", "different rays"]
    {
        assert!(compared.notes.iter().any(|note| note.contains(text)), "{text}: {:?}", compared.notes);
    }
    assert!(compared.notes[0].contains("different machines"));
    let times = compared.changes.iter().filter(|c| !c.metric.contains("memory"));
    assert_eq!(times.count(), 13 + 12);
    let single = compare(&run(1.0, 1, 0), &run(3.0, 1, 0));
    assert!(single.significant().count() == 0 && single.notes[0].contains("two rounds"), "{single:?}");
    new.settings.calibration += 1;
    assert!(compare(&old, &new).notes.iter().any(|note| note.contains("seconds are compared")));
    assert!(compare(&new, &old).changes.iter().all(|c| c.ratio.is_finite()));
}

#[test]
fn bvh_statistics_have_no_noise() {
    let (mut old, mut new) = (run(1.0, 5, 0), run(1.0, 5, 0));
    let tree = BvhResults { nodes: 100, sah_cost: Some(50.0), ..Default::default() };
    old.scenes[0].tree = Some(tree.clone());
    new.scenes[0].tree = Some(BvhResults { sah_cost: Some(51.0), bytes_per_triangle: Some(3.0), ..tree });
    let compared = compare(&old, &new);
    let moved: Vec<&str> = compared.significant().map(|c| c.metric.as_str()).collect();
    assert_eq!(moved, ["SAH cost"]);
}

/// Runs with other hashes of a stage did different work. Frames of other samples do so on purpose.
#[test]
fn different_hashes_are_different_work() {
    let (mut old, mut new) = (run(1.0, 5, 0), run(1.0, 5, 0));
    let set = |results: &mut BenchResults, stage: usize, hash: &str| {
        results.scenes[1].stages[stage].hash = Some(hash.into());
    };
    let frame = BenchStage::ALL.iter().position(|stage| *stage == BenchStage::Frame).unwrap();
    for (stage, [a, b]) in [(2, ["one", "two"]), (3, ["three", "three"]), (frame, ["four", "five"])] {
        set(&mut old, stage, a);
        set(&mut new, stage, b);
    }
    let compared = compare(&old, &new);
    assert_eq!(compared.different_work.len(), 2, "{compared:?}");
    assert!(compared.different_work[0].starts_with("scene 1: eye, 64x36, 1 thread: hash one, then two"));
    assert_eq!(compared.changes.len(), (5 * 14 - 2) * 2);
    new.settings.samples = 4;
    assert_eq!(compare(&old, &new).different_work.len(), 1);
}

#[test]
fn scenes_of_other_paths_are_found_by_their_files() {
    let with_hashes = |mut run: BenchResults, folder: &str| {
        for (i, scene) in run.scenes.iter_mut().enumerate() {
            scene.name = format!("{folder}/{i}.glb");
            scene.sha256 = Some(format!("hash {i}"));
        }
        run
    };
    let compared = compare(&with_hashes(run(1.0, 5, 0), "a"), &with_hashes(run(1.2, 5, 0), "b/c"));
    assert!(compared.notes.is_empty(), "{:?}", compared.notes);
    assert_eq!(compared.significant().count(), 70);
}

#[test]
fn stages_that_were_measured_otherwise_are_counted_and_not_compared() {
    let (mut old, mut new) = (run(1.0, 5, 0), run(2.0, 5, 0));
    new.settings.samples = old.settings.samples + 3;
    old.settings.threads = vec![1];
    new.settings.threads = vec![1, 2];
    new.scenes[0].stages[3].threads = 2;
    let compared = compare(&old, &new);
    // The frames and filtered pictures of all scenes, and the stage of another number of threads.
    assert_eq!(compared.without_counterpart, 11);
    let has_samples = |metric: &str| metric.starts_with("frame") || metric.starts_with("denoise");
    assert!(compared.changes.iter().all(|change| !has_samples(&change.metric)));
    let note = "different numbers of threads: 1, then 1, 2";
    assert!(compared.notes.iter().any(|text| text == note), "{:?}", compared.notes);
}

/// Both programs are named, also where only their files differ.
#[test]
fn programs_are_named() {
    let [old, mut new] = [1.0, 1.0].map(|factor| run(factor, 2, 0));
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(compare(&old, &new).program_line(), format!("blinn {version} in both runs"));
    new.program = Program {
        sha256: Some("0123456789abcdef".into()),
        target: "x86_64-linux".into(),
        rustc: "rustc 1.92.0 (ded5c06cf 2025-12-08)".into(),
        commit: Some("89abcdef01234567".into()),
    };
    let line = compare(&old, &new).program_line();
    assert_eq!(
        line,
        format!(
            "old: blinn {version}; new: blinn {version}, x86_64-linux, rustc 1.92.0, commit 89abcdef, executable 01234567"
        )
    );
}
