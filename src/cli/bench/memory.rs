//! The memory of each stage, from processes of its own: what this one has had for other scenes and rounds,
//! and kept, is not counted.

use std::process::{Command, Stdio};

use crate::bench::{BenchResults, BenchSettings, SceneResults, Workload};
use crate::cli::args::BenchArgs;
use crate::cli::console::tell;
use crate::cli::one_line;

/// Rounds, at most: memory differs by little.
const ROUNDS: u32 = 3;

/// Measures what the stages of `scene` take, which is of `subject`, and adds it to its figures. Where
/// that cannot be had there is none, and a warning.
pub(super) fn add(scene: &mut SceneResults, subject: &Workload, plan: &BenchSettings, args: &BenchArgs) {
    for threads in &plan.threads {
        for round in 0..plan.rounds.min(ROUNDS) {
            if !args.common.quiet && round == 0 {
                tell(&format!("memory on {threads} threads: {}", one_line(&subject.name)));
            }
            match measured(subject, plan, *threads, args) {
                Ok(found) => scene.add_memory(&found),
                Err(why) => {
                    let name = &subject.name;
                    tell(&one_line(&format!("warning: {name}: its memory cannot be measured: {why}")));
                    return;
                }
            }
        }
    }
}

fn measured(
    subject: &Workload,
    plan: &BenchSettings,
    threads: usize,
    args: &BenchArgs,
) -> Result<SceneResults, String> {
    let (width, height) = (plan.render.width, plan.render.height);
    let mut command = Command::new(std::env::current_exe().map_err(|e| e.to_string())?);
    command.args(["bench", "--memory", "--quiet", "--rounds", "1"]);
    command.args(["--size", &format!("{width}x{height}"), "--samples", &plan.render.samples.to_string()]);
    command.args(["--threads", &threads.to_string()]);
    if args.common.allow_outside {
        command.arg("--allow-outside");
    }
    let done = command.arg("--").arg(&subject.file).stdin(Stdio::null()).output();
    let done = done.map_err(|e| e.to_string())?;
    if !done.status.success() {
        return Err(String::from_utf8_lossy(&done.stderr).trim().to_string());
    }
    let figures = BenchResults::parse(&done.stdout)?;
    figures.scenes.into_iter().next().ok_or_else(|| "a process told nothing".into())
}
