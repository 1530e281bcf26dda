//! Image files to texels.

pub(crate) mod environment;
pub(crate) mod jpeg;
mod ktx2;
mod tiff;

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::Limits;
use crate::scene::{Channels, Image, MipMaps, Texels};

/// What textures may be, beside KTX2; of a GIF its first frame.
const TEXTURES: [ImageFormat; 7] = [
    ImageFormat::Png,
    ImageFormat::Jpeg,
    ImageFormat::WebP,
    ImageFormat::Bmp,
    ImageFormat::Tga,
    ImageFormat::Tiff,
    ImageFormat::Gif,
];

/// The last chunk of any PNG.
const PNG_END: &[u8] = b"\0\0\0\0IEND\xaeB`\x82";

/// Decodes an image, its format judged by its bytes alone.
///
/// # Errors
/// A sentence that says what is wrong with it.
pub(crate) fn decode(name: &str, bytes: &[u8], limits: &Limits) -> Result<Image, String> {
    // Libraries end some of their messages with a line break.
    let one_line = |e: &dyn std::fmt::Display| e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    let wrong = |e: &dyn std::fmt::Display| format!("image '{name}' cannot be decoded: {}", one_line(e));
    // No decoder is known to panic, and what becomes of one that does has to be seen: by tests alone.
    #[cfg(debug_assertions)]
    assert!(std::env::var_os("BLINN_TEST_PANIC").is_none_or(|at| at != name), "left: 1\n right: 2");
    let (bytes, palette) = tiff::without_palette(bytes);
    let bytes = &*bytes;
    let (width, height) = size(bytes).map_err(|e| wrong(&e))?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > limits.image_pixels {
        return Err(wrong(&format!(
            "{width}x{height} pixels, where 1 to {} are allowed",
            limits.image_pixels
        )));
    }
    let (channels, texels) = if ktx2::is_ktx2(bytes) {
        (Channels::Rgba, Texels::U8(ktx2::decode(bytes).map_err(|e| wrong(&e))?))
    } else {
        let decode = |bytes: &[u8]| {
            let mut reader = reader(bytes)?;
            let mut decoder_limits = image::Limits::default();
            decoder_limits.max_alloc = Some((pixels * 16).max(64 << 20));
            reader.limits(decoder_limits);
            reader.decode().map_err(|e| e.to_string())
        };
        let image = match image::guess_format(bytes) {
            Ok(ImageFormat::Jpeg) => jpeg::decoded(bytes, decode).map_err(|e| wrong(&e))?,
            // Where nothing else is missing the picture is whole.
            Ok(ImageFormat::Png) => {
                let ended = || decode(&[bytes, PNG_END].concat());
                Some(decode(bytes).or_else(|what| ended().map_err(|_| wrong(&what)))?)
            }
            _ => Some(decode(bytes).map_err(|e| wrong(&e))?),
        };
        texels(colored(image.ok_or_else(|| wrong(&"it is cut off"))?, palette))
    };
    Ok(Image { name: name.to_string(), width, height, channels, texels, mips: MipMaps::default() })
}

/// What was decoded, where it is numbers of a palette's colours with those in their places.
fn colored(image: DynamicImage, palette: Option<tiff::Palette>) -> DynamicImage {
    let (DynamicImage::ImageLuma8(numbers), Some(palette)) = (&image, palette) else { return image };
    let (width, height) = numbers.dimensions();
    let color = |x, y| image::Rgb(palette[usize::from(numbers.get_pixel(x, y).0[0])]);
    image::RgbImage::from_fn(width, height, color).into()
}

/// What was decoded, as it is stored; layouts that nothing here has become RGBA.
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

/// Bytes that [`decode`] makes of it, by its header; 0 where it has none that can be read.
pub(crate) fn decoded_size(bytes: &[u8]) -> u64 {
    if ktx2::is_ktx2(bytes) {
        return ktx2::size(bytes).map_or(0, |(w, h)| (4 * u64::from(w)).saturating_mul(u64::from(h)));
    }
    let (bytes, palette) = tiff::without_palette(bytes);
    let stored = reader(&bytes).ok().and_then(|r| r.into_decoder().ok()).map_or(0, |d| d.total_bytes());
    if palette.is_some() { stored.saturating_mul(3) } else { stored }
}

fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    if ktx2::is_ktx2(bytes) {
        return ktx2::size(bytes);
    }
    reader(bytes)?.into_dimensions().map_err(|e| e.to_string())
}

