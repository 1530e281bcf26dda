//! Layers as pictures for the eye.

use super::cryptomatte::ids;
use crate::display::linear_to_srgb;
use crate::integrator::Aov;
use crate::render::{AovLayer, Matte};

/// An 8-bit picture of a layer: depth from near (bright) to far (dark) by ratios, directions as colours,
/// positions over their own range, ids as distinct colours, steps as heat from none to [`heat_map_max`], nothing
/// as black.
pub fn preview_layer(layer: &AovLayer) -> Vec<[u8; 4]> {
    let width = layer.aov.channel_count();
    let ranges: Vec<(f32, f32)> =
        (0..width).map(|i| range(layer.values.iter().skip(i).step_by(width))).collect();
    let depths = if layer.aov == Aov::Depth { near_and_far(&layer.values) } else { (1.0, 1.0) };
    let heat_map_max = if layer.aov == Aov::Steps { heat_map_max(layer) } else { 1.0 };
    let scaled = |v: f32, (low, high): (f32, f32)| if high > low { (v - low) / (high - low) } else { 0.5 };
    let nothing = |v: &[f32]| v.iter().all(|&x| x == layer.aov.miss_value());
    layer
        .values
        .chunks_exact(width)
        .map(|v| {
            if nothing(v) {
                return [0, 0, 0, 255];
            }
            let rgb = match layer.aov {
                Aov::Depth => [byte(nearness(v[0], depths)); 3],
                Aov::Normal | Aov::VertexNormal | Aov::GeometricNormal => {
                    [0, 1, 2].map(|i| byte(0.5 * v[i] + 0.5))
                }
                Aov::Position => [0, 1, 2].map(|i| byte(scaled(v[i], ranges[i]))),
                Aov::Albedo => [0, 1, 2].map(|i| byte(linear_to_srgb(v[i].clamp(0.0, 1.0)))),
                Aov::Uv => [byte(tiled(v[0])), byte(tiled(v[1])), 0],
                Aov::Mask => [byte(v[0]); 3],
                Aov::ObjectId | Aov::MaterialId => id_color(v[0] as u32),
                Aov::Steps => heat_color((v[0] + v[1]) / heat_map_max),
            };
            [rgb[0], rgb[1], rgb[2], 255]
        })
        .collect()
}

/// The steps, nodes and blocks together, that a preview of [`Aov::Steps`] shows brightest: all but one
/// pixel in two hundred are below. At least 1.
pub fn heat_map_max(layer: &AovLayer) -> f32 {
    let mut all: Vec<f32> =
        layer.values.chunks_exact(layer.aov.channel_count()).map(|v| v.iter().sum()).collect();
    all.sort_by(f32::total_cmp);
    let at = (all.len().saturating_sub(1) as f64 * 0.995).round() as usize;
    all.get(at).copied().unwrap_or(1.0).max(1.0)
}

/// Colours from 0 to 1 that grow brighter all the way: black, blue, purple, red, orange, yellow, white.
pub fn heat_color(v: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 7] = [
        [0.0, 0.0, 0.0],
        [0.09, 0.07, 0.33],
        [0.42, 0.07, 0.48],
        [0.77, 0.2, 0.3],
        [0.95, 0.48, 0.1],
        [0.98, 0.83, 0.3],
        [1.0, 1.0, 0.9],
    ];
    let place = v.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let first = (place as usize).min(STOPS.len() - 2);
    let share = place - first as f32;
    [0, 1, 2].map(|i| byte(STOPS[first][i] + share * (STOPS[first + 1][i] - STOPS[first][i])))
}

/// Depths in steps of so many metres: 1 … 65535, and 0 where nothing is hit.
pub fn quantize_depth(layer: &AovLayer, step: f64) -> Vec<u16> {
    let steps = |z: f32| (f64::from(z) / step).round().clamp(1.0, f64::from(u16::MAX)) as u16;
    layer.values.iter().map(|&z| if z.is_finite() { steps(z) } else { 0 }).collect()
}

/// Texture coordinates in 0…1, repeated outside.
fn tiled(v: f32) -> f32 {
    if (0.0..=1.0).contains(&v) { v } else { v.rem_euclid(1.0) }
}

/// The depths between which nearly all lies: one screw before the lens, or a far corner of the floor,
/// leaves the rest its contrast.
fn near_and_far(depths: &[f32]) -> (f32, f32) {
    let mut seen: Vec<f32> = depths.iter().copied().filter(|z| z.is_finite() && *z > 0.0).collect();
    seen.sort_by(f32::total_cmp);
    let at = |share: f64| seen.get((seen.len().saturating_sub(1) as f64 * share).round() as usize).copied();
    (at(0.005).unwrap_or(1.0), at(0.995).unwrap_or(1.0))
}

