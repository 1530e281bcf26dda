//! Measures the peak memory of each stage in child processes, so that memory which this process keeps from other scenes
//! is not counted.

use std::process::{Command, Stdio};

use crate::args::BenchArgs;
use crate::console::{eprint_line, print_warning, single_line};
use crate::plural::plural;
use blinn_bench::{BenchResults, BenchSettings, BenchStage, SceneResults, Workload};

/// Maximum number of rounds: memory varies little.
const MAX_ROUNDS: u32 = 3;

/// Adds the memory of all stages to the results of a scene. If it cannot be measured, prints a warning.
pub fn measure(scene: &mut SceneResults, workload: &Workload, settings: &BenchSettings, args: &BenchArgs) {
    let name = single_line(&workload.name);
    for threads in &settings.threads {
        for round in 0..settings.rounds.min(MAX_ROUNDS) {
            if !args.common.quiet && round == 0 {
                eprint_line(&format!("memory with {}: {name}", plural(*threads as u64, "thread")));
            }
            match run_child(workload, settings, *threads, args) {
                Ok(results) => scene.add_memory(&results),
                Err(error) => {
                    return print_warning(&format!("{name}: memory could not be measured: {error}"));
                }
            }
        }
    }
}

/// Runs `blinn bench --memory` and returns its results.
fn run_child(
    workload: &Workload,
    settings: &BenchSettings,
    threads: usize,
    args: &BenchArgs,
) -> Result<SceneResults, String> {
    let sizes: Vec<String> =
        settings.sizes.iter().map(|(width, height)| format!("{width}x{height}")).collect();
    let mut command = Command::new(std::env::current_exe().map_err(|e| e.to_string())?);
    command.args(["bench", "--memory", "--quiet", "--rounds", "1"]);
    command.args(["--size", &sizes.join(","), "--samples", &settings.render.samples.to_string()]);
    command.args(["--threads", &threads.to_string()]);
    if args.common.allow_outside() {
        command.arg("--allow-outside");
    }
    if let Some(blender) = &settings.blender {
        command.arg("--blender").arg(blender);
    }
    if settings.stages.len() < BenchStage::ALL.len() {
        let stages: Vec<&str> = settings.stages.iter().map(|stage| stage.name()).collect();
        command.args(["--stages", &stages.join(",")]);
    }
    match &args.scene_folder {
        // The manifest has the cameras.
        Some(folder) if !workload.cameras.is_empty() => {
            command.arg("--scenes").arg(folder).args(["--only-scene", &workload.name]);
        }
        _ => drop(command.arg("--").arg(&workload.file)),
    }
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|e| e.to_string())?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).trim().to_string());
    }
    let results = BenchResults::parse(&output.stdout)?;
    results.scenes.into_iter().next().ok_or_else(|| "the child process printed no results".into())
}
