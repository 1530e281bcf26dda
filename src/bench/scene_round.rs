//! One round of all stages of a scene, on a given number of threads.

use std::hint::black_box;

use super::interleaved_timer::{InterleavedTimer, Timing};
use super::rays::BenchRays;
use super::record::{MeasureError, SceneRecord};
use super::report::HeatMap;
use super::results::{BenchStage, BvhResults};
use super::settings::{BenchObserver, BenchSettings};
use super::workload::Workload;
use crate::accel::{Accel, AccelStats, BuildSettings};
use crate::display::{Background, Display, ViewTransform};
use crate::geometry::Rgb;
use crate::import::load;
use crate::integrator::{Aov, Frame, Phong};
use crate::output::{BitDepth, ImageFormat, Picture};
use crate::render::{RenderSettings, meter, render, render_aovs};
use crate::scene::{Lighting, PoseSettings, PosedScene, Scene, View, pose};

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

impl SceneRound<'_> {
    /// Measures all stages. Returns a heat map in the first round, if the settings want one.
    pub fn run(&mut self, observer: &mut dyn BenchObserver) -> Result<Option<HeatMap>, MeasureError> {
        let settings = self.settings;
        let timer = self.timer;
        let (timing, loaded) = timer.measure(|| load(&self.workload.file, &settings.load));
        let (scene, warnings) = loaded?;
        if self.is_first {
            observer.scene_loaded(self.workload, &warnings).map_err(MeasureError::Rejected)?;
        }
        self.add(BenchStage::Load, None, timing);
        let posed = timer.install(|| pose(&scene, &PoseSettings::default()))?;

        let build = BuildSettings { simd: settings.simd, ..BuildSettings::default() };
        let (timing, (accel, _)) = timer.measure(|| Accel::build(&posed, &build));
        self.add(BenchStage::Build, None, timing);
        if self.is_first {
            self.record.triangles = scene.instanced_triangle_count();
            self.record.bvh = bvh_results(&accel);
        }

        let (frame, display) = timer.install(|| frame_and_display(settings, &scene, &posed, &accel))?;
        self.measure_rays(&frame);

        let (timing, pixels) = timer.measure(|| render(&frame, &Phong::default(), &settings.render, &()));
        self.add(BenchStage::Frame, None, timing);
        let picture = Picture::new(pixels?, display);
        let (timing, png) = timer.measure(|| ImageFormat::Png.encode(&picture, BitDepth::Default));
        png?;
        self.add(BenchStage::Encode, None, timing);

        if self.is_first && settings.heat_maps { self.heat_map(&frame) } else { Ok(None) }
    }

    fn measure_rays(&mut self, frame: &Frame) {
        let timer = self.timer;
        let (accel, posed) = (frame.accel, frame.posed);
        let rays = timer.install(|| BenchRays::new(frame, &self.settings.render));
        let (timing, hits) = timer.measure(|| black_box(rays.trace_eye(accel, posed)));
        self.add(BenchStage::Eye, Some(rays.eye_count()), timing);
        if hits > 0 {
            let (timing, _) = timer.measure(|| black_box(rays.trace_shadow(accel, posed)));
            self.add(BenchStage::Shadow, Some(rays.hit_count()), timing);
            let (timing, _) = timer.measure(|| black_box(rays.trace_incoherent(accel, posed)));
            self.add(BenchStage::Incoherent, Some(rays.hit_count()), timing);
        }
    }

    fn heat_map(&self, frame: &Frame) -> Result<Option<HeatMap>, MeasureError> {
        let render = &self.settings.render;
        let layers = self.timer.install(|| render_aovs(frame, &[Aov::Steps], render, &()))?;
        let size = (render.width, render.height);
        let map = layers.first().map(|layer| HeatMap::new(&self.workload.name, layer, size));
        Ok(map.transpose()?)
    }

    fn add(&mut self, stage: BenchStage, rays: Option<u64>, timing: Timing) {
        self.record.add(stage, self.threads, rays, timing);
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

/// Sets the scene up as `blinn render` does by default: the first camera or a framing, the file's lights or
/// three-point lighting.
fn frame_and_display<'a>(
    settings: &BenchSettings,
    scene: &Scene,
    posed: &'a PosedScene<'a>,
    accel: &'a Accel,
) -> Result<(Frame<'a>, Display), MeasureError> {
    let RenderSettings { width, height, .. } = settings.render;
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
