//! Recognition of .blend files.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use blinn_import::{LoadError, LoadOptions, is_in_archive, open_scene_file};
use blinn_scene::{FileDigest, HashingReader};

const MAGIC: &[u8] = b"BLENDER";
/// Blender writes compressed files with zstd, and wrote them with gzip.
const COMPRESSED_MAGICS: [&[u8]; 2] = [b"\x28\xb5\x2f\xfd", b"\x1f\x8b"];

/// A .blend file.
pub struct BlendFile {
    /// Absolute path.
    pub path: PathBuf,
    /// Digest of its bytes.
    pub digest: FileDigest,
}

impl BlendFile {
    /// Reads a file if it is a .blend file. `None` for other files, for those that cannot be opened, and if the options name a
    /// format.
    ///
    /// # Errors
    /// The name ends in `.blend`, but the content is another; the file is larger than the limit or cannot be read.
    pub fn open(path: &Path, options: &LoadOptions) -> Result<Option<BlendFile>, LoadError> {
        let has_name = has_blend_extension(path);
        if is_in_archive(path) || options.format.is_some() {
            return Ok(None);
        }
        let io_error = |cause| LoadError::Io { path: path.to_path_buf(), cause };
        let file = match open_scene_file(path, options.limits.file_bytes) {
            Ok(file) => file,
            Err(error) if has_name => return Err(error),
            Err(_) => return Ok(None),
        };
        let mut file = HashingReader::new(file);
        let mut head = Vec::new();
        Read::by_ref(&mut file).take(MAGIC.len() as u64).read_to_end(&mut head).map_err(io_error)?;
        let is_compressed = COMPRESSED_MAGICS.iter().any(|magic| head.starts_with(magic));
        if !(head == MAGIC || has_name && is_compressed) {
            return if has_name { Err(no_blend_file(&head)) } else { Ok(None) };
        }
        options.cancel.check()?;
        io::copy(&mut file, &mut io::sink()).map_err(io_error)?;
        let absolute = std::path::absolute(path).map_err(io_error)?;
        Ok(Some(BlendFile { path: absolute, digest: file.digest() }))
    }
}

/// Returns true for names of .blend files and of the backups that Blender numbers.
pub fn has_blend_extension(path: &Path) -> bool {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    extension.is_some_and(|extension| {
        let number = extension.strip_prefix("blend");
        number.is_some_and(|number| number.bytes().all(|digit| digit.is_ascii_digit()))
    })
}

fn no_blend_file(head: &[u8]) -> LoadError {
    let reason =
        if head.is_empty() { "it is empty" } else { "it begins with neither BLENDER nor compressed data" };
    LoadError::Unsupported(format!("the file is not a .blend file: {reason}; save it again in Blender"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(name: &str, content: &[u8]) -> Result<bool, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        std::fs::write(&path, content).unwrap();
        BlendFile::open(&path, &LoadOptions::default()).map(|it| it.is_some()).map_err(|e| e.to_string())
    }

    #[test]
    fn files_are_recognised_by_content_and_name() {
        for (name, content) in [
            ("a.blend", &b"BLENDER-v402"[..]),
            ("a.BLEND1", b"BLENDER-v402"),
            ("a", b"BLENDER17-01v0500"),
            ("a.blend", b"\x28\xb5\x2f\xfd..."),
            ("a.blend", b"\x1f\x8b..."),
        ] {
            assert_eq!(open(name, content), Ok(true), "{name}");
        }
        for (name, content) in [
            ("a.glb", &b"glTF"[..]),
            ("a.obj", b"v 1 2 3"),
            ("a.zst", b"\x28\xb5\x2f\xfd"),
            ("a.gz", b"\x1f\x8b"),
        ] {
            assert_eq!(open(name, content), Ok(false), "{name}");
        }
    }

    #[test]
    fn other_files_with_the_name_are_errors() {
        for content in [&b""[..], b"BLEND", b"glTF", &[0; 100]] {
            assert!(open("a.blend", content).unwrap_err().starts_with("the file is not a .blend file"));
        }
    }

    #[test]
    fn files_above_the_limit_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.blend");
        std::fs::write(&path, "BLENDER-v402").unwrap();
        let mut options = LoadOptions::default();
        options.limits.file_bytes = 11;
        assert!(matches!(BlendFile::open(&path, &options), Err(LoadError::Limit { .. })));
    }
}
