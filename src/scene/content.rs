//! What was in a file when a scene was read from it.

use std::fmt;
use std::io::{self, Read};

use twox_hash::XxHash3_128;

/// What was in a file. It may hold something else a moment later.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// It was not there, or could not be read.
    #[default]
    Unread,
    /// Bytes of this hash (XXH3, 128 bits).
    Hash(u128),
    /// It was read more than once, and was not the same each time.
    Changing,
}

impl Content {
    /// Those bytes.
    pub fn of(bytes: &[u8]) -> Content {
        Content::Hash(XxHash3_128::oneshot(bytes))
    }

    /// What a file that was read before holds when it is read again.
    pub fn again(self, other: Content) -> Content {
        if self == other { self } else { Content::Changing }
    }
}

/// A word: 32 digits, `-` for what was not read, and `?`, which stands for no file's bytes.
impl fmt::Display for Content {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Content::Unread => f.write_str("-"),
            Content::Hash(hash) => write!(f, "{hash:032x}"),
            Content::Changing => f.write_str("?"),
        }
    }
}

/// Hashes what passes through.
pub(crate) struct Hashing<R> {
    from: R,
    hash: XxHash3_128,
}

impl<R: Read> Hashing<R> {
    pub fn new(from: R) -> Hashing<R> {
        Hashing { from, hash: XxHash3_128::new() }
    }

    /// What has passed so far: all of a file, once there is no more of it.
    pub fn content(&self) -> Content {
        Content::Hash(self.hash.finish_128())
    }
}

impl<R: Read> Read for Hashing<R> {
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
        let mut hashing = Hashing::new(&bytes[..]);
        let mut part = [0; 777];
        while hashing.read(&mut part).unwrap() > 0 {}
        assert_eq!(hashing.content(), Content::of(&bytes));
        assert_eq!(hashing.content().to_string().len(), 32);
    }

    #[test]
    fn what_was_not_the_same_twice_is_neither() {
        let (one, other) = (Content::of(b"1"), Content::of(b"2"));
        assert_eq!(one.again(one), one);
        assert_eq!(one.again(other), Content::Changing);
        assert_eq!(one.again(other).again(one), Content::Changing);
        assert_eq!(Content::Unread.again(one), Content::Changing);
    }
}
