//! Blender's AgX view transform, for an sRGB display.
//!
//! Blender applies AgX with a 3D lookup table of 57³ nodes over log2 of the light, tetrahedrally
//! interpolated. Here the published formula computes each node when a colour first needs it. The
//! interpolation is part of the look: between nodes, saturated colours differ from the formula by up to
//! 30/255. The result is within 0.01/255 of Blender 5.0, measured on a 3D ramp of 42³ colours, greys,
//! primaries and 400,000 random colours.
//!
//! Sources of the constants (facts; none of Blender's table data is copied):
//! - `config`: Blender 5.0's `config.ocio`: colour space matrices, ranges, the inset;
//! - `eary`: <https://github.com/EaryChow/AgX_LUT_Gen>, which generates Blender's tables: matrices,
//!   outset, hue mix, gamut guard rails and their luminance weights;
//! - `troy`: the sigmoid of Jed Smith and Troy Sobotka (SB2383).

use std::sync::OnceLock;

use crate::display::agx_look;
use crate::display::agx_space::{
    EGAMUT_TO_REC2020, INSET, MID_GREY, Matrix, SCENE_TO_EGAMUT, axis, dot, guard_rec2020, min_channel, mul,
};
use crate::display::batch::{BATCH, RgbBatch, split};
use crate::display::look::Look;
use crate::display::lut3d::Lut3d;
use blinn_core::simd::{AutovecKernel, SimdLevel};

/// `eary`: the inverse of an inset by 0.323, 0.283, 0.037 without rotation, then conversion to Rec.709.
const OUTSET_TO_REC709: Matrix = [
    [1.9648940291459658, -0.8560079094511955, -0.10888611969477231],
    [-0.29930907896031905, 1.326391891529212, -0.027082812568893812],
    [-0.16435644384894169, -0.2382074020015168, 1.4025638458504575],
];
/// `eary`: luminance weights of Rec.709 for the 2015 colour matching functions.
const LUMA_REC709: [f64; 3] = [0.2103511408861092, 0.6497977702311769, 0.13985108888271428];

/// `eary`: range of the curve, in stops around mid grey; its ends map to 0 and 1.
const CURVE_STOPS: [f64; 2] = [-10.0, 6.5];
/// `troy`, `eary`: slope of the curve at its pivot. The toe and the shoulder have power 1.5.
const SLOPE: f64 = 2.4;
/// The pivot: 10 of 16.5 stops; 0.18^(1/2.4).
const PIVOT: [f64; 2] = [0.6060606060606061, 0.4894370895738783];
/// Scales of the toe and the shoulder, which end in (0, 0) and (1, 1).
const TOE: f64 = -0.5656756066543747;
const SHOULDER: f64 = 0.7151982862790444;
/// `eary`: share of the curve's hue shift that is kept.
const HUE_MIX: f64 = 0.4;
/// Exponent between light and the values of the table.
const POWER: f64 = 2.4;

fn max_channel(c: [f64; 3]) -> f64 {
    c[0].max(c[1]).max(c[2])
}

/// Returns HSV's hue in sixths of the circle; 0 for greys.
fn hue([r, g, b]: [f64; 3]) -> f64 {
    let high = max_channel([r, g, b]);
    let chroma = high - min_channel([r, g, b]);
    if chroma <= 0.0 {
        return 0.0;
    }
    if high == b {
        4.0 + (r - g) / chroma
    } else if high == g {
        2.0 + (b - r) / chroma
    } else if g < b {
        6.0 + (g - b) / chroma
    } else {
        (g - b) / chroma
    }
}

