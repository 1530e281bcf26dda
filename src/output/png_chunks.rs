//! Chunks of PNG and APNG files: length, name, data and CRC (PNG specification, section 5).

#[cfg(feature = "animation")]
use std::io::Write;
use std::io::{self, Read};

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

/// Returns true if a file has all its chunks, and their CRCs are right.
pub(super) fn is_intact(mut file: impl Read) -> bool {
    let mut signature = [0; SIGNATURE.len()];
    if file.read_exact(&mut signature).is_err() || signature != SIGNATURE {
        return false;
    }
    loop {
        match has_next_chunk(&mut file) {
            Ok(Some(name)) if name == *b"IEND" => return matches!(file.read(&mut [0]), Ok(0)),
            Ok(Some(_)) => {}
            Ok(None) | Err(_) => return false,
        }
    }
}

/// Reads a chunk, and returns its name if its CRC is right.
fn has_next_chunk(file: &mut impl Read) -> io::Result<Option<[u8; 4]>> {
    let mut length = [0; 4];
    let mut name = [0; 4];
    file.read_exact(&mut length)?;
    file.read_exact(&mut name)?;
    let mut crc = crc32fast::Hasher::new();
    crc.update(&name);
    let mut left = u32::from_be_bytes(length) as usize;
    let mut block = [0; 1 << 14];
    while left > 0 {
        let part = left.min(block.len());
        file.read_exact(&mut block[..part])?;
        crc.update(&block[..part]);
        left -= part;
    }
    let mut expected = [0; 4];
    file.read_exact(&mut expected)?;
    Ok((crc.finalize() == u32::from_be_bytes(expected)).then_some(name))
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
