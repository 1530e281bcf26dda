//! A place on a mesh, and what is written there: texture coordinates, colours, textures.

use glam::{Vec2, Vec3, Vec4};

use crate::geometry::{HitId, Ray};
use crate::integrator::surface::ray_differentials::Spread;
use crate::integrator::surface::texture_batch::Fetched;
use crate::integrator::surface::triangle_plane::barycentrics;
use crate::scene::{Footprint, Mesh, PosedScene, TexelSemantics, Texture, TextureRef, UvTransform};

/// A place on a mesh, and how much of it a sample stands for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OnMesh<'s> {
    pub mesh: &'s Mesh,
    /// The triangle's.
    pub corners: [u32; 3],
    /// Barycentrics of those.
    pub b: [f32; 3],
    pub spread: Spread,
    /// The instance's own colour.
    pub tint: Option<Vec3>,
    /// What textures were found to have here: the number is the place's there.
    pub fetched: Option<(&'s Fetched<'s>, usize)>,
}

/// Texture coordinates between those of three corners.
#[inline(always)]
fn between([a, b, c]: [Vec2; 3], by: [f32; 3]) -> Vec2 {
    a * by[0] + b * by[1] + c * by[2]
}

/// Where a texture is looked up, and over what: at barycentrics `b` of corners with these texture coordinates.
#[inline(always)]
pub(crate) fn place(uvs: [Vec2; 3], b: [f32; 3], spread: Spread, to: &UvTransform) -> (Vec2, Footprint) {
    let [right, up] = spread.of_uv(uvs).map(|by| to.transform_vector(by));
    let point = spread.is_point();
    let over = |step: Vec2| if point { Vec2::ZERO } else { step };
    (to.apply(between(uvs, b)), Footprint { dx: over(right), dy: over(up) })
}

impl<'s> OnMesh<'s> {
    /// Where `ray` meets triangle `id`, which it is known to hit. Textures are looked up at their finest.
    pub fn at(posed: &PosedScene<'s>, id: HitId, ray: Ray) -> OnMesh<'s> {
        let mesh = posed.mesh(id.instance);
        let corners = mesh.triangles[id.triangle as usize];
        OnMesh {
            mesh,
            corners,
            b: barycentrics(posed.world_triangle(id), ray).map(|b| b as f32),
            spread: Spread::POINT,
            tint: posed.scene.instances[id.instance as usize].color,
            fetched: None,
        }
    }

    /// The same place as a point that stands for nothing about it.
    pub fn as_point(&self) -> OnMesh<'s> {
        OnMesh { spread: Spread::POINT, fetched: None, ..*self }
    }

    /// Texture coordinates of a set; the origin where the mesh has no such set.
    pub fn uv(&self, set: u32) -> Vec2 {
        between(self.uvs(set), self.b)
    }

    fn uvs(&self, set: u32) -> [Vec2; 3] {
        self.mesh.uvs_at(self.corners, set)
    }

    /// Where a texture is looked up, and over what.
    pub fn place(&self, t: &TextureRef) -> (Vec2, Footprint) {
        place(self.uvs(t.uv_set), self.b, self.spread, &t.transform)
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
    pub fn texture(&self, posed: &PosedScene, texture: Option<&TextureRef>, reading: TexelSemantics) -> Vec4 {
        let Some(t) = texture else { return Vec4::ONE };
        if let Some(found) = self.fetched.and_then(|(fetched, i)| fetched.get(t, reading, i)) {
            return found;
        }
        let (uv, over) = self.place(t);
        posed.scene.textures[t.texture as usize].sample_filtered(&posed.scene.images, uv, &over, reading)
    }

    /// The mean vector of a normal map over what this place stands for, and the variance of its slopes.
    pub fn direction(&self, posed: &PosedScene, t: &TextureRef) -> (Vec3, f32) {
        // A point of the map has no spread.
        if let Some(found) = self.fetched.and_then(|(fetched, i)| fetched.get(t, TexelSemantics::Data, i)) {
            return (Texture::decode_normal(found), 0.0);
        }
        let (uv, over) = self.place(t);
        posed.scene.textures[t.texture as usize].sample_normal_map(&posed.scene.images, uv, &over)
    }

    /// A texture's alpha, as [`TexelSemantics::AlphaWeightedColor`] has it; 1 where it is missing.
    pub fn coverage(&self, posed: &PosedScene, texture: Option<&TextureRef>) -> f32 {
        match texture {
            Some(t) if self.spread.is_point() => {
                let uv = t.transform.apply(self.uv(t.uv_set));
                posed.scene.textures[t.texture as usize].sample_alpha(&posed.scene.images, uv)
            }
            _ => self.texture(posed, texture, TexelSemantics::AlphaWeightedColor).w,
        }
    }
}
