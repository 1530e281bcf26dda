//! One round of all stages of a scene, on a given number of threads.

use std::hint::black_box;

use super::interleaved_timer::{InterleavedTimer, Timing};
use super::rays::RaySets;
use super::record::{MeasureError, SceneRecord};
use super::report::HeatMap;
use super::results::BvhResults;
use super::settings::{BenchObserver, BenchSettings};
use super::stage::BenchStage;
use super::stage_record::{StageKey, StageWork};
use super::work_hash::WorkHash;
use super::workload::Workload;
use blinn_accel::{Accel, AccelSettings, AccelStats};
use blinn_core::geometry::Rgb;
use blinn_import::{LoadError, Warning};
use blinn_output::{BitDepth, ImageFormat, Picture};
use blinn_render::display::{Background, Display, ViewTransform};
use blinn_render::integrator::{Aov, Frame, Phong};
use blinn_render::{NoisyPicture, RenderSettings, meter, render, render_aovs};
use blinn_scene::{Lighting, PoseSettings, PosedScene, Scene, View, pose};
use blinn_session::{default_round_sizes, load_scene};

/// Samples per pixel of the picture whose noise is removed, at least: the default of `blinn render`.
const NOISY_SAMPLES: u32 = 4;

/// One round of a scene.
pub(super) struct SceneRound<'a> {
    pub settings: &'a BenchSettings,
    pub workload: &'a Workload,
    pub timer: &'a InterleavedTimer,
    pub threads: usize,
    /// The first round on the first number of threads: it also reports warnings and BVH statistics.
    pub is_first: bool,
    pub record: &'a mut SceneRecord,
}

/// The camera and the size of an image.
struct Image {
    /// Index in the workload's cameras; `None` for the default view.
    camera: Option<usize>,
    settings: RenderSettings,
}

/// Loads a scene. Conversions of .blend files are taken from the cache, unless that is off, from the second time on.
fn load(workload: &Workload, settings: &BenchSettings) -> Result<(Scene, Vec<Warning>), LoadError> {
    load_scene(&workload.file, &settings.load, settings.blender.as_deref())
}

