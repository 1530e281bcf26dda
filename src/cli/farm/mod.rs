//! `blinn job`: describes frames as a job for a render farm, which renders a part of them in each task.
//!
//! Exposure, framing and the frames of a clip are resolved once and become flags of every task. [`farm_job`] describes
//! the tasks for any engine; `openjd` and `slurm` write it in the engines' languages and know nothing of scenes.

mod camera_flags;
mod farm_job;
mod job_output;
mod job_paths;
mod job_text;
mod openjd;
mod resolve;
mod slurm;

use std::ffi::OsString;
use std::path::Path;

use anyhow::Result;

use super::args::{EngineArgs, ExplicitFlags, JobArgs, JobCommand};
use super::console::{is_stdout, print_stdout, scene_error, single_line};
use super::files::create_parent_folder;
use super::plan::{PathConflicts, PlanInputs, RenderPlan, Writer};
use super::run::panics;
use super::run::progress::{Reporter, SceneLog};
use super::summary::Summary;
use super::usage::UsageError;
use blinn_output::{Overwrite, SaveError, write_atomically};
use job_paths::JobFolder;
use resolve::JobPlan;

/// Prints the job for the command line `argv`.
pub fn run(args: &JobArgs, argv: &[OsString]) -> Result<Summary, UsageError> {
    let engine = &args.engine;
    let mut plan = match engine.command() {
        JobCommand::Render(args) => RenderPlan::for_render(args, PlanInputs::of_render(args)?)?,
        JobCommand::Turntable(args) => RenderPlan::for_turntable(args, PlanInputs::of_turntable(args)?)?,
    };
    if plan.check.is_some() {
        let text = "--check compares images where all of them are rendered; run blinn render --check --resume after the job";
        return Err(UsageError(text.into()));
    }
    let output = engine.job().output.as_deref().filter(|output| !is_stdout(output));
    if let Some(file) = output {
        let paths = PathConflicts::with_inputs(plan.scenes.single());
        paths.check_not_input(file, Writer::Option("output")).map_err(UsageError)?;
    }
    plan.read_files()?;
    let flags = ExplicitFlags::parse(argv);
    job_text::check_values(&flags)?;
    let folder = JobFolder::of(output)?;
    let job_plan = JobPlan::new(engine, &plan, flags, &folder)?;
    let scene = &job_plan.file.clone();
    let reporter = Reporter::new(&engine.command().process().log, 1, engine.command().common().quiet);
    let log = SceneLog::new(&reporter, scene, plan.strict);
    let failure = panics::catch(|| {
        let job = job_plan.resolve(&log)?;
        let text = match engine {
            EngineArgs::Openjd(args) => openjd::template(&job, args.target_seconds, &reporter)?,
            EngineArgs::Slurm(args) => slurm::script(&job, args.at_once)?,
        };
        write(&text, output, scene, &reporter)
    });
    let failure = failure.err().map(|error| single_line(&scene_error(scene, &error)));
    if let Some(line) = &failure {
        reporter.fail(Some(scene), line);
    }
    let mut summary = Summary::default();
    summary.add_scene(failure);
    reporter.done(&summary);
    Ok(summary)
}

fn write(text: &str, output: Option<&Path>, scene: &Path, reporter: &Reporter) -> Result<()> {
    let Some(path) = output else {
        return print_stdout(text.as_bytes());
    };
    create_parent_folder(path)?;
    let written = write_atomically(path, text.as_bytes(), Overwrite::Yes);
    written.map_err(|cause| SaveError { path: path.to_path_buf(), cause })?;
    reporter.wrote(Some(scene), path);
    Ok(())
}
