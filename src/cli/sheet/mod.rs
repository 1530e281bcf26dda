//! `blinn sheet`: front, right, top and isometric views at one scale, with dimensions, or other views with their names.

mod cell;
mod empty_views;
mod grid;
mod labels;
mod layout;
mod views;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::args::{OutputArgs, SheetArgs};
use super::console::{print_stdout, scene_error, single_line};
use super::files::create_parent_folder;
use super::plan::{
    ImagePolicy, NumberedScene, OutputKind, PathConflicts, RenderPlan, Target, Writer, scene_list,
};
use super::run::batch::is_queue_full;
use super::run::load_scene::load_scene;
use super::run::progress::{ImageMonitor, Reporter, SceneLog};
use super::run::{panics, runtime};
use super::summary::Summary;
use super::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_core::geometry::{Aabb, Rgb};
use blinn_output::{Canvas, ImageFormat, check_writable, write_atomically};
use blinn_render::display::Background;
use blinn_scene::{PoseSettings, Source, SourceFormat, linear_to_srgb8, pose};
use blinn_session::{
    Claim, Finished, ImageKind, Job, Permit, PlannedFrame, PosedFrame, SceneRenderer, SessionLog,
    check_memory, run_scheduled,
};
use cell::SheetCell;
use empty_views::EmptyViews;
use labels::{Labels, Unit};
use layout::{CELLS, MIN_SIDE, SheetLayout};
use views::SheetContent;

/// The background without --background, linear: light enough for dark labels.
const BACKGROUND: Rgb = Rgb::new(0.8, 0.82, 0.85);
/// Name of a sheet beside its scene or in a folder: not that of a picture of the scene.
const DEFAULT_NAME: &str = "{stem}_sheet.png";

pub fn run(args: &SheetArgs) -> Result<Summary, UsageError> {
    let is_unknown = |file: &Path| file.extension().is_some() && ImageFormat::from_path(file).is_none();
    if args.output.as_deref().is_some_and(|file| is_unknown(file) && !file.is_dir()) {
        return Err(no_such_format());
    }
    let content = SheetContent::of_args(args)?;
    let mut plan = plan(args, &content)?;
    let OutputKind::Images(ImageKind { format, .. }) = plan.outputs.kind else {
        return Err(no_such_format());
    };
    if format == ImageFormat::Exr {
        return Err(no_such_format());
    }
    let process = &args.preview.process;
    if let Err(error) = runtime::start(process.threads) {
        return Ok(Summary::of_output(Err(error)));
    }
    plan.read_files()?;
    let reporter = Reporter::new(&process.log, plan.scenes.len(), args.preview.common.quiet);
    plan.scenes.left_out().for_each(|(folder, text)| reporter.warn(folder, &text));
    let mut summary = Summary::default();
    let mut all = Vec::new();
    let mut list = plan.numbered_scenes().peekable();
    run_scheduled(plan.session.capacity(), |sheets| -> Result<(), UsageError> {
        loop {
            while !is_queue_full(sheets)
                && let Some(Ok(scene)) = list.next_if(Result::is_ok)
            {
                let log = SceneLog::of_batch(&reporter, scene.number, &scene.path, plan.strict);
                sheets.push(Sheet {
                    plan: &plan,
                    content: &content,
                    scene,
                    size: args.size,
                    format,
                    log,
                    cancel: CancelToken::new(),
                });
            }
            let Some(Finished { job: sheet, output, .. }) = sheets.next_finished() else {
                // The list cannot be read to its end.
                return list.next().transpose().map(drop);
            };
            let path = &sheet.scene.path;
            sheet.log.scene_done();
            let failure = output.as_ref().err().map(|error| single_line(&scene_error(path, error)));
            sheet.log.finish();
            if let Some(line) = &failure {
                reporter.fail(Some(path), line);
                all.push(json!({"scene": path.to_string_lossy(), "error": line}));
            }
            all.extend(output);
            summary.add_scene(failure);
        }
    })?;
    reporter.done(&summary);
    if args.json {
        let value = if let [one] = &all[..] { one.clone() } else { Value::Array(all) };
        summary.record(print_stdout(format!("{value:#}\n").as_bytes()));
    }
    Ok(summary)
}

