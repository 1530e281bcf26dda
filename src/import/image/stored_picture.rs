//! Pictures with all their channels, as comparisons need them.

use std::io::Cursor;
use std::path::Path;

use ::exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};

use super::{decode, exr, radiance, size};
use crate::Limits;
use crate::error::LoadError;
use crate::files::read_file::read_scene_file;
use crate::memory::MemoryBudget;
use blinn_scene::Channels;

/// Meaning of the values of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureEncoding {
    /// Colours as displayed, sRGB-encoded, in 0…1. The channels are R, G, B and A, with straight alpha.
    Display,
    /// Linear light and any other values, in channels of any name.
    Linear,
}

/// A channel of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureChannel {
    /// Name, such as `R` or `depth.Z`.
    pub name: String,
    /// Values, row-major, row 0 on top.
    pub values: Vec<f64>,
}

/// A picture with the values that its file stores.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredPicture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Meaning of the values.
    pub encoding: PictureEncoding,
    /// Channels, in the order of their names for EXR.
    pub channels: Vec<PictureChannel>,
}

/// Bytes of the values in memory for each pixel and channel, and of the decoder's copy.
const VALUE_BYTES: u64 = 16;

impl StoredPicture {
    /// Returns true if a file that begins with `head` is a picture and not a scene.
    pub fn is_picture(head: &[u8]) -> bool {
        exr::is_exr(head) || radiance::is_radiance(head) || image::guess_format(head).is_ok()
    }

    /// Loads a PNG, JPEG, WebP, TIFF, BMP, GIF, OpenEXR or Radiance picture. The format is detected from the content.
    ///
    /// # Errors
    /// The file cannot be read, has another format, is damaged, or exceeds a limit.
    pub fn load(path: &Path, limits: &Limits) -> Result<StoredPicture, LoadError> {
        let budget = MemoryBudget::new(limits);
        let bytes = read_scene_file(path, limits.file_bytes.min(limits.memory_bytes))?;
        budget.charge(bytes.len() as u64)?;
        let place = path.display();
        let damaged = |cause: String| {
            let cause = cause.split_whitespace().collect::<Vec<_>>().join(" ");
            LoadError::parse(&place, format!("the picture cannot be decoded: {cause}"))
        };
        let check = |width: u64, height: u64, channels: u64| {
            let pixels = width.saturating_mul(height);
            LoadError::check_limit("pixels of a picture", pixels, limits.image_pixels)?;
            budget.charge(pixels.saturating_mul(channels).saturating_mul(VALUE_BYTES))
        };
        if exr::is_exr(&bytes) {
            let header =
                ::exr::block::read(Cursor::new(&bytes[..]), false).map_err(|e| damaged(e.to_string()))?;
            for part in header.headers() {
                let [width, height] = [part.layer_size.0 as u64, part.layer_size.1 as u64];
                check(width, height, part.channels.list.len() as u64)?;
            }
            return read_exr(&bytes).map_err(damaged);
        }
        if radiance::is_radiance(&bytes) {
            let header = radiance::Header::read(&bytes).map_err(damaged)?;
            check(u64::from(header.width), u64::from(header.height), 3)?;
            let texels = radiance::decode(&bytes, &header).map_err(damaged)?;
            let channel = |i: usize| texels.iter().map(|texel| f64::from(texel[i])).collect();
            let channels = named_channels(&["R", "G", "B"], channel);
            let encoding = PictureEncoding::Linear;
            return Ok(StoredPicture { width: header.width, height: header.height, encoding, channels });
        }
        let (width, height) = size(&bytes).map_err(damaged)?;
        check(u64::from(width), u64::from(height), 4)?;
        let decoded = decode(&place.to_string(), &bytes, limits).map_err(damaged)?;
        let texels: Vec<_> = (0..width as usize * height as usize).map(|i| decoded.stored(i)).collect();
        let channel = |i: usize| texels.iter().map(|texel| f64::from(texel[i])).collect();
        let names = match decoded.channels {
            Channels::L | Channels::Rgb => &["R", "G", "B"][..],
            Channels::La | Channels::Rgba => &["R", "G", "B", "A"],
        };
        let mut channels = named_channels(names, channel);
        if channels.len() == 3 {
            channels.push(PictureChannel { name: "A".into(), values: vec![1.0; texels.len()] });
        }
        Ok(StoredPicture { width, height, encoding: PictureEncoding::Display, channels })
    }

