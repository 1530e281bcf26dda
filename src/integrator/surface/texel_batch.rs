//! Batched texture lookups: every texture of a material, sampled at all points of a triangle in one block.

use std::ops::Range;

use glam::Vec4;

use crate::integrator::surface::mesh_triangle::{MeshTriangle, TextureCoords};
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{HIT_LANES, LANES};
use crate::scene::{Image, PosedScene, SampleCoords, TexelSemantics, Texture, TextureRef};
use crate::simd::{AutovecKernel, SimdLevel};

/// Filtered texels of all textures of one material, by the points' lanes in their [`PointBlock`].
#[derive(Debug, Default)]
pub(crate) struct TexelBatch<'a> {
    material: Option<u32>,
    /// Each use of a texture by the material.
    uses: Vec<TextureUse<'a>>,
    /// The texels of each distinct use.
    texels: Vec<[Option<Vec4>; LANES]>,
}

/// A use of a texture by a material.
#[derive(Clone, Copy, Debug)]
struct TextureUse<'a> {
    texture: &'a TextureRef,
    semantics: TexelSemantics,
    /// False for normal maps: filtered, they need the variance of slopes, which
    /// [`Texture::sample_normal_map`] computes.
    filterable: bool,
    /// Index of its texels in [`TexelBatch::texels`].
    texels: usize,
}

impl<'a> TexelBatch<'a> {
    /// Samples every texture of a material at the points of a triangle in the given lanes.
    pub fn sample(
        &mut self,
        simd: SimdLevel,
        posed: &'a PosedScene,
        material: u32,
        triangle: MeshTriangle,
        block: &PointBlock,
        lanes: Range<usize>,
    ) {
        if self.material != Some(material) {
            self.set_material(posed, material);
        }
        for (i, out) in self.texels.iter_mut().enumerate() {
            let Some(texture_use) = self.uses.iter().find(|u| u.texels == i) else { continue };
            simd.run(SampleTexture {
                triangle,
                block,
                lanes: lanes.clone(),
                texture: &posed.scene.textures[texture_use.texture.texture as usize],
                images: &posed.scene.images,
                texture_use,
                out,
            });
        }
    }

    /// Lists the textures of a material. Equal uses share their texels.
    fn set_material(&mut self, posed: &'a PosedScene, material: u32) {
        self.material = Some(material);
        self.uses.clear();
        let material = &posed.materials[material as usize];
        let normal_map = material.normal.as_ref().map(|map| (&map.texture, TexelSemantics::Data, false));
        let textures =
            material.textures_with_semantics().map(|(texture, semantics)| (texture, semantics, true));
        let mut count = 0;
        for (texture, semantics, filterable) in textures.chain(normal_map) {
            let equal =
                |u: &&TextureUse| (u.texture, u.semantics, u.filterable) == (texture, semantics, filterable);
            let texels = self.uses.iter().find(equal).map_or(count, |u| u.texels);
            count = count.max(texels + 1);
            self.uses.push(TextureUse { texture, semantics, filterable, texels });
        }
        self.texels.resize(count, [None; LANES]);
    }

    /// The filtered texel of a texture in lane `i`; `None` where it has to be sampled alone.
    #[inline(always)]
    pub fn get(&self, texture: &TextureRef, semantics: TexelSemantics, i: usize) -> Option<Vec4> {
        let matches = |u: &&TextureUse| std::ptr::eq(u.texture, texture) && u.semantics == semantics;
        self.uses.iter().find(matches).and_then(|u| self.texels[u.texels][i])
    }
}

/// Samples one texture at a range of points.
struct SampleTexture<'a, 's> {
    triangle: MeshTriangle<'s>,
    block: &'a PointBlock,
    lanes: Range<usize>,
    texture: &'a Texture,
    images: &'a [Image],
    texture_use: &'a TextureUse<'a>,
    out: &'a mut [Option<Vec4>; LANES],
}

impl AutovecKernel for SampleTexture<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let SampleTexture { triangle, block, lanes, texture, images, texture_use, out } = self;
        let &TextureUse { texture: texture_ref, semantics, filterable, .. } = texture_use;
        let uvs = triangle.uvs(texture_ref.uv_set);
        for first in lanes.clone().step_by(HIT_LANES) {
            let mut coords = SampleCoords::<HIT_LANES>::ORIGIN;
            for i in 0..HIT_LANES {
                let point = block.coords(first % LANES + i);
                let TextureCoords { uv, footprint } = TextureCoords::new(uvs, &point, &texture_ref.transform);
                coords.set(i, uv, footprint);
            }
            let end = lanes.end.min(first + HIT_LANES);
            texture.sample_batch(images, &coords, semantics, filterable, &mut out[first..end]);
        }
    }
}
