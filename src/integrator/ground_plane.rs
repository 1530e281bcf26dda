//! Where eye rays meet the ground: a plane, met by its equation.

use glam::{DVec3, Vec3};

use crate::accel::RayBatch;
use crate::geometry::{Ray, Rgb};
use crate::integrator::point::Point;
use crate::integrator::shading_batch::Seen;
use crate::integrator::{Coefficients, Frame, Stage};
use crate::scene::{Ground, GroundKind};

impl Frame<'_> {
    /// The height of `ground` relative to the scene's centre, as the f32 that points on it have.
    fn height(&self, ground: &Ground) -> f32 {
        (ground.centre.y - self.posed.centre.y) as f32
    }

    /// The height of a ground that stands in the way of light.
    pub(crate) fn solid_ground(&self) -> Option<f64> {
        let ground = self.ground.as_ref().filter(|g| g.kind == GroundKind::Plane)?;
        Some(f64::from(self.height(ground)))
    }

    /// The t at which each eye ray meets the ground from above; empty without a ground.
    pub(crate) fn meet_ground(&self, rays: &RayBatch) -> Vec<Option<f64>> {
        let Some(ground) = &self.ground else { return Vec::new() };
        let height = f64::from(self.height(ground));
        let near = self.camera.clip.near / self.camera.depth_per_t();
        let meet = |i: usize| {
            let (above, down) = (f64::from(rays.origins[i].y) - height, f64::from(rays.directions[i].y));
            let t = above / -down;
            let met = above > 0.0 && down < 0.0 && t >= near && t <= f64::from(rays.t_max);
            met.then_some(t)
        };
        (0..rays.len()).map(meet).collect()
    }

    /// Adds the ground where a sample's eye ray meets it at `t`, unless it has thinned to nothing.
    pub(crate) fn add_ground(&self, seen: &mut Seen, stage: Stage, sample: usize, ray: Ray, t: f64) {
        let Some(ground) = self.ground.as_ref() else { return };
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let at = (o + d * t).as_vec3();
        let p = Vec3::new(at.x, self.height(ground), at.z);
        let from_middle = p.as_dvec3() + self.posed.centre - ground.centre;
        let alpha = ground.opacity(from_middle.length());
        if !(p.is_finite() && alpha > 0.0) {
            return;
        }
        let catches = ground.kind == GroundKind::ShadowCatcher;
        let color = if catches { Rgb::ONE } else { Ground::GREY };
        let k = Coefficients {
            k_a: color,
            k_d: color,
            k_s: Rgb::ZERO,
            shininess: 1.0,
            k_e: Rgb::ZERO,
            color,
            alpha,
            through: Rgb::ZERO,
        };
        let point = Point::of_ground(sample, seen.add_look(k), catches);
        seen.add_ground(point, (p, ray.d), &k, stage.unlit(self, &k, DVec3::Y));
    }
}
