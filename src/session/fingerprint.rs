//! Fingerprints of rendered images: a hash of the settings, and the digest of each input file. `--resume` skips images
//! whose fingerprint is current.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, percent_encode, utf8_percent_encode};

use crate::settings_hash::SettingsHash;
use blinn_import::open_input_file;
use blinn_scene::{FileDigest, HashingReader, Source};

/// Percent-encoded in file names: everything that separates words, or that XML escapes.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'/');

/// The first word of a fingerprint.
const VERSION: &str = "1";
/// Words before those of the input files.
const SETTINGS_WORDS: usize = 2;
/// The last word of the fingerprint of a dataset's image that shows nothing.
const EMPTY_WORD: &str = "empty";

/// A cache of the digests of input files, each of which is read once.
#[derive(Debug)]
pub struct FileDigests {
    digests: HashMap<PathBuf, FileDigest>,
    /// Larger files are not read, as the importers do not read them.
    max_bytes: u64,
}

impl FileDigests {
    /// An empty cache for files of at most `max_bytes`.
    pub fn with_limit(max_bytes: u64) -> FileDigests {
        FileDigests { digests: HashMap::new(), max_bytes }
    }

    fn get(&mut self, path: &Path) -> FileDigest {
        let max_bytes = self.max_bytes;
        let digest = || digest_file(path, max_bytes).unwrap_or_default();
        *self.digests.entry(path.to_path_buf()).or_insert_with(digest)
    }

    /// Records the digests of the files that `scene` was imported from. Returns false if one of them differs from
    /// the digest before: the file was replaced in the meantime.
    pub fn record(&mut self, scene: &Path, source: &Source) -> bool {
        let referenced = source.files.iter().map(|file| (resolve(scene, &file.name), file.digest));
        let all = std::iter::once((scene.to_path_buf(), source.digest)).chain(referenced);
        all.fold(true, |unchanged, (path, digest)| {
            let before = self.digests.insert(path, digest);
            unchanged && before.is_none_or(|before| before == digest)
        })
    }

    /// Returns true if rendering `scene` now would produce the image with this fingerprint.
    pub fn is_current(&mut self, fingerprint: &str, settings: SettingsHash, scene: &Path) -> bool {
        if !has_settings(fingerprint, settings) {
            return false;
        }
        let mut words = fingerprint.split(' ').skip(SETTINGS_WORDS);
        let scene_file = words.next().and_then(|word| word.split_once('='));
        // An unreadable scene may have changed.
        let same_scene = scene_file.is_some_and(|(digest, name)| {
            let current = self.get(scene);
            name == encoded_file_name(scene) && current != FileDigest::Unread && digest == current.to_string()
        });
        same_scene
            && words.filter(|word| *word != EMPTY_WORD).all(|word| {
                word.split_once('=').is_some_and(|(digest, name)| {
                    let name = percent_decode_str(name).decode_utf8_lossy();
                    digest == self.get(&resolve(scene, &name)).to_string()
                })
            })
    }
}

/// The fingerprint of an image of `scene`: a version, the settings' hash, and `digest=name` of each input file, with the
/// digest `-` for files that could not be read. Names are relative to the scene's folder, so that a fingerprint stays
/// current when a scene is moved with its files. `None` if a file changed while it was read.
pub fn fingerprint(settings: SettingsHash, scene: &Path, source: &Source) -> Option<String> {
    let mut digests = std::iter::once(source.digest).chain(source.files.iter().map(|file| file.digest));
    if digests.any(|digest| digest == FileDigest::Changed) {
        return None;
    }
    let mut fingerprint =
        format!("{VERSION} {} {}={}", settings.word(), source.digest, encoded_file_name(scene));
    for file in &source.files {
        let _ = write!(fingerprint, " {}={}", file.digest, utf8_percent_encode(&file.name, ENCODED));
    }
    Some(fingerprint)
}

