//! `blinn sheet`: front, right, top and isometric views at one scale, with dimensions, or other views with their names; of
//! several scenes in one file, a picture of each.

mod backdrop;
mod cell;
mod cell_pictures;
mod contact;
mod contact_cell;
mod contact_page;
mod empty_views;
mod grid;
mod labels;
mod layout;
mod pages;
mod scene_sheets;
mod views;
mod write_sheet;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use serde_json::{Value, json};

use super::args::{OutputArgs, SheetArgs};
use super::console::print_stdout;
use super::files::create_parent_folder;
use super::plan::{
    ImagePolicy, NumberedScene, OutputKind, PathConflicts, RenderPlan, SceneList, Target, Writer, scene_list,
};
use super::run::load_scene::load_scene;
use super::run::progress::{Reporter, SceneLog};
use super::run::runtime;
use super::summary::Summary;
use super::usage::UsageError;
use backdrop::{BACKGROUND, background_pixel, is_light};
use blinn_output::{Canvas, ImageFormat, Overwrite, check_writable};
use blinn_scene::{PoseSettings, Source, SourceFormat, pose};
use blinn_session::{ImageKind, Permit, check_memory};
use cell::SheetCell;
use cell_pictures::{CellPictures, planned_frame};
use contact::ContactSheet;
use labels::{Labels, Unit};
use layout::{CELLS, MIN_SIDE, SheetLayout};
use pages::Pages;
use scene_sheets::{RenderScene, SheetScene, render_scenes};
use views::SheetContent;
use write_sheet::write_sheet;

/// Name of a sheet beside its scene or in a folder: not that of a picture of the scene.
const DEFAULT_NAME: &str = "{stem}_sheet.png";

pub fn run(args: &SheetArgs) -> Result<Summary, UsageError> {
    let is_unknown = |file: &Path| file.extension().is_some() && ImageFormat::from_path(file).is_none();
    if args.output.as_deref().is_some_and(|file| is_unknown(file) && !file.is_dir()) {
        return Err(no_such_format());
    }
    let content = SheetContent::of_args(args)?;
    check_size(args.size)?;
    let scenes = scene_list(&args.scene.scenes)?;
    let pages = Pages::of_args(args, scenes.len());
    let mut plan = plan(args, scenes, &content, pages.as_ref())?;
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
    let all = match &pages {
        Some(pages) => {
            let sheet = ContactSheet { plan: &plan, content: &content, pages, size: args.size, format };
            sheet.render(&reporter, &mut summary)?
        }
        None => {
            let sheets = Sheets { content: &content, size: args.size, format };
            render_sheets(&plan, &sheets, &reporter, &mut summary)?
        }
    };
    reporter.done(&summary);
    if args.json {
        let value = if let [one] = &all[..] { one.clone() } else { Value::Array(all) };
        summary.record(print_stdout(format!("{value:#}\n").as_bytes()));
    }
    Ok(summary)
}

/// Writes a sheet of each scene, and returns their descriptions.
fn render_sheets(
    plan: &RenderPlan,
    sheets: &Sheets,
    reporter: &Reporter,
    summary: &mut Summary,
) -> Result<Vec<Value>, UsageError> {
    let mut all = Vec::new();
    render_scenes(plan, sheets, reporter, summary, |scene, output, failure, _| {
        let error = || json!({"scene": scene.path.to_string_lossy(), "error": failure});
        all.push(output.unwrap_or_else(|_| error()));
    })?;
    Ok(all)
}

fn no_such_format() -> UsageError {
    UsageError("a sheet is one image as displayed; set -o to .png, .jpg or .webp, or to a folder/".into())
}

fn check_size((width, height): (u32, u32)) -> Result<(), UsageError> {
    if width.min(height) < MIN_SIDE {
        return Err(UsageError(format!("--size: a sheet needs at least {MIN_SIDE}x{MIN_SIDE} pixels")));
    }
    Ok(())
}

