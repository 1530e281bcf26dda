//! OpenEXR pictures as the programs that write them name their channels: with or without layers, in colour or grey.

use std::io::Cursor;

use exr::block::reader::Reader;
use exr::meta::header::Header;
use exr::prelude::{IntegerBounds, ReadChannels, ReadLayers, ReadSpecificChannel, Text, Vec2, read};

/// The first bytes of every file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Returns true for OpenEXR pictures.
pub(super) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// A picture whose header has been read.
pub(super) struct ExrPicture<'a> {
    reader: Reader<Cursor<&'a [u8]>>,
    channels: Channels,
    /// The part of the plane that the picture shows.
    window: IntegerBounds,
    /// Position of the stored pixels.
    data_position: Vec2<i32>,
}

/// The names of channels.
#[derive(Clone, Debug, PartialEq)]
enum Channels {
    Rgb([Text; 3]),
    Grey(Text),
}

impl ExrPicture<'_> {
    /// # Errors
    /// The file is damaged, or has no colour.
    pub fn open(bytes: &[u8]) -> Result<ExrPicture<'_>, String> {
        let reader = exr::block::read(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
        let flat = reader.headers().iter().filter(|header| !header.deep);
        let found = flat.clone().find_map(|header| Some((header, find_rgb(header)?)));
        let found = found.or_else(|| flat.clone().find_map(|header| Some((header, find_grey(header)?))));
        let (header, channels) = found.ok_or_else(|| {
            let names = reader.headers().iter().flat_map(|header| &header.channels.list);
            let names: Vec<String> = names.take(8).map(|channel| channel.name.to_string()).collect();
            format!("it has no channels R, G and B and no Y, only {}", names.join(", "))
        })?;
        if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            return Err("subsampled channels (luminance and chroma) are not supported; save it as RGB".into());
        }
        let data_position = header.own_attributes.layer_position;
        let data = IntegerBounds { position: data_position, size: header.layer_size };
        let display = header.shared_attributes.display_window;
        // Some programs write a display window that has nothing to do with the picture.
        let window = if is_panorama(display.size) || !is_panorama(data.size) { display } else { data };
        Ok(ExrPicture { channels, window, data_position, reader })
    }

    /// Width and height of the shown part.
    pub fn size(&self) -> [usize; 2] {
        [self.window.size.0, self.window.size.1]
    }

    /// Reads the pixels, row by row from the top. Those that are not stored are black. The caller has checked the size.
    ///
    /// # Errors
    /// The file is truncated or damaged.
    pub fn decode(self) -> Result<Vec<[f32; 3]>, String> {
        let ExrPicture { reader, channels, window, data_position } = self;
        let [width, height] = [window.size.0, window.size.1];
        let set = move |texels: &mut Vec<[f32; 3]>, at: Vec2<usize>, color: [f32; 3]| {
            let shown = |at: usize, data: i32, window: i32, size: usize| {
                let at = i64::try_from(at).ok()? + i64::from(data) - i64::from(window);
                usize::try_from(at).ok().filter(|&at| at < size)
            };
            let x = shown(at.0, data_position.0, window.position.0, width);
            let y = shown(at.1, data_position.1, window.position.1, height);
            if let (Some(x), Some(y)) = (x, y) {
                texels[y * width + x] = color;
            }
        };
        let create = move |_| vec![[0.0; 3]; width * height];
        let flat = read().no_deep_data().largest_resolution_level().specific_channels();
        match channels {
            Channels::Rgb([r, g, b]) => {
                let channels = flat.required(r).required(g).required(b);
                let channels = channels.collect_pixels(
                    move |_: Vec2<usize>, _: &_| create(()),
                    move |texels, at, (r, g, b): (f32, f32, f32)| set(texels, at, [r, g, b]),
                );
                let image = channels.first_valid_layer().all_attributes().from_chunks(reader);
                image.map(|image| image.layer_data.channel_data.pixels)
            }
            Channels::Grey(y) => {
                let channels = flat.required(y).collect_pixels(
                    move |_: Vec2<usize>, _: &_| create(()),
                    move |texels, at, (y,): (f32,)| set(texels, at, [y; 3]),
                );
                let image = channels.first_valid_layer().all_attributes().from_chunks(reader);
                image.map(|image| image.layer_data.channel_data.pixels)
            }
        }
        .map_err(|e| e.to_string())
    }
}

fn is_panorama(size: Vec2<usize>) -> bool {
    size.0 == size.1.saturating_mul(2)
}

/// The layer and the channel of a name such as `ViewLayer.Combined.R`.
fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

/// The channels of the best colour of a part: without layer, else of Blender's combined pass, else of the first layer.
fn find_rgb(header: &Header) -> Option<Channels> {
    let names = || header.channels.list.iter().map(|channel| &channel.name);
    let find = |layer: &str, long: &str| {
        let short = &long[..1];
        names().find(|name| {
            let name = name.to_string();
            let (of, channel) = split(&name);
            of == layer && (channel.eq_ignore_ascii_case(short) || channel.eq_ignore_ascii_case(long))
        })
    };
    let mut layers: Vec<String> = names().map(|name| split(&name.to_string()).0.to_string()).collect();
    layers.sort_by_key(|layer| (!layer.is_empty(), split(layer).1 != "Combined"));
    layers.iter().find_map(|layer| {
        let channel = |long| find(layer, long).cloned();
        Some(Channels::Rgb([channel("Red")?, channel("Green")?, channel("Blue")?]))
    })
}

/// The luminance of a part, or its only channel.
fn find_grey(header: &Header) -> Option<Channels> {
    let list = &header.channels.list;
    let is_grey = |name: &Text| {
        let name = name.to_string();
        ["Y", "L", "Luminance"].iter().any(|grey| split(&name).1.eq_ignore_ascii_case(grey))
    };
    let found = list.iter().find(|channel| is_grey(&channel.name));
    let only = || list.first().filter(|_| list.len() == 1);
    found.or_else(only).map(|channel| Channels::Grey(channel.name.clone()))
}

#[cfg(test)]
mod tests;
