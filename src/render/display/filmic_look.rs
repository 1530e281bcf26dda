//! Looks of Blender's Filmic: other contrast curves.
//!
//! A look maps light to the logarithm that Filmic's curve is for, bright colours faded to white, applies its own curve and
//! then the inverse of Filmic's, and returns to light. Views other than Filmic show that light as any other. Blender
//! interpolates the fading in a table of 33³ nodes, which is part of the look.
//!
//! Each curve is two cubic Bézier curves, which meet where mid grey is one half: within 0.2/255 of Blender's tables of
//! 4096 values. None of their data is copied.
//!
//! Source: Blender 5.0's `config.ocio`, Filmic by Troy Sobotka.

use std::sync::OnceLock;

use crate::display::batch::RgbBatch;
use crate::display::filmic::{self, fade};
use crate::display::look::Look;
use crate::display::lut3d::{self, Lut3d};
use blinn_scene::srgb_to_linear;

/// A contrast curve from (0, 0) over [`MIDDLE`] to (1, 1).
struct Curve {
    /// The two inner control points of the lower half.
    toe: [[f64; 2]; 2],
    /// The two inner control points of the upper half.
    shoulder: [[f64; 2]; 2],
}

/// Mid grey, 10 of 16.5 stops, and its encoded value.
const MIDDLE: [f64; 2] = [10.0 / 16.5, 0.5];

/// The curve of Filmic itself.
const BASE: Curve = Curve {
    toe: [[0.3316, 0.01704], [0.43198, 0.10446]],
    shoulder: [[0.73256, 0.78389], [0.81481, 0.97194]],
};

const CURVES: [(Look, Curve); 6] = [
    (
        Look::VeryLowContrast,
        Curve {
            toe: [[0.28027, 0.06834], [0.43672, 0.22311]],
            shoulder: [[0.75014, 0.71053], [0.86153, 0.93105]],
        },
    ),
    (
        Look::LowContrast,
        Curve {
            toe: [[0.29571, 0.04515], [0.43008, 0.18324]],
            shoulder: [[0.73813, 0.7255], [0.84154, 0.93688]],
        },
    ),
    (
        Look::MediumLowContrast,
        Curve {
            toe: [[0.31464, 0.0277], [0.42883, 0.14159]],
            shoulder: [[0.73351, 0.75134], [0.826, 0.95102]],
        },
    ),
    (
        Look::MediumHighContrast,
        Curve {
            toe: [[0.35626, 0.00812], [0.43711, 0.05889]],
            shoulder: [[0.73068, 0.82402], [0.80178, 0.97804]],
        },
    ),
    (
        Look::HighContrast,
        Curve {
            toe: [[0.37895, 0.00466], [0.446, 0.02128]],
            shoulder: [[0.72886, 0.86791], [0.79107, 0.99106]],
        },
    ),
    (
        Look::VeryHighContrast,
        Curve {
            toe: [[0.41099, 0.00419], [0.45785, -0.01965]],
            shoulder: [[0.72288, 0.91225], [0.77745, 0.98772]],
        },
    ),
];

/// The index of the coordinates of a curve: the logarithm of light, and the encoded value.
const LOG: usize = 0;
const ENCODED: usize = 1;

impl Curve {
    /// Returns coordinate `to` of the point whose coordinate `from` is `v` in 0…1. Both rise along the curve.
    fn at(&self, v: f64, from: usize, to: usize) -> f64 {
        let points = if v < MIDDLE[from] {
            [[0.0; 2], self.toe[0], self.toe[1], MIDDLE]
        } else {
            [MIDDLE, self.shoulder[0], self.shoulder[1], [1.0; 2]]
        };
        let coordinate = |t: f64, c: usize| {
            let [a, b, d, e] = points.map(|point| point[c]);
            let s = 1.0 - t;
            s * s * s * a + 3.0 * s * s * t * b + 3.0 * s * t * t * d + t * t * t * e
        };
        // Bisects, as a table has few points.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if coordinate(middle, from) < v {
                low = middle;
            } else {
                high = middle;
            }
        }
        coordinate(0.5 * (low + high), to)
    }
}

/// A function by a table over 0…1, linearly interpolated; constant beyond.
struct Table(Vec<f32>);

impl Table {
    const STEPS: usize = 4096;

    fn new(function: impl Fn(f64) -> f64) -> Table {
        Table((0..=Table::STEPS).map(|i| function(i as f64 / Table::STEPS as f64) as f32).collect())
    }

    fn at(&self, x: f32) -> f32 {
        let x = x.clamp(0.0, 1.0) * Table::STEPS as f32;
        let low = (x as usize).min(Table::STEPS - 1);
        self.0[low] + (self.0[low + 1] - self.0[low]) * (x - low as f32)
    }
}

