//! A checksum at the end of a fingerprint, for formats that have none of their own: it finds holes that a disk or an
//! interrupted copy left in a file.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

/// Separates the digits from the text before them.
const SEPARATOR: &str = " crc32:";
/// The digits in a file whose checksum is computed.
const ZEROS: &str = "00000000";
/// Bytes that are read at once.
const BLOCK: usize = 1 << 16;

/// Returns a text with room for the checksum of its file.
pub(super) fn with_room(text: &str) -> String {
    format!("{text}{SEPARATOR}{ZEROS}")
}

/// Writes the checksum into a file that holds `text`, which [`with_room`] returned.
pub(super) fn seal(file: &mut [u8], text: &str) {
    let Some(at) = digits_in(file, text.as_bytes()) else { return };
    let digits = format!("{:08x}", crc32fast::hash(file));
    file[at..at + ZEROS.len()].copy_from_slice(digits.as_bytes());
}

/// Returns a text of the file at `path` without its checksum. `None` if the checksum is not that of the file. `head` is
/// the start of the file, which holds the text.
pub(super) fn verified_text(path: &Path, head: &[u8], text: &[u8]) -> Option<Vec<u8>> {
    let (start, digits) = text.split_at_checked(text.len().checked_sub(ZEROS.len())?)?;
    let start = start.strip_suffix(SEPARATOR.as_bytes())?;
    let expected = u32::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    let at = digits_in(head, text)?;
    (checksum(path, at as u64).ok()? == expected).then(|| start.to_vec())
}

/// The offset of the last digits of `text` in a file.
fn digits_in(file: &[u8], text: &[u8]) -> Option<usize> {
    let at = file.windows(text.len()).position(|window| window == text)?;
    (at + text.len()).checked_sub(ZEROS.len())
}

/// The checksum of a file with zeros in place of the digits at an offset.
fn checksum(path: &Path, digits: u64) -> io::Result<u32> {
    let mut file = BufReader::with_capacity(BLOCK, File::open(path)?);
    let mut hasher = crc32fast::Hasher::new();
    update(&mut hasher, (&mut file).take(digits))?;
    let mut replaced = [0; ZEROS.len()];
    file.read_exact(&mut replaced)?;
    hasher.update(ZEROS.as_bytes());
    update(&mut hasher, file)?;
    Ok(hasher.finalize())
}

fn update(hasher: &mut crc32fast::Hasher, mut part: impl Read) -> io::Result<()> {
    let mut block = vec![0; BLOCK];
    loop {
        match part.read(&mut block)? {
            0 => return Ok(()),
            count => hasher.update(&block[..count]),
        }
    }
}
