//! Turns images of heights, as bump maps are, into normal maps.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use blinn_scene::{Channels, Image, MipMaps, Texels};

/// The height that white has over black, in widths of the image: 1 cm on a texture of 1 m.
///
/// Neither MTL nor its files give a unit. The relief of a texture is about a hundredth of its extent on bricks, bark and cloth
/// alike, and so the default multiplier of 1 shows what it stands for, at any scale of the scene and any resolution.
pub(crate) const FULL_HEIGHT: f32 = 0.01;

/// Bytes of a normal map for each texel of its heights.
pub(crate) const BYTES_PER_TEXEL: u64 = 6;

/// Returns the normal map of an image of heights. `height` is that of a texel, 0 to 1. Slopes are those between the two
/// neighbours of a texel along each axis; at the border, the opposite one is a neighbour, unless the image is `clamped`.
/// Texels are squares.
pub(crate) fn normal_map(image: &Image, clamped: bool, height: impl Fn(usize) -> f32 + Sync) -> Image {
    let (width, rows) = (image.width as usize, image.height as usize);
    let scale = FULL_HEIGHT * width as f32;
    let row = |y: usize| (0..width).map(|x| height(y * width + x)).collect::<Vec<f32>>();
    let normals = |y: usize| {
        let [above, below] = neighbours(y, rows, clamped);
        let (own, above_row, below_row) = (row(y), row(above), row(below));
        let normal = |x: usize| {
            let [left, right] = neighbours(x, width, clamped);
            // Texels between the neighbours: fewer at a clamped border.
            let across = (own[right] - own[left]) / distance(left, right, clamped);
            let down = (below_row[x] - above_row[x]) / distance(above, below, clamped);
            encode(Vec2::new(across, down) * scale)
        };
        (0..width).flat_map(normal).collect::<Vec<u16>>()
    };
    let texels: Vec<Vec<u16>> = (0..rows).into_par_iter().map(normals).collect();
    let Image { name, width, height, .. } = image;
    let (width, height) = (*width, *height);
    let texels = Texels::U16(texels.concat());
    Image { name: name.clone(), width, height, channels: Channels::Rgb, texels, mips: MipMaps::default() }
}

/// The texels before and after `i`.
fn neighbours(i: usize, count: usize, clamped: bool) -> [usize; 2] {
    match clamped {
        true => [i.saturating_sub(1), (i + 1).min(count - 1)],
        false => [(i + count - 1) % count, (i + 1) % count],
    }
}

/// Texels from one neighbour to the other.
fn distance(before: usize, after: usize, clamped: bool) -> f32 {
    if clamped { (after - before).max(1) as f32 } else { 2.0 }
}

/// The texel of a normal map for the slopes along the image's rows and columns. Green points up in the image.
fn encode(slopes: Vec2) -> [u16; 3] {
    let normal = Vec3::new(-slopes.x, slopes.y, 1.0).normalize_or(Vec3::Z);
    // Half of 65535 rounds up: a level texel is 32768, and leans by a thousandth of a degree.
    normal.to_array().map(|v| ((v * 0.5 + 0.5) * 65535.0 + 0.5) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32) -> Image {
        let texels = Texels::U8(vec![0; (width * height) as usize]);
        let mips = MipMaps::default();
        Image { name: "h".into(), width, height, channels: Channels::L, texels, mips }
    }

    fn normals(map: &Image) -> Vec<Vec3> {
        let count = (map.width * map.height) as usize;
        (0..count).map(|i| map.stored(i).truncate() * 2.0 - 1.0).collect()
    }

    /// A ramp from black to white over the whole width has the slope 1/100.
    #[test]
    fn a_ramp_leans_by_its_slope() {
        let (width, rows) = (50, 20);
        let along_u = normal_map(&image(width, rows), true, |i| (i % 50) as f32 / 50.0);
        for n in normals(&along_u) {
            assert!(n.abs_diff_eq(Vec3::new(-0.01, 0.0, 1.0).normalize(), 1e-4), "{n}");
        }
        // 0.5 of height over a width of texels downward: it rises to the bottom, so that its normal points up.
        let along_v = normal_map(&image(width, rows), true, |i| (i / 50) as f32 / 100.0);
        for n in normals(&along_v) {
            assert!(n.abs_diff_eq(Vec3::new(0.0, 0.005, 1.0).normalize(), 1e-4), "{n}");
        }
    }

    #[test]
    fn borders_repeat_unless_they_are_clamped() {
        let step = |i: usize| if i == 0 { 1.0 } else { 0.0 };
        let slopes = |clamped| -> Vec<f32> {
            normals(&normal_map(&image(4, 1), clamped, step)).iter().map(|n| -n.x / n.z).collect()
        };
        let close = |found: Vec<f32>, expected: [f32; 4]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?}");
        };
        close(slopes(false), [0.0, -0.02, 0.0, 0.02]);
        close(slopes(true), [-0.04, -0.02, 0.0, 0.0]);
    }

    #[test]
    fn heights_that_are_level_or_not_finite_are_level() {
        for height in [0.0, 1.0, f32::NAN, f32::INFINITY] {
            for (width, rows) in [(1, 1), (3, 2)] {
                let map = normal_map(&image(width, rows), false, |_| height);
                assert!(normals(&map).iter().all(|n| n.abs_diff_eq(Vec3::Z, 1e-4)), "{height}");
            }
        }
    }
}
