//! Open Job Description: a template of revision 2023-09, with the extension TASK_CHUNKING.
//!
//! <https://github.com/OpenJobDescription/openjd-specifications/wiki/2023-09-Template-Schemas>. It is
//! written as JSON, which YAML is as well.

use anyhow::{Result, bail};
use serde_json::{Value, json};

use super::place::Place;
use super::task::{Assembly, Task};
use crate::cli::run::progress::Reporter;

/// Characters that a parameter's value, or a job's name, may have.
const MOST_VALUE: usize = 1024;
const MOST_NAME: usize = 128;
/// Seconds that a task has between being told to stop and being stopped.
const NOTICE: u32 = 5;

/// The template of a job. Tasks are to take `target_seconds`.
///
/// # Errors
/// What the language has no words for.
pub fn template(task: &Task, target_seconds: u32, reporter: &Reporter) -> Result<String> {
    let mut steps = vec![frames(task)?];
    if let Some(assembly) = &task.assembly {
        steps.push(assemble(assembly)?);
    }
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": name(task),
        "parameterDefinitions": parameters(task, target_seconds, reporter)?,
        "steps": steps,
    });
    Ok(format!("{template:#}\n"))
}

fn name(task: &Task) -> String {
    apart(&format!("{} {}", task.command, task.stem())).chars().take(MOST_NAME).collect()
}

/// Text with no two braces together: they would begin, or end, something to fill in.
fn apart(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if "{}".contains(c) && out.ends_with(c) {
            out.push(' ');
        }
        out.push(c);
    }
    out
}

/// The parameter that stands for a file that a flag names.
fn parameter_of(flag: &str) -> &'static str {
    match flag {
        "camera-xml" => "CameraXml",
        _ => "Hdri",
    }
}

fn parameters(task: &Task, target_seconds: u32, reporter: &Reporter) -> Result<Vec<Value>> {
    let mut all = vec![
        json!({
            "name": "Blinn", "type": "STRING", "default": "blinn",
            "description": "The program, on the machines that render.",
        }),
        path("Scene", &task.scene, ("FILE", "IN"), "The scene.", reporter)?,
    ];
    if let Some(folder) = &task.beside {
        let what = "The scene's folder, with the files that the scene refers to.";
        all.push(path("SceneFolder", folder, ("DIRECTORY", "IN"), what, reporter)?);
    }
    for file in &task.files {
        let what = format!("The file of --{}.", file.flag);
        all.push(path(parameter_of(file.flag), &file.place, ("FILE", "IN"), &what, reporter)?);
    }
    all.push(path("Output", &task.folder, ("DIRECTORY", "OUT"), "Where pictures go.", reporter)?);
    let frames = task.frames.to_string();
    if frames.len() > MOST_VALUE {
        bail!(
            "the list of frames takes {} characters, and a template's parameter {MOST_VALUE}: make a job of \
             each part",
            frames.len()
        );
    }
    all.extend([
        json!({"name": "Frames", "type": "STRING", "default": frames, "description": "Which frames."}),
        json!({
            "name": "FramesPerTask", "type": "INT", "default": task.chunk_size, "minValue": 1,
            "description": "Frames in a task, until it is known how long they take.",
        }),
        json!({
            "name": "TargetSeconds", "type": "INT", "default": target_seconds, "minValue": 0,
            "description": "How long a task shall take; 0 for just as many frames as FramesPerTask says.",
        }),
    ]);
    Ok(all)
}

/// A path is by default where it lies beside the template. The specification knows no other defaults:
/// whoever submits the job says where the rest is.
fn path(
    name: &str,
    place: &Place,
    (object, flow): (&str, &str),
    what: &str,
    reporter: &Reporter,
) -> Result<Value> {
    let mut parameter = json!({
        "name": name, "type": "PATH", "objectType": object, "dataFlow": flow, "description": what,
    });
    if !place.is_inside {
        reporter.warn(
            place.path.as_ref(),
            &format!("not in the template's folder: submit the job with the parameter {name}={}", place.path),
        );
    } else if place.path.chars().count() > MOST_VALUE {
        bail!("{}: a template's parameter has at most {MOST_VALUE} characters", place.path);
    } else {
        parameter["default"] = json!(place.path);
    }
    Ok(parameter)
}

fn frames(task: &Task) -> Result<Value> {
    let mut args = vec![literal(task.command)?, "{{Param.Scene}}".to_string()];
    args.push(format!("--output={{{{Param.Output}}}}/{}", literal(&task.pattern)?));
    for flag in task.flags.iter().chain(&task.memory_flag()) {
        args.push(literal(flag)?);
    }
    args.extend(task.threads.map(|n| format!("--threads={n}")));
    for file in &task.files {
        args.push(format!("--{}={{{{Param.{}}}}}", file.flag, parameter_of(file.flag)));
    }
    args.push(format!("{}={{{{Task.Param.Frame}}}}", task.frames_flag));
    args.extend(["--resume".into(), "--progress=openjd".into()]);
    let constraint = if task.frames.is_contiguous() { "CONTIGUOUS" } else { "NONCONTIGUOUS" };
    let mut step = json!({
        "name": "Frames",
        "parameterSpace": {"taskParameterDefinitions": [{
            "name": "Frame",
            "type": "CHUNK[INT]",
            "range": "{{Param.Frames}}",
            "chunks": {
                "defaultTaskCount": "{{Param.FramesPerTask}}",
                "targetRuntimeSeconds": "{{Param.TargetSeconds}}",
                "rangeConstraint": constraint,
            },
        }]},
        "script": script(args),
    });
    let mut amounts = Vec::new();
    amounts.extend(task.threads.map(|n| json!({"name": "amount.worker.vcpu", "min": n})));
    amounts.extend(task.memory.map(|b| json!({"name": "amount.worker.memory", "min": b.div_ceil(1 << 20)})));
    if !amounts.is_empty() {
        step["hostRequirements"] = json!({"amounts": amounts});
    }
    Ok(step)
}

fn assemble(assembly: &Assembly) -> Result<Value> {
    let mut args = vec![
        "assemble".to_string(),
        format!("{{{{Param.Output}}}}/{}", assembly.frames),
        format!("--output={{{{Param.Output}}}}/{}", literal(&assembly.file)?),
    ];
    args.extend(assembly.flags.iter().cloned());
    args.extend(["--strict".into(), "--progress=openjd".into()]);
    Ok(json!({
        "name": "Assemble",
        "dependencies": [{"dependsOn": "Frames"}],
        "script": script(args),
    }))
}

fn script(args: Vec<String>) -> Value {
    json!({"actions": {"onRun": {
        "command": "{{Param.Blinn}}",
        "args": args,
        "cancelation": {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": NOTICE},
    }}})
}

/// Text that stands for itself.
fn literal(text: &str) -> Result<String> {
    if text.contains("{{") || text.contains("}}") {
        bail!("{text}: a template cannot say two braces together: use another name");
    }
    Ok(text.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_braces_are_together() {
        for (text, told) in [("a{{b}}", "a{ {b} }"), ("{{{", "{ { {"), ("}}}}", "} } } }"), ("{}{}", "{}{}")]
        {
            assert_eq!(apart(text), told);
        }
        assert!(literal("{{a").is_err() && literal("a}}").is_err() && literal("{a}").is_ok());
    }
}