/// The plan for one of the views, of the size that it has at most, without its camera. `pages` are those of a contact sheet.
fn plan(
    args: &SheetArgs,
    scenes: SceneList,
    content: &SheetContent,
    pages: Option<&Pages>,
) -> Result<RenderPlan, UsageError> {
    let (width, height) = args.size;
    let is_stdout = args.output.as_deref() == Some(Path::new("-"));
    if args.json && is_stdout {
        return Err(UsageError(
            "-o - and --json would both be written to standard output; name a file".into(),
        ));
    }
    let output = args.output.clone().unwrap_or_else(|| DEFAULT_NAME.into());
    let view_size = match (content, pages) {
        (_, Some(pages)) => pages.grid.area,
        (SheetContent::Drawing, None) => (width / 2, height / 2),
        (SheetContent::Views(_) | SheetContent::Cameras { .. }, None) => (width, height),
    };
    let plan = RenderPlan::for_images(
        scenes,
        args.preview.options(&args.scene, view_size, BACKGROUND)?,
        args.preview.time.time.unwrap_or(0.0),
        &OutputArgs { output: Some(output), no_overwrite: args.no_overwrite, ..OutputArgs::default() },
        ImagePolicy {
            strict: args.preview.common.strict,
            max_memory: args.preview.process.max_memory,
            image_name: Some(DEFAULT_NAME),
            is_shared: pages.is_some(),
        },
    )?;
    pages.map_or(Ok(()), |pages| plan.check_shared_files(pages.files()))?;
    Ok(plan)
}

/// Sheets of one scene each.
struct Sheets<'a> {
    content: &'a SheetContent,
    size: (u32, u32),
    format: ImageFormat,
}

impl RenderScene for Sheets<'_> {
    /// The description of the sheet.
    type Output = Value;

    fn view_count(&self) -> usize {
        CELLS.len()
    }

    /// Renders and writes the sheet, and returns its description.
    fn render(&self, scene: &SheetScene, permit: &Arc<Permit>) -> Result<Value> {
        let SheetScene { plan, scene: NumberedScene { number, path }, log, cancel } = scene;
        let replace = plan.outputs.replace;
        let planned = planned_frame(plan)?;
        let scene = load_scene(plan, path, log, permit, cancel)?;
        let target = plan.outputs.target(path, *number, &planned);
        if let Target::File(file) = &target {
            let paths = PathConflicts::with_scene(path, scene.source.file_names());
            paths.check_not_input(file, Writer::Scene(path)).map_err(anyhow::Error::msg)?;
            create_parent_folder(file)?;
            check_writable(file, replace)?;
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
        let background = plan.session.options.fixed_background();
        let mut canvas = Canvas::new(self.size, background_pixel(background));
        let pictures = CellPictures { plan, scene: &scene, log, cancel };
        let add =
            |cell: &SheetCell, pixels: Vec<[u8; 4]>| canvas.copy(&pixels, cell.view.size.0, cell.origin);
        let exposure = pictures.render(&cells, posed, &planned, add)?;
        let is_metres = scene.source.format == SourceFormat::Gltf;
        let unit = Unit::for_longest(bounds.extent().max_element(), is_metres);
        let up = scene.source.up;
        let labels = Labels { title: &scene.name, unit, up, on_light: is_light(background) };
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
        self.save(&target, &canvas.into_pixels(), replace, log)?;
        let file = match &target {
            Target::Stdout => Value::Null,
            Target::File(file) => json!(file.to_string_lossy()),
        };
        let Source { format, up, .. } = &scene.source;
        Ok(json!({
            "scene": path.to_string_lossy(),
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
            "pixels_per_unit": pixels_per_metre,
            "exposure": exposure,
            "cells": cells.iter().map(SheetCell::describe).collect::<Vec<_>>(),
        }))
    }
}

impl Sheets<'_> {
    fn save(&self, target: &Target, pixels: &[[u8; 4]], replace: Overwrite, log: &SceneLog) -> Result<()> {
        let start = Instant::now();
        match target {
            Target::Stdout => print_stdout(&self.format.encode_rgba8(self.size, pixels)?)?,
            Target::File(file) => {
                write_sheet(file, self.format, self.size, pixels, replace)?;
                log.wrote(file);
            }
        }
        log.stage_since("save", start, "");
        Ok(())
    }
}
