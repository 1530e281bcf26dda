//! Finds triangles that are opaque although their material may be alpha-masked or translucent.
//!
//! Exporters mark whole materials as masked or blended because one texture, shared by many parts, has
//! holes. The alpha of each triangle is therefore bounded from below by the minimum of the texels that
//! it can touch (a min-mip pyramid). Where that bound is opaque, any-hit filters are skipped.

use rayon::prelude::*;

use crate::animation::posed_scene::PosedScene;
use crate::material::{AlphaMode, Material, SurfaceClass};
use crate::mesh::Mesh;
use crate::texture::sampling::TextureRef;
use crate::texture::texels::TextureChannel;

/// The opaque triangles of a mesh: one bit for each triangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpaqueTriangles(Vec<u64>);

impl OpaqueTriangles {
    /// Returns true if `triangle` is opaque.
    #[inline]
    pub fn contains(&self, triangle: u32) -> bool {
        self.0.get(triangle as usize / 64).is_some_and(|word| word >> (triangle % 64) & 1 == 1)
    }

    /// Returns the number of opaque triangles.
    pub fn count(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }
}

/// Relative rounding error of the alpha bound.
const ROUNDING: f32 = 1e-5;

impl PosedScene<'_> {
    /// Finds the triangles of mesh `mesh` that are opaque wherever a ray hits them, given its material at
    /// this time and its textures at full resolution.
    pub fn opaque_triangles(&self, mesh: u32) -> OpaqueTriangles {
        let mesh = &self.scene.meshes[mesh as usize];
        let material = &self.materials[mesh.material as usize];
        let triangles = mesh.triangles.len();
        let threshold = match material.alpha_mode {
            _ if material.surface_class() == SurfaceClass::Opaque => f32::NEG_INFINITY,
            _ if material.transmits() || material.diffuses_inside() => f32::INFINITY,
            AlphaMode::Mask(cutoff) => cutoff / (1.0 - ROUNDING),
            // Transmittance within rounding of 0 counts as 0.
            AlphaMode::Opaque | AlphaMode::Blend => 1.0,
        };
        let alpha_textures = self.alpha_textures(material);
        let word = |word: usize| {
            let range = 64 * word..triangles.min(64 * (word + 1));
            let is_opaque =
                |&i: &usize| self.min_alpha(mesh, material, &alpha_textures, mesh.triangles[i]) >= threshold;
            range.filter(is_opaque).fold(0, |bits, i| bits | 1 << (i % 64))
        };
        OpaqueTriangles((0..triangles.div_ceil(64)).into_par_iter().with_min_len(64).map(word).collect())
    }

    /// Returns the textures whose product is the material's alpha, except those that are opaque everywhere.
    fn alpha_textures(&self, material: &Material) -> Vec<(TextureRef, TextureChannel)> {
        let base =
            material.base_color.texture.filter(|_| material.alpha_from_base).map(|t| (t, TextureChannel::A));
        let has_holes = |(t, channel): &(TextureRef, TextureChannel)| {
            let image = self.scene.textures[t.texture as usize].image;
            self.scene.images[image as usize].min_mip(*channel).min() < 1.0
        };
        [base, material.alpha.texture].into_iter().flatten().filter(has_holes).collect()
    }

    /// Returns a lower bound of the alpha on a triangle.
    fn min_alpha(
        &self,
        mesh: &Mesh,
        material: &Material,
        alpha_textures: &[(TextureRef, TextureChannel)],
        corners: [u32; 3],
    ) -> f32 {
        let vertex_alpha = |c: u32| match mesh.colors.get(c as usize) {
            // The instances of a mesh may have weights of their own, at other times as well.
            Some(_) if mesh.morphs_alpha(c) => 0.0,
            Some(color) => color.w,
            None => 1.0,
        };
        let [a, b, c] = corners.map(vertex_alpha);
        let factor = material.alpha.factor * a.min(b).min(c);
        alpha_textures.iter().fold(factor, |min, (t, channel)| {
            let texture = &self.scene.textures[t.texture as usize];
            let image = &self.scene.images[texture.image as usize];
            if mesh.morphs_uvs(t.uv_set) {
                return min * image.min_mip(*channel).min();
            }
            let bounds = t.transform.bounds_of_triangle(mesh.uvs_at(corners, t.uv_set));
            let [across, down] = texture.texel_ranges(bounds, [image.width, image.height]);
            let min_mip = image.min_mip(*channel);
            let ranges = across.iter().flat_map(|x| down.iter().map(move |y| (x, y)));
            min * ranges.map(|(x, y)| min_mip.min_over(x, y)).fold(f32::INFINITY, f32::min)
        })
    }
}
