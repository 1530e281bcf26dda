//! Texture coordinates that are not finite.

use glam::Vec2;

/// Replaces components that are not finite by 0. Returns the number of changed coordinates.
pub(super) fn replace_nonfinite(uvs: &mut [Vec2]) -> usize {
    let mut replaced = 0;
    for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        *uv = Vec2::from(uv.to_array().map(|x| if x.is_finite() { x } else { 0.0 }));
        replaced += 1;
    }
    replaced
}
