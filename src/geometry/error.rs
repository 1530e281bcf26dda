//! Bounds on what rounding does, after pbrt's chapter on managing rounding error.

use glam::Vec3;

/// The gap between 1 and the next f32, 2⁻²³.
pub const EPSILON: f32 = f32::EPSILON;

/// Moves `p` along the unit normal `n_g`, to the side that `towards` is on, far enough to clear
/// the box `±p_error` around `p`, and rounds away from the surface.
///
/// This is where shadow rays start: the distance follows from the arithmetic that made `p`, so
/// it is right at every scale. A constant epsilon is not.
pub fn offset_point(p: Vec3, p_error: Vec3, n_g: Vec3, towards: Vec3) -> Vec3 {
    let d = n_g.abs().dot(p_error);
    let n = if towards.dot(n_g) < 0.0 { -n_g } else { n_g };
    let moved = p + n * d;
    let away = |moved: f32, n: f32| {
        if n > 0.0 {
            moved.next_up()
        } else if n < 0.0 {
            moved.next_down()
        } else {
            moved
        }
    };
    Vec3::new(away(moved.x, n.x), away(moved.y, n.y), away(moved.z, n.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_clears_the_error_box_on_the_asked_side() {
        let p = Vec3::new(1e5, -2.0, 3e-4);
        let error = Vec3::splat(0.01);
        let up = offset_point(p, error, Vec3::Y, Vec3::new(1.0, 0.1, 0.0));
        assert!(up.y >= p.y + 0.01 && up.x == p.x && up.z == p.z);
        let down = offset_point(p, error, Vec3::Y, Vec3::new(1.0, -0.1, 0.0));
        assert!(down.y <= p.y - 0.01);
    }
}
