//! Stand-ins for render farm engines, as far as tasks notice.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::common::program::{blinn, files};

/// The template that a command line prints.
#[track_caller]
pub fn template(folder: &Path, line: &str) -> Value {
    let output = blinn(folder, line);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Runs all tasks of a template's steps in another folder, as the specification defines: paths are absolute,
/// and each chunk has its default number of frames.
#[track_caller]
pub fn run_template(folder: &Path, template: &Value) {
    let mut values = BTreeMap::new();
    for parameter in template["parameterDefinitions"].as_array().unwrap() {
        let name = parameter["name"].as_str().unwrap();
        let default = match &parameter["default"] {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let value = match parameter["type"].as_str() {
            Some("PATH") => folder.join(default).to_str().unwrap().to_string(),
            _ => default,
        };
        values.insert(format!("Param.{name}"), value);
    }
    values.insert("Param.Blinn".into(), env!("CARGO_BIN_EXE_blinn").into());
    let elsewhere = tempfile::tempdir().unwrap();
    for step in template["steps"].as_array().unwrap() {
        let action = &step["script"]["actions"]["onRun"];
        let chunks = match &step["parameterSpace"]["taskParameterDefinitions"][0] {
            Value::Null => vec![String::new()],
            parameter => {
                let filled = |value: &Value| fill(value.as_str().unwrap(), &values);
                let size = filled(&parameter["chunks"]["defaultTaskCount"]).parse().unwrap();
                chunks(&filled(&parameter["range"]), size)
            }
        };
        for chunk in chunks {
            values.insert("Task.Param.Frame".into(), chunk);
            let args = action["args"].as_array().unwrap().iter();
            let args: Vec<String> = args.map(|arg| fill(arg.as_str().unwrap(), &values)).collect();
            let command = fill(action["command"].as_str().unwrap(), &values);
            let output = Command::new(command).args(&args).current_dir(&elsewhere).output().unwrap();
            assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
        }
    }
}

fn fill(text: &str, values: &BTreeMap<String, String>) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, behind) = after.split_once("}}").unwrap();
        out.push_str(before);
        out.push_str(values.get(name.trim()).unwrap_or_else(|| panic!("{name} is no value")));
        rest = behind;
    }
    out + rest
}

/// Splits a list of frames into chunks.
fn chunks(range: &str, size: usize) -> Vec<String> {
    let list = blinn::session::FrameList::parse(range).unwrap();
    let text = |frames: &[i64]| frames.iter().map(i64::to_string).collect::<Vec<_>>().join(",");
    list.frames().chunks(size).map(text).collect()
}

/// A job submitted to sbatch.
#[derive(Debug)]
pub struct Asked {
    pub words: Vec<String>,
    /// The job script, from standard input.
    pub script: String,
}

/// Submits a job to an sbatch that only records its calls, and numbers jobs from 1.
pub fn submit(folder: &Path, job: &str, words: &[&str]) -> Vec<Asked> {
    let notes = tempfile::tempdir().unwrap();
    let sbatch = notes.path().join("sbatch");
    let script = "#!/bin/bash\ncd -- \"${0%/*}\"\nn=1; while [ -e $n.words ]; do n=$((n+1)); done\n\
                  printf '%s\\0' \"$@\" > $n.words\n\
                  case \"${!#}\" in *.sh) : ;; *) cat ;; esac > $n.script\necho \"$n;cluster\"\n";
    fs::write(&sbatch, script).unwrap();
    let made = Command::new("chmod").arg("+x").arg(&sbatch).status().unwrap();
    assert!(made.success());
    let path = format!("{}:{}", notes.path().display(), std::env::var("PATH").unwrap());
    let mut bash = Command::new("bash");
    bash.arg(job).args(words).current_dir(folder).env("PATH", path).env_remove("SLURM_ARRAY_TASK_ID");
    let output = bash.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    (1..)
        .map_while(|n| fs::read(notes.path().join(format!("{n}.words"))).ok().map(|words| (n, words)))
        .map(|(n, words)| Asked {
            words: words
                .split(|b| *b == 0)
                .map(|w| String::from_utf8_lossy(w).into_owned())
                .collect::<Vec<_>>(),
            script: fs::read_to_string(notes.path().join(format!("{n}.script"))).unwrap(),
        })
        .map(|mut asked| {
            asked.words.pop();
            asked
        })
        .collect()
}

/// Runs all tasks of a Slurm job, and the dependent job. Returns their messages.
pub fn run_script(folder: &Path, job: &str) -> String {
    let script = fs::read_to_string(folder.join(job)).unwrap();
    let array = script.lines().find_map(|line| line.strip_prefix("#SBATCH --array=1-")).unwrap();
    let tasks: usize = array.split_once('%').unwrap().0.parse().unwrap();
    let mut messages = String::new();
    let mut run = |bash: &mut Command| {
        let bash = bash.current_dir(folder).env("BLINN", env!("CARGO_BIN_EXE_blinn"));
        let output = bash.env("SLURM_CPUS_ON_NODE", "1").output().unwrap();
        messages.push_str(&String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{messages}");
    };
    for task in 1..=tasks {
        run(Command::new("bash").arg(job).env("SLURM_ARRAY_TASK_ID", task.to_string()));
    }
    for asked in submit(folder, job, &[]).into_iter().skip(1) {
        run(Command::new("bash").args(["-c", &asked.script]));
    }
    messages
}

/// The pixels of all pictures in a folder.
pub fn pixels(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let all = files(folder).into_keys().filter(|name| name.ends_with(".png"));
    all.map(|name| {
        let file: PathBuf = folder.join(&name);
        let picture = image::open(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        (name, picture.into_rgba8().into_raw())
    })
    .collect()
}
