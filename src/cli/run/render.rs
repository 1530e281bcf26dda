//! `blinn render` and `blinn turntable`: renders each scene of a plan.

use std::ffi::OsString;

use super::batch::fail;
use super::progress::{Reporter, Trace};
use super::runtime;
use super::scenes::render_scenes;
use super::watch;
use crate::args::{ProcessArgs, RenderArgs, TurntableArgs};
use crate::plan::{PlanInputs, RenderPlan};
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_core::worded;

pub fn render(args: &RenderArgs, restart_argv: Option<&[OsString]>) -> Result<Summary, UsageError> {
    let plan = RenderPlan::for_render(args, PlanInputs::of_render(args)?)?;
    if args.watch {
        watch::check(&plan)?;
        tune_malloc(&plan, restart_argv);
        return watch::run(args, plan);
    }
    execute(plan, restart_argv, &args.process, args.common.quiet)
}

pub fn turntable(args: &TurntableArgs, restart_argv: Option<&[OsString]>) -> Result<Summary, UsageError> {
    let plan = RenderPlan::for_turntable(args, PlanInputs::of_turntable(args)?)?;
    execute(plan, restart_argv, &args.process, args.common.quiet)
}

/// Executes a plan. `restart_argv` are the arguments of this process, if it may execute itself again.
fn execute(
    mut plan: RenderPlan,
    restart_argv: Option<&[OsString]>,
    process: &ProcessArgs,
    quiet: bool,
) -> Result<Summary, UsageError> {
    tune_malloc(&plan, restart_argv);
    let mut reporter =
        Reporter::new(&process.log, plan.scene_range().len(), quiet).with_paths(process.print_paths);
    reporter.expect_files(plan.expected_files());
    plan.scenes.left_out().for_each(|(folder, text)| reporter.warn(folder, &text));
    if let Some((archive, text)) = plan.category_warning() {
        reporter.warn(&archive, &text);
    }
    reporter.trace = process.trace.as_deref().map(|file| Trace::new(file, plan.outputs.replace));
    let mut summary = Summary::default();
    // Only now: a restarted process would not know of a signal that arrived earlier.
    if let Err(error) = runtime::start(process.threads) {
        fail(&mut summary, &reporter, &error);
    } else {
        plan.read_files()?;
        plan.check_clip_conflicts()?;
        render_scenes(&plan, process, &reporter, &mut summary)?;
        match reporter.trace.as_ref().filter(|_| !plan.dry_run).map(Trace::write) {
            Some(Ok(file)) => reporter.wrote(None, file),
            Some(Err(error)) => fail(&mut summary, &reporter, &error.context(worded!("`trace`"))),
            None => {}
        }
    }
    if let Err(error) = reporter.paths_printed() {
        fail(&mut summary, &reporter, &error.context(worded!("`print-paths`")));
    }
    reporter.done(&summary);
    Ok(summary)
}

/// Executes this process again if its memory needs other settings.
fn tune_malloc(plan: &RenderPlan, restart_argv: Option<&[OsString]>) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if let Some(argv) = restart_argv.filter(|_| !plan.dry_run) {
        super::malloc_tuning::restart_with_tunables(plan, argv);
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = (plan, restart_argv);
}