    /// Returns the values of a channel.
    pub fn channel(&self, name: &str) -> Option<&[f64]> {
        self.channels.iter().find(|channel| channel.name == name).map(|channel| &channel.values[..])
    }

    /// Returns the number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

fn named_channels(names: &[&str], values: impl Fn(usize) -> Vec<f64>) -> Vec<PictureChannel> {
    let channel = |(i, name): (usize, &&str)| PictureChannel { name: name.to_string(), values: values(i) };
    names.iter().enumerate().map(channel).collect()
}

/// Reads all channels of all parts. The caller has checked their size.
fn read_exr(bytes: &[u8]) -> Result<StoredPicture, String> {
    let all = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let picture = all.from_buffered(Cursor::new(bytes)).map_err(|e| e.to_string())?;
    let Some(first) = picture.layer_data.first() else { return Err("it has no pixels".into()) };
    let size = first.size;
    let mut channels = Vec::new();
    for layer in &picture.layer_data {
        if layer.size != size {
            return Err("its parts have different sizes".into());
        }
        let prefix = layer.attributes.layer_name.as_ref().filter(|_| picture.layer_data.len() > 1);
        for channel in &layer.channel_data.list {
            let name = match prefix {
                Some(prefix) => format!("{prefix}.{}", channel.name),
                None => channel.name.to_string(),
            };
            let values: Vec<f64> = match &channel.sample_data {
                FlatSamples::F16(values) => values.iter().map(|v| f64::from(v.to_f32())).collect(),
                FlatSamples::F32(values) => values.iter().map(|v| f64::from(*v)).collect(),
                FlatSamples::U32(values) => values.iter().map(|v| f64::from(*v)).collect(),
            };
            if values.len() != size.0 * size.1 {
                return Err(format!("channel {name} is subsampled"));
            }
            channels.push(PictureChannel { name, values });
        }
    }
    let (width, height) = (size.0 as u32, size.1 as u32);
    Ok(StoredPicture { width, height, encoding: PictureEncoding::Linear, channels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_told_from_scenes() {
        let head = |name: &str| {
            std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name)).unwrap()
        };
        for name in ["tests/images/rgb.png", "tests/images/rgb.jpg", "tests/images/lossless.webp"] {
            assert!(StoredPicture::is_picture(&head(name)), "{name}");
        }
        for name in ["tests/cube.obj", "figure/figure.glb", "lecture/lecture.obj"] {
            assert!(!StoredPicture::is_picture(&head(name)), "{name}");
        }
        assert!(StoredPicture::is_picture(b"\x76\x2f\x31\x01") && !StoredPicture::is_picture(b""));
    }

    #[test]
    fn a_picture_has_four_channels_and_limits_are_checked() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/tests/images/rgb.png");
        let picture = StoredPicture::load(&path, &Limits::default()).unwrap();
        let at = |name: &str, i: usize| picture.channel(name).unwrap()[i];
        assert_eq!((at("R", 0), at("G", 0), at("G", 15), at("A", 3)), (1.0, 0.0, 1.0, 1.0));
        let palette = StoredPicture::load(&path.with_file_name("palette.tif"), &Limits::default()).unwrap();
        let at = |name: &str, i: usize| palette.channel(name).unwrap()[i];
        assert_eq!((at("R", 0), at("G", 0), at("A", 0)), (1.0, 0.0, 1.0));
        let few = Limits { image_pixels: 100, ..Limits::default() };
        assert!(StoredPicture::load(&path, &few).unwrap_err().to_string().contains("128"));
    }
}
