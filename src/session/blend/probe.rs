//! Asks a program whether it is Blender, or a Python with Blender's module.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::child;
use blinn_core::cancellation::CancelToken;
use blinn_import::LoadError;

/// Prints the version of Python's module `bpy`, without importing it where its package tells the version: the import
/// takes a second. The current folder, which may be a stranger's, is not searched. Packages for editors that only describe the module have other names.
const MODULE_VERSION: &str = "
import sys
sys.path = [path for path in sys.path if path]
import importlib.metadata, importlib.util
if importlib.util.find_spec('bpy'):
    try:
        print('Module', importlib.metadata.version('bpy'))
    except importlib.metadata.PackageNotFoundError:
        import bpy
        print('Module', '.'.join(map(str, bpy.app.version)))
";

/// Major, minor and patch number.
pub type Version = [u32; 3];

/// A program that converts .blend files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blender {
    pub program: PathBuf,
    /// True for a Python with the module `bpy`.
    pub is_python: bool,
    pub version: Version,
}

/// The kind of a program.
#[derive(Debug, PartialEq, Eq)]
pub enum Program {
    Blender(Blender),
    /// A Python without `bpy`.
    PlainPython,
    Other,
}

/// Asks a program.
///
/// # Errors
/// It cannot be started; the work was cancelled.
pub fn probe(program: &Path, cancel: &CancelToken) -> Result<Program, LoadError> {
    let ask = |arguments: &[&str]| {
        let mut command = Command::new(program);
        command.args(arguments);
        child::run(&mut command, cancel).map(|ended| ended.output).map_err(|e| e.into_load_error(program))
    };
    let blender = |text: &str, prefix: &str, is_python: bool| {
        let version = version_in(text, prefix)?;
        Some(Program::Blender(Blender { program: program.to_path_buf(), is_python, version }))
    };
    let text = ask(&["--version"])?;
    if let Some(found) = blender(&text, "Blender ", false) {
        return Ok(found);
    }
    if !text.lines().any(|line| line.starts_with("Python 3")) {
        return Ok(Program::Other);
    }
    Ok(blender(&ask(&["-c", MODULE_VERSION])?, "Module ", true).unwrap_or(Program::PlainPython))
}

/// Returns the version in the first line that begins with `prefix`.
fn version_in(text: &str, prefix: &str) -> Option<Version> {
    text.lines().find_map(|line| {
        let name = line.strip_prefix(prefix)?.split_whitespace().next()?;
        let mut numbers = name.split('.').map(|number| {
            let digits = number.bytes().take_while(u8::is_ascii_digit).count();
            number[..digits].parse().ok()
        });
        let (major, minor) = (numbers.next()??, numbers.next()??);
        Some([major, minor, numbers.next().flatten().unwrap_or(0)])
    })
}

/// Writes a version as Blender does.
pub fn version_name([major, minor, patch]: Version) -> String {
    format!("{major}.{minor}.{patch}")
}

/// Names of programs that may be one, in a folder of `PATH`.
pub fn program_names() -> [OsString; 3] {
    ["blender", "python3", "python"].map(|name| format!("{name}{}", std::env::consts::EXE_SUFFIX).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_found_among_other_lines() {
        for (text, expected) in [
            ("Blender 4.2.1 LTS\n\tbuild date: 2024", Some([4, 2, 1])),
            ("Warning: no display\nBlender 5.10.0\n", Some([5, 10, 0])),
            ("Blender 5.1.0rc1", Some([5, 1, 0])),
            ("Blender 5.1", Some([5, 1, 0])),
            ("Blender is missing", None),
            ("Python 3.11.2", None),
        ] {
            assert_eq!(version_in(text, "Blender "), expected, "{text}");
        }
    }
}
