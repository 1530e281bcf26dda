//! The FLIP error of two pictures: how visible their differences are when one replaces the other.
//!
//! Source: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator for
//! Alternating Images", HPG 2020. Colours are filtered by the contrast sensitivity of the eye and compared by hue and
//! lightness; edges and points that appear or vanish amplify the error.

use std::f64::consts::{PI, SQRT_2};

use glam::DVec3;
use rayon::prelude::*;

/// Pixels per degree of the paper's viewer: 0.7 m from a monitor of 0.7 m and 3840 pixels.
pub const FLIP_PIXELS_PER_DEGREE: f64 = 67.020_643_276_582_26;

/// Exponents and knee of the paper's error mapping.
const Q_C: f64 = 0.7;
const P_C: f64 = 0.4;
const P_T: f64 = 0.95;
const Q_F: f64 = 0.5;
/// Width in degrees of the feature detectors.
const FEATURE_WIDTH: f64 = 0.082;
/// Linear sRGB to XYZ, by rows.
const XYZ: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];
/// XYZ to linear sRGB, by rows.
const RGB: [[f64; 3]; 3] = [
    [3.241_003_232_976_358_3, -1.537_398_969_488_785_3, -0.498_615_881_996_362_8],
    [-0.969_224_252_202_516_3, 1.875_929_983_695_175_7, 0.041_554_226_340_084_69],
    [0.055_639_419_851_975_41, -0.204_011_206_123_909_94, 1.057_148_977_187_533_3],
];

/// Returns the FLIP error of each pixel, from 0 to 1. Pictures are row-major, of `width` pixels a row, in sRGB-encoded
/// colours of 0…1.
pub fn flip(width: usize, old: &[DVec3], new: &[DVec3], pixels_per_degree: f64) -> Vec<f32> {
    if width == 0 || old.len() != new.len() || !old.len().is_multiple_of(width) {
        return Vec::new();
    }
    let [old, new] = [old, new].map(|pixels| Perceived::new(width, pixels, pixels_per_degree));
    let max = maximal_distance();
    let error = |i: usize| {
        let color = redistribute(color_distance(old.lab[i], new.lab[i]), max);
        let feature = (old.edges[i] - new.edges[i]).abs().max((old.points[i] - new.points[i]).abs());
        let feature = libm::pow(feature / SQRT_2, Q_F);
        libm::pow(color, 1.0 - feature) as f32
    };
    (0..old.lab.len()).into_par_iter().map(error).collect()
}

