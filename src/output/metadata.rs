//! A line of text inside a picture file, which says what it was made from.
//!
//! PNG keeps it as a tEXt chunk, EXR as an attribute, JPEG as a comment and WebP in its XMP packet.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// The name that it has where it needs one.
pub(super) const KEY: &str = "blinn";

/// Bytes at the start of a file within which a fingerprint is found.
const HEAD: u64 = 1 << 20;

/// The fingerprint of a picture file. `None` where there is none, and where the file is not whole.
pub fn read_fingerprint(path: &Path) -> Option<String> {
    let (head, tail, length) = ends(path).ok()?;
    let fingerprint = match &head[..] {
        [0x89, b'P', b'N', b'G', ..] if tail.starts_with(b"IEND") => in_png(&head)?,
        [0xff, 0xd8, ..] if tail.ends_with(&[0xff, 0xd9]) => in_jpeg(&head)?,
        [b'R', b'I', b'F', b'F', a, b, c, d, ..] => {
            let told = u64::from(u32::from_le_bytes([*a, *b, *c, *d])) + 8;
            // XMP follows the picture.
            if told == length { in_webp(&std::fs::read(path).ok()?)? } else { return None }
        }
        [0x76, 0x2f, 0x31, 0x01, ..] if super::exr::is_whole(&head, path) => {
            super::exr::attribute(&head, KEY)?.to_vec()
        }
        _ => return None,
    };
    String::from_utf8(fingerprint).ok()
}

/// A file's first bytes, its last eight, and its length.
fn ends(path: &Path) -> io::Result<(Vec<u8>, Vec<u8>, u64)> {
    if !path.metadata()?.is_file() {
        // A pipe would wait for whoever writes to it.
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let (mut head, mut tail) = (Vec::new(), Vec::new());
    (&mut file).take(HEAD).read_to_end(&mut head)?;
    file.seek(SeekFrom::Start(length.saturating_sub(8)))?;
    file.take(8).read_to_end(&mut tail)?;
    Ok((head, tail, length))
}

/// Chunks of length, name, bytes and checksum.
fn in_png(file: &[u8]) -> Option<Vec<u8>> {
    let mut rest = file.get(8..)?;
    loop {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let length = u32::from_be_bytes(*length) as usize;
        let (name, after) = after.split_first_chunk::<4>()?;
        let bytes = after.get(..length)?;
        match name {
            b"tEXt" => {
                if let Some(text) = bytes.strip_prefix(KEY.as_bytes()).and_then(|b| b.strip_prefix(&[0])) {
                    return Some(text.to_vec());
                }
            }
            b"IDAT" => return None,
            _ => {}
        }
        rest = after.get(length.checked_add(4)?..)?;
    }
}

/// The comment that directly follows a JPEG's first marker.
fn in_jpeg(file: &[u8]) -> Option<Vec<u8>> {
    let (length, after) = file.get(2..)?.strip_prefix(&[0xff, 0xfe])?.split_first_chunk::<2>()?;
    let text = after.get(..usize::from(u16::from_be_bytes(*length)).checked_sub(2)?)?;
    text.strip_prefix(KEY.as_bytes())?.strip_prefix(b" ").map(<[u8]>::to_vec)
}

/// Puts a comment after a JPEG's first marker. One that is too long for a comment is left out.
pub(super) fn into_jpeg(file: &mut Vec<u8>, fingerprint: &str) {
    let text = format!("{KEY} {fingerprint}");
    if let Ok(length) = u16::try_from(text.len() + 2) {
        let comment = [&[0xff, 0xfe], &length.to_be_bytes()[..], text.as_bytes()].concat();
        file.splice(2..2, comment);
    }
}

const BEFORE: &str = " blinn:fingerprint=\"";

/// An XMP packet that says it. A fingerprint has no characters that XML would mind.
pub(super) fn xmp(fingerprint: &str) -> Vec<u8> {
    format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" \
         xmlns:blinn=\"urn:blinn\"{BEFORE}{fingerprint}\"/></rdf:RDF></x:xmpmeta>"
    )
    .into_bytes()
}

fn in_webp(file: &[u8]) -> Option<Vec<u8>> {
    let mut rest = file.get(12..)?;
    loop {
        let (name, after) = rest.split_first_chunk::<4>()?;
        let (length, after) = after.split_first_chunk::<4>()?;
        let length = u32::from_le_bytes(*length) as usize;
        let bytes = after.get(..length)?;
        if name == b"XMP " {
            let text = std::str::from_utf8(bytes).ok()?;
            let (_, fingerprint) = text.split_once(BEFORE)?;
            return Some(fingerprint.split_once('"')?.0.into());
        }
        rest = after.get(length + length % 2..)?;
    }
}
