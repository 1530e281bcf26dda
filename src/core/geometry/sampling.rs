//! Maps from the unit square to discs and hemispheres, for sampling area lights and ambient occlusion.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::{DVec2, DVec3};

use super::coordinate_system;
use super::trigonometry::cos_sin_of_eighth;

/// Maps the unit square to the unit disc. Equal areas stay equal and neighbours stay neighbours
/// (Shirley and Chiu, “A Low Distortion Map Between Disk and Square”, JGT 2(3), 1997).
///
/// There are no branches, so that compilers can vectorise loops over many points.
#[inline(always)]
pub fn concentric_disc(u: [f32; 2]) -> DVec2 {
    let [x, y] = u.map(|u| 2.0 * f64::from(u) - 1.0);
    // In the right and the left quarter of the square, x is the radius.
    let is_beside = x.abs() > y.abs();
    let (r, other) = if is_beside { (x, y) } else { (y, x) };
    let ratio = other / r;
    // 0/0 in the middle.
    let ratio = if r == 0.0 { 0.0 } else { ratio };
    let [cos, sin] = cos_sin_of_eighth(FRAC_PI_4 * ratio);
    let (along, across) = (r * cos, r * sin);
    if is_beside { DVec2::new(along, across) } else { DVec2::new(across, along) }
}

/// Maps the unit square to cosine-weighted directions around the unit vector `n`: the disc projected
/// up to the hemisphere (Malley's method). The directions have unit length up to rounding.
#[inline(always)]
pub fn cosine_hemisphere(n: DVec3, u: [f32; 2]) -> DVec3 {
    let p = concentric_disc(u);
    let up2 = 1.0 - p.length_squared();
    let up = if up2 > 0.0 { up2 } else { 0.0 }.sqrt();
    let (a, b) = coordinate_system(n);
    a * p.x + b * p.y + n * up
}

/// Returns the cosine and the sine of `i` golden angles after `offset` turns. With equal steps of an area they spread points
/// evenly over a disc.
pub fn golden_angle(i: u32, offset: f64) -> [f64; 2] {
    const INV_GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
    let turns = f64::from(i) * INV_GOLDEN_RATIO + offset;
    let angle = TAU * (turns - turns.floor());
    [libm::cos(angle), libm::sin(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The centres of an n × n grid of cells.
    fn grid(n: u16) -> impl Iterator<Item = [f32; 2]> {
        let at = move |i: u16| (f32::from(i) + 0.5) / f32::from(n);
        (0..n).flat_map(move |i| (0..n).map(move |j| [at(i), at(j)]))
    }

    #[test]
    fn the_disc_is_sampled_uniformly() {
        let points: Vec<_> = grid(200).map(concentric_disc).collect();
        assert!(points.iter().all(|p| p.length() < 1.0));
        // A radius r encloses r² of the area.
        for r in [0.1f64, 0.5, 0.9] {
            let inside = points.iter().filter(|p| p.length() < r).count() as f64 / 40_000.0;
            assert!((inside - r * r).abs() < 0.004, "{r}: {inside}");
        }
        let mean = points.iter().sum::<DVec2>() / 40_000.0;
        assert!(mean.length() < 1e-9);
        let right = points.iter().filter(|p| p.x > 0.5).count() as f64 / 40_000.0;
        let segment = (0.5f64.acos() - 0.5 * 0.75f64.sqrt()) / std::f64::consts::PI;
        assert!((right - segment).abs() < 0.004, "{right} {segment}");
        assert_eq!(concentric_disc([0.5, 0.5]), DVec2::ZERO);
    }

    #[test]
    fn hemisphere_directions_are_cosine_weighted() {
        for n in [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.6, -0.48, 0.64)] {
            // The mean cosine of cosine-weighted directions is 2/3; the mean of its square is 1/2.
            let cosines: Vec<f64> = grid(100).map(|u| cosine_hemisphere(n, u).dot(n)).collect();
            assert!(cosines.iter().all(|c| (0.0..=1.0 + 1e-12).contains(c)));
            let mean = |f: fn(f64) -> f64| cosines.iter().map(|&c| f(c)).sum::<f64>() / 10_000.0;
            assert!((mean(|c| c) - 2.0 / 3.0).abs() < 1e-3 && (mean(|c| c * c) - 0.5).abs() < 1e-3);
        }
    }
}
