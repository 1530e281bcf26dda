//! Vertex colours as programs write them behind a vertex.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::super::error::Warnings;
use super::block::COLORLESS;
use crate::scene::{Mesh, srgb_to_linear};

/// What no sRGB number is: 10 would be two hundred times as bright as white.
const BRIGHT: f32 = 10.0;

/// Colours as written to linear ones, white where there is none. Programs write sRGB-encoded numbers:
/// Blender, MeshLab and scanners do, and Blender and three.js read them so. Alpha stays.
pub(super) fn to_linear(colors: &mut [Vec4], warnings: &mut Warnings) {
    let given = || colors.iter().filter(|c| c.is_finite());
    let highest = given().map(|c| c.max_element()).fold(0.0, f32::max);
    let whole = || given().all(|c| c.fract() == Vec4::ZERO && c.min_element() >= 0.0);
    // Means of bytes, as programs write that take vertices away, are not whole.
    let bytes = highest > 1.0 && highest <= 255.0 && (highest > BRIGHT || whole());
    if bytes {
        warnings.add("", "vertex colours reach beyond 1: read as bytes from 0 to 255");
    } else if highest > BRIGHT {
        warnings.add("", format!("vertex colours reach {highest}, which is neither up to 1 nor up to 255"));
    }
    let wrong = colors.par_iter_mut().with_min_len(1 << 12).filter_map(|c| {
        let written = std::mem::replace(c, Vec4::ONE);
        let scale = if bytes { 1.0 / 255.0 } else { 1.0 };
        let channel = |v: f32| srgb_to_linear(v * scale);
        // Where none is given, alpha is 1 among bytes too.
        let alpha = if written.w > 1.0 { written.w * scale } else { written.w };
        let linear = Vec4::new(channel(written.x), channel(written.y), channel(written.z), alpha);
        if linear.is_finite() {
            *c = linear;
        }
        (!linear.is_finite() && written != COLORLESS).then_some(())
    });
    let wrong = wrong.count();
    if wrong > 0 {
        warnings.add("", format!("{wrong} vertex colours are no numbers that can be shown: taken as white"));
    }
}

/// True where a vertex has a colour, as written, that is not 0 0 0.
pub(super) fn painted(colors: &[Vec4]) -> bool {
    colors.iter().any(|c| c.is_finite() && c.truncate() != Vec3::ZERO)
}

/// Takes the colours from a mesh that is black all over: then true. In a file that is [`painted`], assimp writes
/// 0 0 0 behind the vertices of the meshes that have none.
pub(super) fn take_black(mesh: &mut Mesh) -> bool {
    let black = !mesh.colors.is_empty() && mesh.colors.iter().all(|c| c.truncate() == Vec3::ZERO);
    if black {
        mesh.colors = Vec::new();
    }
    black
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The colours as linear ones, and what was said of them.
    fn linear(written: &[Vec4]) -> (Vec<Vec4>, Vec<String>) {
        let (mut colors, mut warnings) = (written.to_vec(), Warnings::default());
        to_linear(&mut colors, &mut warnings);
        (colors, warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn numbers_are_srgb_and_whole_ones_beyond_one_are_bytes() {
        let (colors, warnings) = linear(&[Vec4::new(0.735357, 0.0, 1.0, 0.5), COLORLESS]);
        assert!(colors[0].abs_diff_eq(Vec4::new(0.5, 0.0, 1.0, 0.5), 1e-5) && colors[1] == Vec4::ONE);
        assert!(warnings.is_empty(), "{warnings:?}");
        let (colors, warnings) = linear(&[Vec4::new(255.0, 0.0, 51.0, 1.0), COLORLESS]);
        assert!(colors[0].abs_diff_eq(Vec4::new(1.0, 0.0, 0.0331, 1.0), 1e-4) && colors[1] == Vec4::ONE);
        assert_eq!(warnings.len(), 1);
    }

    #[test]
    fn bytes_are_bytes_where_they_are_one_and_where_they_are_means() {
        let (colors, _) = linear(&[Vec4::ONE, Vec4::new(255.0, 255.0, 255.0, 1.0)]);
        assert!(colors[0].abs_diff_eq(Vec4::new(3e-4, 3e-4, 3e-4, 1.0), 1e-4), "{}", colors[0]);
        let (colors, warnings) = linear(&[Vec4::new(127.5, 0.0, 0.25, 1.0)]);
        assert!(colors[0].abs_diff_eq(Vec4::new(0.2140, 0.0, 0.0, 1.0), 1e-3), "{}", colors[0]);
        assert_eq!(warnings, ["vertex colours reach beyond 1: read as bytes from 0 to 255"]);
        // Light, as written; and what can be neither.
        assert_eq!(linear(&[Vec4::new(1.5, 0.0, 0.0, 1.0)]).1.len(), 0);
        let (_, warnings) = linear(&[Vec4::new(300.0, 0.0, 0.0, 1.0)]);
        assert_eq!(warnings, ["vertex colours reach 300, which is neither up to 1 nor up to 255"]);
    }

    #[test]
    fn what_is_no_color_is_white_and_counted_and_says_nothing_of_the_others() {
        let byte = Vec4::new(255.0, 0.0, 0.0, 1.0);
        let (colors, warnings) = linear(&[Vec4::NAN, byte, Vec4::INFINITY.with_w(1.0), COLORLESS]);
        assert_eq!([colors[0], colors[2], colors[3]], [Vec4::ONE; 3]);
        assert!(colors[1].abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-5), "{}", colors[1]);
        let said = "2 vertex colours are no numbers that can be shown: taken as white";
        assert_eq!(warnings, ["vertex colours reach beyond 1: read as bytes from 0 to 255", said]);
        let (colors, warnings) = linear(&[Vec4::new(1e38, 0.0, 0.0, 1.0)]);
        assert!(colors == [Vec4::ONE] && warnings.len() == 2, "{colors:?} {warnings:?}");
    }
}
