//! Chunks of PNG and APNG files: length, name, data and CRC (PNG specification, section 5).

#[cfg(feature = "animation")]
use std::io::{self, Write};

/// The bytes that every PNG starts with.
pub(super) const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// The name and data of each chunk, up to the first incomplete one.
pub(super) fn chunks(png: &[u8]) -> impl Iterator<Item = (&[u8; 4], &[u8])> {
    let mut rest = png.get(SIGNATURE.len()..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (name, after) = after.split_first_chunk::<4>()?;
        let (data, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        rest = after.get(4..)?;
        Some((name, data))
    })
}

/// Writes a chunk with its CRC.
#[cfg(feature = "animation")]
pub(super) fn write_chunk(out: &mut dyn Write, name: &[u8; 4], data: &[u8]) -> io::Result<()> {
    let length = u32::try_from(data.len()).map_err(|_| io::ErrorKind::FileTooLarge)?;
    let mut crc = crc32fast::Hasher::new();
    crc.update(name);
    crc.update(data);
    out.write_all(&length.to_be_bytes())?;
    out.write_all(name)?;
    out.write_all(data)?;
    out.write_all(&crc.finalize().to_be_bytes())
}
