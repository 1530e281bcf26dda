//! Previews of AOV layers and mattes: 8-bit images for the eye, and quantized depth.

use super::cryptomatte::Cryptomatte;
use blinn_render::display::linear_to_srgb;
use blinn_render::integrator::Aov;
use blinn_render::{AovLayer, Matte};

/// The smallest and largest of some values.
#[derive(Clone, Copy)]
struct Range {
    min: f32,
    max: f32,
}

impl Range {
    /// The range of the finite values.
    fn of<'a>(values: impl Iterator<Item = &'a f32>) -> Range {
        let empty = Range { min: f32::INFINITY, max: f32::NEG_INFINITY };
        values
            .filter(|v| v.is_finite())
            .fold(empty, |range, &v| Range { min: range.min.min(v), max: range.max.max(v) })
    }

    /// Maps the range to 0…1.
    fn normalize(self, v: f32) -> f32 {
        if self.max > self.min { (v - self.min) / (self.max - self.min) } else { 0.5 }
    }
}

/// Renders a layer as 8-bit RGBA: depth logarithmically from near (bright) to far (dark), directions as colours,
/// positions relative to their range, ids as distinct colours, traversal steps as a heat map from 0 to
/// [`heat_map_max`], flow by direction (hue) and length (saturation), darker where the other frame does not see the
/// point. Pixels without a hit are black.
pub fn preview_layer(layer: &AovLayer) -> Vec<[u8; 4]> {
    let channels = layer.aov.channel_count();
    let ranges: Vec<Range> =
        (0..channels).map(|i| Range::of(layer.values.iter().skip(i).step_by(channels))).collect();
    let depths =
        if layer.aov.is_distance() { depth_range(&layer.values) } else { Range { min: 1.0, max: 1.0 } };
    let max_steps = if layer.aov == Aov::Steps { heat_map_max(layer) } else { 1.0 };
    let max_flow = if layer.aov.is_flow() { max_flow(&layer.values) } else { 1.0 };
    let is_miss = |v: &[f32]| v.iter().all(|&x| x == layer.aov.miss_value());
    layer
        .values
        .chunks_exact(channels)
        .map(|v| {
            if is_miss(v) {
                return [0, 0, 0, 255];
            }
            let rgb = match layer.aov {
                Aov::Depth | Aov::Distance => [to_byte(depth_brightness(v[0], depths)); 3],
                Aov::Normal | Aov::VertexNormal | Aov::GeometricNormal | Aov::CameraNormal => {
                    [0, 1, 2].map(|i| to_byte(0.5 * v[i] + 0.5))
                }
                Aov::Position | Aov::CameraPosition => [0, 1, 2].map(|i| to_byte(ranges[i].normalize(v[i]))),
                _ if layer.aov.light().is_some() => {
                    [0, 1, 2].map(|i| to_byte(linear_to_srgb(v[i].clamp(0.0, 1.0))))
                }
                Aov::Albedo => [0, 1, 2].map(|i| to_byte(linear_to_srgb(v[i].clamp(0.0, 1.0)))),
                Aov::Uv => [to_byte(wrap_repeat(v[0])), to_byte(wrap_repeat(v[1])), 0],
                Aov::Mask => [to_byte(v[0]); 3],
                Aov::ObjectId | Aov::MaterialId | Aov::TriangleId => id_color(layer.aov.id(v[0])),
                Aov::Nocs | Aov::Barycentric => [0, 1, 2].map(|i| to_byte(v[i])),
                Aov::FlowForward | Aov::FlowBackward => flow_color([v[0], v[1]], v[2], max_flow),
                _ => heat_color((v[0] + v[1]) / max_steps),
            };
            [rgb[0], rgb[1], rgb[2], 255]
        })
        .collect()
}

/// The length of the longest flow of a layer, in pixels; 1 if nothing moves.
fn max_flow(values: &[f32]) -> f32 {
    let longest = values.chunks_exact(3).map(|v| libm::hypotf(v[0], v[1])).fold(0.0, f32::max);
    if longest > 0.0 && longest.is_finite() { longest } else { 1.0 }
}

/// The colour of a flow: white where nothing moves, and of the hue of the direction where it is longest.
fn flow_color([x, y]: [f32; 2], visibility: f32, longest: f32) -> [u8; 3] {
    let hue = (libm::atan2(f64::from(y), f64::from(x)) / std::f64::consts::TAU).rem_euclid(1.0) * 6.0;
    let saturation = f64::from((libm::hypotf(x, y) / longest).min(1.0));
    let brightness = if visibility > 0.0 { 1.0 } else { 0.4 };
    let channel = |shift: f64| {
        let pure = hue_channel(hue + shift);
        to_byte((brightness * (1.0 - saturation * (1.0 - pure))) as f32)
    };
    [channel(0.0), channel(4.0), channel(2.0)]
}

