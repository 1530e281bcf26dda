//! Scenes of the command line: files, and standard input.

use std::io::{Read, stdin};
use std::path::Path;

use blinn_import::{LoadError, LoadOptions, Warning, load_bytes};
use blinn_scene::Scene;
use blinn_session::load_scene;

use super::exporters::section_about;

/// Path that stands for standard input, as on Linux and macOS. The argument `-` is short for it.
const STDIN: &str = "/dev/stdin";

/// Returns the path of a scene argument.
pub fn scene_path(arg: &Path) -> &Path {
    if arg == Path::new("-") { Path::new(STDIN) } else { arg }
}

/// Returns true for standard input, which can be read only once.
pub fn is_stdin(scene: &Path) -> bool {
    scene == Path::new(STDIN)
}

/// Loads a scene. Warnings that its exporter is known to cause name the section about them. References of a scene on
/// standard input are relative to the current folder. `blender` is the option of that name.
///
/// # Errors
/// As for [`load_scene`]; standard input cannot be read.
pub fn load_scene_file(
    path: &Path,
    options: &LoadOptions,
    blender: Option<&Path>,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let (scene, mut warnings) = load_file_or_stdin(path, options, blender)?;
    for warning in &mut warnings {
        if let Some(section) = section_about(&scene.source, &warning.message) {
            warning.message += &format!(" (see {section})");
        }
    }
    Ok((scene, warnings))
}

fn load_file_or_stdin(
    path: &Path,
    options: &LoadOptions,
    blender: Option<&Path>,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    if !is_stdin(path) {
        return load_scene(path, options, blender);
    }
    let mut bytes = Vec::new();
    // One byte more than allowed makes the importer report the limit.
    let limit = options.limits.file_bytes.saturating_add(1);
    let read = stdin().lock().take(limit).read_to_end(&mut bytes);
    read.map_err(|cause| LoadError::Io { path: path.to_path_buf(), cause })?;
    if bytes.is_empty() {
        return Err(LoadError::Unsupported("standard input is empty; write a scene to it".into()));
    }
    load_bytes(&bytes, Path::new("stdin"), options)
}
