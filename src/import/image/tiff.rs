//! TIFFs that the decoder does not support. Palette TIFFs are relabelled as greyscale, and the palette is applied to the
//! decoded image; other kinds are named in messages.

use std::borrow::Cow;

// Tags of the image file directory (IFD).
const BITS_PER_SAMPLE: u16 = 258;
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const SAMPLES_PER_PIXEL: u16 = 277;
const COLOR_MAP: u16 = 320;
const SAMPLE_FORMAT: u16 = 339;

// Values of [`PHOTOMETRIC`].
const BLACK_IS_ZERO: u16 = 1;
const PALETTE: u16 = 3;
const YCBCR: u16 = 6;

// Values of [`COMPRESSION`].
const OLD_JPEG: u16 = 6;
const JPEG: u16 = 7;

// Values of [`SAMPLE_FORMAT`].
const FLOAT: u16 = 3;

/// The 256 colours of the first image.
pub(crate) type Palette = Vec<[u8; 3]>;

/// Splits a palette TIFF into a greyscale TIFF of its indices and the palette. Other files are returned
/// unchanged.
pub(crate) fn split_palette(bytes: &[u8]) -> (Cow<'_, [u8]>, Option<Palette>) {
    grey_and_palette(bytes).map_or((bytes.into(), None), |(grey, palette)| (grey.into(), Some(palette)))
}

/// The reason why a TIFF is not supported, with what to save it as, if that is so.
pub(crate) fn unsupported(bytes: &[u8]) -> Option<&'static str> {
    if matches!(bytes.first_chunk(), Some(b"II+\0" | b"MM\0+")) {
        return Some("it is a BigTIFF, which is not supported; save it as a classic TIFF, PNG or JPEG");
    }
    let tags = Tags::of(bytes)?;
    let value = |tag| tags.value(tag).unwrap_or(0);
    let is_jpeg = matches!(value(COMPRESSION), OLD_JPEG | JPEG);
    if is_jpeg && value(PHOTOMETRIC) == YCBCR {
        return Some(
            "it is a TIFF with YCbCr JPEG data, which is not supported; save it as RGB, or as a JPEG",
        );
    }
    if value(PHOTOMETRIC) == YCBCR {
        return Some("it is a TIFF in YCbCr, which is not supported; save it as RGB");
    }
    let samples = tags.value(SAMPLES_PER_PIXEL).unwrap_or(1);
    if samples == 2 && value(PHOTOMETRIC) <= BLACK_IS_ZERO {
        return Some("it is a TIFF of grey with alpha, which is not supported; save it in RGBA, or as a PNG");
    }
    let bits = tags.first_short(BITS_PER_SAMPLE).unwrap_or(1);
    match (tags.first_short(SAMPLE_FORMAT), bits) {
        (Some(FLOAT), 16) => Some(
            "it is a TIFF of half floats (16 bits), which are not supported; save it with 8 or 16-bit integers",
        ),
        (Some(FLOAT), 32) if samples == 1 => Some(
            "it is a TIFF of one channel of floats, which is not supported; save it in RGB, or with 8 or 16-bit integers",
        ),
        (Some(FLOAT), 64) => {
            Some("it is a TIFF of 64-bit floats, which are not supported; save it with 8 or 16-bit integers")
        }
        _ => None,
    }
}

/// The tags of the first image: the image file directory, whose entries of 12 bytes are tag, type, count, and the value
/// or its offset.
struct Tags<'a> {
    bytes: &'a [u8],
    is_little: bool,
    /// Offset of the first entry, and their number.
    first: usize,
    count: usize,
}

impl<'a> Tags<'a> {
    fn of(bytes: &'a [u8]) -> Option<Tags<'a>> {
        let is_little = match bytes.first_chunk()? {
            b"II*\0" => true,
            b"MM\0*" => false,
            _ => return None,
        };
        let mut tags = Tags { bytes, is_little, first: 0, count: 0 };
        let directory = tags.long(4)?;
        tags.count = usize::from(tags.short(directory)?);
        tags.first = directory.saturating_add(2);
        Some(tags)
    }

    fn short(&self, at: usize) -> Option<u16> {
        let two = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.is_little { u16::from_le_bytes(two) } else { u16::from_be_bytes(two) })
    }

    fn long(&self, at: usize) -> Option<usize> {
        let four = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.is_little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) } as usize)
    }

    fn entry(&self, tag: u16) -> Option<usize> {
        let mut entries = (0..self.count).map(|i| self.first.saturating_add(12 * i));
        entries.find(|&at| self.short(at) == Some(tag))
    }

    /// Offset of the value of a tag, or of the offset of its values.
    fn find(&self, tag: u16) -> Option<usize> {
        self.entry(tag).map(|at| at.saturating_add(8))
    }

    /// The value of a tag that has one short.
    fn value(&self, tag: u16) -> Option<u16> {
        self.short(self.find(tag)?)
    }

    /// The first of the shorts of a tag. More than two are not in the entry.
    fn first_short(&self, tag: u16) -> Option<u16> {
        let entry = self.entry(tag)?;
        let value = entry.saturating_add(8);
        let count = self.long(entry.saturating_add(4))?;
        self.short(if count > 2 { self.long(value)? } else { value })
    }
}

