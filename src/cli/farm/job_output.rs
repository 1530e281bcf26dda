//! Where a job writes: the output folder, names in it, and an animation of all frames.

use std::path::{Path, PathBuf};

use super::job_text::single_line_text;
use crate::args::JobCommand;
use crate::plan::{AnimationOutput, OutputKind, RenderPlan, Target};
use crate::usage::UsageError;
use blinn_output::AnimationFormat;
use blinn_session::{PathTemplate, PlannedFrame};

/// Folder and names of the files that a job writes.
pub struct JobOutput {
    pub folder: PathBuf,
    /// Pattern of image names in the folder; empty for default names and for animations.
    pub pattern: String,
    pub animation: Option<JobAnimation>,
}

/// The animation that all frames are assembled into.
pub struct JobAnimation {
    pub output: AnimationOutput,
    /// The name of its file in the output folder.
    pub file: String,
}

impl JobOutput {
    pub fn new(command: &JobCommand, plan: &RenderPlan, scene: &Path) -> Result<JobOutput, UsageError> {
        match plan.outputs.kind {
            OutputKind::Images(..) => JobOutput::images(command.output().output.as_deref()),
            OutputKind::Animation(output) => {
                let first = plan.frames.known().and_then(|frames| frames.first().copied());
                let frame = first.unwrap_or(PlannedFrame::at(1, 0.0));
                let Target::File(file) = plan.outputs.target(scene, 1, &frame) else {
                    return Err(no_stdout());
                };
                let folder = file.parent().map(Path::to_path_buf).unwrap_or_default();
                let file = single_line_text("-o", file.file_name().unwrap_or_default())?;
                let animation = Some(JobAnimation { output, file });
                Ok(JobOutput { folder, pattern: String::new(), animation })
            }
        }
    }

    /// Splits -o into the folder without placeholders and the pattern after it.
    fn images(output: Option<&Path>) -> Result<JobOutput, UsageError> {
        let (mut folder, mut pattern) = (PathBuf::new(), String::new());
        if let Some(output) = output {
            let name = single_line_text("-o", output.as_os_str())?;
            if name == "-" {
                return Err(no_stdout());
            }
            // The plan takes a name without an extension for a folder.
            let is_folder = output.is_dir()
                || output.extension().is_none()
                    && !output.exists()
                    && PathTemplate::parse(&name).is_literal();
            let name = if is_folder && !name.ends_with('/') { name + "/" } else { name };
            let ends = name.match_indices('/').map(|(i, _)| i + 1);
            let end = ends.take_while(|&i| PathTemplate::parse(&name[..i]).is_literal()).last().unwrap_or(0);
            folder = name[..end].into();
            pattern = name[end..].into();
        }
        Ok(JobOutput { folder, pattern, animation: None })
    }
}

fn no_stdout() -> UsageError {
    UsageError("-o -: a job writes files; set -o to a file name".into())
}

/// Arguments of `blinn assemble` for an animation.
pub fn assemble_args(output: &AnimationOutput) -> Vec<String> {
    let AnimationOutput { format, fps, loops, quality, clockwise, .. } = *output;
    let mut args = vec![format!("--fps={fps}")];
    if !loops {
        args.push("--loop=once".into());
    }
    if format.has_quality() {
        args.push(format!("--encoder-quality={quality}"));
    }
    if clockwise && format == AnimationFormat::Html {
        args.push("--direction=cw".into());
    }
    args
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_html_has_a_direction() {
        let output = |format| AnimationOutput {
            format,
            fps: 24.0,
            has_file_rate: false,
            loops: true,
            quality: 90,
            clockwise: true,
        };
        assert_eq!(assemble_args(&output(AnimationFormat::Html)).last().unwrap(), "--direction=cw");
        assert!(!assemble_args(&output(AnimationFormat::Mp4)).concat().contains("direction"));
    }

    #[test]
    fn output_is_split_into_folder_and_pattern() {
        for (output, folder, pattern) in [
            ("a.png", "", "a.png"),
            ("out/a.png", "out/", "a.png"),
            ("out/####.png", "out/", "####.png"),
            ("/x/out/{stem}/####.png", "/x/out/", "{stem}/####.png"),
            ("f#/a.png", "", "f#/a.png"),
            ("out/", "out/", ""),
            ("out/{stem}/", "out/", "{stem}/"),
            // A folder that exists where the test runs.
            ("args", "args/", ""),
        ] {
            let found = JobOutput::images(Some(Path::new(output))).unwrap();
            assert_eq!(
                (found.folder.as_path(), &found.pattern[..]),
                (Path::new(folder), pattern),
                "{output}"
            );
        }
        assert!(JobOutput::images(Some(Path::new("-"))).is_err());
    }
}
