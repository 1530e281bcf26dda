//! Whether a JPEG is whole: its decoder fills up with grey what was cut off.

/// Where a file ends.
#[derive(PartialEq)]
enum Ending {
    /// Where it says so, whatever follows.
    End,
    /// Among pixels.
    Pixels,
    /// Among what is said of them.
    Segment,
}

/// Whether a JPEG's pictures of pixels end where they say so, whatever follows.
pub(crate) fn is_complete(file: &[u8]) -> bool {
    ending(file) == Ending::End
}

fn ending(file: &[u8]) -> Ending {
    let Some(mut rest) = file.strip_prefix(&[0xff, 0xd8]) else { return Ending::Segment };
    let mut inside = Ending::Segment;
    loop {
        // Pixels are what lies between segments: in them a marker's first byte is followed by nothing, or
        // by where to begin again.
        let Some(at) = rest.windows(2).position(|two| two[0] == 0xff && is_marker(two[1])) else {
            return inside;
        };
        let (marker, after) = (rest[at + 1], &rest[at + 2..]);
        if marker == END {
            return Ending::End;
        }
        // A segment, skipped with what looks like markers in it.
        let Some(length) = after.first_chunk::<2>() else { return Ending::Segment };
        let Some(next) = after.get(usize::from(u16::from_be_bytes(*length))..) else {
            return Ending::Segment;
        };
        inside = if marker == SCAN { Ending::Pixels } else { Ending::Segment };
        rest = next;
    }
}

/// What `decode` makes of a JPEG; `None` where it was cut off. One whose end alone is missing is whole.
pub(crate) fn decoded<I: PartialEq, E>(
    file: &[u8],
    decode: impl Fn(&[u8]) -> Result<I, E>,
) -> Result<Option<I>, E> {
    let image = decode(file)?;
    let whole = match ending(file) {
        Ending::End => true,
        Ending::Pixels => decode(&continued(file)).is_ok_and(|other| other == image),
        Ending::Segment => false,
    };
    Ok(whole.then_some(image))
}

/// The file with what it never had after it: whatever that changes was not in the file.
fn continued(file: &[u8]) -> Vec<u8> {
    // The first half of a marker would become one.
    let kept = file.iter().rposition(|&byte| byte != 0xff).map_or(0, |last| last + 1);
    let noise = (0..64u8).map(|i| i.wrapping_mul(0x9d) ^ 0x5a).filter(|&byte| byte != 0xff);
    file[..kept].iter().copied().chain(noise).chain([0xff, END]).collect()
}

const SCAN: u8 = 0xda;
const END: u8 = 0xd9;

/// Whether it says what follows. A JPEG begins again at 0xd0 to 0xd7, and 0xff may fill up.
fn is_marker(byte: u8) -> bool {
    !matches!(byte, 0 | 0xd0..=0xd7 | 0xff)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cut_off_is_not_whole() {
        let mut file = Vec::new();
        let noise =
            image::RgbImage::from_fn(40, 30, |x, y| image::Rgb([((x * 37) ^ (y * 91)) as u8, x as u8, 9]));
        noise.write_to(&mut std::io::Cursor::new(&mut file), image::ImageFormat::Jpeg).unwrap();
        assert!(is_complete(&file));
        assert!((0..file.len()).all(|cut| !is_complete(&file[..cut])));
        // A small picture inside it has an end of its own.
        let inside = [&[0xff, 0xe1, 0, 8], &[0xff, 0xd8, 1, 2, 0xff, 0xd9][..]].concat();
        file.splice(2..2, inside);
        assert!(is_complete(&file) && !is_complete(&file[..file.len() / 2]));
        file.extend(b"what a camera adds");
        assert!(is_complete(&file));
    }

    #[test]
    fn an_end_alone_may_be_missing() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models/tests/images");
        // Between two scans, of which there are ten, nothing says that another follows; the last byte of one
        // may hold nothing, and half a marker says nothing.
        for (name, most) in [("rgb.jpg", 0), ("grey.jpg", 0), ("progressive.jpg", 30)] {
            let file = std::fs::read(folder.join(name)).unwrap();
            let read = |bytes: &[u8]| image::load_from_memory(bytes);
            let whole = read(&file).unwrap();
            let passes = |bytes: &[u8]| matches!(decoded(bytes, read), Ok(Some(image)) if image == whole);
            assert!(passes(&file) && passes(&[&file[..], b"what a camera adds"].concat()), "{name}");
            assert!(passes(&file[..file.len() - 1]) && passes(&file[..file.len() - 2]), "{name}");
            let cut = (0..file.len() - 2).filter(|&end| matches!(decoded(&file[..end], read), Ok(Some(_))));
            let passed: Vec<usize> = cut.collect();
            assert!(passed.len() <= most, "{name}: {passed:?} of {}", file.len());
        }
    }
}
