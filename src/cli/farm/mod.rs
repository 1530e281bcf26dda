//! `blinn job`: frames as a job for a farm, which renders a share of them in each task.
//!
//! What every task would find out for itself — exposure, framing, the frames of a clip — is found once,
//! here, and said to all of them in flags. The engines' languages know nothing of scenes, and what knows
//! scenes knows nothing of engines: between them stands [`Task`].

mod given;
mod openjd;
mod place;
mod slurm;
mod task;
mod view;

use std::ffi::OsString;
use std::path::Path;

use anyhow::Result;

use super::args::{EngineArgs, FramesArgs, JobArgs};
use super::console::{is_stdout, print};
use super::{Summary, Usage, describe, one_line};
use crate::cli::plan::{Claims, Job, Writer};
use crate::cli::run::panics::caught;
use crate::cli::run::progress::{Reporter, Teller};
use crate::output::{Overwrite, SaveError, write_atomically};
use given::Given;
use place::Base;

/// Prints the job that `words` ask for.
pub(super) fn run(args: &JobArgs, words: &[OsString]) -> Result<Summary, Usage> {
    let engine = &args.engine;
    let (job, quiet) = match engine.frames() {
        FramesArgs::Render(args) => (Job::render(args)?, args.common.quiet),
        FramesArgs::Turntable(args) => (Job::turntable(args)?, args.common.quiet),
    };
    let output = engine.job().output.as_deref().filter(|output| !is_stdout(output));
    if let Some(file) = output {
        Claims::of_read(&job.scenes).spare(file, Writer::Flag("-o")).map_err(Usage)?;
    }
    let given = Given::of(words)?;
    let base = Base::of(output)?;
    let plan = task::Plan::new(engine, &job, given, &base)?;
    let scene = &job.scenes[0];
    let reporter = Reporter::new(&engine.frames().process().telling, 1, quiet);
    let teller = Teller::new(&reporter, scene, job.strict);
    let failure = caught(|| {
        let task = plan.resolve(&teller)?;
        let text = match engine {
            EngineArgs::Openjd(args) => openjd::template(&task, args.target_seconds, &reporter)?,
            EngineArgs::Slurm(args) => slurm::script(&task, args.at_once)?,
        };
        write(&text, output, scene, &reporter)
    })
    .err()
    .map(|e| one_line(&describe(scene, &e)));
    if let Some(line) = &failure {
        reporter.fail(Some(scene), line);
    }
    let mut summary = Summary::default();
    summary.add(failure);
    reporter.done(&summary);
    Ok(summary)
}

fn write(text: &str, output: Option<&Path>, scene: &Path, reporter: &Reporter) -> Result<()> {
    let Some(path) = output else {
        return print(text.as_bytes());
    };
    crate::cli::run::scene_job::folder_of(path)?;
    let written = write_atomically(path, text.as_bytes(), Overwrite::Yes);
    written.map_err(|cause| SaveError { path: path.to_path_buf(), cause })?;
    reporter.wrote(Some(scene), path);
    Ok(())
}
