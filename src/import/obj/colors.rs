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
    if colors.is_empty() {
        return;
    }
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
    let scale = if bytes { 1.0 / 255.0 } else { 1.0 };
    let decoder = ByteDecoder::new(|byte| if bytes { byte * scale } else { byte / 255.0 });
    let invalid = colors.par_iter_mut().with_min_len(1 << 12).filter_map(|c| {
        let written = std::mem::replace(c, Vec4::ONE);
        let channel = |v: f32| decoder.decode(v * scale);
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

/// Decodes sRGB values, most of which were bytes, with a table of those.
struct ByteDecoder {
    /// The sRGB value of each byte.
    values: [f32; 256],
    linear: [f32; 256],
}

impl ByteDecoder {
    /// `value` returns a byte as an sRGB value from 0 to 1, with the rounding of the values that are decoded.
    fn new(value: impl Fn(f32) -> f32) -> ByteDecoder {
        let values = std::array::from_fn(|byte| value(byte as f32));
        ByteDecoder { values, linear: values.map(srgb_to_linear) }
    }

    /// Returns the same bits as [`srgb_to_linear`].
    #[inline]
    fn decode(&self, v: f32) -> f32 {
        // NaN becomes 0.
        let byte = ((v * 255.0 + 0.5) as usize).min(255);
        if self.values[byte].to_bits() == v.to_bits() { self.linear[byte] } else { srgb_to_linear(v) }
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

    #[test]
    fn decoders_of_bytes_have_the_bits_of_the_function() {
        for value in [|byte: f32| byte / 255.0, |byte: f32| byte * (1.0 / 255.0)] {
            let decoder = ByteDecoder::new(value);
            let bytes = (0..=255u8).map(|byte| value(f32::from(byte)));
            assert!(bytes.clone().all(|v| decoder.values.contains(&v)));
            let near = bytes.flat_map(|v| [v, v.next_up(), v.next_down(), -v]);
            let others = [0.0, -0.0, 0.3, 1.5, -2.0, 1e30, f32::INFINITY, f32::NEG_INFINITY];
            for v in near.chain(others) {
                assert_eq!(decoder.decode(v).to_bits(), srgb_to_linear(v).to_bits(), "{v}");
            }
            assert!(decoder.decode(f32::NAN).is_nan());
        }
    }
}
