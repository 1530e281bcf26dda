//! What was in a file when a scene was read from it.

use std::fmt;
use std::io::{self, Read};

use twox_hash::XxHash3_128;

/// What was in a file. It may hold something else a moment later.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FileDigest {
    /// It was not there, or could not be read.
    #[default]
    Unread,
    /// Bytes of this hash (XXH3, 128 bits).
    Hash(u128),
    /// It was read more than once, and was not the same each time.
    Changed,
}

impl FileDigest {
    /// Those bytes.
    pub fn of(bytes: &[u8]) -> FileDigest {
        FileDigest::Hash(XxHash3_128::oneshot(bytes))
    }

    /// What a file that was read before holds when it is read again.
    pub fn merge(self, other: FileDigest) -> FileDigest {
        if self == other { self } else { FileDigest::Changed }
    }
}

/// A word: 32 digits, `-` for what was not read, and `?`, which stands for no file's bytes.
impl fmt::Display for FileDigest {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            FileDigest::Unread => f.write_str("-"),
            FileDigest::Hash(hash) => write!(f, "{hash:032x}"),
            FileDigest::Changed => f.write_str("?"),
        }
    }
}

/// Hashes what passes through.
pub(crate) struct HashingReader<R> {
    from: R,
    hash: XxHash3_128,
}

impl<R: Read> HashingReader<R> {
    pub fn new(from: R) -> HashingReader<R> {
        HashingReader { from, hash: XxHash3_128::new() }
    }

    /// What has passed so far: all of a file, once there is no more of it.
    pub fn digest(&self) -> FileDigest {
        FileDigest::Hash(self.hash.finish_128())
    }
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(buffer)?;
        self.hash.write(&buffer[..read]);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_one_hash_however_they_are_read() {
        let bytes: Vec<u8> = (0..100_000u32).map(|i| (i.wrapping_mul(i) >> 3) as u8).collect();
        let mut hashing = HashingReader::new(&bytes[..]);
        let mut part = [0; 777];
        while hashing.read(&mut part).unwrap() > 0 {}
        assert_eq!(hashing.digest(), FileDigest::of(&bytes));
        assert_eq!(hashing.digest().to_string().len(), 32);
    }

    #[test]
    fn what_was_not_the_same_twice_is_neither() {
        let (one, other) = (FileDigest::of(b"1"), FileDigest::of(b"2"));
        assert_eq!(one.merge(one), one);
        assert_eq!(one.merge(other), FileDigest::Changed);
        assert_eq!(one.merge(other).merge(one), FileDigest::Changed);
        assert_eq!(FileDigest::Unread.merge(one), FileDigest::Changed);
    }
}