/// Returns true if the image with this fingerprint was made with these settings, whatever its input files are now.
pub fn has_settings(fingerprint: &str, settings: SettingsHash) -> bool {
    let mut words = fingerprint.split(' ');
    words.next() == Some(VERSION) && words.next().is_some_and(|word| settings.accepts(word))
}

/// Marks the fingerprint of an image that shows nothing, so that a later run knows without looking at the pixels.
pub fn mark_empty(fingerprint: &str) -> String {
    format!("{fingerprint} {EMPTY_WORD}")
}

/// Returns true if a fingerprint is marked by [`mark_empty`].
pub fn is_marked_empty(fingerprint: &str) -> bool {
    fingerprint.rsplit(' ').next() == Some(EMPTY_WORD)
}

/// Hashes a regular file of at most `max_bytes`. A path with a slash at the end is a folder, of which only the
/// existence matters.
fn digest_file(path: &Path, max_bytes: u64) -> io::Result<FileDigest> {
    let mut file = HashingReader::new(open_input_file(path, max_bytes)?);
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(file.digest()),
            Err(e) if e.kind() != io::ErrorKind::Interrupted => return Err(e),
            _ => {}
        }
    }
}

/// The file name of a scene, percent-encoded byte by byte, because it may not be UTF-8.
fn encoded_file_name(scene: &Path) -> String {
    let name = scene.file_name().unwrap_or_default();
    percent_encode(name.as_encoded_bytes(), ENCODED).to_string()
}

