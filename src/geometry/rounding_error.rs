//! Bounds on what rounding does, after pbrt's chapter on managing rounding error.

use glam::{DAffine3, Vec3};

/// The gap between 1 and the next f32, 2⁻²³.
pub const EPSILON: f32 = f32::EPSILON;

/// Moves `p` along the unit normal `n_g`, to the side that `towards` is on, far enough to clear
/// the box `±p_error` around `p`, and rounds away from the surface.
///
/// This is where shadow rays start: the distance follows from the arithmetic that made `p`, so
/// it is right at every scale. A constant epsilon is not.
#[inline(always)]
pub fn offset_ray_origin(p: Vec3, p_error: Vec3, n_g: Vec3, towards: Vec3) -> Vec3 {
    let d = n_g.abs().dot(p_error);
    let n = if towards.dot(n_g) < 0.0 { -n_g } else { n_g };
    let moved = p + n * d;
    Vec3::new(away(moved.x, n.x), away(moved.y, n.y), away(moved.z, n.z))
}

/// The next number after `moved` on the side that `n` points to: `f32::next_up` and `f32::next_down`,
/// without branches, so that compilers can do many at once.
#[inline(always)]
fn away(moved: f32, n: f32) -> f32 {
    let bits = moved.to_bits();
    let magnitude = bits & 0x7fff_ffff;
    let (up, down) = (n > 0.0, n < 0.0);
    let outward = up == (moved > 0.0);
    // From 0 both ways lead outward.
    let stepped = if outward { bits.wrapping_add(1) } else { bits.wrapping_sub(1) };
    let smallest = if up { 1 } else { 0x8000_0001 };
    let next = if magnitude == 0 { smallest } else { stepped };
    let last = if outward { INFINITY } else { INFINITY + 1 };
    f32::from_bits(if (up | down) & (magnitude < last) { next } else { bits })
}

const INFINITY: u32 = f32::INFINITY.to_bits();

/// How far, along each axis, a point on a triangle may be from the surface that rays meet: the
/// `p_error` of a point interpolated between the corners in f64 and rounded to f32.
///
/// `world` and `local` are the triangle's corners in the world and in the frame that `to_world`
/// takes there. Both count. The world's corners, the point, and the neighbours that are meant to
/// be in one plane are rounded in the world: half an ulp each, 4ε·max|v| for all of them. And where
/// rays meet a shared mesh in its own frame they are rounded there, which the transform carries
/// into the world.
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
    fn the_next_number_away_is_the_standard_librarys() {
        let numbers = [0.0, 1e-45, 1e-38, 1.0, 1.5, 3e38, f32::MAX, f32::MIN_POSITIVE, f32::INFINITY];
        for moved in numbers.into_iter().flat_map(|x| [x, -x]) {
            assert_eq!(away(moved, 0.5).to_bits(), moved.next_up().to_bits(), "{moved}");
            assert_eq!(away(moved, -0.5).to_bits(), moved.next_down().to_bits(), "{moved}");
            for n in [0.0, -0.0, f32::NAN] {
                assert_eq!(away(moved, n).to_bits(), moved.to_bits());
            }
        }
        assert!(away(f32::NAN, 1.0).is_nan() && away(f32::NAN, -1.0).is_nan());
    }

    #[test]
    fn the_offset_clears_the_error_box_on_the_asked_side() {
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
        // A mesh at 1e5 of its own frame, brought back to the middle of the world.
        let far = local.map(|p| p + Vec3::splat(1e5));
        let back = DAffine3::from_translation(glam::DVec3::splat(-1e5));
        assert!(point_error(local, far, &back).min_element() > 1e5 * EPSILON);
    }
}
