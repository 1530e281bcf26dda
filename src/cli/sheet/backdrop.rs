//! The background of a sheet where no picture covers it.

use blinn_core::geometry::Rgb;
use blinn_render::display::Background;
use blinn_scene::linear_to_srgb8;

/// The background without --background, linear: light enough for dark labels.
pub const BACKGROUND: Rgb = Rgb::new(0.8, 0.82, 0.85);

/// The 8-bit sRGB of a background.
pub fn background_pixel(background: Background) -> [u8; 4] {
    match background {
        Background::Transparent => [0; 4],
        Background::Color(color) => {
            let [r, g, b] = color.to_array().map(linear_to_srgb8);
            [r, g, b, 255]
        }
    }
}

/// True for backgrounds on which dark labels are legible. A transparent image is mostly laid over white.
pub fn is_light(background: Background) -> bool {
    match background {
        Background::Transparent => true,
        // Contrast with black and with white is equal at a relative luminance of 0.18.
        Background::Color(color) => color.dot(Rgb::new(0.2126, 0.7152, 0.0722)) > 0.18,
    }
}
