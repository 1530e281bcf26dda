//! Chunks of RIFF files such as WebP: name, length and data, padded to an even length.

#[cfg(feature = "animation")]
use std::io::{self, Write};

/// The bytes `RIFF`, the file's length and its type.
const HEADER: usize = 12;

/// The name and data of each chunk, up to the first incomplete one.
pub(super) fn chunks(file: &[u8]) -> impl Iterator<Item = (&[u8; 4], &[u8])> {
    let mut rest = file.get(HEADER..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (name, after) = rest.split_first_chunk::<4>()?;
        let (length, after) = after.split_first_chunk::<4>()?;
        let length = u32::from_le_bytes(*length) as usize;
        let (data, after) = after.split_at_checked(length)?;
        rest = after.get(length % 2..).unwrap_or_default();
        Some((name, data))
    })
}

/// Writes a chunk with its padding.
#[cfg(feature = "animation")]
pub(super) fn write_chunk(out: &mut dyn Write, name: &[u8; 4], data: &[u8]) -> io::Result<()> {
    let length = u32::try_from(data.len()).map_err(|_| io::ErrorKind::FileTooLarge)?;
    out.write_all(name)?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(data)?;
    out.write_all(&[0][..data.len() % 2])
}
