//! `blinn render`: file → scene → posed scene → trees → picture → file, for each scene.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};

use super::args::RenderArgs;
use super::job::{Job, Target, natural_size};
use super::progress::Reporter;
use super::values::{Ao, Exposure, Layers};
use super::{Summary, Usage};
use crate::accel::{Accel, CleanReport};
use crate::display::{Display, ViewTransform};
use crate::geometry::Rgb;
use crate::import::load;
use crate::integrator::{Frame, Occlusion, Phong, Stage};
use crate::output::{Format, Part, Picture, save};
use crate::render::{RenderSettings, meter, render, render_aovs, render_mattes};
use crate::scene::{
    AnimationChoice, Camera, Ground, GroundKind, PoseSettings, PosedScene, Scene, Selection, View, pose,
};

pub(super) fn run(args: &RenderArgs) -> Result<Summary, Usage> {
    let job = Job::new(args)?;
    if let Some(threads) = args.process.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads));
        pool.build_global().map_err(|e| Usage(format!("--threads {threads}: {e}")))?;
    }
    let process = &args.process;
    let reporter = Reporter::new(process.progress, job.quiet, process.verbose, process.perf);
    let mut summary = Summary::default();
    for (scene, target) in &job.targets {
        summary.add(scene, one(&job, scene, target, &reporter));
    }
    Ok(summary)
}

/// Renders one scene.
fn one(job: &Job, path: &Path, target: &Target, reporter: &Reporter) -> Result<()> {
    let start = Instant::now();
    let (mut scene, warnings) = load(path, &job.load)?;
    scene.select(&job.selection)?;
    reporter.stage("load", start, &format!("{} triangles", scene.drawn_triangles()));
    let mut teller = Teller { job, path, reporter };
    for warning in &warnings {
        teller.warn(&warning.to_string())?;
    }
    if scene.instances.is_empty() && job.selection != Selection::default() {
        teller.warn("--hide and --only-objects leave nothing to see")?;
    }
    let picture = picture(job, &scene, &mut teller)?;

    let start = Instant::now();
    match target {
        Target::Stdout => {
            let bytes = Format::Png.encode(&picture, job.depth).context("standard output")?;
            match std::io::stdout().lock().write_all(&bytes) {
                Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => {}
                other => other.context("standard output")?,
            }
        }
        Target::File(file, format) => {
            if let Some(folder) = file.parent().filter(|f| !f.as_os_str().is_empty()) {
                std::fs::create_dir_all(folder)
                    .with_context(|| format!("folder {} cannot be made", folder.display()))?;
            }
            for written in save(&picture, file, *format, job.depth, job.replace)? {
                reporter.wrote(&written);
            }
        }
    }
    reporter.stage("save", start, "");
    Ok(())
}

/// Passes warnings on, or fails on them with `--strict`.
struct Teller<'a> {
    job: &'a Job,
    path: &'a Path,
    reporter: &'a Reporter,
}

impl Teller<'_> {
    fn warn(&self, text: &str) -> Result<()> {
        if self.job.strict {
            bail!("{text} (an error because of --strict)");
        }
        self.reporter.warn(self.path, text);
        Ok(())
    }
}

fn picture(job: &Job, scene: &Scene, teller: &mut Teller) -> Result<Picture> {
    let reporter = teller.reporter;
    let start = Instant::now();
    let animation = job.animation(scene)?;
    let posed = pose(scene, &PoseSettings { time: job.time, animation: animation.clone(), centre: None })?;
    reporter.stage("pose", start, "");

    let (width, height) = job.size_for(scene);
    let settings = RenderSettings { width, height, ..job.settings };
    if let Some(crop) = settings.crop
        && (u64::from(crop.x) + u64::from(crop.width) > u64::from(width)
            || u64::from(crop.y) + u64::from(crop.height) > u64::from(height))
    {
        bail!("--crop reaches beyond the picture of {width}x{height} pixels");
    }
    let (camera, notes) = job.view.resolve(&posed, width, height)?;
    for warning in &notes.warnings {
        teller.warn(warning)?;
    }

    let start = Instant::now();
    let (accel, cleaned) = Accel::build(&posed, &job.build);
    reporter.stage("build", start, "");
    if let Some(text) = left_out(&cleaned) {
        teller.warn(&text)?;
    }
    let surroundings = Surroundings::of(job, &posed);
    let shot = Shot { job, posed: &posed, accel: &accel, occlusion: surroundings.occlusion };
    let mut frame = shot.frame(camera);
    let integrator = Phong { stage: job.stage };
    let Exposed { ev, ambient } = exposure(job, scene, &animation, &frame, teller)?;
    frame.ambient = ambient.unwrap_or(frame.ambient);
    if job.ground == Some(GroundKind::Shadow) && frame.lights.is_empty() && job.ao.is_none() {
        teller.warn("--ground shadow shows nothing: no light casts a shadow, and --ao is not given")?;
    }
    // Only now: the ground changes neither what is framed nor what is metered.
    frame.ground = surroundings.ground;

    let start = Instant::now();
    let watch =
        reporter.watch(teller.path, u64::from(settings.window().width) * u64::from(settings.window().height));
    let pixels = render(&frame, &integrator, &settings, &watch)?;
    drop(watch);
    reporter.stage("render", start, &format!("{width}x{height}, {} samples", settings.samples));
    let start = Instant::now();
    let layers = render_aovs(&frame, &job.layers.aovs, &settings, &())?;
    let mattes = if job.layers.cryptomatte { render_mattes(&frame, &settings, &())? } else { Vec::new() };
    if job.layers != Layers::default() {
        reporter.stage("layers", start, "");
    }
    let view = job.view_transform.unwrap_or_else(|| ViewTransform::of(&scene.source));
    let display = Display { ev, view, background: job.background };
    let part = settings.crop.map(|crop| Part { crop, width, height });
    Ok(Picture { layers, mattes, part, ..Picture::new(pixels, display) })
}

