//! The hit filter of [`Accel`](blinn_accel::Accel): alpha masks, and transmittance for shadow rays, from the materials of
//! a scene.

use glam::Vec3;

use crate::integrator::material::opacity::{opacity, transmittance};
use crate::integrator::surface::texture_eval::TextureEvalContext;
use crate::integrator::surface::triangle_plane::TrianglePlane;
use blinn_accel::HitFilter;
use blinn_core::geometry::{HitId, Ray, Rgb};
use blinn_scene::PosedScene;

/// Filters hits by the materials of a scene.
pub struct MaterialHitFilter<'a>(pub &'a PosedScene<'a>);

impl MaterialHitFilter<'_> {
    /// True if a triangle belongs to the surface of a solid (a body).
    pub(crate) fn is_body(&self, id: HitId) -> bool {
        self.0.mesh(id.instance).is_body
    }

    /// The share of light that passes a triangle because it is not there: 1 − its opacity.
    pub(crate) fn uncovered(&self, id: HitId, o: Vec3, d: Vec3) -> f32 {
        let ctx = TextureEvalContext::at(self.0, id, Ray { o, d });
        let material = ctx.triangle.mesh.material;
        1.0 - opacity(self.0, &self.0.materials[material as usize], &ctx)
    }
}

impl HitFilter for MaterialHitFilter<'_> {
    fn accepts(&self, id: HitId, o: Vec3, d: Vec3) -> bool {
        let ctx = TextureEvalContext::at(self.0, id, Ray { o, d });
        let material = ctx.triangle.mesh.material;
        opacity(self.0, &self.0.materials[material as usize], &ctx) > 0.0
    }

    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Rgb {
        let ctx = TextureEvalContext::at(self.0, id, Ray { o, d });
        let material = ctx.triangle.mesh.material;
        let is_body = ctx.triangle.mesh.is_body;
        // Colours above 1 do not amplify light.
        transmittance(self.0, &self.0.materials[material as usize], &ctx, is_body).clamp(Rgb::ZERO, Rgb::ONE)
    }

    fn absorption_step(&self, id: HitId, d: Vec3) -> Rgb {
        let mesh = self.0.mesh(id.instance);
        let material = &self.0.materials[mesh.material as usize];
        let Some(volume) = material.volume.filter(|_| mesh.is_body) else { return Rgb::ZERO };
        let flips_winding = self.0.instances[id.instance as usize].transform.flips_winding;
        let plane = TrianglePlane::new(self.0.world_triangle(id), flips_winding);
        let absorption = volume.absorption() * d.length();
        match plane.front_normal {
            Some(n) if n.dot(d.as_dvec3()) < 0.0 => absorption,
            Some(_) => -absorption,
            None => Rgb::ZERO,
        }
    }
}

#[cfg(test)]
mod tests;
