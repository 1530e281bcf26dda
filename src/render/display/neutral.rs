//! Khronos PBR Neutral tone mapping: keeps base colours and compresses only highlights.
//!
//! Source: <https://github.com/KhronosGroup/ToneMapping>, `PBR_Neutral/README.md`.

use crate::display::batch::{BATCH, RgbBatch};
use blinn_core::geometry::Rgb;

/// Fresnel reflectance of dielectrics, which the formula subtracts first.
const F90: f32 = 0.04;
/// Peak value from which highlights are compressed.
const START_COMPRESSION: f32 = 0.8 - F90;
/// How fast compressed colours lose saturation.
const DESATURATION: f32 = 0.15;

/// Maps scene-linear Rec.709 to display-linear Rec.709 in 0…1. NaN and negative values become black.
pub(super) fn pbr_neutral(light: &RgbBatch) -> RgbBatch {
    let mut shown = *light;
    for i in 0..BATCH {
        let color = map_color(Rgb::from([0, 1, 2].map(|c| light[c][i])));
        for (channel, v) in shown.iter_mut().zip(color.to_array()) {
            channel[i] = v;
        }
    }
    shown
}

fn map_color(rgb: Rgb) -> Rgb {
    // `max` returns the bound for NaN.
    let rgb = rgb.max(Rgb::ZERO).min(Rgb::splat(1e30));
    let x = rgb.min_element();
    let offset = if x <= 2.0 * F90 { x - x * x / (4.0 * F90) } else { F90 };
    let c = rgb - offset;
    let peak = c.max_element();
    if peak <= START_COMPRESSION {
        return c;
    }
    let compressed =
        1.0 - (1.0 - START_COMPRESSION) * (1.0 - START_COMPRESSION) / (peak + 1.0 - 2.0 * START_COMPRESSION);
    let g = 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    c * (compressed / peak) * g + compressed * (1.0 - g)
}

#[cfg(test)]
mod tests {
    use super::super::reference;
    use super::*;
    use blinn_scene::linear_to_srgb;

    #[test]
    fn neutral_matches_khronos() {
        for reference::Reference { linear, encoded } in reference::neutral() {
            let ours = map_color(Rgb::from(linear)).to_array().map(linear_to_srgb);
            for (a, b) in ours.into_iter().zip(encoded) {
                assert!((a - b).abs() * 255.0 < 0.02, "{linear:?}: {ours:?}, not {encoded:?}");
            }
        }
    }

    #[test]
    fn base_colours_are_kept_and_results_are_within_0_and_1() {
        // The formula subtracts the Fresnel reflectance.
        assert!(map_color(Rgb::new(0.6, 0.3, 0.2)).abs_diff_eq(Rgb::new(0.56, 0.26, 0.16), 1e-6));
        for c in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e9] {
            let shown = map_color(Rgb::new(c, 0.5, 0.1));
            assert!(shown.cmpge(Rgb::ZERO).all() && shown.cmple(Rgb::ONE).all(), "{c}: {shown}");
        }
    }
}
