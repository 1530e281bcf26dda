//! Finds the user's Blender.

use std::env;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::probe::{Blender, Program, Version, probe, program_names, version_name};
use blinn_core::cancellation::CancelToken;
use blinn_core::worded;
use blinn_import::LoadError;

/// Names Blender where the option does not.
const VARIABLE: &str = "BLINN_BLENDER";

/// The oldest version that the extension supports.
const OLDEST: Version = [4, 2, 0];

/// Where Blender is installed on macOS, beside `PATH`.
const MACOS_PROGRAM: &str = "/Applications/Blender.app/Contents/MacOS/Blender";

/// Settings that choose a Blender: the option, the variable and `PATH`.
type Environment = (Option<PathBuf>, Option<OsString>, Option<OsString>);

/// The Blender that was found last: a batch asks once.
static FOUND: Mutex<Option<(Environment, Blender)>> = Mutex::new(None);

/// Returns the Blender that `option` names, else `$BLINN_BLENDER`, else the newest on `PATH`.
///
/// # Errors
/// There is none, the named one is another program or too old; the work was cancelled.
pub fn find(option: Option<&Path>, cancel: &CancelToken) -> Result<Blender, LoadError> {
    let variable = env::var_os(VARIABLE).filter(|value| !value.is_empty());
    let environment = (option.map(Path::to_path_buf), variable, env::var_os("PATH"));
    let mut found = FOUND.lock().unwrap_or_else(|e| e.into_inner());
    if let Some((known, blender)) = &*found
        && *known == environment
    {
        return Ok(blender.clone());
    }
    let blender = match (&environment.0, &environment.1) {
        (Some(path), _) => named(path, &worded!("`blender`"), cancel)?,
        (None, Some(path)) => named(Path::new(path), "$BLINN_BLENDER", cancel)?,
        (None, None) => newest(environment.2.as_ref(), cancel)?,
    };
    *found = Some((environment, blender.clone()));
    Ok(blender)
}

/// Probes the program that the user names.
fn named(path: &Path, source: &str, cancel: &CancelToken) -> Result<Blender, LoadError> {
    let error = |reason: String| LoadError::Unsupported(format!("{source} {}: {reason}", path.display()));
    let program = probe(path, cancel).map_err(|cause| match cause {
        LoadError::Io { cause, .. } if cause.kind() == io::ErrorKind::NotFound => {
            error("there is no such program".into())
        }
        LoadError::Io { cause, .. } => error(format!("it cannot be started: {cause}")),
        other => other,
    })?;
    match program {
        Program::Blender(blender) if blender.version >= OLDEST => Ok(blender),
        Program::Blender(blender) => {
            let (version, oldest) = (version_name(blender.version), oldest_name());
            Err(error(format!("it is Blender {version}; name Blender {oldest} or later")))
        }
        Program::PlainPython => Err(error(
            "this Python has no module bpy; run `pip install bpy` with it, or name a Blender".into(),
        )),
        Program::Other => Err(error("it is neither Blender nor a Python with the module bpy".into())),
    }
}

/// Asks all programs on `PATH` that may be Blender, and returns the newest. Of equal ones, the first.
fn newest(search_path: Option<&OsString>, cancel: &CancelToken) -> Result<Blender, LoadError> {
    let mut newest: Option<Blender> = None;
    for program in candidates(search_path) {
        let blender = match probe(&program, cancel) {
            Ok(Program::Blender(blender)) => blender,
            Ok(_) => continue,
            Err(LoadError::Cancelled(cause)) => return Err(cause.into()),
            // Something on the way that cannot be started is none.
            Err(_) => continue,
        };
        if newest.as_ref().is_none_or(|newest| newest.version < blender.version) {
            newest = Some(blender);
        }
    }
    let oldest = oldest_name();
    match newest {
        Some(blender) if blender.version >= OLDEST => Ok(blender),
        Some(blender) => Err(LoadError::Unsupported(worded!(
            "a .blend file needs Blender {} or later, and the newest on PATH is {}; name another with `blender`, or \
             export the file as .glb",
            oldest,
            version_name(blender.version)
        ))),
        None => Err(LoadError::Unsupported(worded!(
            "a .blend file needs Blender {} or later, and none is on PATH; install Blender or Python's module bpy, \
             name it with `blender`, or export the file as .glb",
            oldest
        ))),
    }
}

/// The programs on `PATH` that may be Blender, each once.
fn candidates(search_path: Option<&OsString>) -> Vec<PathBuf> {
    let mut programs: Vec<PathBuf> = Vec::new();
    let folders = search_path.map(|path| env::split_paths(path).collect::<Vec<_>>()).unwrap_or_default();
    // A relative folder may hold programs of whoever wrote the scene.
    for folder in folders.iter().filter(|folder| folder.is_absolute()) {
        let here = program_names().map(|name| folder.join(name));
        for program in here.into_iter().filter(|program| program.is_file()) {
            // `python` is often a link to `python3` beside it. Links of virtual environments are no equals of their target.
            let is_same = |known: &&PathBuf| {
                known.parent() == program.parent() && known.canonicalize().ok() == program.canonicalize().ok()
            };
            if !programs.contains(&program) && !programs.iter().any(|known| is_same(&known)) {
                programs.push(program);
            }
        }
    }
    if cfg!(target_os = "macos") && Path::new(MACOS_PROGRAM).is_file() {
        programs.push(MACOS_PROGRAM.into());
    }
    programs
}

/// The oldest version, without patch number.
fn oldest_name() -> String {
    format!("{}.{}", OLDEST[0], OLDEST[1])
}
