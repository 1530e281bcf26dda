//! Mip levels by their definition, texel by texel, which tests compare the fast ones with.

use glam::{Vec3, Vec4};

use crate::texture::downsample::{DownsampleFilter, unweight_by_alpha, weight_by_alpha};
use crate::texture::srgb::{decode_colors, linear_to_srgb, linear_to_srgb8};
use crate::texture::texels::{Channels, TexelView, Texels};

/// Computes the texels of all levels of an image.
pub fn levels(image: TexelView, filter: DownsampleFilter) -> Vec<Texels> {
    let (mut width, mut height) = (image.width as usize, image.height as usize);
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| filter_input(image, filter, x, y)));
    let mut means: Vec<Vec4> = texels.collect();
    let mut levels = Vec::new();
    while (width, height) != (1, 1) {
        let half = ((width / 2).max(1), (height / 2).max(1));
        let texels = (0..half.1).flat_map(|y| (0..half.0).map(move |x| (x, y)));
        let mean = |(x, y)| {
            let mut sum = Vec4::ZERO;
            for (j, down) in covered(height, half.1, y) {
                for (i, across) in covered(width, half.0, x) {
                    sum += means[j * width + i] * (across * down);
                }
            }
            sum
        };
        means = texels.map(mean).collect();
        levels.push(encode(image, filter, &means));
        (width, height) = half;
    }
    levels
}

/// Returns the texels of a side that texel `i` of the smaller side covers, and how much of its area they are.
fn covered(side: usize, half: usize, i: usize) -> Vec<(usize, f32)> {
    let n = side as f32;
    match side {
        1 => vec![(0, 1.0)],
        _ if side == 2 * half => vec![(2 * i, 0.5), (2 * i + 1, 0.5)],
        _ => vec![
            (2 * i, (half - i) as f32 / n),
            (2 * i + 1, half as f32 / n),
            (2 * i + 2, (i + 1) as f32 / n),
        ],
    }
}

fn filter_input(image: TexelView, filter: DownsampleFilter, x: usize, y: usize) -> Vec4 {
    let i = y * image.width as usize + x;
    match filter {
        DownsampleFilter::Data => image.stored(i),
        DownsampleFilter::Light { alpha_weighted: false } => image.decoded(i),
        DownsampleFilter::Light { alpha_weighted: true } => weight_by_alpha(image.decoded(i)),
        DownsampleFilter::EncodedBilinear { alpha_weighted } => {
            interpolated_light(image, x, y, alpha_weighted)
        }
        DownsampleFilter::Normals => (image.stored(i).truncate() * 2.0 - 1.0).normalize_or_zero().extend(0.0),
    }
}

/// The mean light of an interpolated texel, from nine texels.
fn interpolated_light(image: TexelView, x: usize, y: usize, alpha_weighted: bool) -> Vec4 {
    let (w, h) = (image.width as usize, image.height as usize);
    let texel = |x: usize, y: usize| image.stored(y % h * w + x % w);
    let mut sum = Vec4::ZERO;
    for dx in [w - 1, 1] {
        for dy in [h - 1, 1] {
            let (near, far) = (0.788_675_1, 1.0 - 0.788_675_1);
            let sides = texel(x + dx, y) + texel(x, y + dy);
            let corner = texel(x + dx, y + dy);
            let v = texel(x, y) * (near * near) + sides * (near * far) + corner * (far * far);
            let light = decode_colors(v);
            sum += if alpha_weighted { weight_by_alpha(light) } else { light };
        }
    }
    sum * 0.25
}

fn encode(image: TexelView, filter: DownsampleFilter, means: &[Vec4]) -> Texels {
    let values = means.iter().flat_map(|&mean| texel(image.channels, filter, mean));
    match image.texels {
        Texels::U8(_) => {
            let encode = |(v, is_light)| {
                if is_light { linear_to_srgb8(v) } else { (v * 255.0 + 0.5) as u8 }
            };
            Texels::U8(values.map(encode).collect())
        }
        Texels::U16(_) => {
            let encode = |(v, is_light)| {
                let v = if is_light { linear_to_srgb(v) } else { v };
                (v * 65535.0 + 0.5) as u16
            };
            Texels::U16(values.map(encode).collect())
        }
    }
}

/// Returns the values of a texel, and whether they are linear light.
fn texel(channels: Channels, filter: DownsampleFilter, mean: Vec4) -> Vec<(f32, bool)> {
    let (v, channels, is_light) = match filter {
        DownsampleFilter::Data => (mean, channels, false),
        DownsampleFilter::Normals => {
            let n = mean.truncate();
            let unit = n.try_normalize().unwrap_or(Vec3::Z);
            ((unit * 0.5 + 0.5).extend((1.0 - n.length().min(1.0)).sqrt()), Channels::Rgba, false)
        }
        _ if filter.is_alpha_weighted() => (unweight_by_alpha(mean), channels, true),
        _ => (mean, channels, true),
    };
    match channels {
        Channels::L => vec![(v.x, is_light)],
        Channels::La => vec![(v.x, is_light), (v.w, false)],
        Channels::Rgb => v.truncate().to_array().map(|v| (v, is_light)).to_vec(),
        Channels::Rgba => vec![(v.x, is_light), (v.y, is_light), (v.z, is_light), (v.w, false)],
    }
}
