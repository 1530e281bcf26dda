//! Parsers of sizes, backgrounds, exposure and AOVs of images.

use super::color::color_or;
use super::layer_names::{layer_hint, layer_names};
use super::numbers::{exactly, number};
use crate::options::{AovSelection, CRYPTOMATTE, Exposure, ImageBackground};
use blinn_render::PixelRect;
use blinn_render::display::Background;
use blinn_render::integrator::Aov;
use blinn_scene::GAMMAS;

/// A gamma.
pub fn gamma(text: &str) -> Result<f64, String> {
    let gamma = number(text)?;
    if GAMMAS.contains(&gamma) { Ok(gamma) } else { Err("must be from 0.001 to 100".into()) }
}

/// A colour, or `transparent`, also named `none`.
pub fn background(text: &str) -> Result<Background, String> {
    background_or(text, &["transparent"])
}

/// As [`background`]. `words` are those that the option takes besides colours, for errors.
fn background_or(text: &str, words: &[&'static str]) -> Result<Background, String> {
    match text {
        "transparent" | "none" => Ok(Background::Transparent),
        _ => color_or(text, words).map(Background::Color),
    }
}

/// A colour, `transparent` or `hdri`.
pub fn image_background(text: &str) -> Result<ImageBackground, String> {
    if text == "hdri" {
        return Ok(ImageBackground::Environment);
    }
    background_or(text, &["transparent", "hdri"]).map(ImageBackground::Fixed)
}

/// `WxH`, `W,H`, or one number for both, in pixels.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let form = || "expected WIDTHxHEIGHT, such as 1280x720, or one number for both".to_string();
    let (width, height) = text.split_once(['x', 'X', ',']).unwrap_or((text, text));
    let side = |s: &str| s.trim().parse::<u32>().map_err(|_| form());
    let (w, h) = (side(width)?, side(height)?);
    if w == 0 || h == 0 || w > 65_536 || h > 65_536 || u64::from(w) * u64::from(h) > 1 << 29 {
        return Err("each side must be 1 to 65536 pixels, and the image at most 536,870,912 pixels".into());
    }
    Ok((w, h))
}

/// `X,Y,W,H` in pixels.
pub fn crop(text: &str) -> Result<PixelRect, String> {
    let v = exactly::<4>(text, "X,Y,W,H")?;
    if v.iter().any(|v| !(0.0..=65_536.0).contains(v) || v.fract() != 0.0) || v[2] == 0.0 || v[3] == 0.0 {
        return Err("expected whole pixels X,Y,W,H with a width and a height".into());
    }
    let [x, y, width, height] = v.map(|v| v as u32);
    Ok(PixelRect { x, y, width, height })
}

/// Stops, or `auto`.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let ev = number(text).map_err(|e| format!("{e}; expected stops, or 'auto'"))?;
    if ev.abs() <= 100.0 { Ok(Exposure::Stops(ev)) } else { Err("must be within ±100 stops".into()) }
}

/// A comma-separated list of AOV names.
pub fn aovs(text: &str) -> Result<AovSelection, String> {
    let mut selection = AovSelection::default();
    for name in text.split(',').map(str::trim) {
        match Aov::by_name(name) {
            Some(aov) if selection.aovs.contains(&aov) => {}
            Some(aov) => selection.aovs.push(aov),
            None if name == CRYPTOMATTE => selection.cryptomatte = true,
            None => {
                let names: Vec<_> = layer_names().collect();
                let hint = layer_hint(name);
                return Err(format!("unknown layer '{name}'{hint}; expected {}", names.join(", ")));
            }
        }
    }
    Ok(selection)
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Rgb;

    #[test]
    fn backgrounds_are_colours_or_transparent() {
        assert_eq!(background("none"), Ok(Background::Transparent));
        assert_eq!(background("white"), Ok(Background::Color(Rgb::ONE)));
        assert_eq!(image_background("hdri"), Ok(ImageBackground::Environment));
        assert!(image_background("transparant").unwrap_err().contains("did you mean 'transparent'?"));
    }

    #[test]
    fn sizes_and_crops_are_whole_pixels() {
        assert_eq!(size("1280x720").unwrap(), (1280, 720));
        assert_eq!(size("64,32").unwrap(), (64, 32));
        assert_eq!(size("256").unwrap(), (256, 256));
        assert!(size("").is_err() && size("64x").is_err() && size("64px").is_err());
        assert!(size("0x10").is_err() && size("100000x1").is_err() && size("65536x65536").is_err());
        assert_eq!(crop("1,2,3,4").unwrap(), PixelRect { x: 1, y: 2, width: 3, height: 4 });
        assert!(crop("1,2,0,4").is_err() && crop("-1,2,3,4").is_err() && crop("1.5,2,3,4").is_err());
    }
}
