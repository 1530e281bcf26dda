//! Rounding-error bounds for ray origins and surface points, after pbrt's “Managing Rounding Error”.

use glam::{DAffine3, Vec3};

/// The gap between 1 and the next f32, 2⁻²³.
pub const EPSILON: f32 = f32::EPSILON;

/// Offsets a ray origin: moves `p` along the unit normal `n_g`, to the side of `towards`, until it
/// clears the error box `±p_error` around `p`, and rounds away from the surface.
///
/// Shadow rays start here. The distance follows from the arithmetic that produced `p`, so it is right
/// at every scale, unlike a constant epsilon (pbrt's `OffsetRayOrigin`).
#[inline(always)]
pub fn offset_ray_origin(p: Vec3, p_error: Vec3, n_g: Vec3, towards: Vec3) -> Vec3 {
    let d = n_g.abs().dot(p_error);
    let n = if towards.dot(n_g) < 0.0 { -n_g } else { n_g };
    let moved = p + n * d;
    Vec3::new(next_away(moved.x, n.x), next_away(moved.y, n.y), next_away(moved.z, n.z))
}

/// Returns the f32 next to `moved` in the direction of the sign of `n`: `f32::next_up` or
/// `f32::next_down` without branches, so that compilers can vectorise.
#[inline(always)]
fn next_away(moved: f32, n: f32) -> f32 {
    let bits = moved.to_bits();
    let magnitude = bits & 0x7fff_ffff;
    let (up, down) = (n > 0.0, n < 0.0);
    let outward = up == (moved > 0.0);
    // From 0, both directions increase the magnitude.
    let stepped = if outward { bits.wrapping_add(1) } else { bits.wrapping_sub(1) };
    let smallest = if up { 1 } else { 0x8000_0001 };
    let next = if magnitude == 0 { smallest } else { stepped };
    let last = if outward { INFINITY } else { INFINITY + 1 };
    f32::from_bits(if (up | down) & (magnitude < last) { next } else { bits })
}

const INFINITY: u32 = f32::INFINITY.to_bits();

/// Bounds the distance, along each axis, between a point on a triangle and the surface that rays
/// intersect: the `p_error` of a point interpolated from the corners in f64 and rounded to f32.
///
/// `world` and `local` are the triangle's corners in world space and in the space that `to_world`
/// maps from. Both contribute. In world space, the corners, the point and neighbouring vertices that
/// should share a plane are each rounded by half an ulp: 4ε·max|v| in total. Where rays intersect a
/// shared mesh in its local space, they are rounded there, and the transform scales that error.
#[inline]
pub fn point_error(world: [Vec3; 3], local: [Vec3; 3], to_world: &DAffine3) -> Vec3 {
    let largest = |v: [Vec3; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
    let m = to_world.matrix3.abs().as_mat3();
    4.0 * EPSILON * (largest(world) + m * largest(local))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_away_agrees_with_the_standard_library() {
        let numbers = [0.0, 1e-45, 1e-38, 1.0, 1.5, 3e38, f32::MAX, f32::MIN_POSITIVE, f32::INFINITY];
        for moved in numbers.into_iter().flat_map(|x| [x, -x]) {
            assert_eq!(next_away(moved, 0.5).to_bits(), moved.next_up().to_bits(), "{moved}");
            assert_eq!(next_away(moved, -0.5).to_bits(), moved.next_down().to_bits(), "{moved}");
            for n in [0.0, -0.0, f32::NAN] {
                assert_eq!(next_away(moved, n).to_bits(), moved.to_bits());
            }
        }
        assert!(next_away(f32::NAN, 1.0).is_nan() && next_away(f32::NAN, -1.0).is_nan());
    }

    #[test]
    fn the_offset_clears_the_error_box_on_the_requested_side() {
        let p = Vec3::new(1e5, -2.0, 3e-4);
        let error = Vec3::splat(0.01);
        let up = offset_ray_origin(p, error, Vec3::Y, Vec3::new(1.0, 0.1, 0.0));
        assert!(up.y >= p.y + 0.01 && up.x == p.x && up.z == p.z);
        let down = offset_ray_origin(p, error, Vec3::Y, Vec3::new(1.0, -0.1, 0.0));
        assert!(down.y <= p.y - 0.01);
    }

    #[test]
    fn the_error_of_a_point_grows_with_its_coordinates() {
        let world = [Vec3::new(1e3, 1.0, 0.0), Vec3::new(-2e3, 1.0, 0.0), Vec3::ZERO];
        let local = [Vec3::X, Vec3::NEG_X, Vec3::Y];
        let still = point_error(world, local, &DAffine3::from_scale(glam::DVec3::splat(1e-30)));
        assert!(still.abs_diff_eq(4.0 * EPSILON * Vec3::new(2e3, 1.0, 0.0), 1e-12));
        // A mesh 1e5 from its local origin, moved back to the world's origin.
        let far = local.map(|p| p + Vec3::splat(1e5));
        let back = DAffine3::from_translation(glam::DVec3::splat(-1e5));
        assert!(point_error(local, far, &back).min_element() > 1e5 * EPSILON);
    }
}
