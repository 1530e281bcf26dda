//! A list of paths that takes little memory however long it is.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::{SpooledData, SpooledTempFile};

/// Bytes of a list that is kept in memory. Longer lists are in an unnamed temporary file.
const MEMORY_BYTES: usize = 1 << 20;
/// Bytes that an iterator reads at a time.
const BLOCK_BYTES: usize = 1 << 16;

/// Paths in the order in which they were added, each followed by a zero byte.
#[derive(Debug)]
pub struct PathList {
    count: usize,
    storage: Storage,
}

#[derive(Debug)]
enum Storage {
    Memory(Vec<u8>),
    File(Mutex<File>),
}

/// Builds a [`PathList`].
#[derive(Debug)]
pub struct PathListBuilder {
    count: usize,
    bytes: BufWriter<SpooledTempFile>,
}

impl Default for PathListBuilder {
    fn default() -> PathListBuilder {
        PathListBuilder { count: 0, bytes: BufWriter::new(SpooledTempFile::new(MEMORY_BYTES)) }
    }
}

impl PathListBuilder {
    /// Adds a path.
    ///
    /// # Errors
    /// The temporary file cannot be written, or the path contains a zero byte.
    pub fn push(&mut self, path: &Path) -> io::Result<()> {
        let bytes = path.as_os_str().as_encoded_bytes();
        if bytes.contains(&0) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "a path contains a zero byte"));
        }
        self.bytes.write_all(bytes)?;
        self.bytes.write_all(&[0])?;
        self.count += 1;
        Ok(())
    }

    /// Number of paths.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Ends the list.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn finish(self) -> io::Result<PathList> {
        let spooled = self.bytes.into_inner().map_err(|e| e.into_error())?;
        let storage = match spooled.into_inner() {
            SpooledData::InMemory(cursor) => Storage::Memory(cursor.into_inner()),
            SpooledData::OnDisk(file) => Storage::File(Mutex::new(file)),
        };
        Ok(PathList { count: self.count, storage })
    }
}

impl PathList {
    /// Number of paths.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns true if there are no paths.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Reads the paths in order. An error of the temporary file ends the iteration.
    pub fn iter(&self) -> Iter<'_> {
        Iter { list: self, offset: 0, block: Vec::new(), position: 0 }
    }

    /// Reads up to [`BLOCK_BYTES`] bytes from an offset.
    fn read_block(&self, offset: u64, block: &mut Vec<u8>) -> io::Result<()> {
        match &self.storage {
            Storage::Memory(bytes) => {
                let start = usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len());
                block.extend_from_slice(&bytes[start..(start + BLOCK_BYTES).min(bytes.len())]);
            }
            Storage::File(file) => {
                let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                file.seek(SeekFrom::Start(offset))?;
                Read::by_ref(&mut *file).take(BLOCK_BYTES as u64).read_to_end(block)?;
            }
        }
        Ok(())
    }
}

/// Iterator over the paths of a [`PathList`].
#[derive(Debug)]
pub struct Iter<'a> {
    list: &'a PathList,
    /// Offset in the list of the first byte that was not read.
    offset: u64,
    block: Vec<u8>,
    /// Start of the next path in the block.
    position: usize,
}

impl Iterator for Iter<'_> {
    type Item = io::Result<PathBuf>;

    fn next(&mut self) -> Option<io::Result<PathBuf>> {
        loop {
            let rest = &self.block[self.position..];
            if let Some(end) = rest.iter().position(|&b| b == 0) {
                let path = decode(&rest[..end]);
                self.position += end + 1;
                return Some(Ok(path));
            }
            self.block.drain(..self.position);
            self.position = 0;
            let before = self.block.len();
            if let Err(error) = self.list.read_block(self.offset, &mut self.block) {
                // Nothing follows an error.
                self.offset = u64::MAX >> 1;
                self.block.clear();
                return Some(Err(error));
            }
            let read = self.block.len() - before;
            if read == 0 {
                return None;
            }
            self.offset += read as u64;
        }
    }
}

/// The path of its bytes.
#[cfg(unix)]
pub fn decode(bytes: &[u8]) -> PathBuf {
    use std::os::unix::ffi::OsStrExt;
    Path::new(std::ffi::OsStr::from_bytes(bytes)).to_path_buf()
}

/// The path of its bytes, which are UTF-8.
#[cfg(not(unix))]
pub fn decode(bytes: &[u8]) -> PathBuf {
    Path::new(String::from_utf8_lossy(bytes).as_ref()).to_path_buf()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_come_back_in_order_from_memory_and_from_a_file() {
        for count in [0, 1, 5, 3000, 60_000] {
            let path = |i: usize| PathBuf::from(format!("objects/{}/{i}\n.glb", "ä".repeat(i % 40)));
            let mut builder = PathListBuilder::default();
            (0..count).for_each(|i| builder.push(&path(i)).unwrap());
            let list = builder.finish().unwrap();
            assert_eq!(matches!(list.storage, Storage::File(_)), count > 10_000);
            assert_eq!((list.len(), list.is_empty()), (count, count == 0));
            // Iterators do not disturb each other.
            let mut other = list.iter();
            for (i, found) in list.iter().enumerate() {
                assert_eq!(found.unwrap(), path(i));
                assert_eq!(other.next().unwrap().unwrap(), path(i));
            }
            assert!(other.next().is_none());
        }
    }

    #[test]
    fn a_path_longer_than_a_block_is_whole() {
        let long = PathBuf::from("a/".repeat(BLOCK_BYTES));
        let mut builder = PathListBuilder::default();
        for path in [long.as_path(), Path::new("b"), &long] {
            builder.push(path).unwrap();
        }
        let list = builder.finish().unwrap();
        let found: Vec<PathBuf> = list.iter().map(Result::unwrap).collect();
        assert_eq!(found, [long.clone(), "b".into(), long]);
        assert!(PathListBuilder::default().push(Path::new("a\0b")).is_err());
    }
}
