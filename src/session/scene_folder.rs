//! The scene files in a folder and in the folders below it.

use std::collections::{BTreeMap, HashSet};
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use blinn_import::{SCENE_EXTENSIONS, is_foreign_model};
use blinn_output::datasets::MODELS_INFO;

/// Deepest level of folders that is searched.
const MAX_DEPTH: usize = 64;

/// Returns true if a name has one of [`SCENE_EXTENSIONS`], in any case.
pub fn has_scene_extension(path: &Path) -> bool {
    let extension = path.extension().map(OsStr::to_ascii_lowercase).unwrap_or_default();
    SCENE_EXTENSIONS.iter().any(|known| extension == *known)
}

/// Returns true for the name of a .blend file, in any case; not for Blender's backups.
fn is_blend_file(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("blend"))
}

/// Models in formats that are not read, by their extensions in lower case.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ForeignModels(BTreeMap<String, u64>);

impl ForeignModels {
    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn add(&mut self, name: &OsStr) {
        let extension = Path::new(name).extension().unwrap_or_default();
        *self.0.entry(extension.to_string_lossy().to_lowercase()).or_default() += 1;
    }
}

impl fmt::Display for ForeignModels {
    /// Writes `2 .fbx files and 1 .step file`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (i, (extension, count)) in self.0.iter().enumerate() {
            let before = match i {
                0 => "",
                _ if i + 1 == self.0.len() => " and ",
                _ => ", ",
            };
            let files = if *count == 1 { "file" } else { "files" };
            write!(f, "{before}{count} .{extension} {files}")?;
        }
        Ok(())
    }
}

/// Calls `found` for each scene file in `folder` and below, in the order of their names, byte by byte, with a folder's
/// content at the place of its name. A .blend file is found unless a scene file of the same name is beside it, which it was
/// probably exported to. Names that begin with a dot are skipped. Links to files are followed, links to
/// folders are not, nor are the models of BOP's datasets, which blinn writes. A file that cannot be examined, such as a
/// link to nothing, is found: reading it reports why. Returns the models in other formats without a scene file of the same
/// name beside them.
///
/// # Errors
/// A folder cannot be read, folders are nested too deeply, and errors of `found`.
pub fn visit_scenes(
    folder: &Path,
    found: &mut dyn FnMut(&Path) -> io::Result<()>,
) -> io::Result<ForeignModels> {
    let mut foreign = ForeignModels::default();
    visit(folder, 0, found, &mut foreign)?;
    Ok(foreign)
}

fn visit(
    folder: &Path,
    depth: usize,
    found: &mut dyn FnMut(&Path) -> io::Result<()>,
    foreign: &mut ForeignModels,
) -> io::Result<()> {
    let with_path = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", folder.display()));
    if depth > MAX_DEPTH {
        return Err(with_path(io::Error::other(format!("more than {MAX_DEPTH} folders inside each other"))));
    }
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(with_path)? {
        let entry = entry.map_err(with_path)?;
        let name = entry.file_name();
        if name.as_encoded_bytes().starts_with(b".") {
            continue;
        }
        let is_folder = entry.file_type().map_err(with_path)?.is_dir();
        let file = Path::new(&name);
        if is_folder || has_scene_extension(file) || is_blend_file(file) || is_foreign_model(file) {
            entries.push((name, is_folder));
        }
    }
    entries.sort_unstable();
    let exported: HashSet<OsString> = entries
        .iter()
        .filter(|(name, is_folder)| !is_folder && has_scene_extension(Path::new(name)))
        .filter_map(|(name, _)| Path::new(name).file_stem().map(OsStr::to_os_string))
        .collect();
    for (name, is_folder) in entries {
        let stem = Path::new(&name).file_stem().unwrap_or_default();
        if !is_folder && !has_scene_extension(Path::new(&name)) && exported.contains(stem) {
            continue;
        }
        let path: PathBuf = folder.join(name);
        if is_folder && path.join(MODELS_INFO).is_file() {
            continue;
        } else if is_folder {
            visit(&path, depth + 1, found, foreign)?;
        } else if is_foreign_model(&path) {
            foreign.add(path.file_name().unwrap_or_default());
        } else if path.metadata().map_or(true, |metadata| metadata.is_file()) {
            found(&path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_in_other_formats_are_counted_unless_they_were_exported() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["a.glb", "a.step", "b.STEP", "c.fbx", "d/e.step", "d/f.png", "d/g.blend", "h.mtl"] {
            let file = dir.path().join(name);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, "").unwrap();
        }
        let mut found = 0;
        let foreign = visit_scenes(dir.path(), &mut |_| {
            found += 1;
            Ok(())
        });
        assert_eq!((found, foreign.unwrap().to_string().as_str()), (2, "1 .fbx file and 2 .step files"));
    }

    #[test]
    fn scenes_are_found_in_the_order_of_their_names() {
        let dir = tempfile::tempdir().unwrap();
        for name in [
            "b/2.GLB",
            "b/10.obj",
            "b/.hidden.glb",
            "b/note.txt",
            "a.gltf",
            "a.blend",
            "d/e.blend",
            "d/e.blend1",
            "c.glb",
            ".git/x.glb",
            "out/models/obj_000001.ply",
            "out/models/models_info.json",
            "B.obj",
        ] {
            let file = dir.path().join(name);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, "").unwrap();
        }
        std::fs::create_dir(dir.path().join("folder.glb")).unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("..", dir.path().join("b/up")).unwrap();
            std::os::unix::fs::symlink("c.glb", dir.path().join("d.glb")).unwrap();
            std::os::unix::fs::symlink("missing", dir.path().join("e.glb")).unwrap();
        }
        let mut names = Vec::new();
        let mut add = |path: &Path| {
            names.push(path.strip_prefix(dir.path()).unwrap().to_str().unwrap().to_string());
            Ok(())
        };
        visit_scenes(dir.path(), &mut add).unwrap();
        let mut expected = vec!["B.obj", "a.gltf", "b/10.obj", "b/2.GLB", "c.glb"];
        expected.extend(if cfg!(unix) { &["d/e.blend", "d.glb", "e.glb"][..] } else { &["d/e.blend"] });
        assert_eq!(names, expected);
        assert!(visit_scenes(&dir.path().join("gone"), &mut |_| Ok(())).is_err());
    }
}
