//! Converts a .blend file in a process of its own, or takes the conversion from the cache.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::Command;

use super::blend_file::BlendFile;
use super::cache::Cache;
use super::child::{self, Ended};
use super::conversion::{Conversion, Report};
use super::find::find;
use super::probe::{Blender, version_name};
use crate::settings_hash::SettingsHash;
use blinn_blender::{CONVERT, MODULES};
use blinn_core::option_words::word_options;
use blinn_core::worded;
use blinn_import::{BakeMode, LoadError, LoadOptions, SceneChoice, open_scene_file};

/// The last line of Blender, whatever went before.
const GOODBYE: &str = "Blender quit";

/// Name the folder for temporary files on all systems.
const TEMPORARY_VARIABLES: [&str; 3] = ["TMPDIR", "TEMP", "TMP"];

/// Messages of Blender, the C++ library and Python where there is no more memory.
const OUT_OF_MEMORY: [&str; 4] = ["alloc returns null", "bad_alloc", "MemoryError", "annot allocate memory"];

/// Settings of a conversion.
struct Settings<'a> {
    blender: Blender,
    /// Name or index of a scene; `None` for the active one.
    scene: Option<&'a str>,
    options: &'a LoadOptions,
}

/// Converts a file.
///
/// # Errors
/// There is no Blender, it cannot convert the file, or the work was cancelled.
pub fn convert(
    file: &BlendFile,
    options: &LoadOptions,
    blender: Option<&Path>,
) -> Result<Conversion, LoadError> {
    let blender = find(blender, &options.cancel)?;
    let scene = match &options.scene {
        SceneChoice::Default => None,
        SceneChoice::Named(name) => Some(name.as_str()),
    };
    let settings = Settings { blender, scene, options };
    let (cache, key) = (Cache::of_user(), settings.key(file));
    let max_bytes = options.limits.file_bytes;
    if let Some(known) = cache.as_ref().and_then(|cache| cache.get(key, max_bytes)) {
        return Ok(known);
    }
    let conversion = settings.run(file)?;
    if let Some(cache) = cache {
        cache.put(key, &conversion);
    }
    Ok(conversion)
}

impl Settings<'_> {
    /// A hash of all that the conversion depends on, except linked files. Paths of those are relative to the file's
    /// folder.
    fn key(&self, file: &BlendFile) -> u128 {
        let path = file.path.as_os_str().as_encoded_bytes();
        let LoadOptions { allow_outside, bake, bake_size, .. } = self.options;
        let parts = (
            (file.digest.to_string(), path, self.blender.version, self.scene),
            (allow_outside, bake, bake_size),
        );
        SettingsHash::of(&(parts, MODULES)).hash()
    }

    /// Runs Blender.
    fn run(&self, file: &BlendFile) -> Result<Conversion, LoadError> {
        let folder = tempfile::Builder::new().prefix("blinn-").tempdir();
        let folder = folder.map_err(|cause| LoadError::Io { path: std::env::temp_dir(), cause })?;
        let io_error = |cause| LoadError::Io { path: folder.path().to_path_buf(), cause };
        let modules = folder.path().join("modules");
        fs::create_dir(&modules).map_err(io_error)?;
        for (name, text) in MODULES {
            fs::write(modules.join(name), text).map_err(io_error)?;
        }
        let output = folder.path().join("scene.glb");
        let report = folder.path().join("report.txt");
        let mut command = self.command(&modules.join(CONVERT));
        // Blender makes a folder of its own, and leaves it behind where it is killed.
        let temporary = folder.path().join("tmp");
        fs::create_dir(&temporary).map_err(io_error)?;
        for name in TEMPORARY_VARIABLES {
            command.env(name, &temporary);
        }
        command.arg("--input").arg(&file.path).arg("--output").arg(&output).arg("--report").arg(&report);
        command.arg("--end-with-input").arg(folder.path());
        if let Some(scene) = self.scene {
            command.arg(format!("--scene={scene}"));
        }
        if let Some(mode) = self.options.bake {
            let name = match mode {
                BakeMode::Never => "never",
                BakeMode::Auto => "auto",
            };
            command.arg("--bake").arg(name);
        }
        if let Some(size) = self.options.bake_size {
            command.arg("--bake-size").arg(size.to_string());
        }
        if !self.options.allow_outside {
            command.arg("--only-folder");
        }
        let memory = self.options.limits.memory_bytes;
        if i64::try_from(memory).is_ok() {
            command.arg("--memory").arg(memory.to_string());
        }
        let ended = child::run(&mut command, &self.options.cancel);
        let ended = ended.map_err(|error| error.into_load_error(&self.blender.program))?;
        let max_bytes = self.options.limits.file_bytes;
        let text = fs::read(&report).unwrap_or_default();
        let report = Report::of_script(&String::from_utf8_lossy(&text), max_bytes);
        if !ended.status.success() || !output.is_file() {
            return Err(self.failure(&ended, report));
        }
        Ok(Conversion::new(report, &read_file(&output, max_bytes)?))
    }

    /// The start of the command line. Settings and add-ons of the user are not loaded, and scripts of the file not run.
    fn command(&self, script: &Path) -> Command {
        let mut command = Command::new(&self.blender.program);
        if self.blender.is_python {
            command.arg(script);
        } else {
            command.args(["--background", "--factory-startup", "--disable-autoexec", "-noaudio"]);
            command.args(["--python-exit-code", "1", "--python"]).arg(script).arg("--");
        }
        command
    }

    /// The error of a conversion that failed: its own, or what Blender printed last.
    fn failure(&self, ended: &Ended, report: Report) -> LoadError {
        LoadError::Unsupported(report.error.map_or_else(|| self.reason(ended), |text| word_options(&text)))
    }

    /// The reason for the end of a Blender that reported none.
    fn reason(&self, ended: &Ended) -> String {
        let (version, status) = (version_name(self.blender.version), ended.status);
        let memory = self.options.limits.memory_bytes;
        if i64::try_from(memory).is_ok() && OUT_OF_MEMORY.iter().any(|text| ended.output.contains(text)) {
            let allowed = memory.div_ceil(1 << 20);
            return worded!(
                "Blender {} needs more than the {} MiB of memory that it may have for the conversion; allow \
                 more with `max-memory`",
                version,
                allowed
            );
        }
        let is_message = |line: &&str| !matches!(line.trim(), "" | GOODBYE);
        let last = ended.output.lines().rfind(is_message).unwrap_or("no message").trim();
        match status.code() {
            Some(_) => format!("Blender {version} ended with {status}: {last}"),
            None => worded!(
                "Blender {} crashed while it converted the file ({}: {}); the file may be damaged: save it \
                 again in Blender, use its backup (.blend1), or name another Blender with `blender`",
                version,
                status,
                last
            ),
        }
    }
}

fn read_file(path: &Path, max_bytes: u64) -> Result<Vec<u8>, LoadError> {
    let mut bytes = Vec::new();
    let read = open_scene_file(path, max_bytes)?.read_to_end(&mut bytes);
    read.map_err(|cause| LoadError::Io { path: path.to_path_buf(), cause })?;
    Ok(bytes)
}
