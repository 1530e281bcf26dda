//! Scene files on the command line, and those in `@FILE` lists.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::cli::scene_file::{is_stdin, scene_path};
use crate::cli::usage::UsageError;

/// Expands scene arguments. `-` stands for a scene on standard input, `@FILE` stands for the paths in FILE, one per line, and `@-` for those on standard input;
/// empty lines and lines that begin with `#` are skipped. A list is UTF-8, or UTF-16 with a byte order mark. A list
/// that contains zero bytes has a path before each of them, as `find -print0` writes it.
pub fn scene_list(args: &[PathBuf]) -> Result<Vec<PathBuf>, UsageError> {
    let mut scenes = Vec::new();
    for arg in args {
        match arg.to_str().and_then(|text| text.strip_prefix('@')) {
            Some(list) if !arg.exists() => {
                let error = |e: io::Error| UsageError(format!("@{list}: the list cannot be read: {e}"));
                scenes.extend(parse(&read(list).and_then(to_ascii_superset).map_err(error)?));
            }
            _ => scenes.push(scene_path(arg).to_path_buf()),
        }
    }
    let is_list = |arg: &&PathBuf| arg.as_os_str() == "@-";
    if scenes.iter().filter(|scene| is_stdin(scene)).count() + args.iter().filter(is_list).count() > 1 {
        return Err(UsageError("standard input can be read only once; name it once".into()));
    }
    if scenes.is_empty() {
        return Err(UsageError("the lists contain no scene".into()));
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

/// Removes a byte order mark and converts UTF-16 to UTF-8. Other encodings are kept as bytes.
fn to_ascii_superset(bytes: Vec<u8>) -> io::Result<Vec<u8>> {
    let from_utf16 = |unit: fn([u8; 2]) -> u16| {
        let (pairs, rest) = bytes[2..].as_chunks::<2>();
        let text = String::from_utf16(&pairs.iter().map(|pair| unit(*pair)).collect::<Vec<_>>()).ok();
        let text = text.filter(|_| rest.is_empty());
        text.map(String::into_bytes).ok_or_else(|| io::Error::other("invalid UTF-16"))
    };
    match bytes[..] {
        [0xff, 0xfe, ..] => from_utf16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => from_utf16(u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, ..] => Ok(bytes[3..].to_vec()),
        _ => Ok(bytes),
    }
}

fn parse(bytes: &[u8]) -> Vec<PathBuf> {
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
    fn a_list_has_one_path_per_line() {
        let found = parse(b"a.glb\r\n\n # no\n  b c.obj \n#d\nlast.gltf");
        assert_eq!(found, ["a.glb", "b c.obj", "last.gltf"].map(PathBuf::from));
    }

    #[test]
    fn zero_bytes_separate_paths_of_any_characters() {
        let found = parse(b"#a.glb\0 b.obj \0two\nlines.glb\0");
        assert_eq!(found, ["#a.glb", " b.obj ", "two\nlines.glb"].map(PathBuf::from));
    }

    #[test]
    fn byte_order_marks_and_utf16_are_supported() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        let named = |bytes: &[u8]| {
            std::fs::write(&file, bytes).unwrap();
            scene_list(&[format!("@{}", file.display()).into()])
        };
        let text = "a.glb\r\nstühle 🪑.glb\n";
        let utf16 = |to: fn(u16) -> [u8; 2]| -> Vec<u8> {
            "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(to).collect()
        };
        for bytes in
            [format!("\u{feff}{text}").into_bytes(), utf16(u16::to_le_bytes), utf16(u16::to_be_bytes)]
        {
            assert_eq!(named(&bytes).unwrap(), ["a.glb", "stühle 🪑.glb"].map(PathBuf::from));
        }
        for broken in [&b"\xff\xfea"[..], b"\xff\xfe\x00\xd8a\x00", b"\xfe\xff\xd8\x00"] {
            assert!(named(broken).unwrap_err().0.contains("invalid UTF-16"));
        }
        assert!(named(b"\xff\xfe").unwrap_err().0.contains("contain no scene"));
    }

    #[test]
    fn standard_input_is_one_scene() {
        let list = |args: &[&str]| scene_list(&args.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(list(&["a.glb", "-"]).unwrap(), ["a.glb", "/dev/stdin"].map(PathBuf::from));
        for args in [&["-", "-"][..], &["-", "/dev/stdin"]] {
            assert!(list(args).unwrap_err().0.contains("only once"), "{args:?}");
        }
    }

    #[test]
    fn lists_are_expanded_in_place() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("list");
        std::fs::write(&file, "b.glb\nc.glb\n").unwrap();
        let at = format!("@{}", file.display());
        let args = ["a.glb", &at, "d.glb"].map(PathBuf::from);
        assert_eq!(scene_list(&args).unwrap(), ["a.glb", "b.glb", "c.glb", "d.glb"].map(PathBuf::from));
        std::fs::write(&file, "\n").unwrap();
        assert!(scene_list(&args[1..2]).unwrap_err().0.contains("contain no scene"));
        assert!(scene_list(&["@missing".into()]).unwrap_err().0.contains("@missing"));
    }
}
