//! Rounding-error bounds for ray origins and surface points, after pbrt's “Managing Rounding Error”.

use glam::{DAffine3, Vec3};

/// The gap between 1 and the next f32, 2⁻²³.
pub const EPSILON: f32 = f32::EPSILON;

/// Coordinates of offset ray origins are 0 or at least this times the point's largest coordinate, 2⁻⁴⁸: far less than the
/// rounding of the others, but products with it stay far above the smallest normal f32.
const MIN_OFFSET: f32 = 1.0 / (1u64 << 48) as f32;

/// And at least this, 2⁻¹⁰⁰, wherever the point is.
const MIN_COORDINATE: f32 = 1.0 / (1u128 << 100) as f32;

/// Offsets a ray origin: moves `p` along the unit normal `n_g`, to the side of `towards`, until it
/// clears the error box `±p_error` around `p`, and rounds away from the surface.
///
/// Shadow rays start here. The distance follows from the arithmetic that produced `p`, so it is right
/// at every scale, unlike a constant epsilon (pbrt's `OffsetRayOrigin`).
///
/// From a coordinate that is 0, as on a floor at height 0, the next f32 would be subnormal, and so would all products
/// with it, which many processors are slow to compute. Such a coordinate moves to 2⁻⁴⁸ of the largest one.
#[inline(always)]
pub fn offset_ray_origin(p: Vec3, p_error: Vec3, n_g: Vec3, towards: Vec3) -> Vec3 {
    let d = n_g.abs().dot(p_error);
    let n = if towards.dot(n_g) < 0.0 { -n_g } else { n_g };
    let moved = p + n * d;
    // Comparisons instead of `max`: NaN and infinity leave the result non-finite either way.
    let largest = |a: f32, b: f32| if a > b { a } else { b };
    let size = moved.abs();
    let min = largest(largest(largest(size.x, size.y), size.z) * MIN_OFFSET, MIN_COORDINATE);
    Vec3::new(next_away(moved.x, n.x, min), next_away(moved.y, n.y, min), next_away(moved.z, n.z, min))
}

/// Returns the f32 next to `moved` in the direction of the sign of `n`: `f32::next_up` or
/// `f32::next_down` without branches, so that compilers can vectorise. From magnitudes below `min`, a normal number,
/// steps to `min` in that direction.
#[inline(always)]
fn next_away(moved: f32, n: f32, min: f32) -> f32 {
    let bits = moved.to_bits();
    let magnitude = bits & 0x7fff_ffff;
    let (up, down) = (n > 0.0, n < 0.0);
    let outward = up == (moved > 0.0);
    let stepped = if outward { bits.wrapping_add(1) } else { bits.wrapping_sub(1) };
    let from_zero = min.to_bits() | if up { 0 } else { SIGN };
    let next = if magnitude < min.to_bits() { from_zero } else { stepped };
    let last = if outward { INFINITY } else { INFINITY + 1 };
    f32::from_bits(if (up | down) & (magnitude < last) { next } else { bits })
}

const INFINITY: u32 = f32::INFINITY.to_bits();
const SIGN: u32 = (-0.0f32).to_bits();

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
    fn next_away_agrees_with_the_standard_library_from_the_minimum_on() {
        let min = 1e-30;
        let numbers = [0.0, 1e-45, 1e-38, min, 1.0, 1.5, 3e38, f32::MAX, f32::MIN_POSITIVE, f32::INFINITY];
        for moved in numbers.into_iter().flat_map(|x| [x, -x]) {
            let near_zero = moved.abs() < min;
            let [up, down] = if near_zero { [min, -min] } else { [moved.next_up(), moved.next_down()] };
            assert_eq!(next_away(moved, 0.5, min).to_bits(), up.to_bits(), "{moved}");
            assert_eq!(next_away(moved, -0.5, min).to_bits(), down.to_bits(), "{moved}");
            for n in [0.0, -0.0, f32::NAN] {
                assert_eq!(next_away(moved, n, min).to_bits(), moved.to_bits());
            }
        }
        assert!(next_away(f32::NAN, 1.0, min).is_nan() && next_away(f32::NAN, -1.0, min).is_nan());
    }

    /// Subnormal coordinates, and products with them, are slow on many processors.
    #[test]
    fn offsets_from_zero_are_normal_and_negligible() {
        for scale in [1e-30, 1e-18, 1e-3, 1.0, 1e5, 1e18] {
            for p in [Vec3::new(1.0, 0.0, -0.5), Vec3::new(0.3, 1e-44, 0.0), Vec3::ZERO] {
                let p = p * scale;
                let error = 1e-6 * p.abs();
                for n in [Vec3::Y, Vec3::NEG_Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.6, 0.0, -0.8)] {
                    let moved = offset_ray_origin(p, error, n, n);
                    let step = moved - p;
                    for axis in (0..3).filter(|&axis| n[axis] != 0.0) {
                        assert!(step[axis] * n[axis] > 0.0, "{p} {n}: {moved}");
                        assert!(moved[axis].abs() >= 1e-32, "{p} {n}: {moved}");
                        let largest = 2e-14 * scale + 2e-30 + 3.0 * error.max_element();
                        assert!(step[axis].abs() <= largest, "{p} {n}: {moved}");
                    }
                }
            }
        }
        let sides = [Vec3::NAN, Vec3::INFINITY, Vec3::new(f32::INFINITY, 0.0, 0.0)];
        assert!(sides.iter().all(|&p| !offset_ray_origin(p, Vec3::ZERO, Vec3::Y, Vec3::Y).is_finite()));
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
