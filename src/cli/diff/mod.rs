//! `blinn diff`: compares two scenes, two images, or the scenes in two folders.
//!
//! Exit codes are those of diff(1): 0 if both are equal, 1 if they differ, 2 if something fails.

mod animations;
pub(super) mod comparison;
mod folder_pairs;
mod folders;
mod hints;
pub(super) mod html;
pub(super) mod images;
mod information;
mod length;
mod noise;
mod page_names;
mod pair_job;
mod scenes;
mod strip;
pub(super) mod text;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result};

use super::args::{DiffArgs, OutputArgs};
use super::console::{print_stdout, single_line};
use super::files::{create_parent_folder, similar_file};
use super::plan::{ImagePolicy, PathConflicts, RenderPlan, Writer, scene_list};
use super::run::progress::{Reporter, SceneLog};
use super::run::{panics, runtime};
use super::scene_file::{is_stdin, scene_path};
use super::summary::Summary;
use super::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_core::geometry::Rgb;
use blinn_import::StoredPicture;
use blinn_output::{Overwrite, check_writable, write_atomically};
use blinn_session::{Permit, load_limits};
use comparison::{Comparison, Heading};

/// The background without --background.
const BACKGROUND: Rgb = Rgb::new(0.05, 0.05, 0.05);
/// Bytes at the start of a file that tell images from scenes.
const HEAD_BYTES: u64 = 64;

pub fn run(args: &DiffArgs) -> Result<Summary, UsageError> {
    let [old, new] = &args.scene.scenes[..] else {
        return Err(UsageError("diff compares two files or two folders: blinn diff OLD NEW".into()));
    };
    let files = [scene_path(old), scene_path(new)];
    check_exist(files)?;
    match files.map(Path::is_dir) {
        [true, true] => return folders::run(args, files),
        [false, false] => {}
        [is_old, _] => {
            let (folder, file) = if is_old { (old, new) } else { (new, old) };
            let (folder, file) = (folder.display(), file.display());
            return Err(UsageError(format!(
                "{folder} is a folder and {file} is not; compare two files or two folders"
            )));
        }
    }
    if files.iter().all(|file| is_stdin(file)) {
        return Err(UsageError("standard input can be read only once; name it once".into()));
    }
    check_output(args, files)?;
    let mut plan = plan(args, files[0])?;
    let process = &args.preview.process;
    // Everything that fails has the exit code 2, as 1 means different.
    let failure = |error: anyhow::Error| UsageError(single_line(&format!("{error:#}")));
    runtime::start(process.threads).map_err(failure)?;
    plan.read_files()?;
    let reporter = Reporter::new(&process.log, 1, args.preview.common.quiet);
    let comparison = panics::catch(|| compare(args, files, plan, &reporter)).map_err(failure)?;
    let heading = heading(args, files);
    if let Some(page) = &args.output {
        write_output(page, &heading, &comparison, overwrite(args)).map_err(failure)?;
        reporter.wrote(None, page);
    }
    let text = if args.json {
        format!("{:#}\n", text::to_json(&heading, &comparison))
    } else {
        text::to_text(&heading, &comparison)
    };
    print_stdout(text.as_bytes()).map_err(failure)?;
    Ok(Summary { is_different: comparison.is_different(), ..Summary::default() })
}

/// Checks that the files or folders exist. Those inside a tar file are found later.
fn check_exist(files: [&Path; 2]) -> Result<(), UsageError> {
    let missing = files.iter().filter(|file| file.try_exists().is_ok_and(|exists| !exists));
    let missing: Vec<String> =
        missing.map(|file| format!("{} does not exist{}", file.display(), similar_file(file))).collect();
    if missing.is_empty() { Ok(()) } else { Err(UsageError(single_line(&missing.join("; ")))) }
}

fn heading<'a>(args: &DiffArgs, [old, new]: [&'a Path; 2]) -> Heading<'a> {
    let tolerance = args.compare.tolerance.unwrap_or(0.0);
    Heading { old, new, tolerance, flip: args.compare.flip }
}

fn overwrite(args: &DiffArgs) -> Overwrite {
    if args.no_overwrite { Overwrite::No } else { Overwrite::Yes }
}

