//! `blinn render --watch`: renders a scene again each time that a file of it changes.

use std::path::PathBuf;

use super::progress::Reporter;
use super::runtime;
use super::scenes::render_scenes;
use crate::args::RenderArgs;
use crate::console::print_error;
use crate::plan::{PlanInputs, RenderPlan};
use crate::scene_file::is_stdin;
use crate::summary::Summary;
use crate::usage::UsageError;
use crate::watched_files::WatchedFiles;
use blinn_core::option_words::word_options;
use blinn_core::worded;
use blinn_session::EnvironmentSource;

/// Checks that a plan can be watched.
///
/// # Errors
/// Several scenes, or something that can be read or written only once.
pub fn check(plan: &RenderPlan) -> Result<(), UsageError> {
    let scene = plan.scenes.single().filter(|_| !plan.scenes.is_batch());
    let text = match scene {
        None => "it follows one scene; name one file",
        Some(scene) if is_stdin(&scene) => "standard input does not change; save it to a file",
        _ if plan.outputs.is_stdout() => "standard output takes one image; set `output` to a file name",
        _ if plan.outputs.shards.is_some() => "an archive is written once; set `output` to images",
        _ => return Ok(()),
    };
    Err(UsageError(worded!("`watch`: {}", word_options(text))))
}

/// Renders, waits for a change, and so on, until the process ends. Returns only if it cannot begin.
///
/// # Errors
/// The first plan suits no scene.
pub fn run(args: &RenderArgs, mut plan: RenderPlan) -> Result<Summary, UsageError> {
    if let Err(error) = runtime::start(args.process.threads) {
        return Ok(Summary::of_output(Err(error)));
    }
    let reporter = |plan: &RenderPlan| {
        let reporter = Reporter::new(&args.process.log, plan.scene_range().len(), args.common.quiet);
        reporter.expect_files(plan.expected_files());
        reporter.with_paths(args.process.print_paths)
    };
    plan.read_files()?;
    plan.check_clip_conflicts()?;
    let mut files = WatchedFiles::new(option_files(args));
    loop {
        let log = reporter(&plan);
        // Files that change from now on are read again.
        files = files.now();
        let mut summary = Summary::default();
        let outcome = plan.check_clip_conflicts();
        match outcome.and_then(|()| render_scenes(&plan, &args.process, &log, &mut summary)) {
            // The files of a scene that could not be read are those of before.
            Ok(used) if used.is_empty() => {}
            Ok(used) => {
                let own = option_files(args);
                files = files.only(|path| own.iter().chain(&used).any(|file| file == path));
                files = files.with(own.into_iter().chain(used));
            }
            Err(error) => log.fail(None, &error.0),
        }
        log.done(&summary);
        log.watching(files.len());
        // Clears its bar.
        drop(log);
        plan = next_plan(args, &mut files);
    }
}

/// Waits for changes until the arguments suit the files again.
fn next_plan(args: &RenderArgs, files: &mut WatchedFiles) -> RenderPlan {
    loop {
        wait_for_change(files);
        let plan = PlanInputs::of_render(args).and_then(|inputs| RenderPlan::for_render(args, inputs));
        match plan.and_then(|mut plan| plan.read_files().map(|()| plan)) {
            Ok(plan) => return plan,
            Err(error) => {
                print_error(&error.0);
                *files = files.now();
            }
        }
    }
}

fn wait_for_change(files: &WatchedFiles) {
    while !files.have_changed() {
        WatchedFiles::pause();
    }
    files.wait_until_quiet();
}

/// The files that arguments name.
fn option_files(args: &RenderArgs) -> Vec<PathBuf> {
    let value = |name| args.options.given.value(name).map(PathBuf::from);
    let hdri = value("hdri").filter(|path| EnvironmentSource::new(path).file().is_some());
    let options = [hdri, value("camera-xml"), args.cameras.cameras.clone()].into_iter().flatten();
    args.scene.scenes.iter().cloned().chain(options).collect()
}