/// A reader for the format that the bytes show.
fn reader(bytes: &[u8]) -> Result<ImageReader<Cursor<&[u8]>>, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() && looks_like_tga(bytes) {
        reader.set_format(ImageFormat::Tga);
    }
    let textures = "PNG, JPEG, WebP, KTX2, BMP, TGA, TIFF and GIF are read";
    match reader.format() {
        None => Err(format!("it is of no format that is known by its bytes: {textures}")),
        Some(other) if !TEXTURES.contains(&other) => {
            let name = other.extensions_str().first().unwrap_or(&"").to_uppercase();
            Err(format!("it is a file of {name}, which is not read: {textures}; save it as one of them"))
        }
        Some(_) => Ok(reader),
    }
}

/// TGA has no magic number: its header makes sense, or not.
fn looks_like_tga(bytes: &[u8]) -> bool {
    let Some(header) = bytes.first_chunk::<18>() else { return false };
    let side = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
    let (map, kind, depth) = (header[1], header[2], header[16]);
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

    /// Files that `models/scripts/images.py` made, each red on the left and green on the right as far
    /// as it can say so: (name, channels, left, right, tolerance).
    #[test]
    fn every_kind_of_image_is_read() {
        use Channels::{L, La, Rgb, Rgba};
        let (red, green) = ([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]);
        let (clear, exact, lossy) = ([0.0, 1.0, 0.0, 0.2], 1e-4, 0.03);
        let (light, dark) = ([0.8, 0.8, 0.8, 1.0], [0.2, 0.2, 0.2, 1.0]);
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
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models/tests/images");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), cases.len());
        for (name, channels, left, right, tolerance) in cases {
            let bytes = std::fs::read(folder.join(name)).unwrap();
            let image = decode(name, &bytes, &Limits::default()).unwrap();
            assert_eq!((image.width, image.height, image.channels), (16, 8, channels), "{name}");
            assert_eq!(decoded_size(&bytes), image.byte_size(), "{name}");
            for (texel, expected) in [(0, left), (15, right), (7 * 16, left), (7 * 16 + 15, right)] {
                let found = image.stored(texel);
                assert!(found.abs_diff_eq(Vec4::from(expected), tolerance), "{name} at {texel}: {found}");
            }
        }
    }

    #[test]
    fn what_is_no_image_or_too_large_is_refused() {
        let refused = |bytes: &[u8], limits: &Limits| decode("x", bytes, limits).unwrap_err();
        let told = |bytes: &[u8]| refused(bytes, &Limits::default());
        let read = "PNG, JPEG, WebP, KTX2, BMP, TGA, TIFF and GIF are read";
        let wrong = "image 'x' cannot be decoded: it is";
        assert_eq!(told(b"what"), format!("{wrong} of no format that is known by its bytes: {read}"));
        let expected = format!("{wrong} a file of ICO, which is not read: {read}; save it as one of them");
        assert_eq!(told(b"\0\0\x01\0\x01\0"), expected);
        // Sides whose product is more than u64 has.
        let huge = [&b"\xabKTX 20\xbb\r\n\x1a\n"[..], &[0xff; 68]].concat();
        assert_eq!(decoded_size(&huge), u64::MAX);
        assert!(told(&huge).contains("4294967295x4294967295 pixels"));
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/models/tests/images/rgb.png");
        let bytes = std::fs::read(path).unwrap();
        let small = Limits { image_pixels: 100, ..Limits::default() };
        assert!(refused(&bytes, &small).contains("16x8 pixels, where 1 to 100 are allowed"));
        for end in 0..bytes.len() - PNG_END.len() {
            assert!(decode("x", &bytes[..end], &Limits::default()).is_err(), "{end}");
        }
        // Its own end alone may be missing.
        for end in bytes.len() - PNG_END.len()..=bytes.len() {
            let image = decode("x", &bytes[..end], &Limits::default()).unwrap();
            assert_eq!(image.stored(15), Vec4::new(0.0, 1.0, 0.0, 1.0), "{end}");
        }
        // What is cut off is refused, or all that is shown was there.
        for name in ["rgb.tif", "lzw.tif", "grey_16.tif", "palette.tif", "frames.gif"] {
            let path = format!("{}/models/tests/images/{name}", env!("CARGO_MANIFEST_DIR"));
            let bytes = std::fs::read(path).unwrap();
            let whole = decode("x", &bytes, &Limits::default()).unwrap();
            for end in 0..bytes.len() {
                if let Ok(image) = decode("x", &bytes[..end], &Limits::default()) {
                    assert!((0..16 * 8).all(|i| image.stored(i) == whole.stored(i)), "{name}: {end}");
                }
            }
            assert!(decode("x", &bytes[..bytes.len() / 2], &Limits::default()).is_err(), "{name}");
        }
    }
}
