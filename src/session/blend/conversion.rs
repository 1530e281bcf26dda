//! A converted scene: the GLB, the files that the .blend file links, and what was lost.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use super::blend_file::BlendFile;
use blinn_import::open_input_file;
use blinn_scene::{FileDigest, HashingReader, SourceFile};

/// A converted scene as one block of bytes: the length of the report, the report, the GLB.
pub struct Conversion {
    pub report: Report,
    bytes: Vec<u8>,
    glb_start: usize,
}

/// Bytes of the report's length.
const LENGTH_BYTES: usize = 8;

impl Conversion {
    /// Joins a report and a GLB.
    pub fn new(report: Report, glb: &[u8]) -> Conversion {
        let text = report.to_text();
        let mut bytes = (text.len() as u64).to_le_bytes().to_vec();
        bytes.extend(text.as_bytes());
        let glb_start = bytes.len();
        bytes.extend(glb);
        Conversion { report, bytes, glb_start }
    }

    /// Reads what [`Conversion::bytes`] returned. `None` for other bytes.
    pub fn from_bytes(bytes: Vec<u8>) -> Option<Conversion> {
        let (length, rest) = bytes.split_first_chunk::<LENGTH_BYTES>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let report = Report::from_text(std::str::from_utf8(rest.get(..length)?).ok()?)?;
        let glb_start = LENGTH_BYTES + length;
        Some(Conversion { report, bytes, glb_start })
    }

    /// All bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The GLB.
    pub fn glb(&self) -> &[u8] {
        self.bytes.get(self.glb_start..).unwrap_or_default()
    }

    /// True if no linked file has changed.
    pub fn is_current(&self, max_bytes: u64) -> bool {
        self.report.files.iter().all(|(path, digest)| digest_of(path, max_bytes) == *digest)
    }

    /// The linked files, as scenes name the files that they refer to.
    pub fn source_files(&self, file: &BlendFile) -> Vec<SourceFile> {
        let folder = file.path.parent().unwrap_or(Path::new(""));
        let name = |path: &PathBuf| path.strip_prefix(folder).unwrap_or(path).to_string_lossy().into_owned();
        let files = self.report.files.iter();
        files.map(|(path, digest)| SourceFile { name: name(path), digest: *digest }).collect()
    }
}

/// Files that a conversion read, and losses that it found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Linked files, with the digests of their bytes.
    pub files: Vec<(PathBuf, FileDigest)>,
    pub warnings: Vec<String>,
    /// The reason why there is no scene.
    pub error: Option<String>,
}

impl Report {
    /// Reads the report of the script.
    pub fn of_script(text: &str, max_bytes: u64) -> Report {
        let mut report = Report::default();
        for line in text.lines() {
            match line.split_once(' ') {
                Some(("file", path)) => {
                    let path = PathBuf::from(path);
                    let digest = digest_of(&path, max_bytes);
                    report.files.push((path, digest));
                }
                Some(("warning", text)) => report.warnings.push(text.into()),
                Some(("error", text)) => report.error = Some(text.into()),
                _ => {}
            }
        }
        report
    }

    fn to_text(&self) -> String {
        let mut text = String::new();
        for (path, digest) in &self.files {
            let _ = writeln!(text, "file {digest} {}", path.display());
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "warning {warning}");
        }
        text
    }

    fn from_text(text: &str) -> Option<Report> {
        let mut report = Report::default();
        for line in text.lines() {
            match line.split_once(' ')? {
                ("file", rest) => {
                    let (digest, path) = rest.split_once(' ')?;
                    let digest = match digest {
                        "-" => FileDigest::Unread,
                        hash => FileDigest::Hash(u128::from_str_radix(hash, 16).ok()?),
                    };
                    report.files.push((path.into(), digest));
                }
                ("warning", text) => report.warnings.push(text.into()),
                _ => return None,
            }
        }
        Some(report)
    }
}

/// Returns the digest of a file; that of an unread file if it is missing, no regular file, or larger than `max_bytes`.
fn digest_of(path: &Path, max_bytes: u64) -> FileDigest {
    let digest = || -> io::Result<FileDigest> {
        let mut file = HashingReader::new(open_input_file(path, max_bytes)?);
        io::copy(&mut file, &mut io::sink())?;
        Ok(file.digest())
    };
    digest().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_conversion_is_read_as_it_was_written() {
        let dir = tempfile::tempdir().unwrap();
        let (linked, missing) = (dir.path().join("a b.png"), dir.path().join("gone"));
        std::fs::write(&linked, "1").unwrap();
        let script =
            format!("file {}\nfile {}\nwarning lost it\nnoise\n", linked.display(), missing.display());
        let report = Report::of_script(&script, 100);
        let conversion = Conversion::new(report.clone(), b"glTF...");
        let read = Conversion::from_bytes(conversion.bytes().to_vec()).unwrap();
        assert_eq!((&read.report, read.glb()), (&report, &b"glTF..."[..]));
        assert_eq!(read.report.files[1].1, FileDigest::Unread);
        assert!(read.is_current(100));
        let file = BlendFile { path: dir.path().join("x.blend"), digest: FileDigest::Unread };
        assert_eq!(read.source_files(&file)[0].name, "a b.png");
        std::fs::write(&missing, "").unwrap();
        assert!(!read.is_current(100), "a missing file appeared");
        std::fs::remove_file(&missing).unwrap();
        std::fs::write(&linked, "2").unwrap();
        assert!(!read.is_current(100), "a file changed");
    }

    #[test]
    fn other_bytes_are_no_conversion() {
        for bytes in [&b""[..], b"short", &[255; 40], b"\x05\0\0\0\0\0\0\0other", b"\x05\0\0\0\0\0\0\0abc"] {
            assert!(Conversion::from_bytes(bytes.to_vec()).is_none());
        }
    }
}
