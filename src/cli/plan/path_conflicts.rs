//! Which file is whose: nothing is written over what is read, nor twice.

use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};

use crate::output::canonical_path;

/// Files, by what they are and not by how they are spelled.
#[derive(Debug, Default)]
pub struct Claims<'a>(HashMap<PathBuf, Claim<'a>>);

#[derive(Debug)]
enum Claim<'a> {
    Read,
    Written(Writer<'a>),
}

/// What a file is written for.
#[derive(Clone, Copy, Debug)]
pub enum Writer<'a> {
    /// Pictures of a scene.
    Scene(&'a Path),
    /// What a flag asks for.
    Flag(&'static str),
}

impl fmt::Display for Writer<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Writer::Scene(path) => path.display().fmt(f),
            Writer::Flag(flag) => f.write_str(flag),
        }
    }
}

impl<'a> Claims<'a> {
    /// Of files that are read.
    pub fn of_read<P: AsRef<Path>>(files: impl IntoIterator<Item = P>) -> Self {
        // Nothing is lost of a device, nor of what is missing.
        let files = files.into_iter().filter(|file| file.as_ref().is_file());
        Claims(files.map(|file| (canonical_path(file.as_ref()), Claim::Read)).collect())
    }

    /// Of a scene and the files that it refers to by these names.
    pub fn of_scene<'n>(scene: &Path, referred: impl IntoIterator<Item = &'n str>) -> Self {
        let beside = referred.into_iter().map(|name| scene.with_file_name("").join(name));
        Self::of_read(beside.chain([scene.to_path_buf()]))
    }

    /// Refuses to write over a file that is read.
    pub fn spare(&self, file: &Path, writer: Writer) -> Result<(), String> {
        self.check(&canonical_path(file), file, writer, |claim| matches!(claim, Claim::Read))
    }

    /// Claims a file that is to be written. Refuses what is read, and what is claimed.
    pub fn write(&mut self, file: &Path, writer: Writer<'a>) -> Result<(), String> {
        let own = canonical_path(file);
        self.check(&own, file, writer, |_| true)?;
        self.0.insert(own, Claim::Written(writer));
        Ok(())
    }

    fn check(
        &self,
        own: &Path,
        file: &Path,
        writer: Writer,
        counts: impl Fn(&Claim) -> bool,
    ) -> Result<(), String> {
        let file = file.display();
        match (self.0.get(own).filter(|claim| counts(claim)), writer) {
            (None, _) => Ok(()),
            (Some(Claim::Read), Writer::Flag(flag)) => {
                Err(format!("{flag} {file}: that file is read, and would be written over: name another"))
            }
            (Some(Claim::Read), Writer::Scene(scene)) => Err(format!(
                "{file} is read for {}, and would be written over: name another file with -o",
                scene.display()
            )),
            (Some(Claim::Written(Writer::Scene(other))), Writer::Scene(scene)) => Err(format!(
                "{} and {} would both be written to {file}: use {{stem}}, {{parent}} or {{index}} in -o",
                other.display(),
                scene.display()
            )),
            (Some(Claim::Written(other)), _) => {
                Err(format!("{other} and {writer} would both be written to {file}: name another file"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_what_it_is_however_it_is_spelled() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        for name in ["a.glb", "sub/a.png"] {
            std::fs::write(at(name), "").unwrap();
        }
        let (scene, other) = (at("a.glb"), at("b.glb"));
        let mut claims = Claims::of_scene(&scene, ["sub/a.png", "missing.png"]);
        let mine = Writer::Scene(&scene);
        for name in ["a.glb", "sub/../a.glb", "sub/a.png"] {
            let said = claims.spare(&at(name), mine).unwrap_err();
            assert!(said.contains("would be written over") && said.contains("-o"), "{said}");
            assert!(claims.write(&at(name), Writer::Flag("--report")).unwrap_err().starts_with("--report "));
        }
        claims.write(&at("missing.png"), mine).unwrap();
        claims.spare(&at("missing.png"), mine).unwrap();
        let said = claims.write(&at("./missing.png"), Writer::Scene(&other)).unwrap_err();
        assert!(said.contains("b.glb would both be written to") && said.contains("{stem}"), "{said}");
    }
}
