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

    /// True if a triangle's material transmits light diffusely into a body.
    pub(crate) fn diffuses_inside(&self, id: HitId) -> bool {
        self.0.materials[self.0.mesh(id.instance).material as usize].diffuses_inside()
    }

    /// The product of a direction and the normal of a triangle's front face; `None` for a degenerate triangle.
    fn front_cos(&self, id: HitId, d: Vec3) -> Option<f64> {
        let flips_winding = self.0.instances[id.instance as usize].transform.flips_winding;
        let plane = TrianglePlane::new(self.0.world_triangle(id), flips_winding);
        plane.front_normal.map(|n| n.dot(d.as_dvec3()))
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
        let material = &self.0.materials[ctx.triangle.mesh.material as usize];
        let is_body = ctx.triangle.mesh.is_body;
        // Light that a body has diffused where it entered leaves it straight.
        if is_body && material.diffuses_inside() && self.front_cos(id, d).is_some_and(|cos| cos > 0.0) {
            return Rgb::ONE;
        }
        // Colours above 1 do not amplify light.
        transmittance(self.0, material, &ctx, is_body).clamp(Rgb::ZERO, Rgb::ONE)
    }

    fn absorption_step(&self, id: HitId, d: Vec3) -> Rgb {
        let mesh = self.0.mesh(id.instance);
        let material = &self.0.materials[mesh.material as usize];
        let Some(volume) = material.volume.filter(|_| mesh.is_body) else { return Rgb::ZERO };
        let absorption = volume.absorption() * d.length();
        match self.front_cos(id, d) {
            Some(cos) if cos < 0.0 => absorption,
            Some(_) => -absorption,
            None => Rgb::ZERO,
        }
    }
}

#[cfg(test)]
mod tests;
