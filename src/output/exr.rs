//! OpenEXR: one part with linear colour as R G B A and each AOV as `name.channel`.

use std::io::{self, Cursor};

use exr::block::chunk::Chunk;
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

use super::checksum::{seal, with_room};
use super::cryptomatte::{Cryptomatte, PixelFn};
use super::exr_header::sort_attributes;
use super::picture::{FINGERPRINT_KEY, Picture};
use blinn_render::AovLayer;
use blinn_render::integrator::Aov;

type Channels<'p> = SmallVec<[AnyChannel<Channel<'p>>; 4]>;

/// Encodes an image. All channels are 32-bit floats, ids 32-bit integers; with `half`, colour, light, normals and albedo
/// are half floats.
pub(super) fn encode(picture: &Picture, half: bool) -> io::Result<Vec<u8>> {
    let color_type = if half { SampleType::F16 } else { SampleType::F32 };
    let mattes: Vec<_> = picture.mattes.par_iter().map(Cryptomatte::new).collect();
    let mut channels = color_channels(picture, color_type);
    for layer in &picture.layers {
        add_layer(layer, color_type, &mut channels);
    }
    for (name, values) in mattes.iter().flat_map(Cryptomatte::channels) {
        // Ids need all their bits.
        channels.push(AnyChannel::new(
            name.as_str(),
            Channel { sample_type: SampleType::F32, aov: None, values },
        ));
    }

    let size = Vec2(picture.pixels.width as usize, picture.pixels.height as usize);
    let (data_position, display_size) = match picture.crop_window {
        Some(window) => (
            Vec2(window.crop.x as i32, window.crop.y as i32),
            Vec2(window.full_width as usize, window.full_height as usize),
        ),
        None => (Vec2(0, 0), size),
    };
    let attributes = LayerAttributes {
        software_name: Some(concat!("blinn ", env!("CARGO_PKG_VERSION")).into()),
        layer_position: data_position,
        other: text_attributes(picture, &mattes),
        ..Default::default()
    };
    let layer = ExrLayer::new(size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let display_window = IntegerBounds::new((0, 0), display_size);
    let image = Image::new(ImageAttributes::new(display_window), layer);
    let mut bytes = write_image(&image).map_err(io::Error::other)?;
    sort_attributes(&mut bytes);
    if let Some(fingerprint) = &picture.fingerprint {
        seal(&mut bytes, &with_room(fingerprint));
    }
    Ok(bytes)
}

fn color_channels(picture: &Picture, sample_type: SampleType) -> Channels<'_> {
    let mut channels = Channels::new();
    for (c, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let values: PixelFn =
            Box::new(move |i| picture.display.composite_linear(picture.pixels.colors[i])[c]);
        channels.push(AnyChannel::new(name, Channel { sample_type, aov: None, values }));
    }
    channels
}

fn add_layer<'p>(layer: &'p AovLayer, color_type: SampleType, channels: &mut Channels<'p>) {
    let name = layer.aov.name();
    let letters = layer.aov.channels();
    let channel_count = layer.aov.channel_count();
    let sample_type = match layer.aov {
        aov if aov.is_id() => SampleType::U32,
        aov if aov.is_normal() || aov == Aov::Albedo || aov.light().is_some() => color_type,
        _ => SampleType::F32,
    };
    for (c, letter) in letters.chars().enumerate() {
        let values: PixelFn = Box::new(move |i| layer.values[channel_count * i + c]);
        let channel = Channel { sample_type, aov: Some(layer.aov), values };
        channels.push(AnyChannel::new(format!("{name}.{letter}").as_str(), channel));
    }
}

/// The manifests of the mattes and the fingerprint.
fn text_attributes(
    picture: &Picture,
    mattes: &[Cryptomatte],
) -> std::collections::HashMap<ExrText, AttributeValue> {
    let text = |value: &str| ExrText::from_bytes_unchecked(value.bytes().collect());
    let fingerprint = picture.fingerprint.iter().map(|f| (FINGERPRINT_KEY.to_string(), with_room(f)));
    let all = mattes.iter().flat_map(Cryptomatte::metadata).chain(fingerprint);
    all.map(|(key, value)| (text(&key), AttributeValue::Text(text(&value)))).collect()
}

/// A channel whose values are computed while its lines are written, so that they are never stored.
struct Channel<'p> {
    sample_type: SampleType,
    /// The layer that it belongs to.
    aov: Option<Aov>,
    values: PixelFn<'p>,
}

