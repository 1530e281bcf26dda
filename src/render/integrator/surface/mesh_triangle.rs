//! A triangle of a mesh: its vertex attributes, and interpolated texture coordinates with their footprint.

use glam::{Vec2, Vec4};

use crate::integrator::surface::ray_differentials::TriangleCoords;
use blinn_core::geometry::HitId;
use blinn_scene::{Footprint, Mesh, PosedScene, UvTransform, uvs_at};

/// A triangle of a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshTriangle<'s> {
    pub mesh: &'s Mesh,
    /// Indices of the corners.
    pub corners: [u32; 3],
    /// Sets of texture coordinates at this time.
    pub uvs: &'s [Vec<Vec2>],
    /// Vertex colours at this time; empty in a mesh without.
    pub colors: &'s [Vec4],
}

/// A position in a texture, and the part of the texture that a sample covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureCoords {
    pub uv: Vec2,
    pub footprint: Footprint,
}

impl<'s> MeshTriangle<'s> {
    /// The triangle `id` of a posed scene.
    #[inline(always)]
    pub fn new(posed: &'s PosedScene<'s>, id: HitId) -> MeshTriangle<'s> {
        let mesh = posed.mesh(id.instance);
        let corners = mesh.corners(id.triangle);
        MeshTriangle { mesh, corners, uvs: posed.uvs(id.instance), colors: posed.colors(id.instance) }
    }

    /// Texture coordinates of a set at the corners.
    #[inline(always)]
    pub fn uvs(&self, set: u32) -> [Vec2; 3] {
        uvs_at(self.uvs, self.corners, set)
    }

    /// The interpolated vertex colour, linear RGBA; `None` in a mesh without vertex colours. A component that is the same
    /// at all corners is exactly that: an alpha at the cutoff must not fall below it.
    #[inline(always)]
    pub fn color(&self, b: [f32; 3]) -> Option<Vec4> {
        if self.colors.is_empty() {
            return None;
        }
        let [c0, c1, c2] = self.corners.map(|c| self.colors[c as usize]);
        let is_constant = c0.cmpeq(c1) & c0.cmpeq(c2);
        Some(Vec4::select(is_constant, c0, c0 * b[0] + c1 * b[1] + c2 * b[2]))
    }
}

/// Interpolates texture coordinates of the corners. One that is the same at all corners is exactly that: on the border
/// of two texels, it stays on its side.
#[inline(always)]
pub(crate) fn interpolate_uv(uvs: [Vec2; 3], b: [f32; 3]) -> Vec2 {
    let is_constant = uvs[0].cmpeq(uvs[1]) & uvs[0].cmpeq(uvs[2]);
    Vec2::select(is_constant, uvs[0], uvs[0] * b[0] + uvs[1] * b[1] + uvs[2] * b[2])
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Barycentrics whose f32 sum is not exactly 1.
    fn barycentrics() -> impl Iterator<Item = [f32; 3]> {
        (0..1000).map(|i| {
            let (x, y) = (f64::from(i % 37) / 74.1, f64::from(i) / 2001.0);
            [x as f32, y as f32, (1.0 - x - y) as f32]
        })
    }

    #[test]
    fn what_is_the_same_at_all_corners_is_constant() {
        let color = Vec4::new(0.7, 0.1, 1.0 / 3.0, 0.7);
        let mesh = Mesh::default();
        let triangle = MeshTriangle { mesh: &mesh, corners: [0, 1, 2], uvs: &[], colors: &[color; 3] };
        let uv = Vec2::new(0.1, 0.7);
        assert!(barycentrics().any(|b| uv.x * b[0] + uv.x * b[1] + uv.x * b[2] != uv.x));
        for b in barycentrics() {
            assert_eq!(triangle.color(b), Some(color));
            assert_eq!(interpolate_uv([uv; 3], b), uv);
            // One component alone.
            let ramp = [0.0, 0.5, 1.0].map(|u| Vec2::new(u, uv.y));
            assert_eq!(interpolate_uv(ramp, b), Vec2::new(0.5 * b[1] + b[2], uv.y));
        }
    }
}
