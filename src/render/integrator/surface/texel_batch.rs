//! Batched texture lookups: every texture of a material, sampled at the points of a block.

use std::ops::Range;

use glam::{Vec2, Vec3, Vec4};

use crate::integrator::surface::mesh_triangle::{MeshTriangle, TextureCoords};
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::LANES;
use blinn_core::simd::{AutovecKernel, SimdLevel};
use blinn_scene::{Image, PosedScene, SampleCoords, TexelSemantics, Texture, TextureRef};

/// Filtered texels of all textures of one material, by the points' lanes in their [`PointBlock`].
#[derive(Debug, Default)]
pub(crate) struct TexelBatch<'a> {
    material: Option<u32>,
    /// Each use of a texture by the material.
    uses: Vec<TextureUse<'a>>,
    /// Texture coordinates of the points' triangles, one entry for each set in use.
    uv_sets: Vec<CornerUvs>,
    /// The texels of each distinct use.
    texels: Vec<TexelLanes>,
}

/// A use of a texture by a material.
#[derive(Clone, Copy, Debug)]
struct TextureUse<'a> {
    texture: &'a TextureRef,
    semantics: TexelSemantics,
    /// Index of its texels in [`TexelBatch::texels`].
    texels: usize,
}

/// A set of texture coordinates at the corners of each point's triangle.
#[derive(Debug)]
struct CornerUvs {
    set: u32,
    uvs: [[[f32; LANES]; 2]; 3],
}

/// Filtered texels of the points of a block.
#[derive(Clone, Debug)]
pub(crate) struct TexelLanes {
    /// Linear RGBA; the mean vector and the variance of slopes of normal maps.
    pub rgba: [[f32; LANES]; 4],
}

/// Points that are sampled together.
const SAMPLE_LANES: usize = 16;

impl CornerUvs {
    #[inline(always)]
    fn get(&self, i: usize) -> [Vec2; 3] {
        let [a, b, c] = &self.uvs;
        let uv = |of: &[[f32; LANES]; 2]| Vec2::new(of[0][i], of[1][i]);
        [uv(a), uv(b), uv(c)]
    }
}

impl TexelLanes {
    const ZERO: TexelLanes = TexelLanes { rgba: [[0.0; LANES]; 4] };
    /// The texels of a missing texture: white.
    const WHITE: TexelLanes = TexelLanes { rgba: [[1.0; LANES]; 4] };
}

impl<'a> TexelBatch<'a> {
    /// Lists the textures of a material. Equal uses share their texels.
    pub fn set_material(&mut self, posed: &'a PosedScene, material: u32) {
        if self.material == Some(material) {
            return;
        }
        self.material = Some(material);
        self.uses.clear();
        self.uv_sets.clear();
        let material = &posed.materials[material as usize];
        let normal_maps = material.normal_maps().map(|map| (&map.texture, TexelSemantics::Normal));
        let mut count = 0;
        for (texture, semantics) in material.textures_with_semantics().chain(normal_maps) {
            let equal = |u: &&TextureUse| (u.texture, u.semantics) == (texture, semantics);
            let texels = self.uses.iter().find(equal).map_or(count, |u| u.texels);
            count = count.max(texels + 1);
            self.uses.push(TextureUse { texture, semantics, texels });
            let set = texture.uv_set;
            if self.uv_sets.iter().all(|uvs| uvs.set != set) {
                self.uv_sets.push(CornerUvs { set, uvs: [[[0.0; LANES]; 2]; 3] });
            }
        }
        self.texels.resize(count, TexelLanes::ZERO);
    }

    /// Sets the triangle of the points in the given lanes.
    #[inline]
    pub fn set_triangle(&mut self, triangle: MeshTriangle, lanes: Range<usize>) {
        for CornerUvs { set, uvs } in &mut self.uv_sets {
            for (to, uv) in uvs.iter_mut().zip(triangle.uvs(*set)) {
                for axis in 0..2 {
                    to[axis][lanes.clone()].fill(uv[axis]);
                }
            }
        }
    }

    /// Samples every texture at the points in the given lanes, whose triangles have been set.
    pub fn sample(&mut self, simd: SimdLevel, posed: &PosedScene, block: &PointBlock, lanes: &Range<usize>) {
        for (i, out) in self.texels.iter_mut().enumerate() {
            let Some(texture_use) = self.uses.iter().find(|u| u.texels == i) else { continue };
            let texture = texture_use.texture;
            let Some(uvs) = self.uv_sets.iter().find(|uvs| uvs.set == texture.uv_set) else { continue };
            simd.run(SampleTexture {
                uvs,
                block,
                lanes: lanes.clone(),
                texture: &posed.scene.textures[texture.texture as usize],
                images: &posed.scene.images,
                texture_use,
                out,
            });
        }
    }

    /// The texels of a texture; white for `None`.
    #[inline(always)]
    pub fn get(&self, texture: Option<&TextureRef>, semantics: TexelSemantics) -> &TexelLanes {
        let Some(texture) = texture else { return &TexelLanes::WHITE };
        let matches = |u: &&TextureUse| std::ptr::eq(u.texture, texture) && u.semantics == semantics;
        self.uses.iter().find(matches).map_or(&TexelLanes::WHITE, |u| &self.texels[u.texels])
    }

    /// The mean vector of a normal map at point `i`, and the variance of its slopes.
    pub fn normal(&self, texture: &TextureRef, i: usize) -> (Vec3, f32) {
        let TexelLanes { rgba } = self.get(Some(texture), TexelSemantics::Normal);
        let [x, y, z, variance] = rgba.each_ref().map(|channel| channel[i]);
        (Vec3::new(x, y, z), variance)
    }
}

/// Samples one texture at a range of points.
struct SampleTexture<'a> {
    uvs: &'a CornerUvs,
    block: &'a PointBlock,
    lanes: Range<usize>,
    texture: &'a Texture,
    images: &'a [Image],
    texture_use: &'a TextureUse<'a>,
    out: &'a mut TexelLanes,
}

impl AutovecKernel for SampleTexture<'_> {
    #[inline(always)]
    fn run(self) {
        let SampleTexture { uvs, block, lanes, texture, images, texture_use, out } = self;
        let &TextureUse { texture: texture_ref, semantics, .. } = texture_use;
        let transform = texture_ref.transform;
        let first_group = lanes.start / SAMPLE_LANES * SAMPLE_LANES;
        for first in (first_group..lanes.end).step_by(SAMPLE_LANES) {
            // The remainder lets the compiler drop the bounds checks.
            let first = first % LANES;
            let mut coords = SampleCoords::<SAMPLE_LANES>::ORIGIN;
            for i in 0..SAMPLE_LANES {
                let point = block.coords(first + i);
                let TextureCoords { uv, footprint } =
                    TextureCoords::new(uvs.get(first + i), &point, &transform);
                coords.set(i, uv, footprint);
            }
            let sampled = lanes.start.max(first)..lanes.end.min(first + SAMPLE_LANES);
            let mut texels = [Vec4::ZERO; SAMPLE_LANES];
            let points = sampled.start - first..sampled.end - first;
            texture.sample_batch(images, &coords, semantics, points, &mut texels);
            for lane in sampled {
                for (channel, x) in out.rgba.iter_mut().zip(texels[lane % SAMPLE_LANES].to_array()) {
                    channel[lane] = x;
                }
            }
        }
    }
}
