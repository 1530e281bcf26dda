//! Texture evaluation at a point of a mesh: texture coordinates, vertex colours, textures and material inputs.

use glam::{Vec2, Vec3, Vec4};

use crate::integrator::surface::mesh_triangle::{MeshTriangle, TextureCoords, interpolate_uv};
use crate::integrator::surface::ray_differentials::{BarycentricDifferentials, TriangleCoords};
use crate::integrator::surface::round_hit::axis_barycentrics;
use crate::integrator::surface::triangle_plane::barycentrics;
use blinn_core::geometry::{HitId, Ray};
use blinn_scene::{PosedScene, ScalarInput, TexelSemantics, TextureRef};

/// A point of a mesh at which textures are evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureEvalContext<'s> {
    pub triangle: MeshTriangle<'s>,
    pub coords: TriangleCoords,
    /// The instance's own colour.
    pub tint: Option<Vec3>,
    /// The result of [`TextureEvalContext::normal_map`], if it was sampled in advance.
    pub sampled_normal: Option<(Vec3, f32)>,
}

impl<'s> TextureEvalContext<'s> {
    /// The point where `ray` hits triangle `id`, which it is known to hit. Textures are evaluated at their finest level.
    pub fn at(posed: &'s PosedScene<'s>, id: HitId, ray: Ray) -> TextureEvalContext<'s> {
        let triangle = MeshTriangle::new(posed, id);
        let corners = posed.world_triangle(id);
        let b = match triangle.mesh.has_rounds() {
            true => axis_barycentrics(corners.map(|v| v.as_dvec3()), ray),
            false => barycentrics(corners, ray).map(|b| b as f32),
        };
        TextureEvalContext {
            triangle,
            coords: TriangleCoords { b, differentials: BarycentricDifferentials::POINT },
            tint: posed.scene.instances[id.instance as usize].color,
            sampled_normal: None,
        }
    }

    /// The same point without a footprint: textures are evaluated at their finest level.
    pub fn without_footprint(&self) -> TextureEvalContext<'s> {
        let coords = TriangleCoords { differentials: BarycentricDifferentials::POINT, ..self.coords };
        TextureEvalContext { coords, sampled_normal: None, ..*self }
    }

    /// Interpolates an attribute of the mesh's vertices.
    pub fn interpolate(&self, values: &[Vec3]) -> Vec3 {
        let corners = self.triangle.corners.map(|corner| values[corner as usize]);
        corners[0] * self.coords.b[0] + corners[1] * self.coords.b[1] + corners[2] * self.coords.b[2]
    }

    /// Texture coordinates of a set; the origin if the mesh has no such set.
    pub fn uv(&self, set: u32) -> Vec2 {
        interpolate_uv(self.triangle.uvs(set), self.coords.b)
    }

    /// Position and footprint in a texture.
    fn texture_coords(&self, texture: &TextureRef) -> TextureCoords {
        TextureCoords::new(self.triangle.uvs(texture.uv_set), &self.coords, &texture.transform)
    }

    /// Vertex colour × colour of the instance, linear RGBA; white where both are missing.
    pub fn color(&self) -> Vec4 {
        let tint = self.tint.map_or(Vec4::ONE, |tint| tint.extend(1.0));
        match self.triangle.color(self.coords.b) {
            Some(color) => color * tint,
            None => tint,
        }
    }

    /// A texture filtered over the footprint; white where it is missing.
    #[inline(always)]
    pub fn texture(
        &self,
        posed: &PosedScene,
        texture: Option<&TextureRef>,
        semantics: TexelSemantics,
    ) -> Vec4 {
        match texture {
            Some(texture) => self.filtered_texture(posed, texture, semantics),
            // Most inputs of materials have none.
            None => Vec4::ONE,
        }
    }

    fn filtered_texture(&self, posed: &PosedScene, texture: &TextureRef, semantics: TexelSemantics) -> Vec4 {
        let TextureCoords { uv, footprint } = self.texture_coords(texture);
        let images = &posed.scene.images;
        posed.scene.textures[texture.texture as usize].sample_filtered(images, uv, &footprint, semantics)
    }

    /// The mean vector of a normal map over the footprint, in tangent space, and the variance of its slopes.
    pub fn normal_map(&self, posed: &PosedScene, texture: &TextureRef) -> (Vec3, f32) {
        if let Some(sampled) = self.sampled_normal {
            return sampled;
        }
        let TextureCoords { uv, footprint } = self.texture_coords(texture);
        posed.scene.textures[texture.texture as usize].sample_normal_map(&posed.scene.images, uv, &footprint)
    }

    /// A texture's alpha ([`TexelSemantics::AlphaWeightedColor`]); 1 where the texture is missing.
    pub fn alpha(&self, posed: &PosedScene, texture: Option<&TextureRef>) -> f32 {
        match texture {
            Some(texture) if self.coords.differentials.is_point() => {
                let uv = texture.transform.apply(self.uv(texture.uv_set));
                posed.scene.textures[texture.texture as usize].sample_alpha(&posed.scene.images, uv)
            }
            _ => self.texture(posed, texture, TexelSemantics::AlphaWeightedColor).w,
        }
    }

    /// An input of a material: factor × texture.
    pub fn scalar(&self, posed: &PosedScene, input: &ScalarInput) -> f32 {
        let Some((texture, channel)) = &input.texture else { return input.factor };
        input.factor * channel.of(self.texture(posed, Some(texture), TexelSemantics::Data))
    }
}
