//! Reads the fingerprint that is embedded in an image file: a line of text about what the image was rendered from.
//!
//! PNG stores it in a tEXt chunk, EXR in an attribute, JPEG in a comment and WebP in its XMP packet.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use super::picture::FINGERPRINT_KEY;
use super::{exr_header, jpeg, png, webp};

/// Bytes at the start of a file that are searched for a fingerprint.
const HEAD_BYTES: u64 = 1 << 20;
/// Bytes at the end of a file that show whether it is complete.
const TAIL_BYTES: u64 = 8;

/// Returns the fingerprint of an image file. `None` if it has none or is truncated.
pub fn read_fingerprint(path: &Path) -> Option<String> {
    let FileEnds { head, tail, length } = FileEnds::read(path).ok()?;
    let fingerprint = match &head[..] {
        [0x89, b'P', b'N', b'G', ..] if tail.starts_with(b"IEND") => png::fingerprint(&head)?,
        [0xff, 0xd8, ..] if tail.ends_with(&[0xff, 0xd9]) => jpeg::fingerprint(&head)?,
        [b'R', b'I', b'F', b'F', a, b, c, d, ..] => {
            // RIFF's length does not count the 8 bytes before it.
            let complete = u64::from(u32::from_le_bytes([*a, *b, *c, *d])) + 8 == length;
            // XMP follows the image data.
            if complete { webp::fingerprint(&std::fs::read(path).ok()?)? } else { return None }
        }
        [0x76, 0x2f, 0x31, 0x01, ..] if exr_header::is_complete(&head, path) => {
            exr_header::string_attribute(&head, FINGERPRINT_KEY)?.to_vec()
        }
        _ => return None,
    };
    String::from_utf8(fingerprint).ok()
}

/// The start and the end of a file, and its length in bytes.
struct FileEnds {
    head: Vec<u8>,
    tail: Vec<u8>,
    length: u64,
}

impl FileEnds {
    fn read(path: &Path) -> io::Result<FileEnds> {
        if !path.metadata()?.is_file() {
            // Opening a pipe would block until someone writes to it.
            return Err(io::ErrorKind::InvalidInput.into());
        }
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        let mut head = Vec::new();
        (&mut file).take(HEAD_BYTES).read_to_end(&mut head)?;
        file.seek(SeekFrom::Start(length.saturating_sub(TAIL_BYTES)))?;
        let mut tail = Vec::new();
        file.take(TAIL_BYTES).read_to_end(&mut tail)?;
        Ok(FileEnds { head, tail, length })
    }
}
