//! Triangles that nothing shows through, though their material may let light through.
//!
//! Exporters call a material translucent, or masked, for the holes of one texture that many parts share,
//! or for a texture that merely could have some. So the alpha that a lookup can find on a triangle is
//! bounded from below, by the least texel that it may touch; where that is opaque, rays need not ask.

use rayon::prelude::*;

use crate::scene::animation::pose::PosedScene;
use crate::scene::material::{AlphaMode, Material, SurfaceClass, TextureChannel};
use crate::scene::mesh::Mesh;
use crate::scene::texture::sampling::TextureRef;

/// Which triangles of a mesh are solid, a bit for each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpaqueTriangles(Vec<u64>);

impl OpaqueTriangles {
    /// Whether `triangle` is.
    #[inline]
    pub fn contains(&self, triangle: u32) -> bool {
        self.0.get(triangle as usize / 64).is_some_and(|word| word >> (triangle % 64) & 1 == 1)
    }

    /// How many are.
    pub fn count(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }
}

/// Of a bound, what rounding may take off.
const ROUNDING: f32 = 1e-5;

impl PosedScene<'_> {
    /// Which triangles of mesh `mesh` are there and opaque wherever a ray meets them, by their material at
    /// this moment and its textures at their finest.
    pub fn opaque_triangles(&self, mesh: u32) -> OpaqueTriangles {
        let mesh = &self.scene.meshes[mesh as usize];
        let material = &self.materials[mesh.material as usize];
        let triangles = mesh.triangles.len();
        let enough = match material.alpha_mode {
            _ if material.surface_class() == SurfaceClass::Opaque => f32::NEG_INFINITY,
            _ if material.transmits() => f32::INFINITY,
            AlphaMode::Mask(cutoff) => cutoff / (1.0 - ROUNDING),
            // Within rounding of 1 no light is left.
            AlphaMode::Opaque | AlphaMode::Blend => 1.0,
        };
        let alphas = self.alphas(material);
        let word = |word: usize| {
            let here = 64 * word..triangles.min(64 * (word + 1));
            let solid = |&i: &usize| self.least_alpha(mesh, material, &alphas, mesh.triangles[i]) >= enough;
            here.filter(solid).fold(0, |bits, i| bits | 1 << (i % 64))
        };
        OpaqueTriangles((0..triangles.div_ceil(64)).into_par_iter().with_min_len(64).map(word).collect())
    }

    /// The textures of a material that its alpha is a product of, but for those that are opaque all over.
    fn alphas(&self, material: &Material) -> Vec<(TextureRef, TextureChannel)> {
        let base =
            material.base_color.texture.filter(|_| material.alpha_from_base).map(|t| (t, TextureChannel::A));
        let clear = |(t, channel): &(TextureRef, TextureChannel)| {
            let image = self.scene.textures[t.texture as usize].image;
            self.scene.images[image as usize].lowest(*channel).of_all() < 1.0
        };
        [base, material.alpha.texture].into_iter().flatten().filter(clear).collect()
    }

    /// At most the alpha of any place on a triangle.
    fn least_alpha(
        &self,
        mesh: &Mesh,
        material: &Material,
        alphas: &[(TextureRef, TextureChannel)],
        corners: [u32; 3],
    ) -> f32 {
        let of_corner = |c: u32| mesh.colors.get(c as usize).map_or(1.0, |color| color.w);
        let [a, b, c] = corners.map(of_corner);
        let factor = material.alpha.factor * a.min(b).min(c);
        alphas.iter().fold(factor, |least, (t, channel)| {
            let texture = &self.scene.textures[t.texture as usize];
            let image = &self.scene.images[texture.image as usize];
            let bounds = t.transform.bounds(mesh.uvs_at(corners, t.uv_set));
            let [across, down] = texture.texels(bounds, [image.width, image.height]);
            let lowest = image.lowest(*channel);
            let parts = across.iter().flat_map(|x| down.iter().map(move |y| (x, y)));
            least * parts.map(|(x, y)| lowest.over(x, y)).fold(f32::INFINITY, f32::min)
        })
    }
}
