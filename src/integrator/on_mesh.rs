//! A place on a mesh, and what is written there: texture coordinates, colours, textures.

use glam::{Vec2, Vec3, Vec4};

use super::flat::Flat;
use super::footprint::Spread;
use crate::geometry::{HitId, Ray};
use crate::scene::{Footprint, Mesh, PosedScene, Reading, TextureRef};

/// A place on a mesh, and how much of it a sample stands for.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnMesh<'s> {
    pub mesh: &'s Mesh,
    /// The triangle's.
    pub corners: [u32; 3],
    /// Barycentrics of those.
    pub b: [f32; 3],
    pub spread: Spread,
    /// The instance's own colour.
    pub tint: Option<Vec3>,
}

impl<'s> OnMesh<'s> {
    /// Where `ray` meets triangle `id`, which it is known to hit. Textures are looked up at their finest.
    pub fn at(posed: &PosedScene<'s>, id: HitId, ray: Ray) -> OnMesh<'s> {
        let mesh = posed.mesh(id.instance);
        let corners = mesh.triangles[id.triangle as usize];
        let flips = posed.instances[id.instance as usize].transform.flips;
        let flat = Flat::new(posed.world_triangle(id), flips);
        let b = flat.meet(flat.front_to(ray), ray).b;
        OnMesh {
            mesh,
            corners,
            b: b.map(|b| b as f32),
            spread: Spread::POINT,
            tint: posed.scene.instances[id.instance as usize].color,
        }
    }

    /// The same place as a point that stands for nothing about it.
    pub fn as_point(&self) -> OnMesh<'s> {
        OnMesh { spread: Spread::POINT, ..*self }
    }

    /// Texture coordinates of a set; the origin where the mesh has no such set.
    pub fn uv(&self, set: u32) -> Vec2 {
        let [a, b, c] = self.uvs(set);
        a * self.b[0] + b * self.b[1] + c * self.b[2]
    }

    fn uvs(&self, set: u32) -> [Vec2; 3] {
        self.mesh.uvs_at(self.corners, set)
    }

    /// Where a texture is looked up, and over what.
    pub fn place(&self, t: &TextureRef) -> (Vec2, Footprint) {
        let step = |by: Vec2| t.transform.step(by);
        let over = if self.spread.is_point() {
            Footprint::POINT
        } else {
            let [right, up] = self.spread.of_uv(self.uvs(t.uv_set));
            Footprint { right: step(right), up: step(up) }
        };
        (t.transform.apply(self.uv(t.uv_set)), over)
    }

    /// The vertex colour times the instance's, linear RGBA; white where there is none.
    pub fn color(&self) -> Vec4 {
        let tint = self.tint.map_or(Vec4::ONE, |tint| tint.extend(1.0));
        if self.mesh.colors.is_empty() {
            return tint;
        }
        let [a, b, c] = self.corners.map(|c| self.mesh.colors[c as usize]);
        (a * self.b[0] + b * self.b[1] + c * self.b[2]) * tint
    }

    /// A texture over what this place stands for; white where it is missing.
    pub fn texture(&self, posed: &PosedScene, texture: Option<&TextureRef>, reading: Reading) -> Vec4 {
        let Some(t) = texture else { return Vec4::ONE };
        let (uv, over) = self.place(t);
        posed.scene.textures[t.texture as usize].filtered(&posed.scene.images, uv, &over, reading)
    }

    /// A texture's alpha, as [`Reading::Covered`] has it; 1 where it is missing.
    pub fn coverage(&self, posed: &PosedScene, texture: Option<&TextureRef>) -> f32 {
        match texture {
            Some(t) if self.spread.is_point() => {
                let uv = t.transform.apply(self.uv(t.uv_set));
                posed.scene.textures[t.texture as usize].alpha(&posed.scene.images, uv)
            }
            _ => self.texture(posed, texture, Reading::Covered).w,
        }
    }
}
