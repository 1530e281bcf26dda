//! Which scenes: those on the command line, and those that `@list` files name.

use std::io::Read;
use std::path::{Path, PathBuf};

use crate::cli::Usage;

/// The scenes that `words` name: `@FILE` stands for the paths in FILE, one a line, as if they stood
/// on the command line; `@-` reads them from standard input. Empty lines and those that begin with
/// `#` do not count.
pub fn list(words: &[PathBuf]) -> Result<Vec<PathBuf>, Usage> {
    let mut scenes = Vec::new();
    for word in words {
        match word.to_str().and_then(|text| text.strip_prefix('@')) {
            Some(list) if !word.exists() => {
                let wrong = |e: std::io::Error| Usage(format!("@{list}: the list cannot be read: {e}"));
                scenes.extend(lines(&read(list).map_err(wrong)?));
            }
            _ => scenes.push(word.clone()),
        }
    }
    if scenes.is_empty() {
        return Err(Usage("the lists name no scene".into()));
    }
    Ok(scenes)
}

fn read(list: &str) -> std::io::Result<Vec<u8>> {
    if list != "-" {
        return std::fs::read(list);
    }
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn lines(bytes: &[u8]) -> impl Iterator<Item = PathBuf> {
    let lines = bytes.split(|&b| b == b'\n').map(|line| line.trim_ascii());
    lines.filter(|line| !line.is_empty() && !line.starts_with(b"#")).map(path)
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
        let found: Vec<_> = lines(b"a.glb\r\n\n # no\n  b c.obj \n#d\nlast.gltf").collect();
        assert_eq!(found, ["a.glb", "b c.obj", "last.gltf"].map(PathBuf::from));
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
