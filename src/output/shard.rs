//! Tar files of samples, as WebDataset reads them: files that share a name up to its first dot belong together.
//!
//! Headers have no times, owners or other properties of the machine, so that equal files make equal archives.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use tar::{EntryType, Header};

use super::atomic::{Overwrite, unnamed_temp_file, write_atomically_with};

/// Bytes of a block; headers and contents are padded to whole ones.
const BLOCK: u64 = 512;
/// Bytes of zeros behind the last file.
const END: u64 = 2 * BLOCK;
/// Mode of the files in an archive.
const MODE: u32 = 0o644;
/// Bytes of a member that are read into memory at most.
const MAX_MEMBER: u64 = 1 << 24;

/// Files that go into an archive together, in an unnamed temporary file.
#[derive(Debug)]
pub struct ShardPart {
    path: PathBuf,
    file: BufWriter<File>,
    length: u64,
}

impl ShardPart {
    /// Starts a part of the archive that will be at `path`.
    ///
    /// # Errors
    /// The temporary file cannot be created.
    pub fn new(path: &Path) -> io::Result<ShardPart> {
        let file = BufWriter::new(unnamed_temp_file(path)?);
        Ok(ShardPart { path: path.to_path_buf(), file, length: 0 })
    }

    /// The path of its archive.
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

    /// The temporary file from its start.
    fn into_file(self) -> io::Result<File> {
        let mut file = self.file.into_inner().map_err(|e| e.into_error())?;
        file.rewind()?;
        Ok(file)
    }
}

/// An archive that is being written, in an unnamed temporary file until it is complete.
#[derive(Debug)]
pub struct ShardWriter {
    files: ShardPart,
}

impl ShardWriter {
    /// Starts an archive.
    ///
    /// # Errors
    /// The temporary file cannot be created.
    pub fn new(path: &Path) -> io::Result<ShardWriter> {
        Ok(ShardWriter { files: ShardPart::new(path)? })
    }

    /// Bytes that were written.
    pub fn length(&self) -> u64 {
        self.files.length
    }

    /// Appends the files of a part.
    ///
    /// # Errors
    /// A temporary file cannot be read or written.
    pub fn append(&mut self, part: ShardPart) -> io::Result<()> {
        let length = part.length;
        self.copy(&mut part.into_file()?, length)
    }

    /// Appends files of another archive: its bytes `members`, from the first header to the end of the last content.
    ///
    /// # Errors
    /// The other archive cannot be read or is shorter, or the temporary file cannot be written.
    pub fn append_members(&mut self, mut archive: &File, members: Range<u64>) -> io::Result<()> {
        archive.seek(SeekFrom::Start(members.start))?;
        self.copy(&mut archive, members.end.saturating_sub(members.start))
    }

    fn copy(&mut self, from: &mut impl Read, length: u64) -> io::Result<()> {
        let copied = io::copy(&mut from.take(length), &mut self.files.file)?;
        if copied < length {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "an archive was cut off meanwhile"));
        }
        self.files.length += length;
        Ok(())
    }

    /// Ends the archive and names it.
    ///
    /// # Errors
    /// It cannot be written, or exists and must not be overwritten.
    pub fn finish(mut self, overwrite: Overwrite) -> io::Result<()> {
        self.files.file.write_all(&[0; END as usize])?;
        let path = self.files.path.clone();
        let mut file = self.files.into_file()?;
        write_atomically_with(&path, overwrite, |named| io::copy(&mut file, named).map(drop))
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
    /// Where its header begins, in bytes from the start of the archive.
    pub start: u64,
    /// The bytes that it takes in the archive, with its header.
    pub length: u64,
    /// Its content, if it was read.
    pub bytes: &'a [u8],
}

