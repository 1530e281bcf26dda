//! Which scenes: those on the command line, and those that `@list` files name.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::cli::Usage;

/// The scenes that `words` name: `@FILE` stands for the paths in FILE, one a line, as if they stood
/// on the command line; `@-` reads them from standard input. Empty lines and those that begin with
/// `#` do not count. A list is UTF-8, or UTF-16 where a byte order mark says so. One with zeros has a path before
/// each, whatever is in it, as `find -print0` writes it.
pub fn list(words: &[PathBuf]) -> Result<Vec<PathBuf>, Usage> {
    let mut scenes = Vec::new();
    for word in words {
        match word.to_str().and_then(|text| text.strip_prefix('@')) {
            Some(list) if !word.exists() => {
                let wrong = |e: io::Error| Usage(format!("@{list}: the list cannot be read: {e}"));
                scenes.extend(paths(&read(list).and_then(unmarked).map_err(wrong)?));
            }
            _ => scenes.push(word.clone()),
        }
    }
    if scenes.is_empty() {
        return Err(Usage("the lists name no scene".into()));
    }
    Ok(scenes)
}

fn read(list: &str) -> io::Result<Vec<u8>> {
    if list != "-" {
        return std::fs::read(list);
    }
    let mut bytes = Vec::new();
    io::stdin().lock().read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text without a byte order mark, in bytes that ASCII stands in as it is.
fn unmarked(bytes: Vec<u8>) -> io::Result<Vec<u8>> {
    let of_pairs = |pair: fn([u8; 2]) -> u16| {
        let (pairs, rest) = bytes[2..].as_chunks::<2>();
        let text = String::from_utf16(&pairs.iter().map(|two| pair(*two)).collect::<Vec<_>>()).ok();
        let text = text.filter(|_| rest.is_empty());
        text.map(String::into_bytes).ok_or_else(|| io::Error::other("it begins as UTF-16, and is none"))
    };
    match bytes[..] {
        [0xff, 0xfe, ..] => of_pairs(u16::from_le_bytes),
        [0xfe, 0xff, ..] => of_pairs(u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, ..] => Ok(bytes[3..].to_vec()),
        _ => Ok(bytes),
    }
}

fn paths(bytes: &[u8]) -> Vec<PathBuf> {
    if bytes.contains(&0) {
        return bytes.split(|&b| b == 0).filter(|text| !text.is_empty()).map(path).collect();
    }
    let lines = bytes.split(|&b| b == b'\n').map(|line| line.trim_ascii());
    lines.filter(|line| !line.is_empty() && !line.starts_with(b"#")).map(path).collect()
}

#[cfg(unix)]
fn path(line: &[u8]) -> PathBuf {
    use std::os::unix::ffi::OsStrExt;
    Path::new(std::ffi::OsStr::from_bytes(line)).to_path_buf()
}

#[cfg(not(unix))]
fn path(line: &[u8]) -> PathBuf {
    Path::new(String::from_utf8_lossy(line).as_ref()).to_path_buf()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_a_path_a_line() {
        let found = paths(b"a.glb\r\n\n # no\n  b c.obj \n#d\nlast.gltf");
        assert_eq!(found, ["a.glb", "b c.obj", "last.gltf"].map(PathBuf::from));
    }

    #[test]
    fn lists_with_zeros_have_any_path() {
        let found = paths(b"#a.glb\0 b.obj \0two\nlines.glb\0");
        assert_eq!(found, ["#a.glb", " b.obj ", "two\nlines.glb"].map(PathBuf::from));
    }

    #[test]
    fn lists_are_read_as_editors_write_them() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        let named = |bytes: &[u8]| {
            std::fs::write(&file, bytes).unwrap();
            list(&[format!("@{}", file.display()).into()])
        };
        let text = "a.glb\r\nstühle 🪑.glb\n";
        let pairs = |to: fn(u16) -> [u8; 2]| -> Vec<u8> {
            "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(to).collect()
        };
        for bytes in
            [format!("\u{feff}{text}").into_bytes(), pairs(u16::to_le_bytes), pairs(u16::to_be_bytes)]
        {
            assert_eq!(named(&bytes).unwrap(), ["a.glb", "stühle 🪑.glb"].map(PathBuf::from));
        }
        for broken in [&b"\xff\xfea"[..], b"\xff\xfe\x00\xd8a\x00", b"\xfe\xff\xd8\x00"] {
            assert!(named(broken).unwrap_err().0.contains("begins as UTF-16"));
        }
        assert!(named(b"\xff\xfe").unwrap_err().0.contains("no scene"));
    }

    #[test]
    fn lists_stand_among_scenes() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        std::fs::write(&file, "b.glb\nc.glb\n").unwrap();
        let at = format!("@{}", file.display());
        let words = ["a.glb", &at, "d.glb"].map(PathBuf::from);
        assert_eq!(list(&words).unwrap(), ["a.glb", "b.glb", "c.glb", "d.glb"].map(PathBuf::from));
        std::fs::write(&file, "\n").unwrap();
        assert!(list(&words[1..2]).unwrap_err().0.contains("no scene"));
        assert!(list(&["@missing".into()]).unwrap_err().0.contains("@missing"));
    }
}
