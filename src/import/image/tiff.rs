//! TIFFs whose pixels are numbers of colours, which the decoder does not know: it is told that they are grey, and the
//! colours are put in afterwards.

use std::borrow::Cow;

/// The tags of a picture that matter here.
const BITS: u16 = 258;
const KIND: u16 = 262;
const SAMPLES: u16 = 277;
const COLORS: u16 = 320;
/// What [`KIND`] says: grey from black, and numbers of colours.
const GREY: u16 = 1;
const NUMBERED: u16 = 3;

/// The colours of a file's first picture, 256 of them.
pub(crate) type Palette = Vec<[u8; 3]>;

/// The file as one of grey, and the colours of its greys; or as it is, where it has no palette that can be read.
pub(crate) fn without_palette(bytes: &[u8]) -> (Cow<'_, [u8]>, Option<Palette>) {
    palette(bytes).map_or((bytes.into(), None), |(grey, palette)| (grey.into(), Some(palette)))
}

fn palette(bytes: &[u8]) -> Option<(Vec<u8>, Palette)> {
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
    // Entries of twelve bytes: tag, type, count, and a value or where the values are.
    let first = long(4)?;
    let entries = (0..usize::from(short(first)?)).map(|i| first.saturating_add(2 + 12 * i));
    let find = |tag| entries.clone().find(|&at| short(at) == Some(tag)).map(|at| at.saturating_add(8));
    let kind = find(KIND)?;
    if short(kind)? != NUMBERED
        || short(find(BITS)?)? != 8
        || find(SAMPLES).is_some_and(|at| short(at) != Some(1))
    {
        return None;
    }
    // All reds, all greens, all blues.
    let colors = long(find(COLORS)?)?;
    let channel = |i: usize| short(colors.checked_add(2 * i)?);
    let all: Vec<u16> = (0..3 * 256).map(channel).collect::<Option<_>>()?;
    // Some programs write bytes.
    let shift = if all.iter().all(|&v| v < 256) { 0 } else { 8 };
    let palette = (0..256).map(|i| [0, 256, 512].map(|c| (all[i + c] >> shift) as u8)).collect();
    let mut grey = bytes.to_vec();
    let value = if little { GREY.to_le_bytes() } else { GREY.to_be_bytes() };
    grey.get_mut(kind..)?.get_mut(..2)?.copy_from_slice(&value);
    Some((grey, palette))
}
