//! A run: round after round, every scene, every number of threads, every stage.

use std::hint::black_box;

use super::calibration::Calibration;
use super::rays::BenchRays;
use super::report::HeatMap;
use super::results::{BenchResults, BenchStage, BvhResults, RecordedSettings, SceneResults, StageResults};
use super::workload::Workload;
use crate::accel::{Accel, AccelStats, BuildSettings, SimdLevel};
use crate::bench::interleaved_timer::{InterleavedTimer, Timing};
use crate::display::{Background, Display, ViewTransform};
use crate::geometry::Rgb;
use crate::import::{LoadError, LoadOptions, Warning, load};
use crate::integrator::{Aov, Frame, Phong};
use crate::output::{BitDepth, ImageFormat, Picture};
use crate::render::{Cancelled, RenderSettings, meter, render, render_aovs};
use crate::scene::pose;
use crate::scene::{Lighting, PoseError, PoseSettings, PosedScene, Scene, View, ViewError};

/// How a run is made.
#[derive(Clone, Debug)]
pub struct BenchSettings {
    /// How files are read.
    pub load: LoadOptions,
    /// Pixels and samples of pictures; rays go through the pixels' centres.
    pub render: RenderSettings,
    /// Rounds over all scenes.
    pub rounds: u32,
    /// Numbers of threads.
    pub threads: Vec<usize>,
    /// Instructions to trace with.
    pub simd: SimdLevel,
    /// True: with pictures of what eye rays cost.
    pub heat_maps: bool,
    /// True: nothing is timed, and everything is done once for the memory that it takes. A process keeps
    /// much of what it had for what came before, so that this is for one that measures nothing else.
    pub memory: bool,
    /// The command line, for the record.
    pub command: Vec<String>,
}

/// What a run found.
#[derive(Debug)]
pub struct BenchRun {
    /// The figures.
    pub figures: BenchResults,
    /// Pictures of what eye rays cost, where they were asked for.
    pub heat_maps: Vec<HeatMap>,
    /// Scenes that could not be measured: their index, and why.
    pub failed: Vec<(usize, MeasureError)>,
}

/// Why a scene could not be measured, in one line.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// It cannot be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// It cannot be posed.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// It cannot be looked at.
    #[error(transparent)]
    View(#[from] ViewError),
    /// Its picture cannot be encoded.
    #[error("a picture cannot be encoded: {0}")]
    Encode(#[from] std::io::Error),
    /// A picture was not finished.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// So many threads cannot be had.
    #[error("{threads} threads cannot be had: {cause}; ask for fewer")]
    Threads {
        /// How many.
        threads: usize,
        /// Why not.
        cause: rayon::ThreadPoolBuildError,
    },
    /// The listener would not have it.
    #[error("{0}")]
    Refused(String),
}

/// What a run tells of itself as it goes.
pub trait BenchObserver {
    /// A round of a scene begins.
    fn scene_started(&mut self, subject: &Workload, round: u32);
    /// What reading the scene warned of, once.
    ///
    /// # Errors
    /// Why the scene shall not be measured then.
    fn scene_loaded(&mut self, subject: &Workload, warnings: &[Warning]) -> Result<(), String>;
}

/// A scene's outcomes so far.
#[derive(Default)]
struct Record {
    triangles: u64,
    tree: BvhResults,
    /// (stage, threads, rays, the rounds' outcomes)
    rows: Vec<(BenchStage, usize, Option<u64>, Vec<Timing>)>,
    failed: Option<MeasureError>,
}

impl Record {
    fn add(&mut self, stage: BenchStage, threads: usize, rays: Option<u64>, taken: Timing) {
        match self.rows.iter_mut().find(|row| (row.0, row.1) == (stage, threads)) {
            Some(row) => row.3.push(taken),
            None => self.rows.push((stage, threads, rays, vec![taken])),
        }
    }

    fn figures(&self, name: &str) -> SceneResults {
        let row = |(stage, threads, rays, rounds): &(BenchStage, usize, Option<u64>, Vec<Timing>)| {
            StageResults::of(*stage, *threads, *rays, rounds)
        };
        let mut stages: Vec<StageResults> = self.rows.iter().map(row).collect();
        stages.sort_by_key(|s| (s.threads, s.stage));
        let tree = Some(self.tree.clone());
        SceneResults { name: name.into(), triangles: self.triangles, tree, stages }
    }
}

/// Measures. A scene that fails does not keep the others from being measured.
pub fn measure(plan: &BenchSettings, subjects: &[Workload], listener: &mut dyn BenchObserver) -> BenchRun {
    let calibration = (!plan.memory).then_some(Calibration);
    let mut records: Vec<Record> = subjects.iter().map(|_| Record::default()).collect();
    let mut heat_maps = Vec::new();
    for round in 0..plan.rounds {
        for (subject, record) in subjects.iter().zip(&mut records) {
            if record.failed.is_some() {
                continue;
            }
            listener.scene_started(subject, round + 1);
            for (i, &threads) in plan.threads.iter().enumerate() {
                let first = round == 0 && i == 0;
                let turns = InterleavedTimer::new(calibration, threads);
                let done =
                    turns.map_err(|cause| MeasureError::Threads { threads, cause }).and_then(|turns| {
                        Pass { plan, subject, turns: &turns, threads, record: &mut *record }
                            .run(first, listener)
                    });
                match done {
                    Ok(map) => heat_maps.extend(map),
                    Err(e) => {
                        record.failed = Some(e);
                        break;
                    }
                }
            }
        }
    }
    let settings = RecordedSettings {
        command: plan.command.clone(),
        width: plan.render.width,
        height: plan.render.height,
        samples: plan.render.samples,
        rounds: plan.rounds,
        threads: plan.threads.iter().map(|&threads| threads as u32).collect(),
        simd: plan.simd.name().into(),
        debug_build: cfg!(debug_assertions),
        ..RecordedSettings::default()
    };
    let measured = subjects.iter().zip(&records).filter(|(_, record)| record.failed.is_none());
    let scenes = measured.map(|(subject, record)| record.figures(&subject.name)).collect();
    let failed =
        records.into_iter().enumerate().filter_map(|(i, record)| Some((i, record.failed?))).collect();
    BenchRun { figures: BenchResults::new(settings, scenes), heat_maps, failed }
}

/// One round of one scene on so many threads.
struct Pass<'a> {
    plan: &'a BenchSettings,
    subject: &'a Workload,
    turns: &'a InterleavedTimer,
    threads: usize,
    record: &'a mut Record,
}

