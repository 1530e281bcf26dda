//! A triangle of a mesh: its vertex attributes, and interpolated texture coordinates with their footprint.

use glam::{Vec2, Vec4};

use crate::integrator::surface::ray_differentials::TriangleCoords;
use blinn_scene::{Footprint, Mesh, UvTransform};

/// A triangle of a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshTriangle<'s> {
    pub mesh: &'s Mesh,
    /// Indices of the corners.
    pub corners: [u32; 3],
}

/// A position in a texture, and the part of the texture that a sample covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureCoords {
    pub uv: Vec2,
    pub footprint: Footprint,
}

impl MeshTriangle<'_> {
    /// Texture coordinates of a set at the corners.
    #[inline(always)]
    pub fn uvs(&self, set: u32) -> [Vec2; 3] {
        self.mesh.uvs_at(self.corners, set)
    }

    /// The interpolated vertex colour, linear RGBA; `None` in a mesh without vertex colours.
    #[inline(always)]
    pub fn color(&self, b: [f32; 3]) -> Option<Vec4> {
        if self.mesh.colors.is_empty() {
            return None;
        }
        let [c0, c1, c2] = self.corners.map(|c| self.mesh.colors[c as usize]);
        Some(c0 * b[0] + c1 * b[1] + c2 * b[2])
    }
}

/// Interpolates texture coordinates of the corners.
#[inline(always)]
pub(crate) fn interpolate_uv(uvs: [Vec2; 3], b: [f32; 3]) -> Vec2 {
    uvs[0] * b[0] + uvs[1] * b[1] + uvs[2] * b[2]
}

impl TextureCoords {
    /// At a point of a triangle with texture coordinates `uvs` at its corners, after a texture's transform.
    #[inline(always)]
    pub fn new(uvs: [Vec2; 3], coords: &TriangleCoords, transform: &UvTransform) -> TextureCoords {
        let [dx, dy] = coords.differentials.uv_steps(uvs).map(|step| transform.transform_vector(step));
        // uvs that are not finite must not make a point's footprint NaN.
        let is_point = coords.differentials.is_point();
        let finest = |step: Vec2| if is_point { Vec2::ZERO } else { step };
        TextureCoords {
            uv: transform.apply(interpolate_uv(uvs, coords.b)),
            footprint: Footprint { dx: finest(dx), dy: finest(dy) },
        }
    }
}