impl<'c> WritableSamples<'c> for Channel<'_>
where
    Self: 'c,
{
    type Writer = ChannelLines<'c>;

    fn sample_type(&self) -> SampleType {
        self.sample_type
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'c self, header: &Header) -> ChannelLines<'c> {
        let Channel { sample_type, aov, ref values } = *self;
        ChannelLines { sample_type, aov, values, width: header.layer_size.width() }
    }
}

/// Writes the lines of a channel.
struct ChannelLines<'c> {
    sample_type: SampleType,
    aov: Option<Aov>,
    values: &'c (dyn Fn(usize) -> f32 + Sync),
    /// Width of the image in pixels.
    width: usize,
}

impl SamplesWriter for ChannelLines<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let first = line.location.position.y() * self.width + line.location.position.x();
        let value = |i: usize| (self.values)(first + i);
        // Fails only if the line's byte length does not match its sample type, which the encoder rules out.
        let _ = match self.sample_type {
            SampleType::F16 => line.write_samples(|i| f16::from_f32(value(i))),
            SampleType::F32 => line.write_samples(value),
            SampleType::U32 => {
                line.write_samples(|i| self.aov.map_or(value(i) as u32, |aov| aov.id(value(i))))
            }
        };
    }
}

/// Blocks that are compressed in parallel while as many are written: bounds the memory they hold.
const BLOCKS_IN_FLIGHT: usize = 32;

/// Encodes an image on all threads. The bytes do not depend on the number of threads.
fn write_image<'i, L: WritableLayers<'i>>(image: &'i Image<L>) -> exr::error::Result<Vec<u8>> {
    let headers = image.write().infer_meta_data();
    let pixels = image.layer_data.create_writer(&headers);
    let mut bytes = Cursor::new(Vec::new());
    exr::block::write(&mut bytes, headers, true, |meta, file| {
        let blocks: Vec<(usize, BlockIndex)> = meta.enumerate_ordered_header_block_indices().collect();
        let mut compressed = Vec::new();
        for batch in blocks.chunks(BLOCKS_IN_FLIGHT) {
            let compress = |&(position, index): &(usize, BlockIndex)| {
                let data = pixels.extract_uncompressed_block(&meta.headers, index);
                (position, UncompressedBlock { index, data }.compress_to_chunk(&meta.headers))
            };
            let (written, next) = rayon::join(
                || write_chunks(file, compressed),
                || batch.par_iter().with_max_len(1).map(compress).collect::<Vec<_>>(),
            );
            written?;
            compressed = next;
        }
        write_chunks(file, compressed)
    })?;
    Ok(bytes.into_inner())
}

/// Writes chunks, each with its position in the file's table.
fn write_chunks(
    file: &mut impl ChunksWriter,
    chunks: Vec<(usize, exr::error::Result<Chunk>)>,
) -> exr::error::UnitResult {
    chunks.into_iter().try_for_each(|(position, chunk)| file.write_chunk(position, chunk?))
}

#[cfg(test)]
mod tests {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use glam::Vec4;

    use super::*;
    use blinn_render::Pixels;
    use blinn_render::display::Display;

    /// The image has more blocks than are compressed at once, and incomplete ones.
    #[test]
    fn the_bytes_do_not_depend_on_the_number_of_threads() {
        let (width, height) = (450, 390);
        let color = |i: u32| Vec4::new(i as f32, (i % width) as f32, 1.0 / i as f32, 1.0);
        let colors = (0..width * height).map(color).collect();
        let ids = AovLayer { aov: Aov::ObjectId, values: (0..width * height).map(|i| i as f32).collect() };
        let display = Display::default();
        let picture =
            Picture { layers: vec![ids], ..Picture::new(Pixels { width, height, colors }, display) };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| encode(&picture, false).unwrap())
        };
        let bytes = with(1);
        assert!(bytes == with(3));
        let read = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let layer = read.all_attributes().from_buffered(Cursor::new(bytes)).unwrap().layer_data;
        for channel in layer.channel_data.list {
            let name = channel.name.to_string();
            let values = channel.sample_data.values_as_f32();
            let expected = picture.pixels.colors.iter().enumerate().map(|(i, color)| match name.as_str() {
                "R" => color.x,
                "G" => color.y,
                "B" => color.z,
                "A" => color.w,
                _ => i as f32,
            });
            assert!(values.eq(expected), "{name}");
        }
    }
}
