//! Reads the fingerprint that is embedded in an image file: a line of text about what the image was rendered from.
//!
//! PNG stores it in a tEXt chunk, EXR in an attribute, JPEG in a comment and WebP in its XMP packet.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;

use super::checksum::verified_text;
use super::picture::FINGERPRINT_KEY;
use super::{exr_header, jpeg, png, png_chunks, webp};

/// Bytes at the start of a file that are searched for a fingerprint.
const HEAD_BYTES: u64 = 1 << 20;

/// Returns the fingerprint of an image file. `None` if it has none, is truncated or damaged.
pub fn read_fingerprint(path: &Path) -> Option<String> {
    let (mut file, head) = open(path).ok()?;
    let fingerprint = match &head[..] {
        [0x89, b'P', b'N', b'G', ..] => {
            file.rewind().ok()?;
            if !png_chunks::is_intact(BufReader::new(file)) {
                return None;
            }
            png::fingerprint(&head)?
        }
        [0xff, 0xd8, ..] => verified_text(path, &head, &jpeg::fingerprint(&head)?)?,
        [b'R', b'I', b'F', b'F', ..] => {
            // XMP follows the image data.
            let whole = std::fs::read(path).ok()?;
            verified_text(path, &whole, &webp::fingerprint(&whole)?)?
        }
        [0x76, 0x2f, 0x31, 0x01, ..] => {
            verified_text(path, &head, exr_header::string_attribute(&head, FINGERPRINT_KEY)?)?
        }
        _ => return None,
    };
    String::from_utf8(fingerprint).ok()
}

/// Opens a file, and reads its start.
fn open(path: &Path) -> io::Result<(File, Vec<u8>)> {
    if !path.metadata()?.is_file() {
        // Opening a pipe would block until someone writes to it.
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let mut file = File::open(path)?;
    let mut head = Vec::new();
    (&mut file).take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok((file, head))
}

#[cfg(test)]
mod tests {
    use blinn_core::geometry::Rgba;
    use blinn_render::Pixels;
    use blinn_render::display::Display;

    use super::*;
    use crate::format::{BitDepth, ImageFormat};
    use crate::picture::Picture;

    const TEXT: &str = "1 settings=abc digest=scene.glb";

    fn encoded(format: ImageFormat) -> Vec<u8> {
        let (width, height) = (64, 48);
        let color = |i: u32| Rgba::new((i * 7919 % 1000) as f32 / 1000.0, 0.5, (i % 64) as f32 / 64.0, 1.0);
        let colors = (0..width * height).map(color).collect();
        let display = Display::default();
        let picture = Picture::new(Pixels { width, height, colors }, display);
        let picture = Picture { fingerprint: Some(TEXT.into()), ..picture };
        format.encode(&picture, BitDepth::Default).unwrap()
    }

    #[test]
    fn damaged_files_have_no_fingerprint() {
        let dir = tempfile::tempdir().unwrap();
        for format in [ImageFormat::Png, ImageFormat::Jpeg(90), ImageFormat::Webp, ImageFormat::Exr] {
            let file = dir.path().join("image");
            let good = encoded(format);
            let read = |bytes: &[u8]| {
                std::fs::write(&file, bytes).unwrap();
                read_fingerprint(&file)
            };
            assert_eq!(read(&good).as_deref(), Some(TEXT), "{format:?}");
            let length = good.len();
            for cut in [length / 3, length - 9, length - 1] {
                assert_eq!(read(&good[..cut]), None, "{format:?} cut at {cut} of {length}");
            }
            // Blocks of a disk that were never written are zeros.
            for at in [length / 2, length * 2 / 3, length - 40] {
                let mut hole = good.clone();
                hole[at..(at + 32).min(length)].fill(0);
                assert!(hole == good || read(&hole).is_none(), "{format:?}, hole at {at} of {length}");
                let mut flipped = good.clone();
                flipped[at] ^= 1;
                assert_eq!(read(&flipped), None, "{format:?}, flipped bit at {at} of {length}");
            }
            assert_eq!(read(&[&good[..], b"x"].concat()), None, "{format:?}");
        }
    }
}
