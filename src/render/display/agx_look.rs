//! Looks of Blender's AgX: contrast, saturation and shadows, changed before the view transform.
//!
//! They work on the logarithm of light in AgX's inset primaries, 0 to 1 over the 25 stops of its table, after colours outside of
//! Rec.2020 are moved into it by a table of 37³ nodes. The constants are those of Blender 5.0's `config.ocio` (facts); the operators
//! are OpenColorIO's: `GradingPrimaryTransform` of style log, `CDLTransform` and the shadows of `GradingToneTransform`.

use std::sync::OnceLock;

use glam::{DMat3, DVec3};

use crate::display::agx_space::{self, EGAMUT_TO_REC2020, INSET, Matrix, SCENE_TO_EGAMUT};
use crate::display::batch::{BATCH, RgbBatch};
use crate::display::look::Look;
use crate::display::lut3d::{LOG2, Lut3d, log2};

/// The logarithm of light that contrast does not change.
const CONTRAST_PIVOT: f32 = 0.4;
/// Luminance weights of OpenColorIO's saturation.
const SATURATION_LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];
/// Luminance weights of the inset primaries.
const GREY_LUMA: [f32; 3] = [0.258_923_54, 0.610_498_55, 0.130_577_93];
/// Punchy: slopes of the shadows, one curve after the other, and the power of all.
const PUNCHY_SLOPES: [f32; 2] = [0.2, 0.35];
const PUNCHY_POWER: f32 = 1.0912;
/// Punchy: where the slope begins to change, and where shadows begin.
const SHADOWS: [f32; 2] = [0.1, 0.4];

/// Applies a look of AgX to scene-linear Rec.709. Looks of other views change nothing.
pub(super) fn apply(look: Look, rgb: &RgbBatch) -> RgbBatch {
    let (contrast, saturation) = match look {
        Look::None | Look::MediumContrast => return *rgb,
        Look::VeryLowContrast => (0.7, 1.15),
        Look::LowContrast => (0.8, 1.1),
        Look::MediumLowContrast => (0.9, 1.05),
        Look::BaseContrast => (1.0, 1.0),
        Look::MediumHighContrast => (1.2, 1.0),
        Look::HighContrast => (1.4, 0.95),
        Look::VeryHighContrast => (1.57, 0.9),
        Look::Punchy => return map_log(rgb, |log| log.map(punchy)),
        Look::Greyscale => {
            let grey = |log: [f32; 3]| [to_log(dot(GREY_LUMA, log.map(from_log))); 3];
            return map_log(rgb, grey);
        }
    };
    map_log(rgb, |log| {
        let log = log.map(|v| (v - CONTRAST_PIVOT) * contrast + CONTRAST_PIVOT);
        let luma = dot(SATURATION_LUMA, log);
        log.map(|v| luma + saturation * (v - luma))
    })
}

fn dot(weights: [f32; 3], rgb: [f32; 3]) -> f32 {
    weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
}

/// Maps the logarithms of light in the inset primaries of AgX.
fn map_log(rgb: &RgbBatch, map: impl Fn([f32; 3]) -> [f32; 3]) -> RgbBatch {
    let matrices = Matrices::get();
    let egamut = transformed(&SCENE_TO_EGAMUT, rgb);
    let mut light = guard().at(&egamut).map(|channel| channel.map(from_log));
    light = transformed(&matrices.to_inset, &light);
    for i in 0..BATCH {
        let log = map([0, 1, 2].map(|c| to_log(light[c][i])));
        for c in 0..3 {
            light[c][i] = from_log(log[c]);
        }
    }
    transformed(&matrices.from_inset, &light)
}

/// The logarithm of finite light, 0 to 1 over the range of the table.
fn to_log(light: f32) -> f32 {
    (log2(light.max(f32::MIN_POSITIVE)) - LOG2[0]) / (LOG2[1] - LOG2[0])
}

/// The inverse of [`to_log`].
fn from_log(v: f32) -> f32 {
    libm::exp2f(LOG2[0] + (LOG2[1] - LOG2[0]) * v)
}

fn transformed(matrix: &[[f32; 3]; 3], rgb: &RgbBatch) -> RgbBatch {
    let mut out = [[0.0; BATCH]; 3];
    for (out, row) in out.iter_mut().zip(matrix) {
        for (i, v) in out.iter_mut().enumerate() {
            *v = row[0] * rgb[0][i] + row[1] * rgb[1][i] + row[2] * rgb[2][i];
        }
    }
    out
}

/// Nodes along each axis of the table that moves colours into Rec.2020.
const NODES: usize = 37;

/// Returns the table that moves colours into Rec.2020. It has logarithms of E-Gamut.
fn guard() -> &'static Lut3d<NODES> {
    static TABLE: OnceLock<Lut3d<NODES>> = OnceLock::new();
    TABLE.get_or_init(|| Lut3d::new(guarded, agx_space::axis()))
}

/// A node of [`guard`].
fn guarded(egamut: [f64; 3]) -> [f64; 3] {
    let guarded = agx_space::guard_rec2020(agx_space::mul(&EGAMUT_TO_REC2020, egamut));
    let back = dmat3(&EGAMUT_TO_REC2020).inverse() * DVec3::from_array(guarded);
    let [low, high] = LOG2.map(f64::from);
    back.to_array().map(|v| (libm::log2(v.max(f64::MIN_POSITIVE)) - low) / (high - low))
}

/// Matrices between E-Gamut, the inset primaries and Rec.709.
struct Matrices {
    to_inset: [[f32; 3]; 3],
    from_inset: [[f32; 3]; 3],
}

impl Matrices {
    fn get() -> &'static Matrices {
        static MATRICES: OnceLock<Matrices> = OnceLock::new();
        MATRICES.get_or_init(|| {
            let to_inset = dmat3(&INSET) * dmat3(&EGAMUT_TO_REC2020);
            let scene_to_egamut = dmat3(&SCENE_TO_EGAMUT.map(|row| row.map(f64::from)));
            let from_inset = (to_inset * scene_to_egamut).inverse();
            let rows = |m: DMat3| [0, 1, 2].map(|i| m.row(i).to_array().map(|v| v as f32));
            Matrices { to_inset: rows(to_inset), from_inset: rows(from_inset) }
        })
    }
}

/// A matrix by its rows.
fn dmat3(rows: &Matrix) -> DMat3 {
    DMat3::from_cols_array_2d(rows).transpose()
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

    /// Values of OpenColorIO 2.6's processor for the two shadow curves, without the power.
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
}
