//! Layers as pictures for the eye.

use crate::integrator::Aov;
use crate::render::Layer;

/// An 8-bit picture of a layer: depth from near (bright) to far (dark), directions as colours,
/// positions over their own range, ids as distinct colours, nothing as black.
pub fn preview(layer: &Layer) -> Vec<[u8; 4]> {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let width = layer.aov.width();
    let ranges: Vec<(f32, f32)> =
        (0..width).map(|i| range(layer.values.iter().skip(i).step_by(width))).collect();
    let scaled = |v: f32, (low, high): (f32, f32)| if high > low { (v - low) / (high - low) } else { 0.5 };
    let nothing = |v: &[f32]| v.iter().all(|&x| x == layer.aov.nothing());
    layer
        .values
        .chunks_exact(width)
        .map(|v| {
            if nothing(v) {
                return [0, 0, 0, 255];
            }
            let rgb = match layer.aov {
                Aov::Depth => [byte(1.0 - 0.9 * scaled(v[0], ranges[0])); 3],
                Aov::Normal | Aov::VertexNormal | Aov::GeometricNormal => {
                    [0, 1, 2].map(|i| byte(0.5 * v[i] + 0.5))
                }
                Aov::Position => [0, 1, 2].map(|i| byte(scaled(v[i], ranges[i]))),
                Aov::Albedo => [0, 1, 2].map(|i| byte(crate::display::linear_to_srgb(v[i].clamp(0.0, 1.0)))),
                Aov::Uv => [byte(v[0].rem_euclid(1.0)), byte(v[1].rem_euclid(1.0)), 0],
                Aov::Mask => [byte(v[0]); 3],
                Aov::ObjectId | Aov::MaterialId => id_color(v[0] as u32),
            };
            [rgb[0], rgb[1], rgb[2], 255]
        })
        .collect()
}

fn range<'a>(values: impl Iterator<Item = &'a f32>) -> (f32, f32) {
    let finite = values.filter(|v| v.is_finite());
    finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

/// Neighbouring ids far apart in hue: steps of the golden angle.
fn id_color(id: u32) -> [u8; 3] {
    let hue = (id as f32 * 0.618_034).fract() * 6.0;
    let channel = |shift: f32| {
        let h = (hue + shift).rem_euclid(6.0);
        let v = (2.0 - (h - 3.0).abs()).clamp(0.0, 1.0);
        ((0.25 + 0.7 * (1.0 - v)) * 255.0) as u8
    };
    [channel(3.0), channel(1.0), channel(5.0)]
}