/// The red channel of a hue in 0…6; the other channels are those of shifted hues.
fn hue_channel(hue: f64) -> f64 {
    ((hue % 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0)
}

/// The number of traversal steps (nodes and blocks) of the brightest colour in the heat map of an [`Aov::Steps`]
/// layer: the 99.5th percentile of all pixels, at least 1.
pub fn heat_map_max(layer: &AovLayer) -> f32 {
    let mut steps: Vec<f32> =
        layer.values.chunks_exact(layer.aov.channel_count()).map(|v| v.iter().sum()).collect();
    steps.sort_by(f32::total_cmp);
    percentile(&steps, 0.995).unwrap_or(1.0).max(1.0)
}

/// The value at `fraction` of a sorted list.
fn percentile(sorted: &[f32], fraction: f64) -> Option<f32> {
    sorted.get((sorted.len().saturating_sub(1) as f64 * fraction).round() as usize).copied()
}

/// The heat map's colour of a value in 0…1, of increasing brightness: black, blue, purple, red, orange, yellow,
/// white.
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
    let position = v.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let first = (position as usize).min(STOPS.len() - 2);
    let t = position - first as f32;
    [0, 1, 2].map(|i| to_byte(STOPS[first][i] + t * (STOPS[first + 1][i] - STOPS[first][i])))
}

/// Quantizes depth to steps of `step` metres in 1…65535; 0 where nothing is hit.
pub fn quantize_depth(layer: &AovLayer, step: f64) -> Vec<u16> {
    let steps = |z: f32| (f64::from(z) / step).round().clamp(1.0, f64::from(u16::MAX)) as u16;
    layer.values.iter().map(|&z| if z.is_finite() { steps(z) } else { 0 }).collect()
}

/// Wraps a texture coordinate to 0…1. 1 stays 1.
fn wrap_repeat(v: f32) -> f32 {
    if (0.0..=1.0).contains(&v) { v } else { v.rem_euclid(1.0) }
}

/// The range of depth without its outer percentiles: one screw before the lens, or a far corner of the floor,
/// must not cost the rest its contrast.
fn depth_range(depths: &[f32]) -> Range {
    let mut hits: Vec<f32> = depths.iter().copied().filter(|z| z.is_finite() && *z > 0.0).collect();
    hits.sort_by(f32::total_cmp);
    Range { min: percentile(&hits, 0.005).unwrap_or(1.0), max: percentile(&hits, 0.995).unwrap_or(1.0) }
}

/// Brightness from 1 (near) to 0.1 (far), logarithmic: twice the depth is darker by the same step everywhere.
fn depth_brightness(z: f32, range: Range) -> f32 {
    let Range { min: near, max: far } = range;
    let z = z.clamp(near, far);
    if far > near { 1.0 - 0.9 * libm::logf(z / near) / libm::logf(far / near) } else { 1.0 }
}

/// Renders a matte as 8-bit RGBA: the colours of the ids, weighted by coverage.
pub fn preview_matte(matte: &Matte) -> Vec<[u8; 4]> {
    let ids = Cryptomatte::new(matte).into_ids();
    let colors: Vec<[f32; 3]> =
        ids.into_iter().map(|id| id_color(id).map(|v| f32::from(v) / 255.0)).collect();
    let pixel = |i: usize| {
        let mut sum = [0.0; 3];
        for &(id, coverage) in matte.pixel(i) {
            let color = (id as usize).checked_sub(1).and_then(|i| colors.get(i)).copied();
            for (sum, channel) in sum.iter_mut().zip(color.unwrap_or_default()) {
                *sum += channel * coverage;
            }
        }
        let [r, g, b] = sum.map(to_byte);
        [r, g, b, 255]
    };
    (0..matte.len()).map(pixel).collect()
}

fn to_byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// A distinct colour for an id, the same in every image. The hue advances by the golden angle, and three
/// combinations of brightness and saturation alternate, so that successive ids are far apart.
pub(super) fn id_color(id: u32) -> [u8; 3] {
    const INV_GOLDEN_RATIO: f64 = 0.618_033_988_749_895;
    let turn = f64::from(id / 3) * INV_GOLDEN_RATIO + f64::from(id % 3) / 3.0;
    let hue = (turn - turn.floor()) * 6.0;
    let (brightness, whiteness) = [(0.62, 0.1), (1.0, 0.15), (0.9, 0.5)][id as usize % 3];
    let channel = |shift: f64| {
        let pure = hue_channel(hue + shift);
        (brightness * (whiteness + (1.0 - whiteness) * pure) * 255.0 + 0.5) as u8
    };
    [channel(0.0), channel(4.0), channel(2.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn successive_ids_have_distinct_colours() {
        let far = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).map(|(a, b)| a.abs_diff(b)).max().unwrap() >= 24;
        for id in 1..2000 {
            for other in id + 1..id + 24 {
                assert!(far(id_color(id), id_color(other)), "{id} and {other}");
            }
            assert!(id_color(id).iter().any(|&c| c > 100), "{id} is not black");
        }
    }

    #[test]
    fn depth_is_bright_near_dark_far_and_black_where_nothing_is_hit() {
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
    fn depth_is_quantized() {
        let layer = AovLayer { aov: Aov::Depth, values: vec![f32::INFINITY, 0.0, 1.0, 1.26, 1e9] };
        assert_eq!(quantize_depth(&layer, 0.5), [0, 1, 2, 3, u16::MAX]);
    }

    #[test]
    fn texture_coordinates_wrap_but_one_stays_one() {
        let shown = preview_layer(&AovLayer { aov: Aov::Uv, values: vec![1.0, 0.5, -0.25, 2.25] });
        assert_eq!(shown, [[255, 128, 0, 255], [191, 64, 0, 255]]);
    }
}