/// A picture as the eye perceives it.
struct Perceived {
    /// Filtered colours in CIELAB, with the Hunt effect.
    lab: Vec<DVec3>,
    /// Strength of edges and of points.
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Perceived {
    fn new(width: usize, pixels: &[DVec3], pixels_per_degree: f64) -> Perceived {
        let opponent: Vec<DVec3> = pixels.par_iter().map(|p| to_opponent(to_linear(*p))).collect();
        let lab = contrast_filter(width, &opponent, pixels_per_degree);
        let lightness: Vec<f64> = opponent.iter().map(|c| (c.x + 16.0) / 116.0).collect();
        let (edges, points) = detect_features(width, &lightness, pixels_per_degree);
        Perceived { lab, edges, points }
    }
}

/// Filters each channel by the contrast sensitivity of the eye, and converts to CIELAB.
fn contrast_filter(width: usize, opponent: &[DVec3], pixels_per_degree: f64) -> Vec<DVec3> {
    /// Weight and width of the Gaussians of the channels: lightness, red–green, and two of blue–yellow.
    const GAUSSIANS: [(usize, f64, f64); 4] =
        [(0, 1.0, 0.0047), (1, 1.0, 0.0053), (2, 34.1, 0.04), (2, 13.5, 0.025)];
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i64;
    let kernel = |b: f64| -> Vec<f64> {
        let squared = |i: i64| (i as f64 / pixels_per_degree) * (i as f64 / pixels_per_degree);
        (-radius..=radius).map(|i| libm::exp(-PI * PI * squared(i) / b)).collect()
    };
    let sum = |kernel: &[f64]| kernel.iter().sum::<f64>();
    // The sum of a two-dimensional kernel with its weight.
    let totals = GAUSSIANS.map(|(_, a, b)| a * (PI / b).sqrt() * sum(&kernel(b)) * sum(&kernel(b)));
    let mut filtered = vec![DVec3::ZERO; opponent.len()];
    for (i, (channel, _, b)) in GAUSSIANS.into_iter().enumerate() {
        let of_channel =
            || GAUSSIANS.iter().zip(totals).filter(|(g, _)| g.0 == channel).map(|(_, total)| total);
        let share = totals[i] / of_channel().sum::<f64>();
        let mut kernel = kernel(b);
        let total = sum(&kernel);
        kernel.iter_mut().for_each(|k| *k /= total);
        let values: Vec<f64> = opponent.iter().map(|c| c[channel]).collect();
        let blurred = convolve(width, &values, &kernel, &kernel);
        filtered.iter_mut().zip(blurred).for_each(|(out, v)| out[channel] += share * v);
    }
    let clamped = |c: DVec3| from_opponent(c).clamp(DVec3::ZERO, DVec3::ONE);
    filtered.into_par_iter().map(|c| hunt(to_lab(clamped(c)))).collect()
}

/// Returns the strength of edges and points in a picture of lightness.
fn detect_features(width: usize, lightness: &[f64], pixels_per_degree: f64) -> (Vec<f64>, Vec<f64>) {
    let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i64;
    let gauss = |i: i64| libm::exp(-((i * i) as f64) / (2.0 * deviation * deviation));
    let mut smooth: Vec<f64> = (-radius..=radius).map(gauss).collect();
    let total: f64 = smooth.iter().sum();
    smooth.iter_mut().for_each(|k| *k /= total);
    // First and second derivative, with weights of either sign that sum to 1.
    let edge = normalized((-radius..=radius).map(|i| -(i as f64) * gauss(i)).collect());
    let curvature = |i: i64| ((i * i) as f64 / (deviation * deviation) - 1.0) * gauss(i);
    let point = normalized((-radius..=radius).map(curvature).collect());
    let magnitude = |kernel: &[f64]| -> Vec<f64> {
        let across = convolve(width, lightness, kernel, &smooth);
        let down = convolve(width, lightness, &smooth, kernel);
        across.into_iter().zip(down).map(|(x, y)| (x * x + y * y).sqrt()).collect()
    };
    (magnitude(&edge), magnitude(&point))
}

/// Scales the positive and the negative weights of a kernel so that each sum to 1.
fn normalized(mut kernel: Vec<f64>) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|k| **k > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|k| **k < 0.0).sum::<f64>();
    kernel.iter_mut().for_each(|k| *k /= if *k > 0.0 { positive } else { negative });
    kernel
}

/// Correlates with a separable kernel of odd size. The pixels at the edge extend beyond it.
fn convolve(width: usize, values: &[f64], across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = values.len() / width;
    let clamped =
        |at: usize, k: usize, size: usize, end: usize| (at + k).saturating_sub(size / 2).min(end - 1);
    let row = |y: usize| {
        let row = &values[y * width..][..width];
        let weigh = move |x: usize| {
            let terms = across.iter().enumerate();
            terms.map(|(k, weight)| weight * row[clamped(x, k, across.len(), width)]).sum::<f64>()
        };
        (0..width).map(weigh)
    };
    let rows: Vec<f64> = (0..height).into_par_iter().flat_map_iter(row).collect();
    let column = |i: usize| {
        let (x, y) = (i % width, i / width);
        let terms = down.iter().enumerate();
        terms.map(|(k, weight)| weight * rows[clamped(y, k, down.len(), height) * width + x]).sum()
    };
    (0..values.len()).into_par_iter().map(column).collect()
}

