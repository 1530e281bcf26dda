//! OpenEXR: one part, colour as R G B A and every layer as `name.channel`, linear.

use std::io::{self, Cursor};

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer as ExrLayer,
    LayerAttributes, SmallVec, Vec2, WritableImage, f16,
};

use super::{Depth, Picture};
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
    let size = Vec2(picture.pixels.width as usize, picture.pixels.height as usize);
    // The display window is the whole picture, the data window what was rendered of it.
    let (position, whole) = match picture.part {
        Some(part) => {
            (Vec2(part.crop.x as i32, part.crop.y as i32), Vec2(part.width as usize, part.height as usize))
        }
        None => (Vec2(0, 0), size),
    };
    let software_name = Some(concat!("blinn ", env!("CARGO_PKG_VERSION")).into());
    let attributes = LayerAttributes { software_name, layer_position: position, ..Default::default() };
    let layer = ExrLayer::new(size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let image = Image::new(ImageAttributes::new(IntegerBounds::new((0, 0), whole)), layer);
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write().non_parallel().to_buffered(&mut bytes);
    written.map_err(io::Error::other)?;
    Ok(bytes.into_inner())
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
