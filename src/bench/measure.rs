//! Runs the benchmarks: round after round, every scene, every number of threads, every stage.

use super::calibration::Calibration;
use super::interleaved_timer::InterleavedTimer;
use super::record::{MeasureError, SceneRecord};
use super::report::HeatMap;
use super::results::{BenchResults, Program, RecordedSettings};
use super::scene_round::SceneRound;
use super::settings::{BenchObserver, BenchSettings};
use super::workload::Workload;

/// The outcome of a benchmark run.
#[derive(Debug)]
pub struct BenchRun {
    /// The results of the scenes that did not fail and had at least one round.
    pub results: BenchResults,
    /// Index of the workload of each scene in the results.
    pub measured: Vec<usize>,
    /// Heat maps of the eye rays' traversal steps.
    pub heat_maps: Vec<HeatMap>,
    /// Indices of the workloads that failed, with the reason.
    pub failed: Vec<(usize, MeasureError)>,
}

/// Runs the benchmarks. A scene that fails does not affect the others.
pub fn measure(
    settings: &BenchSettings,
    workloads: &[Workload],
    observer: &mut dyn BenchObserver,
) -> BenchRun {
    let mut records: Vec<SceneRecord> = workloads.iter().map(|_| SceneRecord::default()).collect();
    let mut heat_maps = Vec::new();
    'rounds: for round in 0..settings.rounds {
        for (workload, record) in workloads.iter().zip(&mut records) {
            if observer.is_stopped() {
                break 'rounds;
            }
            if record.failure.is_some() {
                continue;
            }
            observer.scene_started(workload, round + 1);
            if let Err(e) = measure_scene(settings, workload, round, record, observer, &mut heat_maps) {
                record.failure = Some(e);
            }
        }
    }
    let measured = workloads.iter().enumerate().zip(&records).filter(|(_, record)| record.is_measured());
    let (measured, scenes) = measured.map(|((i, workload), record)| (i, record.results(workload))).collect();
    let failed =
        records.into_iter().enumerate().filter_map(|(i, record)| Some((i, record.failure?))).collect();
    let results =
        BenchResults { program: Program::current(), ..BenchResults::new(recorded(settings), scenes) };
    BenchRun { results, measured, heat_maps, failed }
}

/// Measures one round of a scene for each number of threads.
fn measure_scene(
    settings: &BenchSettings,
    workload: &Workload,
    round: u32,
    record: &mut SceneRecord,
    observer: &mut dyn BenchObserver,
    heat_maps: &mut Vec<HeatMap>,
) -> Result<(), MeasureError> {
    let calibration = (!settings.memory).then_some(Calibration);
    for (i, &threads) in settings.threads.iter().enumerate() {
        let timer = InterleavedTimer::new(calibration, threads, settings.min_seconds)
            .map_err(|cause| MeasureError::Threads { threads, cause })?;
        let is_first = round == 0 && i == 0;
        let mut scene_round =
            SceneRound { settings, workload, timer: &timer, threads, is_first, record: &mut *record };
        heat_maps.extend(scene_round.run(observer)?);
    }
    Ok(())
}

fn recorded(settings: &BenchSettings) -> RecordedSettings {
    RecordedSettings {
        command: settings.command.clone(),
        sizes: settings.sizes.iter().map(|&(width, height)| [width, height]).collect(),
        samples: settings.render.samples,
        rounds: settings.rounds,
        threads: settings.threads.iter().map(|&threads| threads as u32).collect(),
        simd: settings.simd.name().into(),
        debug_build: cfg!(debug_assertions),
        ..RecordedSettings::default()
    }
}
