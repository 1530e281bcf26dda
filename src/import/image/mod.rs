//! Decodes texture images: PNG, JPEG, WebP, BMP, TGA, TIFF, GIF and KTX2.

pub(crate) mod bmp;
pub(crate) mod cicp;
pub(crate) mod environment;
mod exr;
mod foreign;
pub mod jpeg;
mod ktx2;
mod radiance;
pub(crate) mod stored_frames;
pub(crate) mod stored_picture;
mod tiff;

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::Limits;
use blinn_scene::{Channels, Image, MipMaps, Texels};

/// Texture formats besides KTX2. A GIF is its first frame.
const FORMATS: [ImageFormat; 7] = [
    ImageFormat::Png,
    ImageFormat::Jpeg,
    ImageFormat::WebP,
    ImageFormat::Bmp,
    ImageFormat::Tga,
    ImageFormat::Tiff,
    ImageFormat::Gif,
];

/// The IEND chunk, the last of every PNG.
const PNG_END: &[u8] = b"\0\0\0\0IEND\xaeB`\x82";

/// Decodes an image, whose format is detected from its content.
///
/// # Errors
/// The format is not supported, the image is damaged, or it exceeds a limit.
pub(crate) fn decode(name: &str, bytes: &[u8], limits: &Limits) -> Result<Image, String> {
    // Some decoder messages contain line breaks.
    let one_line = |e: &dyn std::fmt::Display| e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    let error = |e: &dyn std::fmt::Display| format!("image '{name}' cannot be decoded: {}", one_line(e));
    // Lets a test provoke a panic in a decoder.
    #[cfg(debug_assertions)]
    assert!(std::env::var_os("BLINN_TEST_PANIC").is_none_or(|at| at != name), "left: 1\n right: 2");
    if let Some(reason) = tiff::unsupported(bytes) {
        return Err(error(&reason));
    }
    let (bytes, palette) = tiff::split_palette(bytes);
    let bytes = &*bytes;
    let (width, height) = size(bytes).map_err(|e| error(&e))?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > limits.image_pixels {
        return Err(error(&format!(
            "it has {width}x{height} pixels; 1 to {} are allowed",
            limits.image_pixels
        )));
    }
    let (channels, texels) = if ktx2::is_ktx2(bytes) {
        (Channels::Rgba, Texels::U8(ktx2::decode(bytes).map_err(|e| error(&e))?))
    } else {
        let decode = |bytes: &[u8]| {
            let mut reader = reader(bytes)?;
            let mut decoder_limits = image::Limits::default();
            decoder_limits.max_alloc = Some((pixels * 16).max(64 << 20));
            reader.limits(decoder_limits);
            reader.decode().map_err(|e| e.to_string())
        };
        let image = match image::guess_format(bytes) {
            Ok(ImageFormat::Jpeg) => jpeg::decode_complete(bytes, decode).map_err(|e| error(&e))?,
            // A PNG that lacks only its IEND chunk is complete.
            Ok(ImageFormat::Png) => {
                let completed = || decode(&[bytes, PNG_END].concat());
                Some(decode(bytes).or_else(|e| completed().map_err(|_| error(&e)))?)
            }
            _ => Some(decode(bytes).map_err(|e| error(&e))?),
        };
        texels(apply_palette(image.ok_or_else(|| error(&"the file is truncated"))?, palette))
    };
    Ok(Image { name: name.to_string(), width, height, channels, texels, mips: MipMaps::default() })
}

/// Replaces palette indices, which were decoded as grey levels, by their colours.
fn apply_palette(image: DynamicImage, palette: Option<tiff::Palette>) -> DynamicImage {
    let (DynamicImage::ImageLuma8(indices), Some(palette)) = (&image, palette) else { return image };
    let (width, height) = indices.dimensions();
    let color = |x, y| image::Rgb(palette[usize::from(indices.get_pixel(x, y).0[0])]);
    image::RgbImage::from_fn(width, height, color).into()
}