/// Calls `visit` with each file of an archive, in order, and with the content of those that `reads` selects. `archive` is a file
/// that was just opened.
///
/// # Errors
/// The file is no complete archive, and errors of `visit`.
pub fn read_shard(
    archive: &File,
    reads: impl Fn(&str) -> bool,
    mut visit: impl FnMut(ShardMember) -> io::Result<()>,
) -> io::Result<()> {
    let mut end = 0;
    for entry in tar::Archive::new(archive).entries_with_seek()? {
        let mut entry = entry?;
        let name = entry.path()?.to_string_lossy().into_owned();
        let mut bytes = Vec::new();
        if reads(&name) {
            (&mut entry).take(MAX_MEMBER).read_to_end(&mut bytes)?;
        }
        let (start, length) = (entry.raw_header_position(), padded(entry.size()));
        visit(ShardMember { name: &name, start, length, bytes: &bytes })?;
        end = start.saturating_add(length);
    }
    if archive.metadata()?.len() < end.saturating_add(END) {
        return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the archive is cut off"));
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
        read_shard(&File::open(path).unwrap(), |_| true, visit).unwrap();
        all
    }

    /// Appends a file as a part of its own.
    fn add(shard: &mut ShardWriter, name: &str, bytes: &[u8]) -> io::Result<()> {
        let mut part = ShardPart::new(shard.files.path())?;
        part.add(name, bytes)?;
        shard.append(part)
    }

    #[test]
    fn files_come_back_in_order() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("0.tar");
        let mut shard = ShardWriter::new(&path).unwrap();
        let files: Vec<(String, Vec<u8>)> =
            [0, 1, 511, 512, 513, 70_000].map(|size| (format!("a_{size}.depth.png"), vec![7; size])).into();
        for (name, bytes) in &files {
            add(&mut shard, name, bytes).unwrap();
            assert_eq!(shard.length() % 512, 0);
        }
        assert!(!path.exists(), "it has no name before it is complete");
        add(&mut shard, "last.json", b"{}").unwrap();
        shard.finish(Overwrite::No).unwrap();
        let found = contents(&path);
        assert_eq!(found[..6], files);
        assert_eq!(found[6..], [("last.json".to_string(), b"{}".to_vec())]);
        // The same files make the same archive.
        let mut again = ShardWriter::new(&dir.path().join("1.tar")).unwrap();
        found.iter().for_each(|(name, bytes)| add(&mut again, name, bytes).unwrap());
        again.finish(Overwrite::No).unwrap();
        assert!(std::fs::read(&path).unwrap() == std::fs::read(dir.path().join("1.tar")).unwrap());
        assert!(ShardWriter::new(&path).unwrap().finish(Overwrite::No).is_err());
    }

    #[test]
    fn an_archive_of_parts_is_as_if_of_one() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let mut whole = ShardWriter::new(&path("0.tar")).unwrap();
        let mut parts = ShardWriter::new(&path("1.tar")).unwrap();
        let mut all = ShardPart::new(&path("0.tar")).unwrap();
        for (name, bytes) in [("a.png", vec![1; 700]), ("b.png", vec![2; 70_000]), ("c.png", vec![3; 10])] {
            add(&mut parts, name, &bytes).unwrap();
            all.add(name, &bytes).unwrap();
            assert_eq!(parts.length(), all.length());
        }
        whole.append(all).unwrap();
        let length = whole.length();
        whole.finish(Overwrite::No).unwrap();
        parts.finish(Overwrite::No).unwrap();
        assert!(std::fs::read(path("0.tar")).unwrap() == std::fs::read(path("1.tar")).unwrap());
        // Members of a finished archive, all and the middle one.
        let archive = File::open(path("0.tar")).unwrap();
        let mut all = ShardWriter::new(&path("2.tar")).unwrap();
        all.append_members(&archive, 0..1536).unwrap();
        all.append_members(&archive, 1536..length).unwrap();
        all.finish(Overwrite::No).unwrap();
        assert!(std::fs::read(path("0.tar")).unwrap() == std::fs::read(path("2.tar")).unwrap());
        let mut places = Vec::new();
        let visit = |member: ShardMember| {
            places.push((member.name.to_string(), member.start..member.start + member.length));
            Ok(())
        };
        read_shard(&File::open(path("0.tar")).unwrap(), |_| false, visit).unwrap();
        assert_eq!((&places[0].1, places[2].1.end), (&(0..1536), length));
        let mut middle = ShardWriter::new(&path("3.tar")).unwrap();
        middle.append_members(&archive, places[1].1.clone()).unwrap();
        assert!(middle.append_members(&archive, 0..1 << 40).is_err(), "an archive that is too short");
        let mut middle = ShardWriter::new(&path("3.tar")).unwrap();
        middle.append_members(&archive, places[1].1.clone()).unwrap();
        middle.finish(Overwrite::No).unwrap();
        assert_eq!(contents(&path("3.tar")), [("b.png".to_string(), vec![2; 70_000])]);
    }

    #[test]
    fn an_incomplete_archive_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("0.tar");
        let mut shard = ShardWriter::new(&path).unwrap();
        add(&mut shard, "a.png", &[3; 2000]).unwrap();
        shard.finish(Overwrite::No).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in [whole.len() - 1, whole.len() - 1025, 600] {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(read_shard(&File::open(&path).unwrap(), |_| false, |_| Ok(())).is_err(), "{length}");
        }
        std::fs::write(&path, &whole[..700]).unwrap();
        assert!(
            read_shard(
                &File::open(&path).unwrap(),
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
        assert!(read_shard(&File::open(&path).unwrap(), |_| true, |_| Ok(())).is_err());
        assert!(ShardPart::new(&path).unwrap().add(&"a/".repeat(200), b"").is_err());
    }
}