fn grey_and_palette(bytes: &[u8]) -> Option<(Vec<u8>, Palette)> {
    let tags = Tags::of(bytes)?;
    let photometric = tags.find(PHOTOMETRIC)?;
    if tags.short(photometric)? != PALETTE
        || tags.value(BITS_PER_SAMPLE)? != 8
        || tags.find(SAMPLES_PER_PIXEL).is_some_and(|at| tags.short(at) != Some(1))
    {
        return None;
    }
    // All reds, then all greens, then all blues, 16 bits each.
    let colors = tags.long(tags.find(COLOR_MAP)?)?;
    let channel = |i: usize| tags.short(colors.checked_add(2 * i)?);
    let all: Vec<u16> = (0..3 * 256).map(channel).collect::<Option<_>>()?;
    // Some programs store 8-bit values.
    let shift = if all.iter().all(|&v| v < 256) { 0 } else { 8 };
    let palette = (0..256).map(|i| [0, 256, 512].map(|c| (all[i + c] >> shift) as u8)).collect();
    let mut grey = bytes.to_vec();
    let value = if tags.is_little { BLACK_IS_ZERO.to_le_bytes() } else { BLACK_IS_ZERO.to_be_bytes() };
    grey.get_mut(photometric..)?.get_mut(..2)?.copy_from_slice(&value);
    Some((grey, palette))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A TIFF without pixels that has these tags of one short.
    fn tiff(is_little: bool, tags: &[(u16, u16)]) -> Vec<u8> {
        let short = |v: u16| if is_little { v.to_le_bytes() } else { v.to_be_bytes() };
        let long = |v: u32| if is_little { v.to_le_bytes() } else { v.to_be_bytes() };
        let mut bytes = if is_little { b"II*\0".to_vec() } else { b"MM\0*".to_vec() };
        bytes.extend(long(8));
        bytes.extend(short(tags.len() as u16));
        for &(tag, value) in tags {
            bytes.extend([short(tag), short(3)].as_flattened());
            bytes.extend(long(1));
            bytes.extend([short(value), [0; 2]].as_flattened());
        }
        bytes
    }

    #[test]
    fn unsupported_kinds_are_named() {
        for is_little in [true, false] {
            let check = |tags: &[(u16, u16)], expected: Option<&str>| {
                let found = unsupported(&tiff(is_little, tags));
                let agrees = match (found, expected) {
                    (Some(found), Some(expected)) => found.contains(expected),
                    (found, expected) => found.is_none() && expected.is_none(),
                };
                assert!(agrees, "{tags:?}: {found:?}");
            };
            check(&[(COMPRESSION, JPEG), (PHOTOMETRIC, YCBCR)], Some("YCbCr JPEG"));
            check(&[(COMPRESSION, OLD_JPEG), (PHOTOMETRIC, YCBCR)], Some("YCbCr JPEG"));
            check(&[(COMPRESSION, 1), (PHOTOMETRIC, YCBCR)], Some("a TIFF in YCbCr"));
            check(&[(BITS_PER_SAMPLE, 16), (PHOTOMETRIC, 2), (SAMPLE_FORMAT, FLOAT)], Some("half floats"));
            let floats =
                |samples| [(BITS_PER_SAMPLE, 32), (SAMPLES_PER_PIXEL, samples), (SAMPLE_FORMAT, FLOAT)];
            check(&floats(1), Some("one channel of floats"));
            check(&floats(3), None);
            check(&[(BITS_PER_SAMPLE, 32), (SAMPLE_FORMAT, FLOAT)], Some("one channel of floats"));
            check(&[(BITS_PER_SAMPLE, 16), (PHOTOMETRIC, 2), (SAMPLE_FORMAT, 1)], None);
            check(&[(COMPRESSION, JPEG), (PHOTOMETRIC, 2)], None);
            check(&[(PHOTOMETRIC, BLACK_IS_ZERO), (SAMPLES_PER_PIXEL, 2)], Some("grey with alpha"));
            check(&[(PHOTOMETRIC, BLACK_IS_ZERO), (SAMPLES_PER_PIXEL, 1)], None);
        }
        assert!(unsupported(b"II+\0\x08\0\0\0").unwrap().contains("BigTIFF"));
        assert!(unsupported(b"MM\0+\0\x08\0\0").unwrap().contains("BigTIFF"));
    }

    /// Three shorts do not fit into the entry.
    #[test]
    fn formats_of_several_samples_are_behind_an_offset() {
        let mut bytes = tiff(true, &[(BITS_PER_SAMPLE, 0), (SAMPLE_FORMAT, 0)]);
        for (entry, value) in [(0, 16u16), (1, FLOAT)] {
            let at = 10 + 12 * entry;
            bytes[at + 4] = 3;
            let offset = bytes.len() as u32;
            bytes[at + 8..at + 12].copy_from_slice(&offset.to_le_bytes());
            bytes.extend(std::iter::repeat_n(value.to_le_bytes(), 3).flatten());
        }
        assert!(unsupported(&bytes).unwrap().contains("half floats"));
        for end in 0..bytes.len() {
            let _ = unsupported(&bytes[..end]);
        }
    }
}