/// What is sized by the scene, over the whole clip: no frame differs.
struct Surroundings {
    occlusion: Option<Occlusion>,
    ground: Option<Ground>,
}

impl Surroundings {
    /// Share of the scene's diagonal that occlusion looks for things in the way.
    const NEAR: f64 = 0.25;

    fn of(job: &Job, posed: &PosedScene) -> Surroundings {
        if job.ground.is_none() && job.ao.is_none() {
            return Surroundings { occlusion: None, ground: None };
        }
        let bounds = posed.clip_bounds();
        let occlusion = |ao: Ao| Occlusion {
            samples: ao.samples,
            distance: ao.distance.unwrap_or(Surroundings::NEAR * bounds.extent().length()),
        };
        Surroundings {
            occlusion: job.ao.map(occlusion),
            ground: job.ground.map(|kind| Ground::under(&bounds, kind)),
        }
    }
}

/// What a frame is made from beside its camera.
struct Shot<'a> {
    job: &'a Job,
    posed: &'a PosedScene<'a>,
    accel: &'a Accel,
    occlusion: Option<Occlusion>,
}

impl<'a> Shot<'a> {
    fn frame(&self, camera: Camera) -> Frame<'a> {
        let lit = self.job.lighting.resolve(self.posed, &camera);
        Frame {
            overrides: self.job.overrides,
            cull: self.job.cull,
            shadows: self.job.shadows,
            occlusion: self.occlusion,
            ..Frame::new(self.posed, self.accel, camera, &lit)
        }
    }
}

/// How a picture is exposed.
struct Exposed {
    /// Stops.
    ev: f64,
    /// Takes the place of the ambient colour.
    ambient: Option<Rgb>,
}

impl Exposed {
    fn at(ev: f64) -> Exposed {
        Exposed { ev, ambient: None }
    }
}

/// Stops: as given; 0 where the light is the lecture's own; else metered, once, at time 0 and
/// through the first camera, whatever frame is rendered.
fn exposure(
    job: &Job,
    scene: &Scene,
    animation: &AnimationChoice,
    frame: &Frame,
    teller: &Teller,
) -> Result<Exposed> {
    let lit = job.lighting.resolve(frame.posed, &frame.camera);
    teller.reporter.note(&format!("lights: {}", lit.note));
    let automatic = match job.exposure {
        Some(Exposure::Stops(ev)) => return Ok(Exposed::at(ev)),
        Some(Exposure::Auto) => true,
        None => lit.by_file && job.stage != Stage::Color,
    };
    if !automatic {
        return Ok(Exposed::at(0.0));
    }
    let start = Instant::now();
    // The shape is the camera's, not the picture's: thumbnails are exposed as their originals.
    let (width, height) = natural_size(scene, (!scene.cameras.is_empty()).then_some(0));
    let aspect = f64::from(width) / f64::from(height);
    let integrator = Phong { stage: job.stage };
    let first = if scene.cameras.is_empty() {
        job.view.at_rest()
    } else {
        View { clip: job.view.clip, ..View::default() }
    };
    let measure = |posed: &PosedScene, accel: &Accel| -> Result<_> {
        let (camera, _) = first.resolve(posed, width, height)?;
        let frame = Shot { job, posed, accel, occlusion: frame.occlusion }.frame(camera);
        if lit.assumed {
            // What the lights' unit is shows in the lights alone.
            let unlit = Frame { ambient: Rgb::ZERO, ..frame.clone() };
            if let Some(metered) = meter(&unlit, &integrator, aspect, &())? {
                return Ok(Some(metered));
            }
        }
        Ok(meter(&frame, &integrator, aspect, &())?)
    };
    let metered = if job.time == 0.0 || scene.animations.is_empty() {
        measure(frame.posed, frame.accel)?
    } else {
        let posed = pose(scene, &PoseSettings { time: 0.0, animation: animation.clone(), centre: None })?;
        measure(&posed, &Accel::build(&posed, &job.build).0)?
    };
    teller.reporter.stage("meter", start, "");
    let Some(metered) = metered else {
        teller.warn("nothing that the camera sees is lit: exposure 0")?;
        return Ok(Exposed::at(0.0));
    };
    // Blender's files near mid-grey are exposed as their author saw them.
    let near = metered.below_mid_grey.abs() <= 4.0;
    let keep = job.exposure.is_none() && scene.source.is_blender() && near;
    let ev = if keep { 0.0 } else { (metered.ev * 1e4).round() / 1e4 };
    if near || !lit.assumed {
        teller.reporter.note(&format!("exposure: --exposure {ev}"));
        return Ok(Exposed::at(ev));
    }
    // Far from it, the lights are in another unit than the usual one — no file says which — and the
    // world, which is in none, stays what it is beside them.
    let ambient = frame.ambient * libm::exp2(-ev) as f32;
    let [r, g, b] = ambient.to_array();
    teller.reporter.note(&format!("exposure: --exposure {ev} --ambient {r},{g},{b}"));
    Ok(Exposed { ev, ambient: Some(ambient) })
}

fn left_out(report: &CleanReport) -> Option<String> {
    let mut parts = Vec::new();
    if report.non_finite > 0 {
        parts.push(format!("{} with vertices that are not finite numbers", report.non_finite));
    }
    if report.zero_area > 0 {
        parts.push(format!("{} without area", report.zero_area));
    }
    (!parts.is_empty()).then(|| format!("triangles left out: {}", parts.join(", ")))
}
