//! Transforms of texture coordinates: KHR_texture_transform, and MTL's `-s` and `-o`.

use glam::Vec2;

/// An affine transform of texture coordinates: `uv' = M·uv + t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
    /// Columns of M, computed from rotation and scale.
    x_axis: Vec2,
    y_axis: Vec2,
}

impl UvTransform {
    /// The identity.
    pub const IDENTITY: UvTransform =
        UvTransform { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE, x_axis: Vec2::X, y_axis: Vec2::Y };

    /// Returns KHR_texture_transform: scale, then rotation by `rotation` radians (counter-clockwise in
    /// the image, so clockwise in uv), then offset.
    pub fn khr(offset: Vec2, rotation: f32, scale: Vec2) -> UvTransform {
        let (s, c) = (libm::sinf(rotation), libm::cosf(rotation));
        let (x_axis, y_axis) = (Vec2::new(c, -s) * scale.x, Vec2::new(s, c) * scale.y);
        UvTransform { offset, rotation, scale, x_axis, y_axis }
    }

    /// Transforms a difference of coordinates.
    #[inline(always)]
    pub fn transform_vector(&self, by: Vec2) -> Vec2 {
        self.x_axis * by.x + self.y_axis * by.y
    }

    /// Returns the determinant of M, negative where it mirrors.
    pub(crate) fn determinant(&self) -> f32 {
        self.x_axis.perp_dot(self.y_axis)
    }

    /// Transforms coordinates.
    #[inline(always)]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        self.transform_vector(uv) + self.offset
    }

    /// Returns, for each axis, the range of the transformed coordinates over a triangle, widened by the
    /// rounding error of interpolation.
    pub(crate) fn bounds_of_triangle(&self, uv: [Vec2; 3]) -> [[f64; 2]; 2] {
        let max_abs = uv[0].abs().max(uv[1].abs()).max(uv[2].abs());
        let magnitude = (self.x_axis * max_abs.x).abs() + (self.y_axis * max_abs.y).abs() + self.offset.abs();
        // NaN if a coordinate is not finite, 0 otherwise. `min` and `max` alone would drop NaN.
        let nan_or_zero = f64::from((uv[0] + uv[1] + uv[2]).element_sum()) * 0.0;
        let to = uv.map(|uv| self.apply(uv));
        let low = to[0].min(to[1]).min(to[2]);
        let high = to[0].max(to[1]).max(to[2]);
        [0, 1].map(|k| {
            let slack = 16.0 * f64::from(f32::EPSILON) * f64::from(magnitude[k]) + nan_or_zero;
            [f64::from(low[k]) - slack, f64::from(high[k]) + slack]
        })
    }

    /// Returns the offset t.
    pub fn offset(&self) -> Vec2 {
        self.offset
    }

    /// Returns the rotation in radians.
    pub fn rotation(&self) -> f32 {
        self.rotation
    }

    /// Returns the scale, which precedes the rotation.
    pub fn scale(&self) -> Vec2 {
        self.scale
    }

    pub(crate) fn set_offset(&mut self, offset: Vec2) {
        self.offset = offset;
    }

    pub(crate) fn set_rotation(&mut self, rotation: f32) {
        *self = UvTransform::khr(self.offset, rotation, self.scale);
    }

    pub(crate) fn set_scale(&mut self, scale: Vec2) {
        *self = UvTransform::khr(self.offset, self.rotation, scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrix_is_that_of_khr_texture_transform() {
        // Scale 2, a quarter turn, offset (0, 1): the matrix in the extension's text.
        let t = UvTransform::khr(Vec2::new(0.0, 1.0), std::f32::consts::FRAC_PI_2, Vec2::splat(2.0));
        assert!(t.apply(Vec2::new(1.0, 0.0)).abs_diff_eq(Vec2::new(0.0, -1.0), 1e-6));
        assert!(t.apply(Vec2::new(0.0, 1.0)).abs_diff_eq(Vec2::new(2.0, 1.0), 1e-6));
    }
}
