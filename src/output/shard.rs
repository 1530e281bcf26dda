//! Tar files of samples, as WebDataset reads them: files that share a name up to its first dot belong together.
//!
//! Headers have no times, owners or other properties of the machine, so that equal files make equal archives.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

use tar::{EntryType, Header};

use super::atomic::{Overwrite, unnamed_temp_file, write_atomically_with};

/// Bytes of a block; headers and contents are padded to whole ones.
const BLOCK: u64 = 512;
/// Mode of the files in an archive.
const MODE: u32 = 0o644;
/// Bytes of a member that are read into memory at most.
const MAX_MEMBER: u64 = 1 << 24;

/// An archive that is being written, in an unnamed temporary file until it is complete.
#[derive(Debug)]
pub struct ShardWriter {
    path: PathBuf,
    file: BufWriter<File>,
    length: u64,
}

impl ShardWriter {
    /// Starts an archive.
    ///
    /// # Errors
    /// The temporary file cannot be created.
    pub fn new(path: &Path) -> io::Result<ShardWriter> {
        let file = BufWriter::new(unnamed_temp_file(path)?);
        Ok(ShardWriter { path: path.to_path_buf(), file, length: 0 })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes that were written.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Appends a file.
    ///
    /// # Errors
    /// The name is too long for an archive, or the temporary file cannot be written.
    pub fn add(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let mut header = Header::new_ustar();
        header.set_path(name)?;
        header.set_entry_type(EntryType::Regular);
        header.set_mode(MODE);
        header.set_size(bytes.len() as u64);
        header.set_mtime(0);
        header.set_uid(0);
        header.set_gid(0);
        header.set_cksum();
        self.file.write_all(header.as_bytes())?;
        self.file.write_all(bytes)?;
        let length = padded(bytes.len() as u64);
        let padding = length - BLOCK - bytes.len() as u64;
        self.file.write_all(&[0; BLOCK as usize][..padding as usize])?;
        self.length += length;
        Ok(())
    }

    /// Appends the files of another archive.
    ///
    /// # Errors
    /// A temporary file cannot be read or written.
    pub fn append(&mut self, files: ShardWriter) -> io::Result<()> {
        let mut file = files.file.into_inner().map_err(|e| e.into_error())?;
        file.rewind()?;
        io::copy(&mut file, &mut self.file)?;
        self.length += files.length;
        Ok(())
    }

    /// Ends the archive and names it.
    ///
    /// # Errors
    /// It cannot be written, or exists and must not be overwritten.
    pub fn finish(mut self, overwrite: Overwrite) -> io::Result<()> {
        self.file.write_all(&[0; 2 * BLOCK as usize])?;
        let mut file = self.file.into_inner().map_err(|e| e.into_error())?;
        file.rewind()?;
        write_atomically_with(&self.path, overwrite, |named| io::copy(&mut file, named).map(drop))
    }
}

/// The bytes that a file of `size` bytes takes in an archive.
fn padded(size: u64) -> u64 {
    BLOCK.saturating_add(size.div_ceil(BLOCK).saturating_mul(BLOCK))
}

/// A file in an archive.
#[derive(Clone, Copy, Debug)]
pub struct ShardMember<'a> {
    /// Its name.
    pub name: &'a str,
    /// The bytes that it takes in the archive, with its header.
    pub length: u64,
    /// Its content, if it was read.
    pub bytes: &'a [u8],
}

/// Calls `visit` with each file of an archive, in order, and with the content of those that `reads` selects.
///
/// # Errors
/// The file is no complete archive, and errors of `visit`.
pub fn read_shard(
    path: &Path,
    reads: impl Fn(&str) -> bool,
    mut visit: impl FnMut(ShardMember) -> io::Result<()>,
) -> io::Result<()> {
    let mut archive = tar::Archive::new(File::open(path)?);
    for entry in archive.entries_with_seek()? {
        let mut entry = entry?;
        let name = entry.path()?.to_string_lossy().into_owned();
        let mut bytes = Vec::new();
        if reads(&name) {
            (&mut entry).take(MAX_MEMBER).read_to_end(&mut bytes)?;
        }
        visit(ShardMember { name: &name, length: padded(entry.size()), bytes: &bytes })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contents(path: &Path) -> Vec<(String, Vec<u8>)> {
        let mut all = Vec::new();
        let visit = |member: ShardMember| {
            all.push((member.name.to_string(), member.bytes.to_vec()));
            Ok(())
        };
        read_shard(path, |_| true, visit).unwrap();
        all
    }

    #[test]
    fn files_come_back_in_order() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("0.tar");
        let mut shard = ShardWriter::new(&path).unwrap();
        let files: Vec<(String, Vec<u8>)> =
            [0, 1, 511, 512, 513, 70_000].map(|size| (format!("a_{size}.depth.png"), vec![7; size])).into();
        for (name, bytes) in &files {
            shard.add(name, bytes).unwrap();
            assert_eq!(shard.length() % 512, 0);
        }
        assert!(!path.exists(), "it has no name before it is complete");
        shard.add("last.json", b"{}").unwrap();
        shard.finish(Overwrite::No).unwrap();
        let found = contents(&path);
        assert_eq!(found[..6], files);
        assert_eq!(found[6..], [("last.json".to_string(), b"{}".to_vec())]);
        // The same files make the same archive.
        let mut again = ShardWriter::new(&dir.path().join("1.tar")).unwrap();
        found.iter().for_each(|(name, bytes)| again.add(name, bytes).unwrap());
        again.finish(Overwrite::No).unwrap();
        assert!(std::fs::read(&path).unwrap() == std::fs::read(dir.path().join("1.tar")).unwrap());
        assert!(ShardWriter::new(&path).unwrap().finish(Overwrite::No).is_err());
    }

    #[test]
    fn an_archive_of_parts_is_as_if_written_at_once() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let mut whole = ShardWriter::new(&path("0.tar")).unwrap();
        let mut parts = ShardWriter::new(&path("1.tar")).unwrap();
        for (name, bytes) in [("a.png", vec![1; 700]), ("b.png", vec![2; 70_000]), ("c.png", vec![3; 10])] {
            let mut part = ShardWriter::new(&path("1.tar")).unwrap();
            part.add(name, &bytes).unwrap();
            parts.append(part).unwrap();
            whole.add(name, &bytes).unwrap();
            assert_eq!(parts.length(), whole.length());
        }
        whole.finish(Overwrite::No).unwrap();
        parts.finish(Overwrite::No).unwrap();
        assert!(std::fs::read(path("0.tar")).unwrap() == std::fs::read(path("1.tar")).unwrap());
    }

    #[test]
    fn an_incomplete_archive_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("0.tar");
        let mut shard = ShardWriter::new(&path).unwrap();
        shard.add("a.png", &[3; 2000]).unwrap();
        shard.finish(Overwrite::No).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..700]).unwrap();
        assert!(
            read_shard(
                &path,
                |_| true,
                |member| {
                    assert!(member.bytes.len() < 2000);
                    Err(io::Error::other("short"))
                }
            )
            .is_err()
        );
        std::fs::write(
            &path,
            b"no archive at all, but longer than a block of five hundred and twelve bytes".repeat(20),
        )
        .unwrap();
        assert!(read_shard(&path, |_| true, |_| Ok(())).is_err());
        assert!(ShardWriter::new(&path).unwrap().add(&"a/".repeat(200), b"").is_err());
    }
}
