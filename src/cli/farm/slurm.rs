//! Slurm: a script for sbatch, whose array has a share of the frames in each task.

use anyhow::{Context, Result};

use super::task::{Assembly, Task};

/// The script of a job of which `at_once` tasks run at one time.
///
/// # Errors
/// Text that no shell can quote.
pub fn script(task: &Task, at_once: u32) -> Result<String> {
    let count = task.frames.frames().len();
    let tasks = count.div_ceil(task.chunk_size as usize);
    let name = identifier(&format!("{}-{}", task.command, task.stem()));
    let mut directives = vec![
        format!("--job-name={name}"),
        format!("--array=1-{tasks}%{at_once}"),
        // What a lost machine was at is queued again; finished frames are kept.
        "--requeue".to_string(),
    ];
    directives.extend(task.threads.map(|n| format!("--cpus-per-task={n}")));
    directives.extend(task.memory.map(|bytes| format!("--mem={}M", bytes.div_ceil(1 << 20))));
    let directives: String = directives.iter().map(|d| format!("#SBATCH {d}\n")).collect();
    let and_then = if task.assembly.is_some() { ", and after it what assembles them" } else { "" };
    let assembly = task.assembly.as_ref().map(|a| submit_assembly(task, a, &name)).transpose()?;
    let words = words(&frames_words(task))?;
    Ok(format!(
        r#"#!/bin/bash
{directives}#
# {count} frames in {tasks} tasks. `bash` with this file submits them{and_then}; words behind it, such as
# --partition=render, are sbatch's. BLINN names the program where it is not in PATH.
set -euo pipefail
blinn=${{BLINN:-blinn}}

if [ -z "${{SLURM_ARRAY_TASK_ID:-}}" ]; then
    cd -- "$(dirname -- "$0")"
    frames=$(sbatch --parsable "$@" "./${{0##*/}}")
    echo "frames: job ${{frames%%;*}}"
{submit_assembly}    exit
fi

exec "$blinn" {words} \
    --chunk="$SLURM_ARRAY_TASK_ID/{tasks}" {threads} --resume --progress=plain
"#,
        submit_assembly = assembly.unwrap_or_default(),
        threads = match task.threads {
            Some(n) => format!("--threads={n}"),
            None => r#"--threads="$SLURM_CPUS_ON_NODE""#.into(),
        },
    ))
}

fn frames_words(task: &Task) -> Vec<String> {
    let mut words = vec![task.command.to_string(), task.scene.path.clone()];
    words.push(format!("--output={}/{}", task.folder.path, task.pattern));
    words.extend(task.flags.iter().cloned());
    words.extend(task.memory_flag());
    words.extend(task.files.iter().map(|file| format!("--{}={}", file.flag, file.place.path)));
    words.push(format!("{}={}", task.frames_flag, task.frames));
    words
}

/// The lines that submit what assembles the frames. Where a frame fails, it is taken out of the queue.
fn submit_assembly(task: &Task, assembly: &Assembly, name: &str) -> Result<String> {
    let folder = &task.folder.path;
    let mut all = vec!["assemble".to_string(), format!("{folder}/{}", assembly.frames)];
    all.push(format!("--output={folder}/{}", assembly.file));
    all.extend(assembly.flags.iter().cloned());
    all.extend(["--strict".into(), "--progress=plain".into()]);
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
        words(&all)?
    ))
}

/// Words as a shell takes them.
fn words(words: &[String]) -> Result<String> {
    shlex::try_join(words.iter().map(String::as_str)).context("no shell can quote it")
}

/// Letters, digits, `-`, `_` and `.` alone: directives have rules of their own for the rest.
fn identifier(text: &str) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    text.chars().map(keep).take(64).collect()
}
