//! What the accelerator asks of materials: is the surface there, and what passes through it.

use glam::Vec3;

use super::coefficients::{alpha, transmitted};
use super::on_mesh::OnMesh;
use crate::accel::Cutout;
use crate::geometry::{HitId, Ray, Rgb};
use crate::scene::PosedScene;

/// Answers the accelerator's questions from a scene's materials.
pub struct Materials<'a>(pub &'a PosedScene<'a>);

impl Cutout for Materials<'_> {
    fn keeps(&self, id: HitId, o: Vec3, d: Vec3) -> bool {
        let on = OnMesh::at(self.0, id, Ray { o, d });
        alpha(self.0, &self.0.materials[on.mesh.material as usize], &on) > 0.0
    }

    fn transmits(&self, id: HitId, o: Vec3, d: Vec3) -> Rgb {
        let on = OnMesh::at(self.0, id, Ray { o, d });
        // Colours beyond 1 do not make light more on its way.
        transmitted(self.0, &self.0.materials[on.mesh.material as usize], &on).clamp(Rgb::ZERO, Rgb::ONE)
    }
}
