//! Distinguishes normal maps from images of heights, which exporters write in their place.

use glam::{DVec4, Vec3, Vec4};

use blinn_scene::Image;

/// Texels that [`holds_normals`] looks at: enough for a mean.
const MAX_TEXELS: usize = 1 << 16;

/// Difference of a texel's components up to which it is grey. JPEG adds some to each.
const MAX_GREY_CHROMA: f32 = 0.04;

/// Returns true if an image holds tangent-space normals. Black and transparent texels are ignored, since baking
/// leaves them around the islands; transparent ones count if alpha has another use.
pub(crate) fn looks_like_normals(image: &Image) -> bool {
    let count = image.width as usize * image.height as usize;
    let texels = || (0..count).map(|i| image.stored(i)).filter(|v| v.truncate() != Vec3::ZERO);
    are_normals(texels().filter(|v| v.w > 0.0)) || are_normals(texels())
}

/// Returns true if the mean is mostly blue with medium red and green.
fn are_normals(texels: impl Iterator<Item = Vec4>) -> bool {
    // The fourth component counts the texels.
    let sum: DVec4 = texels.map(|v| v.truncate().as_dvec3().extend(1.0)).sum();
    let [r, g, b, _] = (sum / sum.w).to_array();
    (0.3..0.7).contains(&r) && (0.3..0.7).contains(&g) && b > 0.65 && b > r + 0.1
}

/// Returns true if nearly all texels are vectors of unit length on the front: also of a map that leans to one side.
fn are_unit_vectors(texels: impl Iterator<Item = Vec4>) -> bool {
    let (mut count, mut units) = (0_usize, 0_usize);
    for texel in texels {
        let v = texel.truncate() * 2.0 - 1.0;
        count += 1;
        units += usize::from((v.length() - 1.0).abs() < 0.15 && v.z > -0.05);
    }
    count > 0 && units * 10 >= count * 9
}

/// Returns true if an image that is given as a normal map holds tangent-space normals, and not heights. Grey texels are
/// ignored, since no normal is grey but one that leans by 55 degrees: they fill what a map does not use. An image that has
/// no other holds heights.
pub(crate) fn holds_normals(image: &Image) -> bool {
    let count = image.width as usize * image.height as usize;
    // Odd, so that it does not fall into columns of widths that are powers of two.
    let step = (count / MAX_TEXELS) | 1;
    let has_chroma = |v: &Vec4| {
        let rgb = v.truncate();
        rgb.max_element() - rgb.min_element() > MAX_GREY_CHROMA
    };
    let texels = || (0..count).step_by(step).map(|i| image.stored(i)).filter(has_chroma);
    are_normals(texels().filter(|v| v.w > 0.0)) || are_normals(texels()) || are_unit_vectors(texels())
}

#[cfg(test)]
mod tests {
    use blinn_scene::{Channels, MipMaps, Texels};

    use super::*;

    fn image(texel: impl Fn(usize) -> [u8; 3]) -> Image {
        let (width, height) = (512, 256);
        let texels = Texels::U8((0..width * height).flat_map(texel).collect());
        let (width, height) = (width as u32, height as u32);
        Image {
            name: String::new(),
            width,
            height,
            channels: Channels::Rgb,
            texels,
            mips: MipMaps::default(),
        }
    }

    #[test]
    fn heights_are_grey_or_have_the_colours_of_a_picture() {
        assert!(!holds_normals(&image(|_| [128; 3])));
        assert!(!holds_normals(&image(|i| [(i * 7) as u8; 3])));
        // A JPEG of heights, and a brown picture.
        assert!(!holds_normals(&image(|i| [(i % 200) as u8, (i % 200) as u8 + 3, (i % 200) as u8 + 7])));
        assert!(!holds_normals(&image(|i| [150 + (i % 50) as u8, 110, 60])));
    }

    #[test]
    fn normal_maps_may_have_grey_surroundings() {
        let lean = |i: usize| (i * 37 % 160) as u8;
        assert!(holds_normals(&image(|_| [128, 128, 255])));
        // All lean by 45 degrees.
        assert!(holds_normals(&image(|_| [219, 128, 219])));
        assert!(holds_normals(&image(|i| [48 + lean(i), 208 - lean(i), 230])));
        for around in [0, 128, 255] {
            assert!(holds_normals(&image(|i| if i % 512 < 40 { [128, 120, 250] } else { [around; 3] })));
        }
    }
}
