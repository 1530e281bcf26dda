//! Digests of the files that a scene was read from, which detect changes between runs.

use std::fmt;
use std::io::{self, Read};

use twox_hash::XxHash3_128;

/// A digest of a file, taken when it was read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FileDigest {
    /// The file was missing or unreadable.
    #[default]
    Unread,
    /// XXH3 hash of its bytes, 128 bits.
    Hash(u128),
    /// The file was read more than once, with different bytes.
    Changed,
}

impl FileDigest {
    /// Returns the digest of `bytes`.
    pub fn of(bytes: &[u8]) -> FileDigest {
        FileDigest::Hash(XxHash3_128::oneshot(bytes))
    }

    /// Merges the digests of two reads of the same file.
    pub fn merge(self, other: FileDigest) -> FileDigest {
        if self == other { self } else { FileDigest::Changed }
    }
}

/// Formats the digest as one word: 32 hexadecimal digits, `-` if unread, `?` if changed.
impl fmt::Display for FileDigest {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            FileDigest::Unread => f.write_str("-"),
            FileDigest::Hash(hash) => write!(f, "{hash:032x}"),
            FileDigest::Changed => f.write_str("?"),
        }
    }
}

/// A reader that hashes the bytes passing through it.
pub struct HashingReader<R> {
    inner: R,
    hash: XxHash3_128,
}

impl<R: Read> HashingReader<R> {
    /// Wraps a reader of which nothing has been read.
    pub fn new(inner: R) -> HashingReader<R> {
        HashingReader { inner, hash: XxHash3_128::new() }
    }

    /// Returns the digest of the bytes read so far.
    pub fn digest(&self) -> FileDigest {
        FileDigest::Hash(self.hash.finish_128())
    }
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.hash.write(&buffer[..read]);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_does_not_depend_on_the_read_sizes() {
        let bytes: Vec<u8> = (0..100_000u32).map(|i| (i.wrapping_mul(i) >> 3) as u8).collect();
        let mut reader = HashingReader::new(&bytes[..]);
        let mut part = [0; 777];
        while reader.read(&mut part).unwrap() > 0 {}
        assert_eq!(reader.digest(), FileDigest::of(&bytes));
        assert_eq!(reader.digest().to_string().len(), 32);
    }

    #[test]
    fn different_reads_of_a_file_merge_to_changed() {
        let (one, other) = (FileDigest::of(b"1"), FileDigest::of(b"2"));
        assert_eq!(one.merge(one), one);
        assert_eq!(one.merge(other), FileDigest::Changed);
        assert_eq!(one.merge(other).merge(one), FileDigest::Changed);
        assert_eq!(FileDigest::Unread.merge(one), FileDigest::Changed);
    }
}
