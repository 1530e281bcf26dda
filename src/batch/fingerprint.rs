//! What a picture was made from: enough to know that it would come out the same.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use twox_hash::XxHash3_128;

/// What stands between a stamp's words, and what XML minds, is encoded in names.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'/');

/// All that a picture depends on but the files it is made from: settings, frame, and the program's
/// version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key(u128);

impl Key {
    /// The key of anything whose debug form says all about it.
    pub fn of(what: &dyn std::fmt::Debug) -> Key {
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
        Key(sink.0.finish_128())
    }
}

/// What is in files, each read once.
#[derive(Debug, Default)]
pub struct Contents(HashMap<PathBuf, Option<u128>>);

impl Contents {
    /// A hash of the file's bytes; `None` where it cannot be read.
    fn of(&mut self, path: &Path) -> Option<u128> {
        *self.0.entry(path.to_path_buf()).or_insert_with(|| {
            let mut file = File::open(path).ok().filter(|f| f.metadata().is_ok_and(|m| m.is_file()))?;
            let (mut hash, mut buffer) = (XxHash3_128::new(), vec![0; 1 << 18]);
            loop {
                match file.read(&mut buffer) {
                    Ok(0) => return Some(hash.finish_128()),
                    Ok(n) => hash.write(&buffer[..n]),
                    Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                    Err(_) => return None,
                }
            }
        })
    }

    /// The stamp of a picture of `scene`, which refers to files by their names relative to its folder:
    /// the key, then each file with what is in it, `-` where there is none. It knows no folder, so
    /// that a stamp holds wherever a scene is moved with its files.
    pub fn stamp(&mut self, key: Key, scene: &Path, referred: &[String]) -> String {
        let mut stamp = format!("1 {:032x}", key.0);
        let own = scene.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        for name in std::iter::once(&own).chain(referred) {
            let content = match self.of(&beside(scene, name)) {
                Some(hash) => format!("{hash:032x}"),
                None => "-".into(),
            };
            let _ = write!(stamp, " {content}={}", utf8_percent_encode(name, ENCODED));
        }
        stamp
    }

    /// Whether a picture with that stamp is what `key` would make of `scene` today.
    pub fn still_hold(&mut self, stamp: &str, key: Key, scene: &Path) -> bool {
        let mut words = stamp.split(' ');
        if words.next() != Some("1") || words.next() != Some(&format!("{:032x}", key.0)) {
            return false;
        }
        let decoded = |name: &str| percent_decode_str(name).decode_utf8_lossy().into_owned();
        let files: Vec<(String, Option<u128>)> = words
            .filter_map(|word| word.split_once('='))
            .map(|(content, name)| (decoded(name), u128::from_str_radix(content, 16).ok()))
            .collect();
        let own = scene.file_name().map(|n| n.to_string_lossy());
        files.first().is_some_and(|(name, _)| Some(name.as_str()) == own.as_deref())
            && files.iter().all(|(name, content)| self.of(&beside(scene, name)) == *content)
    }
}

fn beside(scene: &Path, name: &str) -> PathBuf {
    scene.parent().unwrap_or(Path::new("")).join(name)
}

/// True where one of the scene's files was written since `then`: what was read of it may not be
/// what it holds now.
pub fn written_since(then: SystemTime, scene: &Path, referred: &[String]) -> bool {
    let now = SystemTime::now();
    let own = std::iter::once(scene.to_path_buf());
    own.chain(referred.iter().map(|name| beside(scene, name))).any(|path| {
        let at = std::fs::metadata(path).and_then(|m| m.modified());
        at.is_ok_and(|at| then <= at && at <= now)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_holds_until_something_changes() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("a b.gltf"), "{}").unwrap();
        std::fs::write(at("x=\"1\".png"), "x").unwrap();
        let referred = ["x=\"1\".png".to_string(), "missing.bin".to_string()];
        let (scene, key) = (at("a b.gltf"), Key::of(&("size", 3)));
        let stamp = Contents::default().stamp(key, &scene, &referred);
        assert!(stamp.is_ascii() && !stamp.contains(['"', '<', '&', '\n']), "{stamp}");
        let holds = |key: Key, scene: &Path| Contents::default().still_hold(&stamp, key, scene);
        assert!(holds(key, &scene));
        assert!(!holds(Key::of(&("size", 4)), &scene));
        assert!(!Contents::default().still_hold("", key, &scene));
        assert!(!Contents::default().still_hold(&stamp[..34], key, &scene));
        std::fs::copy(&scene, at("c.gltf")).unwrap();
        assert!(!holds(key, &at("c.gltf")));
        std::fs::write(at("missing.bin"), "").unwrap();
        assert!(!holds(key, &scene), "what was missing is there");
        std::fs::remove_file(at("missing.bin")).unwrap();
        std::fs::write(at("x=\"1\".png"), "y").unwrap();
        assert!(!holds(key, &scene), "another content");
    }
}
