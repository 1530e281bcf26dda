//! Looks of Blender's AgX: contrast, saturation and shadows, changed before the view transform.
//!
//! They work on the logarithm of light in E-Gamut, 0 to 1 over the 25 stops of AgX's table. The constants are those of Blender 5.0's
//! `config.ocio` (facts); the operators are OpenColorIO's: `GradingPrimaryTransform` of style log, `CDLTransform` and the
//! shadows of `GradingToneTransform`.

use crate::display::batch::{BATCH, RgbBatch};
use crate::display::lut3d::{LOG2, log2};

/// A look of AgX.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum Look {
    /// The view transform alone; Blender's Base Contrast is the same.
    #[default]
    None,
    /// Contrast 0.7, saturation 1.15.
    VeryLowContrast,
    /// Contrast 0.8, saturation 1.1.
    LowContrast,
    /// Contrast 0.9, saturation 1.05.
    MediumLowContrast,
    /// Contrast 1.2.
    MediumHighContrast,
    /// Contrast 1.4, saturation 0.95.
    HighContrast,
    /// Contrast 1.57, saturation 0.9.
    VeryHighContrast,
    /// Darker, with deep shadows.
    Punchy,
    /// Black and white.
    Greyscale,
}

/// The logarithm of light that contrast does not change.
const CONTRAST_PIVOT: f32 = 0.4;
/// Luminance weights of OpenColorIO's saturation.
const SATURATION_LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];
/// Luminance weights of E-Gamut.
const GREY_LUMA: [f32; 3] = [0.258_923_54, 0.610_498_55, 0.130_577_93];
/// Punchy: slopes of the shadows, one curve after the other, and the power of all.
const PUNCHY_SLOPES: [f32; 2] = [0.2, 0.35];
const PUNCHY_POWER: f32 = 1.0912;
/// Punchy: where the slope begins to change, and where shadows begin.
const SHADOWS: [f32; 2] = [0.1, 0.4];

impl Look {
    /// Returns the look that Blender calls `name`; `None` if it is another one.
    pub fn of_blender(name: &str) -> Option<Look> {
        match name.strip_prefix("AgX - ").unwrap_or(name) {
            "" | "None" | "Base Contrast" => Some(Look::None),
            "Very Low Contrast" => Some(Look::VeryLowContrast),
            "Low Contrast" => Some(Look::LowContrast),
            "Medium Low Contrast" => Some(Look::MediumLowContrast),
            "Medium High Contrast" => Some(Look::MediumHighContrast),
            "High Contrast" => Some(Look::HighContrast),
            "Very High Contrast" => Some(Look::VeryHighContrast),
            "Punchy" => Some(Look::Punchy),
            "Greyscale" => Some(Look::Greyscale),
            _ => None,
        }
    }

    /// Applies the look to linear light in E-Gamut.
    pub(super) fn apply(self, light: &mut RgbBatch) {
        let (contrast, saturation) = match self {
            Look::None => return,
            Look::VeryLowContrast => (0.7, 1.15),
            Look::LowContrast => (0.8, 1.1),
            Look::MediumLowContrast => (0.9, 1.05),
            Look::MediumHighContrast => (1.2, 1.0),
            Look::HighContrast => (1.4, 0.95),
            Look::VeryHighContrast => (1.57, 0.9),
            Look::Punchy => return map_log(light, |rgb| rgb.map(punchy)),
            Look::Greyscale => return grey(light),
        };
        map_log(light, |rgb| {
            let rgb = rgb.map(|v| (v - CONTRAST_PIVOT) * contrast + CONTRAST_PIVOT);
            let luma = dot(SATURATION_LUMA, rgb);
            rgb.map(|v| luma + saturation * (v - luma))
        });
    }
}

fn dot(weights: [f32; 3], rgb: [f32; 3]) -> f32 {
    weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
}

/// Maps the logarithms of light.
fn map_log(light: &mut RgbBatch, map: impl Fn([f32; 3]) -> [f32; 3]) {
    let range = LOG2[1] - LOG2[0];
    for i in 0..BATCH {
        // `max` turns NaN into the smallest light, `min` infinity into the largest.
        let log = [0, 1, 2].map(|c| {
            let v: f32 = light[c][i];
            (log2(v.max(f32::MIN_POSITIVE).min(f32::MAX)) - LOG2[0]) / range
        });
        let mapped = map(log);
        for c in 0..3 {
            light[c][i] = libm::exp2f(LOG2[0] + range * mapped[c].clamp(0.0, 1.0));
        }
    }
}

/// Replaces light by its luminance.
fn grey(light: &mut RgbBatch) {
    for i in 0..BATCH {
        let luma = dot(GREY_LUMA, [0, 1, 2].map(|c| light[c][i]));
        for channel in light.iter_mut() {
            channel[i] = luma;
        }
    }
}

fn punchy(v: f32) -> f32 {
    let v = PUNCHY_SLOPES.into_iter().fold(v, shadows);
    if v > 0.0 { libm::powf(v, PUNCHY_POWER) } else { v }
}

/// A curve of this slope in deep shadows, of slope 1 above them, and of slopes that change linearly in two parts between.
fn shadows(v: f32, slope: f32) -> f32 {
    let [low, high] = SHADOWS;
    let half = 0.5 * (high - low);
    // Both halves add up to the height of the part.
    let middle = 0.5 * (3.0 - slope);
    let rise = |from: f32, to: f32, x: f32| x * (from + 0.5 * (to - from) * x / half);
    if v <= low {
        low + slope * (v - low)
    } else if v <= low + half {
        low + rise(slope, middle, v - low)
    } else if v < high {
        low + rise(slope, middle, half) + rise(middle, 1.0, v - low - half)
    } else {
        v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of OpenColorIO 2.6's processor for the two shadow curves, without the power.
    #[test]
    fn shadows_are_those_of_open_color_io() {
        for (x, expected) in [
            (-0.2, 0.079),
            (0.05, 0.0965),
            (0.1, 0.1),
            (0.2, 0.1327),
            (0.3, 0.272_751_93),
            (0.4, 0.4),
            (0.9, 0.9),
        ] {
            let found = PUNCHY_SLOPES.into_iter().fold(x, shadows);
            assert!((found - expected).abs() < 1e-6, "{x}: {found}");
        }
    }

    #[test]
    fn names_are_those_of_blender() {
        assert_eq!(Look::of_blender("AgX - Punchy"), Some(Look::Punchy));
        assert_eq!(Look::of_blender("AgX - Base Contrast"), Some(Look::None));
        assert_eq!(Look::of_blender("False Color - Punchy"), None);
    }
}
