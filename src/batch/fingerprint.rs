//! What a picture was made from: enough to know that it would come out the same.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, percent_encode, utf8_percent_encode};
use twox_hash::XxHash3_128;

use crate::import::open_regular_file;
use crate::scene::{FileDigest, HashingReader, Source};

/// What stands between a fingerprint's words, and what XML minds, is encoded in names.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'/');

/// What a fingerprint's key ends in where every warning was an error.
const STRICT: &str = "+strict";

/// All that a picture depends on but the files it is made from: settings, frame, and the program's
/// version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettingsHash {
    hash: u128,
    strict: bool,
}

impl SettingsHash {
    /// The key of anything whose debug form says all about it.
    pub fn of(what: &dyn std::fmt::Debug) -> SettingsHash {
        struct Sink(XxHash3_128);
        impl std::fmt::Write for Sink {
            fn write_str(&mut self, text: &str) -> std::fmt::Result {
                self.0.write(text.as_bytes());
                Ok(())
            }
        }
        let mut sink = Sink(XxHash3_128::new());
        // A sink of this kind never fails.
        let _ = write!(sink, "{} {what:?}", env!("CARGO_PKG_VERSION"));
        SettingsHash { hash: sink.0.finish_128(), strict: false }
    }

    /// The same where every warning is an error. Such pictures do for anyone, and others, which may
    /// have been made with a warning, not for this key.
    pub fn strict(self, strict: bool) -> SettingsHash {
        SettingsHash { strict, ..self }
    }

    fn word(self) -> String {
        format!("{:032x}{}", self.hash, if self.strict { STRICT } else { "" })
    }

    /// Whether a picture that was made by the key of that word will do for this one.
    fn takes(self, word: &str) -> bool {
        word == SettingsHash { strict: true, ..self }.word() || !self.strict && word == self.word()
    }
}

/// What is in files, each read once.
#[derive(Debug)]
pub struct FileDigests {
    known: HashMap<PathBuf, FileDigest>,
    /// Bytes of a file that is read, at most.
    limit: u64,
}

impl FileDigests {
    /// Of files that whoever makes the pictures reads: those of no more than `limit` bytes.
    pub fn with_limit(limit: u64) -> FileDigests {
        FileDigests { known: HashMap::new(), limit }
    }

    fn of(&mut self, path: &Path) -> FileDigest {
        let limit = self.limit;
        let content = || content(path, limit).unwrap_or_default();
        *self.known.entry(path.to_path_buf()).or_insert_with(content)
    }

    /// Takes what `scene` was made of for what is in its files. False where something else was found in
    /// one of them before: it was replaced meanwhile.
    pub fn record(&mut self, scene: &Path, source: &Source) -> bool {
        let others = source.files.iter().map(|file| (beside(scene, &file.name), file.digest));
        let all = std::iter::once((scene.to_path_buf(), source.digest)).chain(others);
        all.fold(true, |agreed, (path, content)| {
            let before = self.known.insert(path, content);
            agreed && before.is_none_or(|before| before == content)
        })
    }

    /// Whether a picture with that fingerprint is what `key` would make of `scene` today.
    pub fn is_current(&mut self, fingerprint: &str, key: SettingsHash, scene: &Path) -> bool {
        let mut words = fingerprint.split(' ');
        if words.next() != Some("1") || !words.next().is_some_and(|word| key.takes(word)) {
            return false;
        }
        let own = words.next().and_then(|word| word.split_once('='));
        // Of a scene that cannot be read nothing is known, so nothing is the same.
        own.is_some_and(|(content, name)| {
            let today = self.of(scene);
            name == own_name(scene) && today != FileDigest::Unread && content == today.to_string()
        }) && words.all(|word| {
            word.split_once('=').is_some_and(|(content, name)| {
                let name = percent_decode_str(name).decode_utf8_lossy();
                content == self.of(&beside(scene, &name)).to_string()
            })
        })
    }
}

/// The fingerprint of a picture of a scene that was read from a file of that name: the key, then each file with
/// what was in it, `-` where it could not be read. It knows no folder, so that a fingerprint holds wherever a scene
/// is moved with its files. `None` where a file changed while it was read: nobody knows what the picture is of.
pub fn fingerprint(key: SettingsHash, scene: &Path, source: &Source) -> Option<String> {
    let mut contents = std::iter::once(source.digest).chain(source.files.iter().map(|file| file.digest));
    if contents.any(|content| content == FileDigest::Changed) {
        return None;
    }
    let mut fingerprint = format!("1 {} {}={}", key.word(), source.digest, own_name(scene));
    for file in &source.files {
        let _ = write!(fingerprint, " {}={}", file.digest, utf8_percent_encode(&file.name, ENCODED));
    }
    Some(fingerprint)
}

/// What is in a regular file of no more than `limit` bytes.
fn content(path: &Path, limit: u64) -> io::Result<FileDigest> {
    let mut file = HashingReader::new(open_regular_file(path, limit)?.take(limit));
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(file.digest()),
            Err(e) if e.kind() != io::ErrorKind::Interrupted => return Err(e),
            _ => {}
        }
    }
}