/// Returns the colour of a hue in 0…6, given its largest and smallest channel.
fn from_hue(hue: f64, high: f64, low: f64) -> [f64; 3] {
    [5.0, 3.0, 1.0].map(|n| {
        let k = if n + hue >= 6.0 { n + hue - 6.0 } else { n + hue };
        high - (high - low) * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// Gamut guard rail for Rec.709: the compensation fades as the luminance grows.
fn guard_rec709(c: [f64; 3]) -> [f64; 3] {
    let (low, luma) = (min_channel(c), dot(LUMA_REC709, c));
    if low >= 0.0 {
        return c;
    }
    let raised = luma - low;
    let fade = |y: f64| 1.0 - libm::pow(y, 0.08).min(1.0);
    let ratio = if luma >= 0.0 {
        ((luma + fade(luma) * raised) / (raised + fade(raised) * raised)).min(1.0)
    } else {
        1.0
    };
    c.map(|v| (v - low) * ratio)
}

/// `troy`: the tone curve over the normalised logarithm of the light.
fn sigmoid(x: f64) -> f64 {
    let scale = if x < PIVOT[0] { TOE } else { SHOULDER };
    let u = SLOPE * (x - PIVOT[0]) / scale;
    // u / (1 + u^1.5)^(1 / 1.5)
    let bend = 1.0 + u * u.sqrt();
    PIVOT[1] + scale * u / libm::cbrt(bend * bend)
}

/// Returns AgX's image of light in E-Gamut: Rec.709, encoded with the power 1 / 2.4.
fn formation(egamut: [f64; 3]) -> [f64; 3] {
    let c = mul(&INSET, guard_rec2020(mul(&EGAMUT_TO_REC2020, egamut)));
    let before = hue(c);
    let c = c.map(|v| {
        let stops = libm::log2(v.max(1e-30) / MID_GREY);
        let x = (stops - CURVE_STOPS[0]) / (CURVE_STOPS[1] - CURVE_STOPS[0]);
        libm::pow(sigmoid(x).max(0.0), POWER)
    });
    let mut turn = hue(c) - before;
    turn -= 6.0 * (turn / 6.0).round();
    let mixed = before + HUE_MIX * turn;
    let mixed = mixed - 6.0 * (mixed / 6.0).floor();
    let c = from_hue(mixed, max_channel(c), min_channel(c));
    let c = guard_rec709(mul(&OUTSET_TO_REC709, c));
    c.map(|v| libm::pow(v.max(0.0), 1.0 / POWER).min(1.0))
}

/// Nodes along each axis of AgX's table.
const NODES: usize = 57;

/// Returns the lookup table. Its nodes are computed on demand.
fn lut() -> &'static Lut3d<NODES> {
    static LATTICE: OnceLock<Lut3d<NODES>> = OnceLock::new();
    LATTICE.get_or_init(|| Lut3d::new(formation, axis()))
}

/// Maps scene-linear Rec.709 to display-linear Rec.709 in 0…1, with a look. NaN becomes black, infinity white.
pub(super) fn agx(simd: SimdLevel, rgb: &RgbBatch, look: Look) -> RgbBatch {
    let mut out = [[0.0; BATCH]; 3];
    simd.run(Agx { rgb: &agx_look::apply(look, rgb), lut: lut(), powers: powers(), out: &mut out });
    out
}

struct Agx<'a> {
    rgb: &'a RgbBatch,
    lut: &'static Lut3d<NODES>,
    powers: &'static [f32; STEPS + 1],
    out: &'a mut RgbBatch,
}

impl AutovecKernel for Agx<'_> {
    #[inline(always)]
    fn run(self) {
        let rgb = self.rgb;
        let mut egamut = [[0.0; BATCH]; 3];
        for (out, row) in egamut.iter_mut().zip(SCENE_TO_EGAMUT) {
            for (i, v) in out.iter_mut().enumerate() {
                // Infinities of opposite signs cancel to NaN in all three channels: black. One infinity
                // alone is white.
                *v = row[0] * rgb[0][i] + row[1] * rgb[1][i] + row[2] * rgb[2][i];
            }
        }
        for (out, formed) in self.out.iter_mut().zip(self.lut.at(&egamut)) {
            *out = to_light(self.powers, &formed);
        }
    }
}

/// Steps of the table of powers.
const STEPS: usize = 4096;

/// Returns the table of v^2.4 for v in 0…1.
fn powers() -> &'static [f32; STEPS + 1] {
    static TABLE: OnceLock<[f32; STEPS + 1]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| libm::pow(i as f64 / STEPS as f64, POWER) as f32))
}

/// Returns v^2.4 for each v in 0…1, within 1e-7, by the table.
#[inline(always)]
fn to_light(powers: &[f32; STEPS + 1], values: &[f32; BATCH]) -> [f32; BATCH] {
    let (mut low, mut rest) = ([0; BATCH], [0.0; BATCH]);
    for (i, v) in values.iter().enumerate() {
        (low[i], rest[i]) = split(v.clamp(0.0, 1.0) * STEPS as f32, (STEPS - 1) as f32);
    }
    let mut ends = [[0.0; BATCH]; 2];
    for (i, low) in low.into_iter().enumerate() {
        // As `split` has limited it.
        let low = low as usize % STEPS;
        ends[0][i] = powers[low];
        ends[1][i] = powers[low + 1];
    }
    let mut light = ends[0];
    for (i, light) in light.iter_mut().enumerate() {
        *light += (ends[1][i] - ends[0][i]) * rest[i];
    }
    light
}

#[cfg(test)]
mod tests {
    use super::super::{ViewTransform, reference};
    use super::*;
    use blinn_scene::linear_to_srgb;

    fn close(input: [f32; 3], theirs: [f32; 3]) {
        close_with(Look::None, 0.02, input, theirs);
    }

    /// `tolerance` is of 255.
    fn close_with(look: Look, tolerance: f32, input: [f32; 3], theirs: [f32; 3]) {
        let ours = SimdLevel::ALL.map(|simd| agx(simd, &input.map(|v| [v; BATCH]), look));
        assert_eq!(ours, [ours[0]; 3]);
        let ours = ours[0].map(|channel| linear_to_srgb(channel[BATCH - 1]));
        for (a, b) in ours.into_iter().zip(theirs) {
            assert!((a - b).abs() * 255.0 < tolerance, "{look:?} {input:?}: {ours:?}, not {theirs:?}");
        }
    }

    #[test]
    fn agx_matches_blender() {
        let colors = reference::agx();
        assert_eq!(colors.len(), 274);
        for color in colors {
            close(color.linear, color.encoded);
        }
    }

    #[test]
    fn looks_match_blender() {
        let colors = reference::looks();
        assert_eq!(colors.len(), 9 * 35);
        for (look, color) in colors {
            let look = Look::of_blender(look, ViewTransform::Agx).unwrap();
            close_with(look, 0.05, color.linear, color.encoded);
        }
    }

    #[test]
    fn invalid_colours_become_black_or_white() {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        for c in [[nan, 0.5, 0.5], [nan; 3], [-inf, 0.5, 0.5], [inf, -inf, 0.0], [-1.0; 3]] {
            close(c, [0.0; 3]);
        }
        for c in [[inf, 0.5, 0.5], [inf; 3], [f32::MAX; 3]] {
            close(c, [1.0; 3]);
        }
    }

    #[test]
    fn the_power_table_is_within_its_bound() {
        for i in 0..100_000 {
            let v = i as f32 / 99_999.0;
            let [light, ..] = to_light(powers(), &[v; BATCH]);
            assert!((f64::from(light) - libm::pow(f64::from(v), POWER)).abs() < 1e-7, "{v}");
        }
    }
}