fn check_output(args: &DiffArgs, files: [&Path; 2]) -> Result<(), UsageError> {
    let Some(page) = &args.output else { return Ok(()) };
    check_page_format(page)?;
    PathConflicts::with_inputs(files).check_not_input(page, Writer::Option("output")).map_err(UsageError)
}

fn check_page_format(page: &Path) -> Result<(), UsageError> {
    if has_extension(page, &["html", "htm", "png"]) {
        return Ok(());
    }
    let page = page.display();
    Err(UsageError(format!("-o {page}: diff writes an HTML page or a picture; use .html or .png")))
}

fn has_extension(file: &Path, extensions: &[&str]) -> bool {
    file.extension().is_some_and(|e| extensions.iter().any(|known| e.eq_ignore_ascii_case(known)))
}

/// Creates the folder of a page or picture, and checks that it can be written.
fn prepare_output(file: &Path, overwrite: Overwrite) -> Result<()> {
    create_parent_folder(file)?;
    Ok(check_writable(file, overwrite)?)
}

/// Writes the page or the picture.
fn write_output(file: &Path, heading: &Heading, comparison: &Comparison, overwrite: Overwrite) -> Result<()> {
    if has_extension(file, &["png"]) {
        let cannot_be_written = || format!("{} cannot be written", file.display());
        let bytes = strip::encode(comparison).with_context(cannot_be_written)?;
        return write_atomically(file, &bytes, overwrite).with_context(cannot_be_written);
    }
    html::write_page(file, heading, comparison, overwrite)
}

/// The plan for pictures of a scene. Its size is preliminary.
fn plan(args: &DiffArgs, old: &Path) -> Result<RenderPlan, UsageError> {
    // No picture is written under this name.
    let output = OutputArgs { output: Some("{stem}.diff.png".into()), ..OutputArgs::default() };
    RenderPlan::for_images(
        scene_list(&[old.to_path_buf()])?,
        args.preview.options(&args.scene, args.size.unwrap_or(scenes::DEFAULT_SIZE), BACKGROUND)?,
        args.preview.time.time.unwrap_or(0.0),
        &output,
        ImagePolicy {
            strict: args.preview.common.strict,
            max_memory: args.preview.process.max_memory,
            image_name: None,
            is_shared: false,
        },
    )
}

fn compare(args: &DiffArgs, files: [&Path; 2], plan: RenderPlan, reporter: &Reporter) -> Result<Comparison> {
    if let Some(page) = &args.output {
        prepare_output(page, overwrite(args))?;
    }
    let [old, new] = files;
    match (is_picture(old)?, is_picture(new)?) {
        (true, true)
            if args.new.new_up.is_some()
                || args.new.new_scale.is_some()
                || args.distance_tolerance.is_some() =>
        {
            anyhow::bail!("--new-up, --new-scale and --distance-tolerance apply only to scenes; remove them")
        }
        (true, true) => images::compare(old, new, &args.compare, &load_limits(plan.session.max_memory)),
        (false, false) => {
            let logs = files.map(|file| SceneLog::new(reporter, file, plan.strict));
            let cancel = CancelToken::default();
            let comparison = scenes::compare(files, plan, args, &logs, &Permit::alone(), &cancel)?;
            logs.iter().for_each(|log| drop(log.finish()));
            Ok(comparison)
        }
        (is_old, _) => {
            let (image, scene) = if is_old { (old, new) } else { (new, old) };
            let (image, scene) = (image.display(), scene.display());
            anyhow::bail!("{image} is an image and {scene} is not; compare two images or two scenes")
        }
    }
}

/// True for image files, judged by their content.
fn is_picture(file: &Path) -> Result<bool> {
    if is_stdin(file) {
        return Ok(false);
    }
    let cannot_be_read = || format!("{} cannot be read", file.display());
    let mut head = Vec::new();
    let opened = File::open(file).with_context(cannot_be_read)?;
    opened.take(HEAD_BYTES).read_to_end(&mut head).with_context(cannot_be_read)?;
    Ok(StoredPicture::is_picture(&head))
}
