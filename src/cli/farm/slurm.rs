//! Writes a job as an sbatch script for Slurm: an array job whose tasks each render a part of the frames.

use anyhow::{Context, Result};

use super::farm_job::{Assembly, FarmJob};

/// Writes the script of a job that runs at most `at_once` tasks at the same time.
///
/// # Errors
/// Text that cannot be quoted for a shell.
pub fn script(job: &FarmJob, at_once: u32) -> Result<String> {
    let count = job.frames.frames().len();
    let tasks = count.div_ceil(job.chunk_size as usize);
    let name = identifier(&format!("{}-{}", job.command, job.stem()));
    let mut directives = vec![
        format!("--job-name={name}"),
        format!("--array=1-{tasks}%{at_once}"),
        // Tasks of a lost node are queued again. They keep finished images.
        "--requeue".to_string(),
    ];
    directives.extend(job.threads.map(|n| format!("--cpus-per-task={n}")));
    directives.extend(job.max_memory.map(|bytes| format!("--mem={}M", bytes.div_ceil(1 << 20))));
    let directives: String = directives.iter().map(|d| format!("#SBATCH {d}\n")).collect();
    let and_assembly = if job.assembly.is_some() { " and then a job that assembles them" } else { "" };
    let assembly = job.assembly.as_ref().map(|a| submit_assembly(job, a, &name)).transpose()?;
    let args = quote(&frames_args(job))?;
    Ok(format!(
        r#"#!/bin/bash
{directives}#
# {count} frames in {tasks} tasks. Run this file with `bash` to submit them{and_assembly}; its arguments, such as
# --partition=render, are passed to sbatch. BLINN is the program if it is not in PATH.
set -euo pipefail
blinn=${{BLINN:-blinn}}

if [ -z "${{SLURM_ARRAY_TASK_ID:-}}" ]; then
    cd -- "$(dirname -- "$0")"
    frames=$(sbatch --parsable "$@" "./${{0##*/}}")
    echo "frames: job ${{frames%%;*}}"
{submit_assembly}    exit
fi

exec "$blinn" {args} \
    --chunk="$SLURM_ARRAY_TASK_ID/{tasks}" {threads} --resume --progress=plain
"#,
        submit_assembly = assembly.unwrap_or_default(),
        threads = match job.threads {
            Some(n) => format!("--threads={n}"),
            None => r#"--threads="$SLURM_CPUS_ON_NODE""#.into(),
        },
    ))
}

fn frames_args(job: &FarmJob) -> Vec<String> {
    let mut args = vec![job.command.to_string(), job.scene.path.clone()];
    args.push(format!("--output={}/{}", job.output_folder.path, job.output_pattern));
    args.extend(job.args.iter().cloned());
    args.extend(job.max_memory_arg());
    args.extend(job.inputs.iter().map(|input| format!("--{}={}", input.flag, input.path.path)));
    args.push(format!("{}={}", job.frames_flag, job.frames));
    args
}

/// The lines that submit the assembly. It is cancelled if a frame fails.
fn submit_assembly(job: &FarmJob, assembly: &Assembly, name: &str) -> Result<String> {
    let folder = &job.output_folder.path;
    let mut args = vec!["assemble".to_string(), format!("{folder}/{}", assembly.frames_folder)];
    args.push(format!("--output={folder}/{}", assembly.file));
    args.extend(assembly.args.iter().cloned());
    args.extend(["--strict".into(), "--progress=plain".into()]);
    Ok(format!(
        r#"    assembled=$(sbatch --parsable --dependency="afterok:${{frames%%;*}}" --kill-on-invalid-dep=yes "$@" <<'JOB'
#!/bin/bash
#SBATCH --job-name={name}-assemble
#SBATCH --requeue
exec "${{BLINN:-blinn}}" {}
JOB
    )
    echo "assembled: job ${{assembled%%;*}}"
"#,
        quote(&args)?
    ))
}

/// Quotes arguments for a shell.
fn quote(args: &[String]) -> Result<String> {
    shlex::try_join(args.iter().map(String::as_str)).context("the text cannot be quoted for a shell")
}

/// Replaces everything but letters, digits, `-`, `_` and `.` by `_`: directives have quoting rules of their own.
fn identifier(text: &str) -> String {
    let replace = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    text.chars().map(replace).take(64).collect()
}
