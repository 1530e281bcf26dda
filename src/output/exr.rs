//! OpenEXR: one part, colour as R G B A and every layer as `name.channel`, linear.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use exr::block::lines::LineRefMut;
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::Header;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, Image, ImageAttributes, IntegerBounds,
    Layer as ExrLayer, LayerAttributes, SmallVec, Text as ExrText, Vec2, WritableImage, f16,
};
use rayon::prelude::*;

use super::{BitDepth, Picture, cryptomatte};
use crate::integrator::Aov;
use crate::render::AovLayer;

/// Encodes a picture. Everything is 32-bit floats, ids 32-bit integers; `Sixteen` makes colour,
/// normals and albedo half.
pub(super) fn encode(picture: &Picture, depth: BitDepth) -> io::Result<Vec<u8>> {
    let kind = if depth == BitDepth::Sixteen { SampleType::F16 } else { SampleType::F32 };
    let mattes: Vec<_> = picture.mattes.iter().map(cryptomatte::Layers::new).collect();
    let mut channels: SmallVec<[AnyChannel<Channel>; 4]> = SmallVec::new();
    for (c, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let values: Values = Box::new(move |i| picture.display.composite_linear(picture.pixels.colors[i])[c]);
        channels.push(AnyChannel::new(name, Channel { kind, values }));
    }
    for layer in &picture.layers {
        add_layer(layer, kind, &mut channels);
    }
    for (name, values) in mattes.iter().flat_map(cryptomatte::Layers::channels) {
        // Ids lose their meaning with any bit of theirs.
        channels.push(AnyChannel::new(name.as_str(), Channel { kind: SampleType::F32, values }));
    }
    let size = Vec2(picture.pixels.width as usize, picture.pixels.height as usize);
    // The display window is the whole picture, the data window what was rendered of it.
    let (position, whole) = match picture.crop_window {
        Some(part) => {
            (Vec2(part.crop.x as i32, part.crop.y as i32), Vec2(part.width as usize, part.height as usize))
        }
        None => (Vec2(0, 0), size),
    };
    let text = |value: &str| ExrText::from_bytes_unchecked(value.bytes().collect());
    let fingerprint =
        picture.fingerprint.iter().map(|fingerprint| (super::metadata::KEY.to_string(), fingerprint.clone()));
    let other = mattes.iter().flat_map(cryptomatte::Layers::metadata);
    let other = other
        .chain(fingerprint)
        .map(|(key, value)| (text(&key), AttributeValue::Text(text(&value))))
        .collect();
    let software_name = Some(concat!("blinn ", env!("CARGO_PKG_VERSION")).into());
    let attributes = LayerAttributes { software_name, layer_position: position, other, ..Default::default() };
    let layer = ExrLayer::new(size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let image = Image::new(ImageAttributes::new(IntegerBounds::new((0, 0), whole)), layer);
    let mut bytes = file(&image).map_err(io::Error::other)?;
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn add_layer<'p>(
    layer: &'p AovLayer,
    kind: SampleType,
    channels: &mut SmallVec<[AnyChannel<Channel<'p>>; 4]>,
) {
    let name = layer.aov.name();
    let letters = layer.aov.channels();
    let width = layer.aov.channel_count();
    let kind = match layer.aov {
        aov if aov.is_id() => SampleType::U32,
        Aov::Normal | Aov::VertexNormal | Aov::GeometricNormal | Aov::Albedo => kind,
        _ => SampleType::F32,
    };
    for (c, letter) in letters.chars().enumerate() {
        let values: Values = Box::new(move |i| layer.values[width * i + c]);
        channels.push(AnyChannel::new(format!("{name}.{letter}").as_str(), Channel { kind, values }));
    }
}

/// What a channel has at each pixel.
pub(super) type Values<'p> = Box<dyn Fn(usize) -> f32 + Sync + 'p>;

/// A channel, whose values are asked for when they are written: there is no copy of all of them.
struct Channel<'p> {
    kind: SampleType,
    values: Values<'p>,
}

impl<'c> WritableSamples<'c> for Channel<'_>
where
    Self: 'c,
{
    type Writer = Rows<'c>;

    fn sample_type(&self) -> SampleType {
        self.kind
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'c self, header: &Header) -> Rows<'c> {
        Rows { kind: self.kind, values: &self.values, width: header.layer_size.width() }
    }
}

/// A channel of a picture so many pixels wide.
struct Rows<'c> {
    kind: SampleType,
    values: &'c (dyn Fn(usize) -> f32 + Sync),
    width: usize,
}

impl SamplesWriter for Rows<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let first = line.location.position.y() * self.width + line.location.position.x();
        let value = |i: usize| (self.values)(first + i);
        // Lines are as long as their channel's numbers are: it cannot fail.
        let _ = match self.kind {
            SampleType::F16 => line.write_samples(|i| f16::from_f32(value(i))),
            SampleType::F32 => line.write_samples(value),
            SampleType::U32 => line.write_samples(|i| value(i) as u32),
        };
    }
}