/// The path of a file that `scene` refers to as `name`.
fn resolve(scene: &Path, name: &str) -> PathBuf {
    scene.parent().unwrap_or(Path::new("")).join(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_scene::SourceFile;

    fn digests() -> FileDigests {
        FileDigests::with_limit(1 << 20)
    }

    /// The source of a scene that an importer read with the files `referred`.
    fn source(scene: &Path, referred: &[&str]) -> Source {
        let mut digests = digests();
        let mut file =
            |name: &&str| SourceFile { name: name.to_string(), digest: digests.get(&resolve(scene, name)) };
        let files = referred.iter().map(&mut file).collect();
        Source { digest: digests.get(scene), files, ..Source::default() }
    }

    fn current_fingerprint(key: SettingsHash, scene: &Path, referred: &[&str]) -> String {
        fingerprint(key, scene, &source(scene, referred)).unwrap()
    }

    #[test]
    fn a_fingerprint_is_current_until_something_changes() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("a b.gltf"), "{}").unwrap();
        std::fs::write(at("x=\"1\".png"), "x").unwrap();
        let referred = ["x=\"1\".png", "missing.bin"];
        let (scene, key) = (at("a b.gltf"), SettingsHash::of(&("size", 3)));
        let fingerprint = current_fingerprint(key, &scene, &referred);
        assert!(fingerprint.is_ascii() && !fingerprint.contains(['"', '<', '&', '\n']), "{fingerprint}");
        let is_current = |key: SettingsHash, scene: &Path| digests().is_current(&fingerprint, key, scene);
        assert!(is_current(key, &scene));
        assert!(!is_current(SettingsHash::of(&("size", 4)), &scene));
        assert!(!digests().is_current("", key, &scene));
        assert!(!digests().is_current(&fingerprint[..34], key, &scene));
        std::fs::copy(&scene, at("c.gltf")).unwrap();
        assert!(!is_current(key, &at("c.gltf")));
        std::fs::write(at("missing.bin"), "").unwrap();
        assert!(!is_current(key, &scene), "a missing file appeared");
        std::fs::remove_file(at("missing.bin")).unwrap();
        std::fs::write(at("x=\"1\".png"), "y").unwrap();
        assert!(!is_current(key, &scene), "a file changed");
        // The settings are the same, whatever the files are.
        assert!(has_settings(&fingerprint, key) && !has_settings(&fingerprint, SettingsHash::of(&1)));
        assert!(!has_settings("", key) && !has_settings(&fingerprint[2..], key));
    }

    #[test]
    fn a_mark_of_empty_images_does_not_make_a_fingerprint_outdated() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.gltf");
        std::fs::write(&scene, "{}").unwrap();
        let key = SettingsHash::of(&1);
        let plain = current_fingerprint(key, &scene, &["empty"]);
        let marked = mark_empty(&plain);
        assert!(is_marked_empty(&marked) && !is_marked_empty(&plain));
        assert!(digests().is_current(&marked, key, &scene));
        std::fs::write(&scene, "{ }").unwrap();
        assert!(!digests().is_current(&marked, key, &scene));
    }

    /// `--strict` does not keep an image that may have been rendered with warnings.
    #[test]
    fn a_strict_fingerprint_is_current_for_all_and_others_not_for_strict() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.gltf");
        std::fs::write(&scene, "{}").unwrap();
        let key = SettingsHash::of(&1);
        for (rendered, requested, current) in
            [(false, false, true), (false, true, false), (true, false, true), (true, true, true)]
        {
            let fingerprint = current_fingerprint(key.strict(rendered), &scene, &[]);
            assert_eq!(
                digests().is_current(&fingerprint, key.strict(requested), &scene),
                current,
                "{fingerprint}"
            );
        }
    }

    /// Files that the importers refuse are not read here either.
    #[test]
    fn folders_and_too_large_files_count_as_missing() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.gltf");
        std::fs::write(&scene, "{}").unwrap();
        std::fs::create_dir(dir.path().join("folder")).unwrap();
        let huge = std::fs::File::create(dir.path().join("huge.mtl")).unwrap();
        huge.set_len(2 << 20).unwrap();
        let (key, referred) = (SettingsHash::of(&1), ["folder", "huge.mtl"]);
        let fingerprint = current_fingerprint(key, &scene, &referred);
        assert!(fingerprint.ends_with(" -=folder -=huge.mtl"), "{fingerprint}");
        assert!(digests().is_current(&fingerprint, key, &scene));
    }

    /// An unreadable scene may have changed.
    #[test]
    fn a_fingerprint_of_an_unreadable_scene_is_never_current() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("gone.gltf");
        let fingerprint = current_fingerprint(SettingsHash::of(&1), &scene, &[]);
        assert!(fingerprint.ends_with(" -=gone.gltf"), "{fingerprint}");
        assert!(!digests().is_current(&fingerprint, SettingsHash::of(&1), &scene));
    }

    /// A fingerprint describes what was read, even if the file changes before the image is written.
    #[test]
    fn a_file_replaced_after_it_was_read_makes_the_fingerprint_outdated() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.gltf");
        std::fs::write(&scene, "{}").unwrap();
        let (key, read) = (SettingsHash::of(&1), source(&scene, &[]));
        let mut before = digests();
        assert!(before.record(&scene, &read) && before.record(&scene, &read));
        std::fs::write(&scene, "{ }").unwrap();
        let fingerprint = fingerprint(key, &scene, &read).unwrap();
        assert!(!digests().is_current(&fingerprint, key, &scene));
        assert!(!before.record(&scene, &source(&scene, &[])), "the file was replaced");
        assert!(!before.is_current(&fingerprint, key, &scene), "the latest digest counts");
    }

    #[test]
    fn a_file_that_changed_while_it_was_read_prevents_a_fingerprint() {
        let changing = SourceFile { name: "a.png".into(), digest: FileDigest::Changed };
        let own = Source { digest: FileDigest::of(b"{}"), ..Source::default() };
        assert!(fingerprint(SettingsHash::of(&1), Path::new("a.gltf"), &own).is_some());
        for source in [
            Source { digest: FileDigest::Changed, ..own.clone() },
            Source { files: vec![changing], ..own.clone() },
        ] {
            assert_eq!(fingerprint(SettingsHash::of(&1), Path::new("a.gltf"), &source), None);
        }
    }
}
