//! A triangle without what is smooth about it: where a ray meets its plane.

use glam::{DVec3, Vec3};

use super::footprint::Steps;
use crate::geometry::Ray;

/// A triangle in the world, relative to the scene's centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat {
    pub v: [DVec3; 3],
    /// Unit normal of the front; `None` where the triangle has no area to speak of.
    pub front: Option<DVec3>,
    pub steps: Steps,
}

/// Where a ray meets a triangle's plane, pulled onto the triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnFlat {
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
