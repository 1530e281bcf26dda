//! OpenEXR: one part, colour as R G B A and every layer as `name.channel`, linear.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
    Layer as ExrLayer, LayerAttributes, SmallVec, Text as ExrText, Vec2, WritableImage, f16,
};

use super::{Depth, Picture, cryptomatte};
use crate::integrator::Aov;
use crate::render::Layer;

/// Encodes a picture. Everything is 32-bit floats, ids 32-bit integers; `Sixteen` makes colour,
/// normals and albedo half.
pub(super) fn encode(picture: &Picture, depth: Depth) -> io::Result<Vec<u8>> {
    let half = depth == Depth::Sixteen;
    let colors = picture.display.to_linear(&picture.pixels);
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (i, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        channels.push(AnyChannel::new(name, floats(colors.iter().map(|c| c[i]), half)));
    }
    for layer in &picture.layers {
        add_layer(layer, half, &mut channels);
    }
    let mattes: Vec<_> = picture.mattes.iter().map(cryptomatte::Layers::new).collect();
    for (name, values) in mattes.iter().flat_map(cryptomatte::Layers::channels) {
        // Ids lose their meaning with any bit of theirs.
        channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(values)));
    }
    let size = Vec2(picture.pixels.width as usize, picture.pixels.height as usize);
    // The display window is the whole picture, the data window what was rendered of it.
    let (position, whole) = match picture.part {
        Some(part) => {
            (Vec2(part.crop.x as i32, part.crop.y as i32), Vec2(part.width as usize, part.height as usize))
        }
        None => (Vec2(0, 0), size),
    };
    let text = |value: &str| ExrText::from_bytes_unchecked(value.bytes().collect());
    let stamp = picture.stamp.iter().map(|stamp| (super::stamp::KEY.to_string(), stamp.clone()));
    let other = mattes.iter().flat_map(cryptomatte::Layers::metadata);
    let other =
        other.chain(stamp).map(|(key, value)| (text(&key), AttributeValue::Text(text(&value)))).collect();
    let software_name = Some(concat!("blinn ", env!("CARGO_PKG_VERSION")).into());
    let attributes = LayerAttributes { software_name, layer_position: position, other, ..Default::default() };
    let layer = ExrLayer::new(size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let image = Image::new(ImageAttributes::new(IntegerBounds::new((0, 0), whole)), layer);
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write().non_parallel().to_buffered(&mut bytes);
    written.map_err(io::Error::other)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn add_layer(layer: &Layer, half: bool, channels: &mut SmallVec<[AnyChannel<FlatSamples>; 4]>) {
    let (name, letters) = layer.aov.channels();
    let width = layer.aov.width();
    let shortened = matches!(layer.aov, Aov::Normal | Aov::VertexNormal | Aov::GeometricNormal | Aov::Albedo);
    for (i, letter) in letters.chars().enumerate() {
        let values = layer.values.iter().skip(i).step_by(width).copied();
        let samples = if layer.aov.is_id() {
            FlatSamples::U32(values.map(|v| v as u32).collect())
        } else {
            floats(values, half && shortened)
        };
        channels.push(AnyChannel::new(format!("{name}.{letter}").as_str(), samples));
    }
}

fn floats(values: impl Iterator<Item = f32>, half: bool) -> FlatSamples {
    if half {
        FlatSamples::F16(values.map(f16::from_f32).collect())
    } else {
        FlatSamples::F32(values.collect())
    }
}

/// Puts a header's attributes in the order of their names. The encoder keeps some of them in an
/// order that changes from run to run, and a picture shall always be the same bytes. The header's
/// length stays, so all that follows it holds.
fn sort_attributes(file: &mut [u8]) {
    let mut sorted: Vec<&[u8]> = attributes(file).collect();
    sorted.sort();
    let header = sorted.concat();
    if let Some(place) = file.get_mut(MAGIC_AND_VERSION..MAGIC_AND_VERSION + header.len()) {
        place.copy_from_slice(&header);
    }
}

const MAGIC_AND_VERSION: usize = 8;

/// The attributes of the header that a file begins with.
fn attributes(file: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = file.get(MAGIC_AND_VERSION..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (first, after) = rest.split_at_checked(attribute_length(rest)?)?;
        rest = after;
        Some(first)
    })
}

/// The text of the attribute of that name in a header that `file` begins with.
pub(super) fn attribute<'f>(file: &'f [u8], name: &str) -> Option<&'f [u8]> {
    let text = |attribute: &'f [u8]| attribute.strip_prefix(name.as_bytes())?.strip_prefix(b"\0string\0");
    attributes(file).find_map(text)?.get(4..)
}

/// Whether the file that begins with `head` ends where its last chunk does.
pub(super) fn is_whole(head: &[u8], path: &Path) -> bool {
    // A zero ends the header; then come the places of the chunks, and directly behind those the first.
    let table = MAGIC_AND_VERSION + attributes(head).map(<[u8]>::len).sum::<usize>() + 1;
    // A chunk begins with its place, a tile's four numbers or a line's one, and its size.
    let tiled = attributes(head).any(|attribute| attribute.starts_with(b"tiles\0"));
    let place_length = if tiled { 16 } else { 4 };
    let place = |at: usize| Some(u64::from_le_bytes(*head.get(at..)?.first_chunk()?));
    let end = || {
        let count = place(table)?.checked_sub(table as u64)? / 8;
        let last = place(table.checked_add(usize::try_from(count).ok()?.checked_sub(1)?.checked_mul(8)?)?)?;
        let mut file = File::open(path).ok()?;
        let mut size = [0; 4];
        file.seek(SeekFrom::Start(last.checked_add(place_length)?)).ok()?;
        file.read_exact(&mut size).ok()?;
        let end = last.checked_add(place_length + 4)?.checked_add(u64::from(u32::from_le_bytes(size)))?;
        Some(end == file.metadata().ok()?.len())
    };
    end() == Some(true)
}

/// The length of the attribute that `bytes` begin with: name, type, size and value. `None` at the
/// header's end.
fn attribute_length(bytes: &[u8]) -> Option<usize> {
    let text = |from: usize| bytes.get(from..)?.iter().position(|&b| b == 0);
    let name = text(0).filter(|&length| length > 0)?;
    let kind = text(name + 1)?;
    let value = name + kind + 2;
    let (size, rest) = bytes.get(value..)?.split_first_chunk::<4>()?;
    let size = u32::from_le_bytes(*size) as usize;
    (size <= rest.len()).then_some(value + 4 + size)
}
