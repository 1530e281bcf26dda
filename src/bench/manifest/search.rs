//! Finds the files of a manifest's scenes and hashes them.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use glob::{MatchOptions, Pattern, glob_with};
use sha2::{Digest, Sha256};

use super::definition::ManifestScene;

/// The file of a scene below `folder`: the first by its path that matches the first pattern with a match. Patterns do
/// not depend on case. `None` if there is none.
pub fn find_scene_file(folder: &Path, scene: &ManifestScene) -> Option<PathBuf> {
    let options = MatchOptions { case_sensitive: false, ..MatchOptions::new() };
    let folder = Pattern::escape(folder.to_str()?);
    scene.files.iter().find_map(|pattern| {
        // The paths of `glob` are in alphabetical order.
        let mut paths = glob_with(&format!("{folder}/{pattern}"), options).ok()?;
        paths.find_map(|path| path.ok().filter(|path| path.is_file()))
    })
}

/// SHA-256 of a file as 64 hexadecimal digits.
///
/// # Errors
/// The file cannot be read.
pub fn sha256_of_file(file: &Path) -> io::Result<String> {
    let mut reader = File::open(file)?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match reader.read(&mut buffer)? {
            0 => break,
            length => hash.update(&buffer[..length]),
        }
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn patterns_ignore_case_and_prefer_their_order() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a [b]");
        fs::create_dir_all(folder.join("x/y")).unwrap();
        let scene = |files: &[&str]| ManifestScene {
            name: "s".into(),
            files: files.iter().map(|file| file.to_string()).collect(),
            licence: None,
            source: None,
            sha256: None,
            quirks: Vec::new(),
            cameras: Vec::new(),
        };
        let find = |files: &[&str]| find_scene_file(&folder, &scene(files));
        assert_eq!(find(&["**/sponza.obj"]), None);
        fs::write(folder.join("x/y/SPONZA.obj"), "abc").unwrap();
        fs::create_dir(folder.join("other.obj")).unwrap();
        let found = find(&["**/other.obj", "**/sponza.obj"]).unwrap();
        assert!(found.ends_with("x/y/SPONZA.obj"), "{found:?}");
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_of_file(&found).unwrap(), expected);
    }
}
