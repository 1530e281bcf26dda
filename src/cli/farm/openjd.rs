//! Writes a job as an Open Job Description template of revision 2023-09 with the extension TASK_CHUNKING, as JSON.
//!
//! <https://github.com/OpenJobDescription/openjd-specifications/wiki/2023-09-PathTemplate-Schemas>

use anyhow::{Result, bail};
use serde_json::{Value, json};

use super::farm_job::{Assembly, FarmJob};
use super::job_paths::JobPath;
use crate::run::progress::Reporter;

/// Maximum length of a parameter's value in characters.
const MAX_VALUE: usize = 1024;
/// Maximum length of a job's name in characters.
const MAX_NAME: usize = 128;
/// Seconds between the signal to terminate a task and the end of its process.
const NOTICE_PERIOD: u32 = 5;

/// Writes the template of a job whose tasks should take `target_seconds`.
///
/// # Errors
/// Names and lists that a template cannot contain.
pub fn template(job: &FarmJob, target_seconds: u32, reporter: &Reporter) -> Result<String> {
    let mut steps = vec![frames_step(job)?];
    if let Some(assembly) = &job.assembly {
        steps.push(assemble_step(assembly)?);
    }
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": name(job),
        "parameterDefinitions": parameters(job, target_seconds, reporter)?,
        "steps": steps,
    });
    Ok(format!("{template:#}\n"))
}

fn name(job: &FarmJob) -> String {
    separate_braces(&format!("{} {}", job.command, job.stem())).chars().take(MAX_NAME).collect()
}

/// Inserts a space between equal braces: `{{` and `}}` enclose format expressions.
fn separate_braces(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if "{}".contains(c) && out.ends_with(c) {
            out.push(' ');
        }
        out.push(c);
    }
    out
}

/// The parameter for the input file of a flag.
fn input_parameter(flag: &str) -> &'static str {
    match flag {
        "camera-xml" => "CameraXml",
        "cameras" => "Cameras",
        _ => "Hdri",
    }
}

fn parameters(job: &FarmJob, target_seconds: u32, reporter: &Reporter) -> Result<Vec<Value>> {
    let frames = job.frames.to_string();
    if frames.len() > MAX_VALUE {
        let length = frames.len();
        bail!(
            "the list of frames has {length} characters, but a parameter at most {MAX_VALUE}; split the job"
        );
    }
    let mut parameters = vec![json!({
        "name": "Blinn", "type": "STRING", "default": "blinn",
        "description": "The program on the machines that render.",
    })];
    let mut add_path = |parameter: PathParameter| {
        parameters.push(parameter.to_json(reporter)?);
        Ok::<_, anyhow::Error>(())
    };
    add_path(PathParameter::input("Scene", &job.scene, "FILE", "The scene."))?;
    if let Some(folder) = &job.scene_folder {
        let description = "The scene's folder with all files that the scene refers to.";
        add_path(PathParameter::input("SceneFolder", folder, "DIRECTORY", description))?;
    }
    for input in &job.inputs {
        let (kind, what) = if input.is_folder { ("DIRECTORY", "folder") } else { ("FILE", "file") };
        let description = format!("The {what} of --{}.", input.flag);
        add_path(PathParameter::input(input_parameter(input.flag), &input.path, kind, &description))?;
    }
    add_path(PathParameter {
        name: "Output",
        path: &job.output_folder,
        object_type: "DIRECTORY",
        data_flow: "OUT",
        description: "The folder for the images.",
    })?;
    parameters.extend([
        json!({"name": "Frames", "type": "STRING", "default": frames, "description": "The frames to render."}),
        json!({
            "name": "FramesPerTask", "type": "INT", "default": job.chunk_size, "minValue": 1,
            "description": "Frames per task, until their run time is known.",
        }),
        json!({
            "name": "TargetSeconds", "type": "INT", "default": target_seconds, "minValue": 0,
            "description": "Target run time of a task; 0 to always use FramesPerTask.",
        }),
    ]);
    Ok(parameters)
}

/// A parameter of type PATH.
struct PathParameter<'a> {
    name: &'a str,
    path: &'a JobPath,
    object_type: &'a str,
    data_flow: &'a str,
    description: &'a str,
}

impl<'a> PathParameter<'a> {
    fn input(name: &'a str, path: &'a JobPath, object_type: &'a str, description: &'a str) -> Self {
        PathParameter { name, path, object_type, data_flow: "IN", description }
    }

    /// A path in the template's folder is the default. The specification allows no others, so a warning asks for the
    /// parameter.
    fn to_json(&self, reporter: &Reporter) -> Result<Value> {
        let path = &self.path.path;
        let mut parameter = json!({
            "name": self.name, "type": "PATH", "objectType": self.object_type, "dataFlow": self.data_flow,
            "description": self.description,
        });
        if !self.path.is_inside {
            let name = self.name;
            let warning =
                format!("not in the template's folder; submit the job with the parameter {name}={path}");
            reporter.warn(path.as_ref(), &warning);
        } else if path.chars().count() > MAX_VALUE {
            bail!("{path}: a parameter of a template has at most {MAX_VALUE} characters");
        } else {
            parameter["default"] = json!(path);
        }
        Ok(parameter)
    }
}

fn frames_step(job: &FarmJob) -> Result<Value> {
    let mut args = vec![literal(job.command)?, "{{Param.Scene}}".to_string()];
    args.push(format!("--output={{{{Param.Output}}}}/{}", literal(&job.output_pattern)?));
    for arg in job.args.iter().chain(&job.max_memory_arg()) {
        args.push(literal(arg)?);
    }
    args.extend(job.threads.map(|n| format!("--threads={n}")));
    for input in &job.inputs {
        args.push(format!("--{}={{{{Param.{}}}}}", input.flag, input_parameter(input.flag)));
    }
    args.push(format!("{}={{{{Task.Param.Frame}}}}", job.frames_flag));
    args.extend(["--resume".into(), "--progress=openjd".into()]);
    let constraint = if job.frames.is_contiguous() { "CONTIGUOUS" } else { "NONCONTIGUOUS" };
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
    amounts.extend(job.threads.map(|n| json!({"name": "amount.worker.vcpu", "min": n})));
    let mebibytes = job.max_memory.map(|bytes| bytes.div_ceil(1 << 20));
    amounts.extend(mebibytes.map(|min| json!({"name": "amount.worker.memory", "min": min})));
    if !amounts.is_empty() {
        step["hostRequirements"] = json!({"amounts": amounts});
    }
    Ok(step)
}

fn assemble_step(assembly: &Assembly) -> Result<Value> {
    let mut args = vec![
        "assemble".to_string(),
        format!("{{{{Param.Output}}}}/{}", assembly.frames_folder),
        format!("--output={{{{Param.Output}}}}/{}", literal(&assembly.file)?),
    ];
    args.extend(assembly.args.iter().cloned());
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
        "cancelation": {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": NOTICE_PERIOD},
    }}})
}

/// Text without format expressions.
fn literal(text: &str) -> Result<String> {
    if text.contains("{{") || text.contains("}}") {
        bail!("{text}: a template cannot contain double braces; use another name");
    }
    Ok(text.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_braces_are_separated_or_rejected() {
        for (text, separated) in
            [("a{{b}}", "a{ {b} }"), ("{{{", "{ { {"), ("}}}}", "} } } }"), ("{}{}", "{}{}")]
        {
            assert_eq!(separate_braces(text), separated);
        }
        assert!(literal("{{a").is_err() && literal("a}}").is_err() && literal("{a}").is_ok());
    }
}