/// Converts a decoded image to stored texels. Layouts without an equivalent become RGBA with 8 bits per
/// channel.
fn texels(image: DynamicImage) -> (Channels, Texels) {
    use image::DynamicImage as D;
    match image {
        D::ImageLuma8(i) => (Channels::L, Texels::U8(i.into_raw())),
        D::ImageLumaA8(i) => (Channels::La, Texels::U8(i.into_raw())),
        D::ImageRgb8(i) => (Channels::Rgb, Texels::U8(i.into_raw())),
        D::ImageRgba8(i) => (Channels::Rgba, Texels::U8(i.into_raw())),
        D::ImageLuma16(i) => (Channels::L, Texels::U16(i.into_raw())),
        D::ImageLumaA16(i) => (Channels::La, Texels::U16(i.into_raw())),
        D::ImageRgb16(i) => (Channels::Rgb, Texels::U16(i.into_raw())),
        D::ImageRgba16(i) => (Channels::Rgba, Texels::U16(i.into_raw())),
        other => (Channels::Rgba, Texels::U8(other.into_rgba8().into_raw())),
    }
}

/// Size in bytes of the result of [`decode`], judged by the header; 0 if the header cannot be read.
pub(crate) fn decoded_size(bytes: &[u8]) -> u64 {
    if ktx2::is_ktx2(bytes) {
        return ktx2::size(bytes).map_or(0, |(w, h)| (4 * u64::from(w)).saturating_mul(u64::from(h)));
    }
    let (bytes, palette) = tiff::split_palette(bytes);
    let stored = reader(&bytes).ok().and_then(|r| r.into_decoder().ok()).map_or(0, |d| d.total_bytes());
    if palette.is_some() { stored.saturating_mul(3) } else { stored }
}

fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    if ktx2::is_ktx2(bytes) {
        return ktx2::size(bytes);
    }
    if let Some(reason) = tiff::unsupported(bytes) {
        return Err(reason.into());
    }
    let (bytes, _) = tiff::split_palette(bytes);
    reader(&bytes)?.into_dimensions().map_err(|e| e.to_string())
}

/// Creates a reader for the format detected from the content.
fn reader(bytes: &[u8]) -> Result<ImageReader<Cursor<&[u8]>>, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() && looks_like_tga(bytes) {
        reader.set_format(ImageFormat::Tga);
    }
    let formats = "PNG, JPEG, WebP, KTX2, BMP, TGA, TIFF or GIF";
    let name = match reader.format() {
        Some(format) if FORMATS.contains(&format) => return Ok(reader),
        Some(other) => other.extensions_str().first().unwrap_or(&"").to_uppercase(),
        None => match foreign::format_name(bytes) {
            Some(name) => name.to_string(),
            None => {
                let unknown = || format!("unknown image format; expected {formats}");
                return Err(foreign::describe(bytes).map_or_else(unknown, str::to_string));
            }
        },
    };
    Err(format!("{name} images are not supported; save it as {formats}"))
}