/// A scene's name without its folder, byte by byte: it may be no text.
fn own_name(scene: &Path) -> String {
    let name = scene.file_name().unwrap_or_default();
    percent_encode(name.as_encoded_bytes(), ENCODED).to_string()
}

fn beside(scene: &Path, name: &str) -> PathBuf {
    scene.parent().unwrap_or(Path::new("")).join(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SourceFile;

    fn contents() -> FileDigests {
        FileDigests::with_limit(1 << 20)
    }

    /// As an importer would have read them.
    fn source(scene: &Path, referred: &[&str]) -> Source {
        let mut contents = contents();
        let mut file =
            |name: &&str| SourceFile { name: name.to_string(), digest: contents.of(&beside(scene, name)) };
        let files = referred.iter().map(&mut file).collect();
        Source { digest: contents.of(scene), files, ..Source::default() }
    }

    fn stamped(key: SettingsHash, scene: &Path, referred: &[&str]) -> String {
        fingerprint(key, scene, &source(scene, referred)).unwrap()
    }

    #[test]
    fn a_stamp_holds_until_something_changes() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("a b.gltf"), "{}").unwrap();
        std::fs::write(at("x=\"1\".png"), "x").unwrap();
        let referred = ["x=\"1\".png", "missing.bin"];
        let (scene, key) = (at("a b.gltf"), SettingsHash::of(&("size", 3)));
        let fingerprint = stamped(key, &scene, &referred);
        assert!(fingerprint.is_ascii() && !fingerprint.contains(['"', '<', '&', '\n']), "{fingerprint}");
        let holds = |key: SettingsHash, scene: &Path| contents().is_current(&fingerprint, key, scene);
        assert!(holds(key, &scene));
        assert!(!holds(SettingsHash::of(&("size", 4)), &scene));
        assert!(!contents().is_current("", key, &scene));
        assert!(!contents().is_current(&fingerprint[..34], key, &scene));
        std::fs::copy(&scene, at("c.gltf")).unwrap();
        assert!(!holds(key, &at("c.gltf")));
        std::fs::write(at("missing.bin"), "").unwrap();
        assert!(!holds(key, &scene), "what was missing is there");
        std::fs::remove_file(at("missing.bin")).unwrap();
        std::fs::write(at("x=\"1\".png"), "y").unwrap();
        assert!(!holds(key, &scene), "another content");
    }

    /// A picture that may have been made with a warning is none that `--strict` keeps.
    #[test]
    fn a_strict_stamp_does_for_anyone_and_another_not_for_the_strict() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.gltf");
        std::fs::write(&scene, "{}").unwrap();
        let key = SettingsHash::of(&1);
        for (made, asked, holds) in
            [(false, false, true), (false, true, false), (true, false, true), (true, true, true)]
        {
            let fingerprint = stamped(key.strict(made), &scene, &[]);
            assert_eq!(
                contents().is_current(&fingerprint, key.strict(asked), &scene),
                holds,
                "{fingerprint}"
            );
        }
    }

    /// What the importers refuse is not read here either, and a fingerprint that names it holds.
    #[test]
    fn what_is_no_file_or_too_large_counts_as_missing() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.gltf");
        std::fs::write(&scene, "{}").unwrap();
        std::fs::create_dir(dir.path().join("folder")).unwrap();
        let huge = std::fs::File::create(dir.path().join("huge.mtl")).unwrap();
        huge.set_len(2 << 20).unwrap();
        let (key, referred) = (SettingsHash::of(&1), ["folder", "huge.mtl"]);
        let fingerprint = stamped(key, &scene, &referred);
        assert!(fingerprint.ends_with(" -=folder -=huge.mtl"), "{fingerprint}");
        assert!(contents().is_current(&fingerprint, key, &scene));
    }

    /// Nothing is known of a scene that cannot be read, whatever was known of it before.
    #[test]
    fn an_unreadable_scene_holds_no_stamp() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("gone.gltf");
        let fingerprint = stamped(SettingsHash::of(&1), &scene, &[]);
        assert!(fingerprint.ends_with(" -=gone.gltf"), "{fingerprint}");
        assert!(!contents().is_current(&fingerprint, SettingsHash::of(&1), &scene));
    }

    /// A fingerprint is of what was read, whatever the file holds by the time it is written.
    #[test]
    fn what_is_replaced_after_it_was_read_is_another() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.gltf");
        std::fs::write(&scene, "{}").unwrap();
        let (key, read) = (SettingsHash::of(&1), source(&scene, &[]));
        let mut before = contents();
        assert!(before.record(&scene, &read) && before.record(&scene, &read));
        std::fs::write(&scene, "{ }").unwrap();
        let fingerprint = fingerprint(key, &scene, &read).unwrap();
        assert!(!contents().is_current(&fingerprint, key, &scene));
        assert!(!before.record(&scene, &source(&scene, &[])), "it was replaced");
        assert!(!before.is_current(&fingerprint, key, &scene), "and what was read last counts");
    }

    #[test]
    fn what_changed_while_it_was_read_has_no_stamp() {
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
