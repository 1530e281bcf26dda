//! Vertex colours, which many exporters write after the position of a vertex.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::super::error::Warnings;
use super::chunk::NO_COLOR;
use blinn_scene::{Mesh, srgb_to_linear};

/// Largest plausible sRGB value: 10 decodes to two hundred times the radiance of white.
const MAX_SRGB: f32 = 10.0;

/// Converts colours from sRGB to linear and uses white for vertices without one. Blender, MeshLab and scanners
/// write sRGB; Blender and three.js read it. Alpha is linear.
pub(crate) fn to_linear(colors: &mut [Vec4], warnings: &mut Warnings) {
    let valid = || colors.iter().filter(|c| c.is_finite());
    let max = valid().map(|c| c.max_element()).fold(0.0, f32::max);
    let are_integers = || valid().all(|c| c.fract() == Vec4::ZERO && c.min_element() >= 0.0);
    // Mesh simplification averages bytes, so they need not be integers.
    let bytes = max > 1.0 && max <= 255.0 && (max > MAX_SRGB || are_integers());
    if bytes {
        warnings.add("", "vertex colours exceed 1: read as bytes from 0 to 255");
    } else if max > MAX_SRGB {
        warnings.add("", format!("vertex colours have the value {max}, expected 0 to 1 or 0 to 255"));
    }
    let invalid = colors.par_iter_mut().with_min_len(1 << 12).filter_map(|c| {
        let written = std::mem::replace(c, Vec4::ONE);
        let scale = if bytes { 1.0 / 255.0 } else { 1.0 };
        let channel = |v: f32| srgb_to_linear(v * scale);
        // A missing alpha is 1 in byte colours too.
        let alpha = if written.w > 1.0 { written.w * scale } else { written.w };
        let linear = Vec4::new(channel(written.x), channel(written.y), channel(written.z), alpha);
        if linear.is_finite() {
            *c = linear;
        }
        (!linear.is_finite() && written != NO_COLOR).then_some(())
    });
    let invalid = invalid.count();
    if invalid > 0 {
        warnings.add("", format!("used white instead of {invalid} invalid vertex colours"));
    }
}

/// Returns true if any vertex has a colour other than 0 0 0.
pub(super) fn has_colors(colors: &[Vec4]) -> bool {
    colors.iter().any(|c| c.is_finite() && c.truncate() != Vec3::ZERO)
}

/// Removes the colours of a mesh if all are black, and returns true then. assimp writes 0 0 0 for meshes without
/// colours if another mesh of the file has some (see [`has_colors`]).
pub(super) fn remove_black(mesh: &mut Mesh) -> bool {
    let black = !mesh.colors.is_empty() && mesh.colors.iter().all(|c| c.truncate() == Vec3::ZERO);
    if black {
        mesh.colors = Vec::new();
    }
    black
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the linear colours and the warnings.
    fn linear(written: &[Vec4]) -> (Vec<Vec4>, Vec<String>) {
        let (mut colors, mut warnings) = (written.to_vec(), Warnings::default());
        to_linear(&mut colors, &mut warnings);
        (colors, warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn colours_are_srgb_and_integers_above_one_are_bytes() {
        let (colors, warnings) = linear(&[Vec4::new(0.735357, 0.0, 1.0, 0.5), NO_COLOR]);
        assert!(colors[0].abs_diff_eq(Vec4::new(0.5, 0.0, 1.0, 0.5), 1e-5) && colors[1] == Vec4::ONE);
        assert!(warnings.is_empty(), "{warnings:?}");
        let (colors, warnings) = linear(&[Vec4::new(255.0, 0.0, 51.0, 1.0), NO_COLOR]);
        assert!(colors[0].abs_diff_eq(Vec4::new(1.0, 0.0, 0.0331, 1.0), 1e-4) && colors[1] == Vec4::ONE);
        assert_eq!(warnings.len(), 1);
    }

    #[test]
    fn bytes_are_detected_for_all_values_of_a_file() {
        let (colors, _) = linear(&[Vec4::ONE, Vec4::new(255.0, 255.0, 255.0, 1.0)]);
        assert!(colors[0].abs_diff_eq(Vec4::new(3e-4, 3e-4, 3e-4, 1.0), 1e-4), "{}", colors[0]);
        let (colors, warnings) = linear(&[Vec4::new(127.5, 0.0, 0.25, 1.0)]);
        assert!(colors[0].abs_diff_eq(Vec4::new(0.2140, 0.0, 0.0, 1.0), 1e-3), "{}", colors[0]);
        assert_eq!(warnings, ["vertex colours exceed 1: read as bytes from 0 to 255"]);
        // A value slightly above 1 is kept, an impossible one is reported.
        assert_eq!(linear(&[Vec4::new(1.5, 0.0, 0.0, 1.0)]).1.len(), 0);
        let (_, warnings) = linear(&[Vec4::new(300.0, 0.0, 0.0, 1.0)]);
        assert_eq!(warnings, ["vertex colours have the value 300, expected 0 to 1 or 0 to 255"]);
    }

    #[test]
    fn invalid_colours_become_white_and_do_not_affect_others() {
        let byte = Vec4::new(255.0, 0.0, 0.0, 1.0);
        let (colors, warnings) = linear(&[Vec4::NAN, byte, Vec4::INFINITY.with_w(1.0), NO_COLOR]);
        assert_eq!([colors[0], colors[2], colors[3]], [Vec4::ONE; 3]);
        assert!(colors[1].abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-5), "{}", colors[1]);
        let invalid = "used white instead of 2 invalid vertex colours";
        assert_eq!(warnings, ["vertex colours exceed 1: read as bytes from 0 to 255", invalid]);
        let (colors, warnings) = linear(&[Vec4::new(1e38, 0.0, 0.0, 1.0)]);
        assert!(colors == [Vec4::ONE] && warnings.len() == 2, "{colors:?} {warnings:?}");
    }
}
