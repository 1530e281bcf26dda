//! STL text in UTF-16, as shells of Windows save the output of programs.

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE};

/// Returns the encoding of a file in UTF-16 with a byte-order mark, or without one if it begins with `solid`, and the length of the
/// mark. Returns `None` for other files.
fn utf16(bytes: &[u8]) -> Option<(&'static Encoding, usize)> {
    match Encoding::for_bom(bytes) {
        Some((encoding, _)) if encoding == UTF_8 => None,
        Some(marked) => Some(marked),
        None if begins_with_solid(bytes, 0) => Some((UTF_16LE, 0)),
        None if begins_with_solid(bytes, 1) => Some((UTF_16BE, 0)),
        None => None,
    }
}

/// Returns the most bytes that [`decode_utf16`] makes of a file.
pub(super) fn decoded_size(bytes: &[u8]) -> u64 {
    // A unit of two bytes becomes at most three.
    utf16(bytes).map_or(0, |_| bytes.len() as u64 / 2 * 3 + 3)
}

/// Returns the text of a file in UTF-16; `None` for other files.
pub(super) fn decode_utf16(bytes: &[u8]) -> Option<String> {
    let (encoding, mark) = utf16(bytes)?;
    let text = bytes.get(mark..)?;
    Some(encoding.decode_without_bom_handling(text).0.into_owned())
}

/// Returns true if the letters of `solid` are at every second byte from `first`, with zeros between them.
fn begins_with_solid(bytes: &[u8], first: usize) -> bool {
    bytes.get(..10).is_some_and(|bytes| {
        bytes
            .as_chunks::<2>()
            .0
            .iter()
            .zip(b"solid")
            .all(|(unit, letter)| unit[first].eq_ignore_ascii_case(letter) && unit[1 - first] == 0)
    })
}
