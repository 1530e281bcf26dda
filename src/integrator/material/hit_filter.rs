//! The accelerator's hit filter: alpha masks, and transmittance for shadow rays, from the materials of a scene.

use glam::Vec3;

use crate::accel::AnyHitFilter;
use crate::geometry::{HitId, Ray, Rgb};
use crate::integrator::material::opacity::{alpha, transmittance};
use crate::integrator::surface::texture_eval::TextureEvalContext;
use crate::scene::PosedScene;

/// Filters hits by the materials of a scene.
pub struct MaterialHitFilter<'a>(pub &'a PosedScene<'a>);

impl AnyHitFilter for MaterialHitFilter<'_> {
    fn accepts(&self, id: HitId, o: Vec3, d: Vec3) -> bool {
        let ctx = TextureEvalContext::at(self.0, id, Ray { o, d });
        let material = ctx.triangle.mesh.material;
        alpha(self.0, &self.0.materials[material as usize], &ctx) > 0.0
    }

    fn transmittance(&self, id: HitId, o: Vec3, d: Vec3) -> Rgb {
        let ctx = TextureEvalContext::at(self.0, id, Ray { o, d });
        let material = ctx.triangle.mesh.material;
        let is_body = ctx.triangle.mesh.is_body;
        // Colours above 1 do not amplify light.
        transmittance(self.0, &self.0.materials[material as usize], &ctx, is_body).clamp(Rgb::ZERO, Rgb::ONE)
    }
}

#[cfg(test)]
mod tests;
