//! The inputs of a material at the points of a block: its textures, vertex colours and alpha mask.

use std::ops::Range;

use glam::Vec4;

use crate::integrator::material::opacity::opacity;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::shading_triangle::TriangleSurface;
use crate::integrator::surface::soa::LANES;
use crate::integrator::surface::texel_batch::TexelBatch;
use blinn_scene::{AlphaMode, ColorInput, PosedScene, ScalarInput, TexelSemantics, TextureChannel};

/// The values that the points of a block look up for one material.
pub(crate) struct MaterialInputs<'a> {
    pub texels: TexelBatch<'a>,
    /// Vertex colour × colour of the instance, linear RGBA, if any triangle has one.
    pub own_color: [[f32; LANES]; 4],
    /// Opacity by a textured alpha mask.
    pub mask: [f32; LANES],
}

impl<'a> MaterialInputs<'a> {
    pub fn new() -> MaterialInputs<'a> {
        MaterialInputs { texels: TexelBatch::default(), own_color: [[1.0; LANES]; 4], mask: [1.0; LANES] }
    }

    /// Looks up what the points of a triangle in the given lanes have of their own, except for filtered textures.
    pub fn set_triangle(
        &mut self,
        posed: &PosedScene,
        triangle: &TriangleSurface,
        block: &PointBlock,
        lanes: Range<usize>,
    ) {
        self.texels.set_triangle(triangle.triangle, lanes.clone());
        if triangle.has_color {
            for lane in lanes.clone() {
                let color = triangle.texture_context(block.coords(lane)).color();
                for (channel, x) in self.own_color.iter_mut().zip(color.to_array()) {
                    channel[lane] = x;
                }
            }
        }
        let material = &posed.materials[triangle.material as usize];
        if matches!(material.alpha_mode, AlphaMode::Mask(_)) && material.is_textured() {
            for lane in lanes {
                self.mask[lane] = opacity(posed, material, &triangle.texture_context(block.coords(lane)));
            }
        }
    }

    /// Factor × texture of a colour, linear RGB.
    #[inline(always)]
    pub fn color(&self, input: &ColorInput, semantics: TexelSemantics) -> [[f32; LANES]; 3] {
        let [r, g, b, _] = &self.texels.get(input.texture.as_ref(), semantics).rgba;
        let factor = input.factor;
        [scaled(factor.x, r), scaled(factor.y, g), scaled(factor.z, b)]
    }

    /// Factor × texture of a scalar.
    #[inline(always)]
    pub fn scalar(&self, input: &ScalarInput) -> [f32; LANES] {
        scaled(input.factor, &self.texel(input))
    }

    /// [`MaterialInputs::scalar`], clamped to 0…1.
    #[inline(always)]
    pub fn share(&self, input: &ScalarInput) -> [f32; LANES] {
        let mut lanes = self.scalar(input);
        for x in &mut lanes {
            *x = x.clamp(0.0, 1.0);
        }
        lanes
    }

    /// The texture's channel of a scalar without the factor; 1 without a texture.
    #[inline(always)]
    pub fn texel(&self, input: &ScalarInput) -> [f32; LANES] {
        let Some((texture, channel)) = &input.texture else { return [1.0; LANES] };
        let [r, g, b, a] = &self.texels.get(Some(texture), TexelSemantics::Data).rgba;
        match channel {
            TextureChannel::R => *r,
            TextureChannel::G => *g,
            TextureChannel::B => *b,
            TextureChannel::A => *a,
            TextureChannel::Mean => std::array::from_fn(|i| channel.of(Vec4::new(r[i], g[i], b[i], a[i]))),
        }
    }
}

#[inline(always)]
fn scaled(factor: f32, lanes: &[f32; LANES]) -> [f32; LANES] {
    let mut scaled = *lanes;
    for x in &mut scaled {
        *x *= factor;
    }
    scaled
}
