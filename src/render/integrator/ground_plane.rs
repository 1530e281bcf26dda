//! The ground plane: its intersection with path rays, and what it hides from lights. It lies below the scene's bounds, so
//! that rays from above meet nothing behind it.

use glam::{DVec3, Vec3};

use crate::integrator::frame::Frame;
use crate::integrator::material::coefficients::{BaseTerms, Coefficients};
use crate::integrator::path_rays::PathRays;
use crate::integrator::shading_batch::{ShadingBatch, ShadingPoint};
use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use crate::integrator::surface::surface_hit::SurfaceHit;
use blinn_accel::RayBatch;
use blinn_core::geometry::{HitId, Ray, Rgb, offset_ray_origin};
use blinn_scene::{Ground, GroundKind};

impl Frame<'_> {
    /// Height of `ground` relative to the scene's centre, as the f32 that its points have.
    fn ground_height(&self, ground: &Ground) -> f32 {
        (ground.centre.y - self.posed.centre.y) as f32
    }

    /// Height of a ground that blocks light. A shadow catcher casts no shadows itself.
    pub(crate) fn opaque_ground_height(&self) -> Option<f64> {
        let ground = self.ground.as_ref().filter(|g| g.kind == GroundKind::Plane)?;
        Some(f64::from(self.ground_height(ground)))
    }

    /// True if only the shadows on the ground are seen.
    pub(crate) fn has_shadow_catcher(&self) -> bool {
        self.ground.is_some_and(|ground| ground.kind == GroundKind::ShadowCatcher)
    }

    /// The t where each ray hits the ground from above; empty without a ground. Eye rays miss it in front of the near
    /// plane.
    pub(crate) fn intersect_ground(&self, rays: &RayBatch, is_secondary: bool) -> Vec<Option<f64>> {
        let Some(ground) = &self.ground else { return Vec::new() };
        let height = f64::from(self.ground_height(ground));
        let near = if is_secondary { 0.0 } else { self.camera.clip.near / self.camera.depth_per_t() };
        let intersect = |i: usize| {
            let above = f64::from(rays.origins[i].y) - height;
            let d_y = f64::from(rays.directions[i].y);
            let t = above / -d_y;
            let hits = above > 0.0 && d_y < 0.0 && t >= near && t <= f64::from(rays.t_max);
            hits.then_some(t)
        };
        (0..rays.len()).map(intersect).collect()
    }

    /// Adds the ground where it is in front of the rays' hits. `ground_t`, by path, loses what was added.
    pub(crate) fn gather_ground(
        &self,
        batch: &mut ShadingBatch,
        rays: &PathRays,
        ground_t: &mut [Option<f64>],
        base_radiance: impl Fn(BaseTerms, DVec3) -> Rgb,
    ) {
        if ground_t.is_empty() {
            return;
        }
        for ray_hit in rays.iter() {
            // The t of a hit has an error of about one ulp: an object on the ground is in front of it.
            let in_front = |t: &mut f64| ray_hit.hit.is_miss() || (*t as f32) < ray_hit.hit.t.next_down();
            if let Some(t) = ground_t[ray_hit.path].take_if(in_front) {
                self.add_ground_point(batch, ray_hit.path, ray_hit.ray, t, &base_radiance);
            }
        }
    }

    /// Adds the point of the ground at `t`, unless the ground has faded out there.
    fn add_ground_point(
        &self,
        batch: &mut ShadingBatch,
        path: usize,
        ray: Ray,
        t: f64,
        base_radiance: impl Fn(BaseTerms, DVec3) -> Rgb,
    ) {
        let Some(ground) = self.ground.as_ref() else { return };
        let at = (ray.o.as_dvec3() + ray.d.as_dvec3() * t).as_vec3();
        let p = Vec3::new(at.x, self.ground_height(ground), at.z);
        let from_centre = p.as_dvec3() + self.posed.centre - ground.centre;
        let opacity = ground.opacity(from_centre.length());
        if !(p.is_finite() && opacity > 0.0) {
            return;
        }
        let is_shadow_catcher = ground.kind == GroundKind::ShadowCatcher;
        let color = if is_shadow_catcher { Rgb::ONE } else { Ground::GREY };
        let k = Coefficients::matte(color, opacity);
        let n = DVec3::Y;
        let hit = SurfaceHit {
            p,
            // Its height is exact.
            ray_origin: offset_ray_origin(p, Vec3::ZERO, Vec3::Y, Vec3::Y),
            terminator_offset: Vec3::ZERO,
            n_g: n,
            n_v: n,
            coords: TriangleCoords { b: [0.0; 3], differentials: BarycentricDifferentials::POINT },
        };
        let (block, lane) = batch.soa.append(1);
        block.store_hit(lane, ray.d, &hit);
        block.set_material(lane, n, &k, base_radiance(k.base_terms(), n));
        batch.points.push(ShadingPoint { path, id: HitId::NONE, is_shadow_catcher });
    }

    /// True if the ground is between `from` and `from + to_light`, or between `from` and infinity in that direction.
    pub(crate) fn ground_blocks(&self, from: Vec3, to_light: DVec3, to_infinity: bool) -> bool {
        let Some(height) = self.opaque_ground_height() else { return false };
        let from = f64::from(from.y);
        let end = match to_infinity {
            true if to_light.y == 0.0 => from,
            true => f64::INFINITY.copysign(to_light.y),
            false => from + to_light.y,
        };
        (from >= height) != (end >= height)
    }
}
