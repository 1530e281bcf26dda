//! 8-bit sRGB colours of an image, with alpha only where it is needed.

use std::borrow::Cow;

use rayon::prelude::*;

use super::picture::Picture;

/// Pixels that are worth a task of their own.
const TASK_PIXELS: usize = 1 << 16;

/// Colours, row-major, row 0 on top.
pub(super) enum DisplayColors<'p> {
    /// Every pixel is opaque.
    Rgb(Vec<[u8; 3]>),
    /// Straight alpha.
    Rgba(Cow<'p, [[u8; 4]]>),
}

impl DisplayColors<'_> {
    /// The colours of a picture.
    pub fn of(picture: &Picture) -> DisplayColors<'static> {
        let Picture { pixels, display, .. } = picture;
        if let Some(rgb) = display.to_rgb8(pixels) {
            return DisplayColors::Rgb(rgb);
        }
        DisplayColors::from_rgba(display.to_rgba8(pixels).into())
    }

    fn from_rgba(rgba: Cow<[[u8; 4]]>) -> DisplayColors {
        let pixels = rgba.par_iter().with_min_len(TASK_PIXELS);
        let is_opaque = pixels.clone().all(|p| p[3] == u8::MAX);
        if !is_opaque {
            return DisplayColors::Rgba(rgba);
        }
        DisplayColors::Rgb(pixels.map(|&[r, g, b, _]| [r, g, b]).collect())
    }

    /// The channels of all pixels, interleaved.
    pub fn bytes(&self) -> &[u8] {
        match self {
            DisplayColors::Rgb(rgb) => rgb.as_flattened(),
            DisplayColors::Rgba(rgba) => rgba.as_flattened(),
        }
    }

    /// True if [`DisplayColors::bytes`] have no alpha.
    pub fn is_opaque(&self) -> bool {
        matches!(self, DisplayColors::Rgb(_))
    }
}

impl<'p> From<&'p [[u8; 4]]> for DisplayColors<'p> {
    fn from(rgba: &'p [[u8; 4]]) -> DisplayColors<'p> {
        DisplayColors::from_rgba(rgba.into())
    }
}