/// 1 near to .1 far, by ratios of distance: twice as far is as much darker everywhere.
fn nearness(z: f32, (near, far): (f32, f32)) -> f32 {
    let z = z.clamp(near, far);
    if far > near { 1.0 - 0.9 * libm::logf(z / near) / libm::logf(far / near) } else { 1.0 }
}

fn range<'a>(values: impl Iterator<Item = &'a f32>) -> (f32, f32) {
    let finite = values.filter(|v| v.is_finite());
    finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

/// Things in the colours of their names, as much of each as it covers.
pub fn preview_matte(matte: &Matte) -> Vec<[u8; 4]> {
    let colors: Vec<[f32; 3]> =
        ids(matte).into_iter().map(|id| id_color(id).map(|v| f32::from(v) / 255.0)).collect();
    let one = |i: usize| {
        let mut mixed = [0.0; 3];
        for &(id, coverage) in matte.pixel(i) {
            let color = (id as usize).checked_sub(1).and_then(|i| colors.get(i)).copied();
            for (mixed, channel) in mixed.iter_mut().zip(color.unwrap_or_default()) {
                *mixed += channel * coverage;
            }
        }
        let [r, g, b] = mixed.map(byte);
        [r, g, b, 255]
    };
    (0..matte.len()).map(one).collect()
}

fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// A colour of its own for every id, the same in every picture: each of three strengths goes through
/// the hues by steps of the golden angle, so that neighbours are far apart in either.
fn id_color(id: u32) -> [u8; 3] {
    let turn = f64::from(id / 3) * 0.618_033_988_749_895 + f64::from(id % 3) / 3.0;
    let hue = (turn - turn.floor()) * 6.0;
    let (bright, pale) = [(0.62, 0.1), (1.0, 0.15), (0.9, 0.5)][id as usize % 3];
    let channel = |shift: f64| {
        let h = (hue + shift) % 6.0;
        let full = ((h - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        (bright * (pale + (1.0 - pale) * full) * 255.0 + 0.5) as u8
    };
    [channel(0.0), channel(4.0), channel(2.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_next_to_each_other_look_different() {
        let far = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).map(|(a, b)| a.abs_diff(b)).max().unwrap() >= 24;
        for id in 1..2000 {
            for other in id + 1..id + 24 {
                assert!(far(id_color(id), id_color(other)), "{id} and {other}");
            }
            assert!(id_color(id).iter().any(|&c| c > 100), "{id} is not black");
        }
    }

    #[test]
    fn what_is_infinitely_far_is_black_and_near_is_bright() {
        let shown = preview_layer(&AovLayer { aov: Aov::Depth, values: vec![f32::INFINITY, 2.0, 3.0, 4.0] });
        let grey: Vec<u8> = shown.iter().map(|p| p[0]).collect();
        assert_eq!(grey[0], 0);
        assert!(grey[1] == 255 && grey[1] > grey[2] && grey[2] > grey[3] && grey[3] > 20, "{grey:?}");
        let none = preview_layer(&AovLayer { aov: Aov::Depth, values: vec![f32::INFINITY; 3] });
        assert!(none.iter().all(|p| *p == [0, 0, 0, 255]));
    }

    #[test]
    fn more_steps_are_brighter() {
        let values: Vec<f32> = (0..400u16).flat_map(|i| [f32::from(i), 0.0]).collect();
        let shown = preview_layer(&AovLayer { aov: Aov::Steps, values });
        let brightness = |p: &[u8; 4]| 0.3 * f32::from(p[0]) + 0.6 * f32::from(p[1]) + 0.1 * f32::from(p[2]);
        let shown: Vec<f32> = shown.iter().map(brightness).collect();
        assert!(shown.windows(2).all(|w| w[1] > w[0] - 1.0), "{shown:?}");
        assert!(shown[0] == 0.0 && shown[398] > 250.0, "{shown:?}");
        assert_eq!(heat_map_max(&AovLayer { aov: Aov::Steps, values: Vec::new() }), 1.0);
    }

    #[test]
    fn depths_are_counted_in_steps() {
        let layer = AovLayer { aov: Aov::Depth, values: vec![f32::INFINITY, 0.0, 1.0, 1.26, 1e9] };
        assert_eq!(quantize_depth(&layer, 0.5), [0, 1, 2, 3, u16::MAX]);
    }

    #[test]
    fn texture_coordinates_repeat_but_for_the_edge_at_one() {
        let shown = preview_layer(&AovLayer { aov: Aov::Uv, values: vec![1.0, 0.5, -0.25, 2.25] });
        assert_eq!(shown, [[255, 128, 0, 255], [191, 64, 0, 255]]);
    }
}
