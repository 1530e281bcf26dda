//! Detects outputs that would overwrite inputs or each other.

use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};

use blinn_core::option_words::option_word;
use blinn_core::worded;
use blinn_output::canonical_path;

/// Inputs and outputs by the identity of their files, however their paths are written.
#[derive(Debug, Default)]
pub struct PathConflicts<'a>(HashMap<PathBuf, PathUse<'a>>);

#[derive(Debug)]
enum PathUse<'a> {
    Input,
    Output(Writer<'a>),
}

/// The writer of an output.
#[derive(Clone, Copy, Debug)]
pub enum Writer<'a> {
    /// The images of a scene.
    Scene(&'a Path),
    /// An option such as `report`.
    Option(&'static str),
}

impl fmt::Display for Writer<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Writer::Scene(path) => path.display().fmt(f),
            Writer::Option(name) => f.write_str(&option_word(name, None)),
        }
    }
}

impl<'a> PathConflicts<'a> {
    /// Starts with input files.
    pub fn with_inputs<P: AsRef<Path>>(files: impl IntoIterator<Item = P>) -> Self {
        // Devices and missing files lose nothing when they are written to.
        let files = files.into_iter().filter(|file| file.as_ref().is_file());
        PathConflicts(files.map(|file| (canonical_path(file.as_ref()), PathUse::Input)).collect())
    }

    /// Starts with a scene and the files that it refers to, named relative to its folder.
    pub fn with_scene<'n>(scene: &Path, referenced: impl IntoIterator<Item = &'n str>) -> Self {
        let files = referenced.into_iter().map(|name| scene.with_file_name("").join(name));
        Self::with_inputs(files.chain([scene.to_path_buf()]))
    }

    /// Returns an error if `file` is an input.
    pub fn check_not_input(&self, file: &Path, writer: Writer) -> Result<(), String> {
        match self.0.get(&canonical_path(file)) {
            Some(PathUse::Input) => Err(overwritten_input(file, writer)),
            _ => Ok(()),
        }
    }

    /// Adds an output. Returns an error if it is an input or was added before.
    pub fn add_output(&mut self, file: &Path, writer: Writer<'a>) -> Result<(), String> {
        let canonical = canonical_path(file);
        match self.0.get(&canonical) {
            None => {}
            Some(PathUse::Input) => return Err(overwritten_input(file, writer)),
            Some(PathUse::Output(other)) => {
                let what_to_do = match (other, writer) {
                    (Writer::Scene(a), Writer::Scene(b)) if differ_by_extension(a, b) => {
                        worded!("use {{stem}}.{{ext}} in `output`, which has the extension of the scene")
                    }
                    (Writer::Scene(_), Writer::Scene(_)) => {
                        worded!("use {{stem}}, {{parent}} or {{index}} in `output`")
                    }
                    _ => "name another file".to_string(),
                };
                let file = file.display();
                return Err(format!("{other} and {writer} would both be written to {file}; {what_to_do}"));
            }
        }
        self.0.insert(canonical, PathUse::Output(writer));
        Ok(())
    }
}

/// Returns true if two files beside each other have names with the same stem: `part.stl` and `part.glb`.
pub(super) fn differ_by_extension(a: &Path, b: &Path) -> bool {
    a.parent() == b.parent() && a.file_stem() == b.file_stem() && a.extension() != b.extension()
}

fn overwritten_input(file: &Path, writer: Writer) -> String {
    let file = file.display();
    match writer {
        Writer::Option(_) => format!("{writer} {file} would overwrite an input file; name another file"),
        Writer::Scene(scene) => {
            let scene = scene.display();
            worded!("{} would overwrite an input file of {}; name another file with `output`", file, scene)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_recognized_however_their_paths_are_written() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        for name in ["a.glb", "sub/a.png"] {
            std::fs::write(at(name), "").unwrap();
        }
        let (scene, other) = (at("a.glb"), at("b.glb"));
        let mut paths = PathConflicts::with_scene(&scene, ["sub/a.png", "missing.png"]);
        let writer = Writer::Scene(&scene);
        for name in ["a.glb", "sub/../a.glb", "sub/a.png"] {
            let error = paths.check_not_input(&at(name), writer).unwrap_err();
            assert!(error.contains("would overwrite an input file") && error.contains("`output`"), "{error}");
            let error = paths.add_output(&at(name), Writer::Option("report")).unwrap_err();
            assert!(error.starts_with("`report` "), "{error}");
        }
        paths.add_output(&at("missing.png"), writer).unwrap();
        paths.check_not_input(&at("missing.png"), writer).unwrap();
        let error = paths.add_output(&at("./missing.png"), Writer::Scene(&other)).unwrap_err();
        assert!(error.contains("b.glb would both be written to") && error.contains("{stem}, "), "{error}");
        let error = paths.add_output(&at("missing.png"), Writer::Scene(&at("a.stl"))).unwrap_err();
        assert!(
            error.ends_with("use {stem}.{ext} in `output`, which has the extension of the scene"),
            "{error}"
        );
    }
}