impl Pass<'_> {
    fn run(
        &mut self,
        first: bool,
        listener: &mut dyn BenchObserver,
    ) -> Result<Option<HeatMap>, MeasureError> {
        let (plan, turns) = (self.plan, self.turns);
        let (taken, loaded) = turns.measure(|| load(&self.subject.file, &plan.load));
        let (scene, warnings) = loaded?;
        if first {
            listener.scene_loaded(self.subject, &warnings).map_err(MeasureError::Refused)?;
        }
        self.add(BenchStage::Load, None, taken);
        let posed = turns.install(|| pose(&scene, &PoseSettings::default()))?;

        let build = BuildSettings { simd: plan.simd, ..BuildSettings::default() };
        let (taken, (accel, _)) = turns.measure(|| Accel::build(&posed, &build));
        self.add(BenchStage::Build, None, taken);
        if first {
            self.record.triangles = scene.instanced_triangle_count();
            self.record.tree = tree(&accel);
        }

        let (frame, display) = turns.install(|| set_up(plan, &scene, &posed, &accel))?;
        let rays = turns.install(|| BenchRays::new(&frame, &plan.render));
        let (taken, hits) = turns.measure(|| black_box(rays.trace_eye(&accel, &posed)));
        self.add(BenchStage::Eye, Some(rays.eye_count()), taken);
        if hits > 0 {
            let (taken, _) = turns.measure(|| black_box(rays.trace_shadow(&accel, &posed)));
            self.add(BenchStage::Shadow, Some(rays.hit_count()), taken);
            let (taken, _) = turns.measure(|| black_box(rays.trace_incoherent(&accel, &posed)));
            self.add(BenchStage::Incoherent, Some(rays.hit_count()), taken);
        }
        drop(rays);

        let (taken, pixels) = turns.measure(|| render(&frame, &Phong::default(), &plan.render, &()));
        self.add(BenchStage::Frame, None, taken);
        let picture = Picture::new(pixels?, display);
        let (taken, png) = turns.measure(|| ImageFormat::Png.encode(&picture, BitDepth::Default));
        png?;
        self.add(BenchStage::Encode, None, taken);

        if !(first && plan.heat_maps) {
            return Ok(None);
        }
        let layers = turns.install(|| render_aovs(&frame, &[Aov::Steps], &plan.render, &()))?;
        let size = (plan.render.width, plan.render.height);
        let map = layers.first().map(|layer| HeatMap::new(&self.subject.name, layer, size));
        Ok(map.transpose()?)
    }

    fn add(&mut self, stage: BenchStage, rays: Option<u64>, taken: Timing) {
        self.record.add(stage, self.threads, rays, taken);
    }
}

fn tree(accel: &Accel) -> BvhResults {
    let AccelStats { nodes, triangles: entries, bytes, .. } = accel.stats();
    let finite = |v: f64| Some(v).filter(|v| v.is_finite());
    BvhResults {
        nodes: nodes as u64,
        entries: entries as u64,
        bytes: bytes as u64,
        bytes_per_triangle: finite(bytes as f64 / entries as f64),
        sah_cost: finite(accel.sah_cost()),
    }
}

/// The scene as `render` shows it: through its first camera or framed, lit by its lights or by three.
fn set_up<'a>(
    plan: &BenchSettings,
    scene: &Scene,
    posed: &'a PosedScene<'a>,
    accel: &'a Accel,
) -> Result<(Frame<'a>, Display), MeasureError> {
    let RenderSettings { width, height, .. } = plan.render;
    let (camera, _) = View::default().resolve(posed, width, height)?;
    let lit = Lighting::default().resolve(posed, &camera);
    let frame = Frame::new(posed, accel, camera, &lit);
    let metered = match lit.uses_file_lights {
        true => meter(&frame, &Phong::default(), f64::from(width) / f64::from(height), &())?,
        false => None,
    };
    let display = Display {
        ev: metered.map_or(0.0, |metered| metered.ev),
        view: ViewTransform::default_for(&scene.source),
        background: Background::Color(Rgb::splat(0.05)),
    };
    Ok((frame, display))
}
