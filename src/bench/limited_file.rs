//! Reads small files and pipes, whose size is known only at their end.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Reads a file or a pipe of at most `max_bytes`, which is a `kind` for messages, such as `a results file`.
///
/// # Errors
/// It cannot be read, or is longer.
pub(super) fn read_limited(path: &Path, max_bytes: u64, kind: &str) -> Result<Vec<u8>, String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let mut bytes = Vec::new();
    file.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() as u64 > max_bytes {
        return Err(format!("more than {max_bytes} bytes are too many for {kind}"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, b"12345").unwrap();
        assert_eq!(read_limited(&path, 5, "a number").unwrap(), b"12345");
        assert_eq!(
            read_limited(&path, 4, "a number").unwrap_err(),
            "more than 4 bytes are too many for a number"
        );
        assert!(read_limited(folder.path(), 4, "a number").is_err());
    }

    /// A device without end has no size.
    #[test]
    #[cfg(target_os = "linux")]
    fn endless_files_are_errors() {
        assert!(read_limited("/dev/zero".as_ref(), 1000, "zeros").is_err());
    }
}
