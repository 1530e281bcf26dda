//! Reads a compressed stream byte by byte.

/// A result with a fixed message, which becomes a string outside this module.
pub(super) type Decoded<T> = Result<T, &'static str>;

pub(super) const TRUNCATED: &str = "the meshopt stream is truncated";
pub(super) const TRAILING: &str = "the meshopt stream has trailing bytes";

/// A bounds-checked reader.
pub(super) struct Reader<'a> {
    pub bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn take(&mut self, n: usize) -> Decoded<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(n).ok_or(TRUNCATED)?;
        self.bytes = rest;
        Ok(taken)
    }

    pub fn byte(&mut self) -> Decoded<u8> {
        let (&first, rest) = self.bytes.split_first().ok_or(TRUNCATED)?;
        self.bytes = rest;
        Ok(first)
    }

    /// Reads an unsigned LEB128 of at most five bytes. Bits beyond 32 are dropped, as specified.
    pub fn varint(&mut self) -> Decoded<u32> {
        let mut value = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err("a number in a meshopt stream is longer than five bytes")
    }

    pub fn finish(&self) -> Decoded<()> {
        if self.bytes.is_empty() { Ok(()) } else { Err(TRAILING) }
    }
}

/// Decodes a zigzag-coded signed number.
pub(super) fn unzigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}