/// Applies a look of Filmic to scene-linear Rec.709. Looks of AgX alone change nothing.
pub(super) fn apply(look: Look, light: &RgbBatch) -> RgbBatch {
    static TABLES: [OnceLock<Table>; CURVES.len()] = [const { OnceLock::new() }; CURVES.len()];
    let [low, high] = filmic::LOG2;
    let from_log = |x: f32| libm::exp2f(low + (high - low) * x);
    if look == Look::MediumContrast {
        // Without a table nothing limits bright light.
        return to_log(light).map(|channel| channel.map(from_log));
    }
    let Some(index) = CURVES.iter().position(|(of, _)| *of == look) else {
        return *light;
    };
    let curve = &CURVES[index].1;
    let contrast = |x| BASE.at(curve.at(x, LOG, ENCODED), ENCODED, LOG);
    let table = TABLES[index].get_or_init(|| Table::new(contrast));
    to_log(light).map(|channel| channel.map(|x| from_log(table.at(x))))
}

/// Maps scene-linear light with a look to display-linear Rec.709 in 0…1, as Filmic does.
pub(super) fn filmic(light: &RgbBatch) -> RgbBatch {
    static TABLE: OnceLock<Table> = OnceLock::new();
    let display = |x| f64::from(srgb_to_linear(BASE.at(x, LOG, ENCODED) as f32));
    let table = TABLE.get_or_init(|| Table::new(display));
    to_log(light).map(|channel| channel.map(|x| table.at(x)))
}

/// Nodes along each axis of the table that fades bright colours.
const NODES: usize = 33;

/// Returns the logarithm of faded light, 0 to 1 over the stops of the curves and above 1 beyond. NaN counts as black.
fn to_log(light: &RgbBatch) -> RgbBatch {
    static FADED: OnceLock<Lut3d<NODES>> = OnceLock::new();
    let lut = FADED.get_or_init(|| Lut3d::new(faded, axis()));
    let stops = |[low, high]: [f32; 2]| high - low;
    let scale = stops(lut3d::LOG2) / stops(filmic::LOG2);
    lut.at(light).map(|channel| channel.map(|v| v * scale))
}

/// Light of each node along an axis.
fn axis() -> [f64; NODES] {
    let [low, high] = lut3d::LOG2.map(f64::from);
    std::array::from_fn(|i| libm::exp2(low + (high - low) * i as f64 / (NODES - 1) as f64))
}

/// Returns a node: the logarithm of faded light, 0 to 1 over the stops of the table.
fn faded(light: [f64; 3]) -> [f64; 3] {
    let peak = light[0].max(light[1]).max(light[2]);
    let weight = f64::from(fade(peak as f32));
    let [low, high] = lut3d::LOG2.map(f64::from);
    light.map(|v| (libm::log2(v + weight * (peak - v)) - low) / (high - low))
}

#[cfg(test)]
mod tests {
    use super::super::{Display, ViewTransform, reference};
    use super::*;
    use crate::Pixels;
    use crate::display::batch::BATCH;
    use blinn_core::geometry::Rgba;

    #[test]
    fn looks_match_blender() {
        let colors = reference::filmic_looks();
        assert_eq!(colors.len(), 7 * 2 * 60);
        for (view, look, color) in colors {
            let view = match view {
                "Filmic" => ViewTransform::Filmic,
                "Standard" => ViewTransform::Standard,
                _ => panic!("{view}"),
            };
            let display = Display { view, look: Look::of_blender(look, view).unwrap(), ..Display::default() };
            let [r, g, b] = color.linear;
            let pixels = Pixels { width: 1, height: 1, colors: vec![Rgba::new(r, g, b, 1.0)] };
            let ours = display.to_rgba16(&pixels)[0].map(|v| f32::from(v) / 65535.0);
            for (a, b) in ours.into_iter().zip(color.encoded) {
                let error = (a - b).abs() * 255.0;
                assert!(error < 0.3, "{view:?} {look} {:?}: {ours:?}, not {:?}", color.linear, color.encoded);
            }
        }
    }

    #[test]
    fn curves_rise_from_black_to_white() {
        for (look, curve) in &CURVES {
            let values: Vec<f64> =
                (0..=4096).map(|i| curve.at(f64::from(i) / 4096.0, LOG, ENCODED)).collect();
            assert!(values.is_sorted(), "{look:?}");
            assert!(values[0].abs() < 1e-9 && (values[4096] - 1.0).abs() < 1e-9, "{look:?}");
        }
    }

    #[test]
    fn medium_contrast_is_the_curve_of_filmic() {
        let light = [[0.002; BATCH], [0.18; BATCH], [3.0; BATCH]];
        for (looked, light) in apply(Look::MediumContrast, &light).into_iter().zip(light) {
            assert!((looked[0] / light[0] - 1.0).abs() < 1e-3, "{looked:?}, not {light:?}");
        }
    }

    #[test]
    fn invalid_light_becomes_black_or_white() {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        let shown = |v: f32| filmic(&apply(Look::HighContrast, &[[v; BATCH]; 3]));
        for v in [nan, -inf, -1.0, 0.0] {
            assert!(shown(v).iter().flatten().all(|v| v.abs() < 1e-6), "{v}");
        }
        for v in [inf, f32::MAX] {
            assert!(shown(v).iter().flatten().all(|v| (1.0 - v).abs() < 1e-6), "{v}");
        }
    }
}