fn to_linear(color: DVec3) -> DVec3 {
    let decode = |v: f64| if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) };
    DVec3::new(decode(color.x), decode(color.y), decode(color.z))
}

fn transform(matrix: &[[f64; 3]; 3], v: DVec3) -> DVec3 {
    DVec3::from(matrix.map(|row| DVec3::from(row).dot(v)))
}

/// XYZ of white.
fn white() -> DVec3 {
    transform(&XYZ, DVec3::ONE)
}

/// Linear sRGB to YCxCz.
fn to_opponent(color: DVec3) -> DVec3 {
    let xyz = transform(&XYZ, color) / white();
    DVec3::new(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
}

/// YCxCz to linear sRGB.
fn from_opponent(color: DVec3) -> DVec3 {
    let y = (color.x + 16.0) / 116.0;
    transform(&RGB, DVec3::new(y + color.y / 500.0, y, y - color.z / 200.0) * white())
}

fn to_lab(color: DVec3) -> DVec3 {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |t: f64| {
        if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let xyz = transform(&XYZ, color) / white();
    let [x, y, z] = [f(xyz.x), f(xyz.y), f(xyz.z)];
    DVec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

/// Makes dark colours less colourful.
fn hunt(lab: DVec3) -> DVec3 {
    DVec3::new(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

/// HyAB distance, raised to the exponent of the error mapping.
fn color_distance(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    libm::pow(d.x.abs() + (d.y * d.y + d.z * d.z).sqrt(), Q_C)
}

/// The distance of green and blue, the farthest colours.
fn maximal_distance() -> f64 {
    color_distance(hunt(to_lab(DVec3::Y)), hunt(to_lab(DVec3::Z)))
}

/// Maps a colour distance to an error in 0…1; small distances take most of the range.
fn redistribute(distance: f64, max: f64) -> f64 {
    let knee = P_C * max;
    let error = if distance < knee {
        P_T / knee * distance
    } else {
        P_T + (distance - knee) / (max - knee) * (1.0 - P_T)
    };
    error.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 24;
    const HEIGHT: usize = 16;

    /// Ramps of colours that `shift` displaces.
    fn picture(shift: usize) -> Vec<DVec3> {
        let value = |x: usize, y: usize, c: usize| {
            let number = (x * (c + 3) + y * (5 - c) + shift * ((x / 6 + y / 4 + c) % 3)) % 40;
            f64::from(number as u32) / 40.0
        };
        (0..WIDTH * HEIGHT).map(|i| DVec3::from([0, 1, 2].map(|c| value(i % WIDTH, i / WIDTH, c)))).collect()
    }

    #[test]
    fn equal_pictures_have_no_error_and_opposite_ones_a_large_one() {
        let a = picture(0);
        assert!(flip(WIDTH, &a, &a, FLIP_PIXELS_PER_DEGREE).iter().all(|e| *e == 0.0));
        let [green, blue] = [DVec3::Y, DVec3::Z].map(|color| vec![color; WIDTH * HEIGHT]);
        let errors = flip(WIDTH, &green, &blue, FLIP_PIXELS_PER_DEGREE);
        assert!(errors.iter().all(|e| (*e - 1.0).abs() < 1e-3), "{:?}", &errors[..3]);
        assert!(flip(0, &[], &[], 1.0).is_empty());
    }

    #[test]
    fn flip_errors_equal_the_reference() {
        let errors = flip(WIDTH, &picture(0), &picture(7), FLIP_PIXELS_PER_DEGREE);
        let mean = errors.iter().map(|e| f64::from(*e)).sum::<f64>() / errors.len() as f64;
        // NVIDIA's flip-evaluator of the same pictures: mean, and pixels (3, 2), (20, 9) and (12, 15).
        let expected = [0.554_128, 0.622_568, 0.237_859, 0.613_580];
        let at = |x: usize, y: usize| f64::from(errors[y * WIDTH + x]);
        let found = [mean, at(3, 2), at(20, 9), at(12, 15)];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 2e-4, "{found} {expected}");
        }
    }
}
