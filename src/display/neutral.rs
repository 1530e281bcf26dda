//! Khronos PBR Neutral, which keeps base colours as they are and compresses highlights alone.
//!
//! Source: <https://github.com/KhronosGroup/ToneMapping>, `PBR_Neutral/README.md`.

use super::{AT_ONCE, Lights};
use crate::geometry::Rgb;

/// Reflectance of dielectrics seen along the surface, which is taken off first.
const F90: f32 = 0.04;
/// Where compression starts.
const START: f32 = 0.8 - F90;
/// How fast compressed colours lose their saturation.
const DESATURATION: f32 = 0.15;

/// Scene-linear Rec.709 to display-linear Rec.709 in 0…1. NaN and negatives are black.
pub(super) fn pbr_neutral(light: &Lights) -> Lights {
    let mut shown = *light;
    for i in 0..AT_ONCE {
        let color = one(Rgb::from([0, 1, 2].map(|c| light[c][i])));
        for (channel, v) in shown.iter_mut().zip(color.to_array()) {
            channel[i] = v;
        }
    }
    shown
}

fn one(rgb: Rgb) -> Rgb {
    // NaN fails max in favour of the bound.
    let rgb = rgb.max(Rgb::ZERO).min(Rgb::splat(1e30));
    let x = rgb.min_element();
    let offset = if x <= 2.0 * F90 { x - x * x / (4.0 * F90) } else { F90 };
    let c = rgb - offset;
    let peak = c.max_element();
    if peak <= START {
        return c;
    }
    let compressed = 1.0 - (1.0 - START) * (1.0 - START) / (peak + 1.0 - 2.0 * START);
    let g = 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    c * (compressed / peak) * g + compressed * (1.0 - g)
}

#[cfg(test)]
mod tests {
    use super::super::reference;
    use super::*;
    use crate::scene::linear_to_srgb;

    #[test]
    fn it_is_khronoss() {
        for reference::Reference { linear, encoded } in reference::neutral() {
            let ours = one(Rgb::from(linear)).to_array().map(linear_to_srgb);
            for (a, b) in ours.into_iter().zip(encoded) {
                assert!((a - b).abs() * 255.0 < 0.02, "{linear:?}: {ours:?}, not {encoded:?}");
            }
        }
    }

    #[test]
    fn base_colours_stay_and_everything_is_within_bounds() {
        // Less the reflectance at the surface, as the formula's text says.
        assert!(one(Rgb::new(0.6, 0.3, 0.2)).abs_diff_eq(Rgb::new(0.56, 0.26, 0.16), 1e-6));
        for c in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e9] {
            let shown = one(Rgb::new(c, 0.5, 0.1));
            assert!(shown.cmpge(Rgb::ZERO).all() && shown.cmple(Rgb::ONE).all(), "{c}: {shown}");
        }
    }
}