/// Blocks of which threads make their part of the file before it is written: of few there is little to hold.
const AT_ONCE: usize = 32;

/// An image's file. It does not depend on how many threads there are.
fn file<'i, L: WritableLayers<'i>>(image: &'i Image<L>) -> exr::error::Result<Vec<u8>> {
    let headers = image.write().infer_meta_data();
    let pixels = image.layer_data.create_writer(&headers);
    let mut bytes = Cursor::new(Vec::new());
    exr::block::write(&mut bytes, headers, true, |meta, file| {
        let blocks: Vec<(usize, BlockIndex)> = meta.enumerate_ordered_header_block_indices().collect();
        for some in blocks.chunks(AT_ONCE) {
            let pack = |&(place, index): &(usize, BlockIndex)| {
                let data = pixels.extract_uncompressed_block(&meta.headers, index);
                (place, UncompressedBlock { index, data }.compress_to_chunk(&meta.headers))
            };
            let packed: Vec<_> = some.par_iter().with_max_len(1).map(pack).collect();
            packed.into_iter().try_for_each(|(place, chunk)| file.write_chunk(place, chunk?))?;
        }
        Ok(())
    })?;
    Ok(bytes.into_inner())
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

#[cfg(test)]
mod tests {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use glam::Vec4;

    use super::*;
    use crate::display::{Background, Display, ViewTransform};
    use crate::render::Pixels;

    /// Of more blocks than are made at once, and some cut short.
    #[test]
    fn blocks_are_where_they_belong_whoever_makes_them() {
        let (width, height) = (450, 390);
        let color = |i: u32| Vec4::new(i as f32, (i % width) as f32, 1.0 / i as f32, 1.0);
        let colors = (0..width * height).map(color).collect();
        let ids = AovLayer { aov: Aov::ObjectId, values: (0..width * height).map(|i| i as f32).collect() };
        let display = Display { ev: 0.0, view: ViewTransform::Standard, background: Background::Transparent };
        let picture =
            Picture { layers: vec![ids], ..Picture::new(Pixels { width, height, colors }, display) };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| encode(&picture, BitDepth::Default).unwrap())
        };
        let bytes = with(1);
        assert!(bytes == with(3));
        let read = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let layer = read.all_attributes().from_buffered(Cursor::new(bytes)).unwrap().layer_data;
        for channel in layer.channel_data.list {
            let name = channel.name.to_string();
            let found = channel.sample_data.values_as_f32();
            let expected = picture.pixels.colors.iter().enumerate().map(|(i, color)| match name.as_str() {
                "R" => color.x,
                "G" => color.y,
                "B" => color.z,
                "A" => color.w,
                _ => i as f32,
            });
            assert!(found.eq(expected), "{name}");
        }
    }
}