fn no_such_format() -> UsageError {
    UsageError("a sheet is one image as displayed; set -o to .png, .jpg or .webp, or to a folder/".into())
}

/// The plan for one of the views, of the size that it has at most, without its camera.
fn plan(args: &SheetArgs, content: &SheetContent) -> Result<RenderPlan, UsageError> {
    let (width, height) = args.size;
    if width.min(height) < MIN_SIDE {
        return Err(UsageError(format!("--size: a sheet needs at least {MIN_SIDE}x{MIN_SIDE} pixels")));
    }
    let is_stdout = args.output.as_deref() == Some(Path::new("-"));
    if args.json && is_stdout {
        return Err(UsageError(
            "-o - and --json would both be written to standard output; name a file".into(),
        ));
    }
    let output = args.output.clone().unwrap_or_else(|| DEFAULT_NAME.into());
    let view_size = match content {
        SheetContent::Drawing => (width / 2, height / 2),
        SheetContent::Views(_) | SheetContent::Cameras { .. } => (width, height),
    };
    RenderPlan::for_images(
        scene_list(&args.scene.scenes)?,
        args.preview.options(&args.scene, view_size, BACKGROUND)?,
        args.preview.time.time.unwrap_or(0.0),
        &OutputArgs { output: Some(output), no_overwrite: args.no_overwrite, ..OutputArgs::default() },
        ImagePolicy {
            strict: args.preview.common.strict,
            max_memory: args.preview.process.max_memory,
            image_name: Some(DEFAULT_NAME),
        },
    )
}

/// The sheet of a scene.
struct Sheet<'a> {
    plan: &'a RenderPlan,
    content: &'a SheetContent,
    scene: NumberedScene,
    size: (u32, u32),
    format: ImageFormat,
    log: SceneLog<'a>,
    cancel: CancelToken,
}

impl Job for Sheet<'_> {
    /// The description of the sheet.
    type Output = Result<Value>;

    fn claim(&self) -> Claim {
        self.plan.session.scene_claim(&self.scene.path, Some(CELLS.len()))
    }

    fn run(&self, permit: &Arc<Permit>) -> Result<Value> {
        panics::catch(|| self.write(permit))
    }

    fn begin_again(&self) {
        self.log.clear();
    }

    fn begin_turn(&self) {
        self.log.begin_turn();
    }

    fn cancel(&self) {
        self.cancel.cancel();
    }
}

