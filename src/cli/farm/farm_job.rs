//! A job for any render farm.

use std::path::Path;

use super::job_paths::JobPath;
use blinn_session::FrameList;

/// A job whose tasks each render a part of the frames, and keep images that are up to date.
#[derive(Debug)]
pub struct FarmJob {
    /// `render` or `turntable`.
    pub command: &'static str,
    pub scene: JobPath,
    /// The folder with the files that the scene refers to; `None` if it refers to none.
    pub scene_folder: Option<JobPath>,
    /// Arguments of all tasks.
    pub args: Vec<String>,
    /// Other input files.
    pub inputs: Vec<InputFile>,
    /// All frames, in ascending order.
    pub frames: FrameList,
    /// The flag that selects the frames of a task.
    pub frames_flag: &'static str,
    /// The folder that images are written to.
    pub output_folder: JobPath,
    /// The pattern of their names in it; empty for default names.
    pub output_pattern: String,
    /// Set if the frames are assembled into an animation.
    pub assembly: Option<Assembly>,
    /// Frames per task.
    pub chunk_size: u32,
    pub threads: Option<u16>,
    /// Memory limit in bytes.
    pub max_memory: Option<u64>,
}

/// An input file that a flag names.
#[derive(Debug)]
pub struct InputFile {
    /// Without dashes.
    pub flag: &'static str,
    pub path: JobPath,
    pub is_folder: bool,
}

/// The step that assembles all frames.
#[derive(Debug)]
pub struct Assembly {
    /// The folder of the frames, inside the output folder.
    pub frames_folder: String,
    /// The animation file, in the output folder.
    pub file: String,
    /// Arguments of `blinn assemble`.
    pub args: Vec<String>,
}

impl FarmJob {
    /// The scene's name without folder and extension.
    pub fn stem(&self) -> String {
        let stem = Path::new(&self.scene.path).file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// The argument for the memory limit.
    pub fn max_memory_arg(&self) -> Option<String> {
        self.max_memory.map(|bytes| format!("--max-memory={bytes}"))
    }
}
