//! Palette TIFFs, which the decoder does not support: the file is relabelled as greyscale, and the palette is
//! applied to the decoded image.

use std::borrow::Cow;

// Tags of the image file directory (IFD).
const BITS_PER_SAMPLE: u16 = 258;
const PHOTOMETRIC: u16 = 262;
const SAMPLES_PER_PIXEL: u16 = 277;
const COLOR_MAP: u16 = 320;

// Values of [`PHOTOMETRIC`].
const BLACK_IS_ZERO: u16 = 1;
const PALETTE: u16 = 3;

/// The 256 colours of the first image.
pub(crate) type Palette = Vec<[u8; 3]>;

/// Splits a palette TIFF into a greyscale TIFF of its indices and the palette. Other files are returned
/// unchanged.
pub(crate) fn split_palette(bytes: &[u8]) -> (Cow<'_, [u8]>, Option<Palette>) {
    grey_and_palette(bytes).map_or((bytes.into(), None), |(grey, palette)| (grey.into(), Some(palette)))
}

fn grey_and_palette(bytes: &[u8]) -> Option<(Vec<u8>, Palette)> {
    let little = match bytes.first_chunk()? {
        b"II*\0" => true,
        b"MM\0*" => false,
        _ => return None,
    };
    let short = |at: usize| {
        let two = *bytes.get(at..)?.first_chunk()?;
        Some(if little { u16::from_le_bytes(two) } else { u16::from_be_bytes(two) })
    };
    let long = |at: usize| {
        let four = *bytes.get(at..)?.first_chunk()?;
        Some(if little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) } as usize)
    };
    // IFD entries of 12 bytes: tag, type, count, and the value or its offset.
    let first = long(4)?;
    let entries = (0..usize::from(short(first)?)).map(|i| first.saturating_add(2 + 12 * i));
    let find = |tag| entries.clone().find(|&at| short(at) == Some(tag)).map(|at| at.saturating_add(8));
    let photometric = find(PHOTOMETRIC)?;
    if short(photometric)? != PALETTE
        || short(find(BITS_PER_SAMPLE)?)? != 8
        || find(SAMPLES_PER_PIXEL).is_some_and(|at| short(at) != Some(1))
    {
        return None;
    }
    // All reds, then all greens, then all blues, 16 bits each.
    let colors = long(find(COLOR_MAP)?)?;
    let channel = |i: usize| short(colors.checked_add(2 * i)?);
    let all: Vec<u16> = (0..3 * 256).map(channel).collect::<Option<_>>()?;
    // Some programs store 8-bit values.
    let shift = if all.iter().all(|&v| v < 256) { 0 } else { 8 };
    let palette = (0..256).map(|i| [0, 256, 512].map(|c| (all[i + c] >> shift) as u8)).collect();
    let mut grey = bytes.to_vec();
    let value = if little { BLACK_IS_ZERO.to_le_bytes() } else { BLACK_IS_ZERO.to_be_bytes() };
    grey.get_mut(photometric..)?.get_mut(..2)?.copy_from_slice(&value);
    Some((grey, palette))
}
