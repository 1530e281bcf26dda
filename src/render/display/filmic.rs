//! Blender's Filmic view transform without a look, the default before version 4.0. `filmic_look` has the looks.
//!
//! Filmic takes the logarithm of the light, fades colours that are brighter than 6 stops above mid grey towards white, and
//! applies a contrast curve to 16.5 stops. The fading is exact (2e-4/255 at the nodes of Blender's table), and the curve,
//! AgX's sigmoid with other constants, is within 0.75/255 of Blender's table of 4096 values. None of Blender's table data is
//! copied.
//!
//! Source: Blender 5.0's `config.ocio`, Filmic by Troy Sobotka.

use std::sync::OnceLock;

use crate::display::batch::{BATCH, RgbBatch};
use crate::display::lut3d::log2;
use blinn_scene::srgb_to_linear;

/// log2 of the light at both ends of the curve: 10 stops below mid grey, 6.5 above.
pub(super) const LOG2: [f32; 2] = [-12.473_931, 4.026_069];
/// Light from which, and at which entirely, colours are white: 6 and 15 stops above mid grey.
const FADE: [f64; 2] = [0.18 * 64.0, 0.18 * 32768.0];
const FADE_POWER: f64 = 1.1;

/// The pivot of the curve, and its slope there.
const PIVOT: [f64; 2] = [0.635_436, 0.564_164];
const SLOPE: f64 = 2.176_294;
/// Powers of the toe, which ends in (0, 0), and of the shoulder, which ends in (1, 1).
const POWERS: [f64; 2] = [2.752_349, 2.670_544];

/// Maps scene-linear Rec.709 to display-linear Rec.709 in 0…1. NaN and negative values become black.
pub(super) fn filmic(light: &RgbBatch) -> RgbBatch {
    // NaN compares false and becomes 0.
    let mut faded = light.map(|channel| channel.map(|v| if v > 0.0 { v.min(f32::MAX) } else { 0.0 }));
    for i in 0..BATCH {
        let peak = faded[0][i].max(faded[1][i]).max(faded[2][i]);
        if f64::from(peak) > FADE[0] {
            let weight = fade(peak);
            faded.iter_mut().for_each(|channel| channel[i] += weight * (peak - channel[i]));
        }
    }
    faded.map(|channel| channel.map(curve))
}

/// Returns how far a colour with this largest channel is faded to white.
pub(super) fn fade(peak: f32) -> f32 {
    let share = (f64::from(peak) - FADE[0]) / (FADE[1] - FADE[0]);
    libm::pow(share.clamp(0.0, 1.0), FADE_POWER) as f32
}

/// Returns the display-linear value of light, by a table over its logarithm.
fn curve(light: f32) -> f32 {
    const STEPS: usize = 4096;
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let value = |i| srgb_to_linear(sigmoid(i as f64 / STEPS as f64) as f32);
    let table = TABLE.get_or_init(|| (0..=STEPS).map(value).collect());
    let position = (log2(light.max(f32::MIN_POSITIVE)) - LOG2[0]) / (LOG2[1] - LOG2[0]);
    let x = position.clamp(0.0, 1.0) * STEPS as f32;
    let low = (x as usize).min(STEPS - 1);
    table[low] + (table[low + 1] - table[low]) * (x - low as f32)
}

/// The contrast curve over the normalised logarithm of the light; sRGB-encoded.
fn sigmoid(x: f64) -> f64 {
    let [px, py] = PIVOT;
    let (run, rise, power, sign) =
        if x < px { (px, py, POWERS[0], -1.0) } else { (1.0 - px, 1.0 - py, POWERS[1], 1.0) };
    // The scale with which the curve reaches its end.
    let scale = libm::pow(libm::pow(rise, -power) - libm::pow(SLOPE * run, -power), -1.0 / power);
    let u = SLOPE * (x - px).abs() / scale;
    py + sign * scale * u / libm::pow(1.0 + libm::pow(u, power), 1.0 / power)
}

#[cfg(test)]
mod tests {
    use super::super::reference;
    use super::*;
    use blinn_scene::linear_to_srgb;

    fn encoded(input: [f32; 3]) -> [f32; 3] {
        filmic(&input.map(|v| [v; BATCH])).map(|channel| linear_to_srgb(channel[BATCH - 1]))
    }

    #[test]
    fn filmic_matches_blender() {
        let colors = reference::filmic();
        assert!(colors.len() > 200);
        for color in colors {
            let ours = encoded(color.linear);
            for (a, b) in ours.into_iter().zip(color.encoded) {
                assert!((a - b).abs() * 255.0 < 0.8, "{:?}: {ours:?}, not {:?}", color.linear, color.encoded);
            }
        }
    }

    #[test]
    fn the_curve_rises_from_black_to_white() {
        let curve: Vec<f64> = (0..=1000).map(|i| sigmoid(f64::from(i) / 1000.0)).collect();
        assert!(curve.is_sorted() && curve[0].abs() < 1e-9 && (curve[1000] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn invalid_colours_become_black_or_white() {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        for color in [[nan; 3], [-1.0; 3], [0.0; 3], [-inf; 3]] {
            assert_eq!(encoded(color), [0.0; 3], "{color:?}");
        }
        for color in [[inf; 3], [inf, 0.0, 0.0], [f32::MAX; 3], [nan, inf, 1.0]] {
            assert!(encoded(color).iter().all(|v| (1.0 - v).abs() < 1e-6), "{color:?}");
        }
    }
}