impl SceneRound<'_> {
    /// Measures all stages. Returns a heat map in the first round, if the settings want one.
    pub fn run(&mut self, observer: &mut dyn BenchObserver) -> Result<Option<HeatMap>, MeasureError> {
        let settings = self.settings;
        let timer = self.timer;
        let build = AccelSettings { simd: settings.simd, ..AccelSettings::default() };
        if self.is_first && !settings.memory {
            self.warm_up(&build)?;
        }
        let (timing, loaded) = self.timed(BenchStage::Load, || load(self.workload, settings));
        let (scene, warnings) = loaded?;
        if self.is_first {
            observer.scene_loaded(self.workload, &warnings).map_err(MeasureError::Rejected)?;
        }
        self.add(BenchStage::Load, None, StageWork::default(), timing)?;
        let posed = timer.install(|| pose(&scene, &PoseSettings::default()))?;

        let (timing, (accel, _)) = self.timed(BenchStage::Build, || Accel::build(&posed, &build));
        self.add(BenchStage::Build, None, StageWork::default(), timing)?;
        if self.is_first {
            self.record.triangles = Some(scene.instanced_triangle_count());
            self.record.bvh = bvh_results(&accel);
        }

        let mut heat_map = None;
        let cameras = &self.workload.cameras;
        let cameras = if cameras.is_empty() { vec![None] } else { (0..cameras.len()).map(Some).collect() };
        for (camera, &(width, height)) in
            cameras.into_iter().flat_map(|camera| settings.sizes.iter().map(move |size| (camera, size)))
        {
            let image = Image { camera, settings: RenderSettings { width, height, ..settings.render } };
            let map = self.measure_image(&image, &scene, &posed, &accel)?;
            heat_map = heat_map.or(map);
        }
        Ok(heat_map)
    }

    /// Loads the scene and builds its BVH once before anything is timed.
    ///
    /// glibc's malloc raises its thresholds when it frees a large buffer, such as a BVH. Before that, each load gets its
    /// memory from the kernel anew and takes up to 1.8× as long: the first round, and so one thread, would look slower.
    fn warm_up(&self, build: &AccelSettings) -> Result<(), MeasureError> {
        let (scene, _) = self.timer.install(|| load(self.workload, self.settings))?;
        let posed = self.timer.install(|| pose(&scene, &PoseSettings::default()))?;
        drop(self.timer.install(|| Accel::build(&posed, build)));
        Ok(())
    }

    /// Measures the stages that depend on the image. Returns a heat map in the first round.
    fn measure_image(
        &mut self,
        image: &Image,
        scene: &Scene,
        posed: &PosedScene,
        accel: &Accel,
    ) -> Result<Option<HeatMap>, MeasureError> {
        let timer = self.timer;
        let settings = &image.settings;
        let camera = image.camera.and_then(|i| self.workload.cameras.get(i));
        let view = camera.map_or_else(View::default, |camera| camera.view(posed.bounds()));
        let (frame, display) = timer.install(|| frame_and_display(settings, &view, scene, posed, accel))?;
        self.measure_rays(&frame, image)?;

        if self.wants(BenchStage::Frame) || self.wants(BenchStage::Encode) {
            let (timing, pixels) =
                self.timed(BenchStage::Frame, || render(&frame, &Phong::default(), settings, &()));
            let pixels = pixels?;
            let hash = self.has_hashes().then(|| WorkHash::of_pixels(&pixels.colors));
            self.add(BenchStage::Frame, Some(image), StageWork { hash, ..StageWork::default() }, timing)?;
            let picture = Picture::new(pixels, display);
            let encode = || ImageFormat::Png.encode(&picture, BitDepth::Default);
            let (timing, png) = self.timed(BenchStage::Encode, encode);
            png?;
            self.add(BenchStage::Encode, Some(image), StageWork::default(), timing)?;
        }
        if self.wants(BenchStage::Denoise) {
            self.measure_filter(&frame, image)?;
        }

        if self.is_first && self.settings.heat_maps { self.heat_map(&frame, settings) } else { Ok(None) }
    }

    /// Measures the filter of a picture with one bounce of indirect light.
    fn measure_filter(&mut self, frame: &Frame, image: &Image) -> Result<(), MeasureError> {
        let frame = Frame { indirect: 1, ..frame.clone() };
        let samples = image.settings.samples.max(NOISY_SAMPLES);
        let settings = RenderSettings { samples, ..image.settings };
        let render = || NoisyPicture::render(&frame, &Phong::default(), &settings, &());
        let noisy = self.timer.install(render)?;
        let (timing, pixels) = self.timed(BenchStage::Denoise, || noisy.filter(&frame, &()));
        let pixels = pixels?;
        let hash = self.has_hashes().then(|| WorkHash::of_pixels(&pixels.colors));
        self.add(BenchStage::Denoise, Some(image), StageWork { hash, ..StageWork::default() }, timing)
    }

    fn measure_rays(&mut self, frame: &Frame, image: &Image) -> Result<(), MeasureError> {
        let timer = self.timer;
        let (accel, posed) = (frame.accel, frame.posed);
        let Some(last) = self.settings.stages.iter().copied().filter(|stage| stage.traces_rays()).max()
        else {
            return Ok(());
        };
        let mut sets = RaySets::new(frame, &image.settings);
        while let Some(set) = timer.install(|| sets.next_set()) {
            if self.wants(set.stage) {
                let timing = timer.measure(|| black_box(set.trace(accel, posed))).0;
                let mut work = StageWork { rays: Some(set.len()), ..StageWork::default() };
                if self.has_hashes() {
                    work.hash = Some(timer.install(|| set.hash(accel, posed)));
                }
                if self.has_hashes() && self.is_first {
                    work.steps = timer.install(|| set.mean_steps(accel, posed));
                }
                self.add(set.stage, Some(image), work, Some(timing))?;
            }
            if set.stage == last {
                break;
            }
        }
        Ok(())
    }

    /// Returns false for a run that measures memory: hashes and steps would add to it.
    fn has_hashes(&self) -> bool {
        !self.settings.memory
    }

    fn wants(&self, stage: BenchStage) -> bool {
        self.settings.stages.contains(&stage)
    }

    /// Does the work of a stage: several times if it is measured, else once.
    fn timed<T: Send>(&self, stage: BenchStage, work: impl Fn() -> T + Send + Sync) -> (Option<Timing>, T) {
        if self.wants(stage) {
            let (timing, result) = self.timer.measure(work);
            return (Some(timing), result);
        }
        (None, self.timer.install(work))
    }

    fn heat_map(&self, frame: &Frame, settings: &RenderSettings) -> Result<Option<HeatMap>, MeasureError> {
        let layers = self.timer.install(|| render_aovs(frame, &[Aov::Steps], settings, &()))?;
        let size = (settings.width, settings.height);
        let map = layers.first().map(|layer| HeatMap::new(&self.workload.name, layer, size));
        Ok(map.transpose()?)
    }

    /// Adds the measurement of a stage, if it is measured.
    fn add(
        &mut self,
        stage: BenchStage,
        image: Option<&Image>,
        work: StageWork,
        timing: Option<Timing>,
    ) -> Result<(), MeasureError> {
        let Some(timing) = timing else { return Ok(()) };
        let size = image.map(|image| (image.settings.width, image.settings.height));
        let camera = image.and_then(|image| image.camera);
        self.record.add(StageKey { threads: self.threads, camera, size, stage }, work, timing)
    }
}

fn bvh_results(accel: &Accel) -> BvhResults {
    let AccelStats { nodes, triangles, bytes, .. } = accel.stats();
    let finite = |v: f64| Some(v).filter(|v| v.is_finite());
    BvhResults {
        nodes: nodes as u64,
        entries: triangles as u64,
        bytes: bytes as u64,
        bytes_per_triangle: finite(bytes as f64 / triangles as f64),
        sah_cost: finite(accel.sah_cost()),
    }
}

/// Sets the scene up as `blinn render` does by default: the view, else the first camera or a framing, and the file's
/// lights or three-point lighting.
fn frame_and_display<'a>(
    settings: &RenderSettings,
    view: &View,
    scene: &Scene,
    posed: &'a PosedScene<'a>,
    accel: &'a Accel,
) -> Result<(Frame<'a>, Display), MeasureError> {
    let RenderSettings { width, height, .. } = *settings;
    let (camera, _) = view.resolve(posed, width, height)?;
    let lit = Lighting::default().resolve(posed, &camera);
    let rounds = default_round_sizes(accel, &camera, height);
    let frame = Frame { rounds, ..Frame::new(posed, accel, camera, &lit) };
    let metered = match lit.uses_file_lights {
        true => meter(&frame, &Phong::default(), f64::from(width) / f64::from(height), &())?,
        false => None,
    };
    let display = Display {
        ev: metered.map_or(0.0, |metered| metered.ev),
        view: ViewTransform::default_for(&scene.source),
        background: Background::Color(Rgb::splat(0.05)),
        ..Display::default()
    };
    Ok((frame, display))
}
