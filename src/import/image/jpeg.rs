//! Detects truncated JPEG files, whose missing pixels the decoder fills with grey.

/// The part of a JPEG in which the file ends.
#[derive(PartialEq)]
enum Ending {
    /// After the end-of-image marker (EOI).
    EndOfImage,
    /// In the entropy-coded data of a scan.
    Scan,
    /// In another segment.
    Segment,
}

/// Returns true if a JPEG has its end-of-image marker, whatever follows.
pub fn is_complete(file: &[u8]) -> bool {
    ending(file) == Ending::EndOfImage
}

fn ending(file: &[u8]) -> Ending {
    let Some(mut rest) = file.strip_prefix(&[0xff, 0xd8]) else { return Ending::Segment };
    let mut inside = Ending::Segment;
    loop {
        // Entropy-coded data lies between segments. In it, 0xff is followed by 0 or by a restart marker.
        let Some(at) = rest.windows(2).position(|two| two[0] == 0xff && is_marker(two[1])) else {
            return inside;
        };
        let marker = rest[at + 1];
        let after = &rest[at + 2..];
        if marker == END {
            return Ending::EndOfImage;
        }
        // Skips the segment, which may contain bytes that look like markers.
        let Some(length) = after.first_chunk::<2>() else { return Ending::Segment };
        let Some(next) = after.get(usize::from(u16::from_be_bytes(*length))..) else {
            return Ending::Segment;
        };
        inside = if marker == SCAN { Ending::Scan } else { Ending::Segment };
        rest = next;
    }
}

/// Decodes a JPEG; `None` if it is truncated. A file that lacks only its end-of-image marker is complete.
pub(crate) fn decode_complete<I: PartialEq, E>(
    file: &[u8],
    decode: impl Fn(&[u8]) -> Result<I, E>,
) -> Result<Option<I>, E> {
    let image = decode(file)?;
    let complete = match ending(file) {
        Ending::EndOfImage => true,
        Ending::Scan => decode(&with_noise_appended(file)).is_ok_and(|other| other == image),
        Ending::Segment => false,
    };
    Ok(complete.then_some(image))
}

/// The file with noise and an end-of-image marker appended. Pixels that this changes are missing from the
/// file.
fn with_noise_appended(file: &[u8]) -> Vec<u8> {
    // A trailing 0xff would combine with the noise to a marker.
    let kept = file.iter().rposition(|&byte| byte != 0xff).map_or(0, |last| last + 1);
    let noise = (0..64u8).map(|i| i.wrapping_mul(0x9d) ^ 0x5a).filter(|&byte| byte != 0xff);
    file[..kept].iter().copied().chain(noise).chain([0xff, END]).collect()
}

/// Start of scan (SOS).
const SCAN: u8 = 0xda;
/// End of image (EOI).
const END: u8 = 0xd9;

/// Returns true for the second byte of a marker that starts a segment: not restart markers (0xd0 to 0xd7),
/// stuffing (0) or fill bytes (0xff).
fn is_marker(byte: u8) -> bool {
    !matches!(byte, 0 | 0xd0..=0xd7 | 0xff)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truncated_files_are_not_complete() {
        let mut file = Vec::new();
        let noise =
            image::RgbImage::from_fn(40, 30, |x, y| image::Rgb([((x * 37) ^ (y * 91)) as u8, x as u8, 9]));
        noise.write_to(&mut std::io::Cursor::new(&mut file), image::ImageFormat::Jpeg).unwrap();
        assert!(is_complete(&file));
        assert!((0..file.len()).all(|cut| !is_complete(&file[..cut])));
        // An embedded thumbnail has an end-of-image marker of its own.
        let inside = [&[0xff, 0xe1, 0, 8], &[0xff, 0xd8, 1, 2, 0xff, 0xd9][..]].concat();
        file.splice(2..2, inside);
        assert!(is_complete(&file) && !is_complete(&file[..file.len() / 2]));
        file.extend(b"trailing data");
        assert!(is_complete(&file));
    }

    #[test]
    fn a_missing_end_of_image_marker_is_accepted() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/tests/images");
        // A cut between two of the ten scans cannot be detected, nor one that removes only padding bits or
        // half a marker.
        for (name, max) in [("rgb.jpg", 0), ("grey.jpg", 0), ("progressive.jpg", 30)] {
            let file = std::fs::read(folder.join(name)).unwrap();
            let read = |bytes: &[u8]| image::load_from_memory(bytes);
            let complete = read(&file).unwrap();
            let passes =
                |bytes: &[u8]| matches!(decode_complete(bytes, read), Ok(Some(image)) if image == complete);
            assert!(passes(&file) && passes(&[&file[..], b"trailing data"].concat()), "{name}");
            assert!(passes(&file[..file.len() - 1]) && passes(&file[..file.len() - 2]), "{name}");
            let cut =
                (0..file.len() - 2).filter(|&end| matches!(decode_complete(&file[..end], read), Ok(Some(_))));
            let passed: Vec<usize> = cut.collect();
            assert!(passed.len() <= max, "{name}: {passed:?} of {}", file.len());
        }
    }
}
