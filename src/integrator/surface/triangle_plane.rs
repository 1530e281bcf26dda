//! A triangle without what is smooth about it: where a ray meets its plane.

use glam::{DVec3, Vec3};

use crate::geometry::Ray;
use crate::integrator::surface::ray_differentials::Steps;

/// A triangle in the world, relative to the scene's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flat {
    pub v: [DVec3; 3],
    /// Unit normal of the front; `None` where the triangle has no area to speak of.
    pub front: Option<DVec3>,
    pub steps: Steps,
}

/// Where a ray meets a triangle's plane, pulled onto the triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OnFlat {
    pub t: f64,
    /// The ray's direction by the normal, and 1 over that.
    pub facing: f64,
    pub per_facing: f64,
    /// Barycentrics.
    pub b: [f64; 3],
}

impl Flat {
    /// With corners `v`, seen from the front where they go round counter-clockwise, or, if that `flips`,
    /// clockwise.
    #[inline(always)]
    pub fn new(v: [Vec3; 3], flips: bool) -> Flat {
        let v = v.map(|v| v.as_dvec3());
        let e = [v[1] - v[0], v[2] - v[0]];
        let wound = e[0].cross(e[1]) * if flips { -1.0 } else { 1.0 };
        let front = wound.try_normalize();
        Flat { v, front, steps: Steps::new(e, front.unwrap_or(DVec3::ZERO)) }
    }

    /// Its front's normal; without area it faces whoever looks.
    #[inline(always)]
    pub fn front_to(&self, ray: Ray) -> DVec3 {
        match self.front {
            Some(front) => front,
            None => -ray.d.as_dvec3().normalize_or(DVec3::NEG_Z),
        }
    }

    /// Where `ray` meets it, which it is known to do; `front` is [`Flat::front_to`] it.
    #[inline(always)]
    pub fn meet(&self, front: DVec3, ray: Ray) -> OnFlat {
        let v0 = self.v[0];
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let facing = front.dot(d);
        let per_facing = 1.0 / facing;
        let t = (v0 - o).dot(front) * per_facing;
        OnFlat { t, facing, per_facing, b: on_triangle(self.steps.of(o - v0 + d * t)) }
    }
}

/// Barycentrics of where `ray` meets the triangle of corners `v`, which it is known to do: those of [`Flat::meet`]
/// but for rounding, for less where nothing else is asked of the triangle (Möller and Trumbore, 1997).
#[inline(always)]
pub(crate) fn barycentrics(v: [Vec3; 3], ray: Ray) -> [f64; 3] {
    let [v0, v1, v2] = v.map(|v| v.as_dvec3());
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let (e1, e2, from) = (v1 - v0, v2 - v0, o - v0);
    let (across, along) = (d.cross(e2), from.cross(e1));
    let per = 1.0 / across.dot(e1);
    on_triangle([across.dot(from) * per, along.dot(d) * per])
}

/// All three barycentrics of a point, of which 1 and 2 are `u` and `v`; pulled onto the triangle where
/// rounding left it.
#[inline(always)]
fn on_triangle([u, v]: [f64; 2]) -> [f64; 3] {
    let finite = u.is_finite() & v.is_finite();
    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
    let sum = u + v;
    let beyond = sum > 1.0;
    let per = if beyond { 1.0 / sum } else { 1.0 };
    let b = [if beyond { 0.0 } else { 1.0 - sum }, u * per, v * per];
    let third = 1.0 / 3.0;
    [if finite { b[0] } else { third }, if finite { b[1] } else { third }, if finite { b[2] } else { third }]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of all shapes, from all sides, through places inside and on the border; edge on and without area.
    #[test]
    fn both_ways_find_the_same_barycentrics() {
        let mut state = 3u32;
        let mut any = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 23) as f32 - 1.0
        };
        let mut compared = 0;
        for i in 0..5000 {
            let mut vector = || Vec3::new(any(), any(), any());
            let (v0, o) = (vector(), vector() * 3.0);
            // The third corner may be very near the line through the others.
            let (e1, e2) = (vector(), vector() * if i % 3 == 0 { 1e-3 } else { 1.0 });
            let v = [v0, v0 + e1, v0 + e2 + e1 * if i % 3 == 0 { 0.4 } else { 0.0 }];
            let weights = vector().abs();
            let weights = weights / weights.element_sum();
            let p = v[0] * weights.x + v[1] * weights.y + v[2] * weights.z;
            let ray = Ray { o, d: p - o };
            let flat = Flat::new(v, i % 2 == 0);
            let facing = flat.front_to(ray).dot(ray.d.as_dvec3().normalize());
            let (one, other) = (flat.meet(flat.front_to(ray), ray).b, barycentrics(v, ray));
            if facing.abs() > 1e-3 {
                assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-9), "{one:?} {other:?}");
                compared += 1;
            }
        }
        assert!(compared > 4900, "{compared}");
        let third = [1.0 / 3.0; 3];
        let flat = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(barycentrics(flat, Ray { o: Vec3::NEG_X, d: Vec3::X }), third);
        assert_eq!(barycentrics([Vec3::ZERO, Vec3::X, Vec3::X], Ray { o: Vec3::Z, d: Vec3::NEG_Z }), third);
    }
}
