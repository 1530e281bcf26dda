//! Whether a JPEG is whole: its decoder fills up with grey what was cut off.

/// Whether a JPEG's pictures of pixels end where they say so, whatever follows.
pub(super) fn is_whole(file: &[u8]) -> bool {
    let Some(mut rest) = file.strip_prefix(&[0xff, 0xd8]) else { return false };
    loop {
        // Pixels are what lies between segments: in them a marker's first byte is followed by nothing, or
        // by where to begin again.
        let Some(at) = rest.windows(2).position(|two| two[0] == 0xff && is_marker(two[1])) else {
            return false;
        };
        let (marker, after) = (rest[at + 1], &rest[at + 2..]);
        if marker == END {
            return true;
        }
        // A segment, skipped with what looks like markers in it.
        let Some(length) = after.first_chunk::<2>() else { return false };
        let Some(next) = after.get(usize::from(u16::from_be_bytes(*length))..) else { return false };
        rest = next;
    }
}

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
        assert!(is_whole(&file));
        assert!((0..file.len()).all(|cut| !is_whole(&file[..cut])));
        // A small picture inside it has an end of its own.
        let inside = [&[0xff, 0xe1, 0, 8], &[0xff, 0xd8, 1, 2, 0xff, 0xd9][..]].concat();
        file.splice(2..2, inside);
        assert!(is_whole(&file) && !is_whole(&file[..file.len() / 2]));
        file.extend(b"what a camera adds");
        assert!(is_whole(&file));
    }
}
