//! Vertex colours as programs write them behind a vertex.

use glam::Vec4;
use rayon::prelude::*;

use super::super::error::Warnings;
use crate::scene::srgb_to_linear;

/// Colours as written to linear ones. Programs write sRGB-encoded numbers: Blender, MeshLab and
/// scanners do, and Blender and three.js read them so. Alpha stays.
pub(super) fn to_linear(colors: &mut [Vec4], warnings: &mut Warnings) {
    let highest = colors.iter().map(|c| c.max_element()).fold(0.0, f32::max);
    let whole = || colors.iter().all(|c| c.fract() == Vec4::ZERO && c.min_element() >= 0.0);
    // Vertices without a colour are 1 already, and alpha where none is given.
    let bytes = highest > 1.0 && highest <= 255.0 && whole();
    if bytes {
        warnings.add("", "vertex colours reach beyond 1: read as bytes from 0 to 255");
    }
    colors.par_iter_mut().with_min_len(1 << 12).for_each(|c| {
        let scale = if bytes && *c != Vec4::ONE { 1.0 / 255.0 } else { 1.0 };
        let channel = |v: f32| srgb_to_linear(v * scale);
        *c = Vec4::new(channel(c.x), channel(c.y), channel(c.z), if c.w > 1.0 { c.w * scale } else { c.w });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_srgb_and_whole_ones_beyond_one_are_bytes() {
        let mut warnings = Warnings::default();
        let mut colors = [Vec4::new(0.735357, 0.0, 1.0, 0.5), Vec4::ONE];
        to_linear(&mut colors, &mut warnings);
        assert!(colors[0].abs_diff_eq(Vec4::new(0.5, 0.0, 1.0, 0.5), 1e-5) && colors[1] == Vec4::ONE);
        let mut colors = [Vec4::new(255.0, 0.0, 51.0, 1.0), Vec4::ONE];
        to_linear(&mut colors, &mut warnings);
        assert!(colors[0].abs_diff_eq(Vec4::new(1.0, 0.0, 0.0331, 1.0), 1e-4) && colors[1] == Vec4::ONE);
        assert_eq!(warnings.into_vec().len(), 1);
    }
}