impl Sheet<'_> {
    /// Renders and writes the sheet, and returns its description.
    fn write(&self, permit: &Arc<Permit>) -> Result<Value> {
        let Sheet { plan, scene: NumberedScene { number, path }, log, cancel, .. } = self;
        let planned = self.planned_frame()?;
        let scene = load_scene(plan, path, log, permit, cancel)?;
        let target = plan.outputs.target(path, *number, &planned);
        if let Target::File(file) = &target {
            let paths = PathConflicts::with_scene(path, scene.source.file_names());
            paths.check_not_input(file, Writer::Scene(path)).map_err(anyhow::Error::msg)?;
            create_parent_folder(file)?;
            check_writable(file, plan.outputs.replace)?;
        }
        permit.resize(check_memory(&plan.session, &scene, 1)?)?;
        let animation = plan.session.options.animation(&scene)?;
        let posed = pose(&scene, &PoseSettings { time: planned.time, animation, centre: None })?;
        let bounds = posed.bounds();
        let layout = SheetLayout::new(bounds, self.size);
        let named = self.content.named_views(&posed, self.size, planned.time)?;
        let cells = match &named {
            Some(named) => named.cells.clone(),
            None => layout.pictures(planned.time),
        };

        let mut plan = (*plan).clone();
        match self.content {
            // Lights stand as for `render` with the list.
            SheetContent::Cameras { list, .. } => plan.session.cameras = Some(list.clone()),
            SheetContent::Drawing | SheetContent::Views(_) => {
                plan.session.options.view.complete = cells.first().map(|cell| cell.view.camera);
            }
        }
        if let Some(named) = &named {
            plan.session.options.size = Some(named.grid.area);
        }
        let mut time = planned.time;
        let mut frame = PosedFrame { time: planned.time, posed, accel: None };
        let renderer = SceneRenderer::from_start(&plan.session, &scene, log, &mut frame, cancel)?;
        renderer.setup.build(&mut frame)?;
        let mut canvas = Canvas::new(self.size, background_pixel(plan.session.options.fixed_background()));
        let mut empty_views = EmptyViews::default();
        log.begin_frames(cells.len());
        for cell in &cells {
            if cell.time != time {
                let reusable = frame.accel.take();
                frame = renderer.setup.pose_at(cell.time, &frame, reusable)?;
                time = cell.time;
            }
            let (width, height) = cell.view.size;
            let pixels = u64::from(width) * u64::from(height);
            let monitor = ImageMonitor::new(log, pixels, &renderer.setup.cancel);
            let image = renderer.render_camera(&cell.view, &planned, &frame, &monitor)?;
            monitor.finish();
            let pixels = image.picture.display.to_rgba8(&image.picture.pixels);
            canvas.copy(&pixels, width, cell.origin);
            if let Some(reason) = image.empty {
                empty_views.add(reason, &cell.name);
            }
        }
        if let Some(notice) = empty_views.summary() {
            log.warn(notice)?;
        }
        let is_metres = scene.source.format == SourceFormat::Gltf;
        let unit = Unit::for_longest(bounds.extent().max_element(), is_metres);
        let on_light = is_light(plan.session.options.fixed_background());
        let up = scene.source.up;
        let labels = Labels { title: &scene.name, unit, up, on_light };
        let pixels_per_metre = match &named {
            Some(named) => {
                labels::draw_names(&mut canvas, named, self.size.0, bounds, &labels);
                named.pixels_per_metre
            }
            None => {
                labels::draw(&mut canvas, &layout, &labels);
                Some(layout.pixels_per_metre)
            }
        };
        self.save(&target, &canvas.into_pixels())?;
        let mut description = self.describe(&target, &scene.source, &bounds);
        description["pixels_per_unit"] = json!(pixels_per_metre);
        description["exposure"] = json!(renderer.exposure.ev);
        description["cells"] = cells.iter().map(SheetCell::describe).collect();
        Ok(description)
    }

    /// Describes the sheet of a scene, without its pictures, for --json.
    fn describe(&self, target: &Target, source: &Source, bounds: &Aabb) -> Value {
        let file = match target {
            Target::Stdout => Value::Null,
            Target::File(file) => json!(file.to_string_lossy()),
        };
        let Source { format, up, .. } = source;
        json!({
            "scene": self.scene.path.to_string_lossy(),
            "file": file,
            "width": self.size.0,
            "height": self.size.1,
            "unit": if *format == SourceFormat::Gltf { json!("metre") } else { Value::Null },
            "up": up.name(),
            "size_in_file": up.size_in_file(bounds.extent()).to_array(),
            "bounds": {
                "min": bounds.min.to_array(),
                "max": bounds.max.to_array(),
                "size": bounds.extent().to_array(),
            },
        })
    }

    fn planned_frame(&self) -> Result<PlannedFrame> {
        let frames = self.plan.frames.resolve(0.0, None)?;
        frames.first().copied().context("there is no frame")
    }

    fn save(&self, target: &Target, pixels: &[[u8; 4]]) -> Result<()> {
        let start = Instant::now();
        let bytes = self.format.encode_rgba8(self.size, pixels)?;
        match target {
            Target::Stdout => print_stdout(&bytes)?,
            Target::File(file) => {
                write_atomically(file, &bytes, self.plan.outputs.replace)
                    .with_context(|| format!("{} cannot be written", file.display()))?;
                self.log.wrote(file);
            }
        }
        self.log.stage_since("save", start, "");
        Ok(())
    }
}

/// The background of the sheet where no view covers it.
fn background_pixel(background: Background) -> [u8; 4] {
    match background {
        Background::Transparent => [0; 4],
        Background::Color(color) => {
            let [r, g, b] = color.to_array().map(linear_to_srgb8);
            [r, g, b, 255]
        }
    }
}

/// True for backgrounds on which dark labels are legible. A transparent image is mostly laid over white.
fn is_light(background: Background) -> bool {
    match background {
        Background::Transparent => true,
        // Contrast with black and with white is equal at a relative luminance of 0.18.
        Background::Color(color) => color.dot(Rgb::new(0.2126, 0.7152, 0.0722)) > 0.18,
    }
}