/// Detects TGA, which has no magic number, by a plausible header.
fn looks_like_tga(bytes: &[u8]) -> bool {
    let Some(header) = bytes.first_chunk::<18>() else { return false };
    let side = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
    let map = header[1];
    let kind = header[2];
    let depth = header[16];
    let mapped = matches!(kind, 1 | 9) == (map == 1);
    map <= 1
        && mapped
        && matches!(kind, 1..=3 | 9..=11)
        && matches!(depth, 8 | 15 | 16 | 24 | 32)
        && side(12) > 0
        && side(14) > 0
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    /// Files of `models/scripts/images.py`, each red on the left and green on the right as far as its format
    /// allows: (name, channels, left, right, tolerance).
    #[test]
    fn every_image_format_and_layout_is_decoded() {
        use Channels::{L, La, Rgb, Rgba};
        let red = [1.0, 0.0, 0.0, 1.0];
        let green = [0.0, 1.0, 0.0, 1.0];
        let clear = [0.0, 1.0, 0.0, 0.2];
        let exact = 1e-4;
        let lossy = 0.03;
        let light = [0.8, 0.8, 0.8, 1.0];
        let dark = [0.2, 0.2, 0.2, 1.0];
        let cases = [
            ("rgb.png", Rgb, red, green, exact),
            ("rgba.png", Rgba, red, clear, exact),
            ("grey.png", L, light, dark, exact),
            ("grey_alpha.png", La, light, [0.2; 4], exact),
            ("grey_16.png", L, light, dark, exact),
            ("palette.png", Rgb, red, green, exact),
            ("palette_transparent.png", Rgba, red, clear, exact),
            ("one_bit.png", L, [1.0; 4], [0.0, 0.0, 0.0, 1.0], exact),
            ("rgb.jpg", Rgb, red, green, lossy),
            ("progressive.jpg", Rgb, red, green, lossy),
            ("grey.jpg", L, light, dark, lossy),
            ("cmyk.jpg", Rgb, red, green, lossy),
            ("lossless.webp", Rgba, red, clear, exact),
            ("lossy.webp", Rgb, red, green, lossy),
            ("rgb.bmp", Rgb, red, green, exact),
            ("rgba.tga", Rgba, red, clear, exact),
            ("rgb.tif", Rgb, red, green, exact),
            ("lzw.tif", Rgba, red, clear, exact),
            ("palette.tif", Rgb, red, green, exact),
            ("grey_16.tif", L, light, dark, exact),
            ("frames.gif", Rgba, red, green, exact),
        ];
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/tests/images");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), cases.len());
        for (name, channels, left, right, tolerance) in cases {
            let bytes = std::fs::read(folder.join(name)).unwrap();
            let image = decode(name, &bytes, &Limits::default()).unwrap();
            assert_eq!((image.width, image.height, image.channels), (16, 8, channels), "{name}");
            assert_eq!(decoded_size(&bytes), image.byte_size(), "{name}");
            for (texel, expected) in [(0, left), (15, right), (7 * 16, left), (7 * 16 + 15, right)] {
                let color = image.stored(texel);
                assert!(color.abs_diff_eq(Vec4::from(expected), tolerance), "{name} at {texel}: {color}");
            }
        }
    }

    #[test]
    fn invalid_truncated_and_oversized_images_are_errors() {
        let error_within = |bytes: &[u8], limits: &Limits| decode("x", bytes, limits).unwrap_err();
        let error = |bytes: &[u8]| error_within(bytes, &Limits::default());
        let formats = "PNG, JPEG, WebP, KTX2, BMP, TGA, TIFF or GIF";
        let prefix = "image 'x' cannot be decoded:";
        assert_eq!(error(b"what"), format!("{prefix} unknown image format; expected {formats}"));
        let avif = format!("{prefix} AVIF images are not supported; save it as {formats}");
        assert_eq!(error(b"\0\0\0\x20ftypavif\0\0\0\0avifmif1miaf"), avif);
        assert_eq!(error(b"\x13\xab\xa1\x5c\x04\x04\x01\x04"), avif.replace("AVIF", "ASTC"));
        assert_eq!(error(b"DDS |\0\0\0"), avif.replace("AVIF", "DDS"));
        assert_eq!(error(b""), format!("{prefix} the file is empty"));
        let expected = format!("{prefix} ICO images are not supported; save it as {formats}");
        assert_eq!(error(b"\0\0\x01\0\x01\0"), expected);
        // The number of pixels overflows 64 bits.
        let huge = [&b"\xabKTX 20\xbb\r\n\x1a\n"[..], &[0xff; 68]].concat();
        assert_eq!(decoded_size(&huge), u64::MAX);
        assert!(error(&huge).contains("4294967295x4294967295 pixels"));
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/tests/images/rgb.png");
        let bytes = std::fs::read(path).unwrap();
        let small = Limits { image_pixels: 100, ..Limits::default() };
        assert!(error_within(&bytes, &small).contains("it has 16x8 pixels; 1 to 100 are allowed"));
        for end in 0..bytes.len() - PNG_END.len() {
            assert!(decode("x", &bytes[..end], &Limits::default()).is_err(), "{end}");
        }
        // Only the IEND chunk may be missing.
        for end in bytes.len() - PNG_END.len()..=bytes.len() {
            let image = decode("x", &bytes[..end], &Limits::default()).unwrap();
            assert_eq!(image.stored(15), Vec4::new(0.0, 1.0, 0.0, 1.0), "{end}");
        }
        // A truncated file is an error, or all its texels are present.
        for name in ["rgb.tif", "lzw.tif", "grey_16.tif", "palette.tif", "frames.gif"] {
            let path = format!("{}/../../models/tests/images/{name}", env!("CARGO_MANIFEST_DIR"));
            let bytes = std::fs::read(path).unwrap();
            let intact = decode("x", &bytes, &Limits::default()).unwrap();
            for end in 0..bytes.len() {
                if let Ok(image) = decode("x", &bytes[..end], &Limits::default()) {
                    assert!((0..16 * 8).all(|i| image.stored(i) == intact.stored(i)), "{name}: {end}");
                }
            }
            assert!(decode("x", &bytes[..bytes.len() / 2], &Limits::default()).is_err(), "{name}");
        }
    }
}
