//! The light of samples by layer: by what sends it, and by how the first surface reflects it.

use std::ops::{AddAssign, Index, IndexMut, Mul};

use crate::integrator::light_parts::{NoisyLight, SampleParts};
use blinn_core::geometry::Rgb;

/// A layer of light. The sum of all is the light of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightLayer {
    /// Light of light sources and glowing surfaces, reflected by matte surfaces.
    DiffuseDirect,
    /// Ambient light and light of other surfaces, reflected by matte surfaces.
    DiffuseIndirect,
    /// Light of light sources and glowing surfaces that specular lobes reflect or transmit.
    SpecularDirect,
    /// Light of other surfaces and of the environment that specular lobes reflect or transmit.
    SpecularIndirect,
    /// Light of glowing surfaces and colours of unlit ones.
    Emission,
    /// Light of the background.
    Environment,
}

impl LightLayer {
    /// All layers.
    pub const ALL: [LightLayer; 6] = [
        LightLayer::DiffuseDirect,
        LightLayer::DiffuseIndirect,
        LightLayer::SpecularDirect,
        LightLayer::SpecularIndirect,
        LightLayer::Emission,
        LightLayer::Environment,
    ];
}

/// Light by layer, premultiplied by alpha.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightLayers([Rgb; LightLayer::ALL.len()]);

impl LightLayers {
    /// Black.
    pub const ZERO: LightLayers = LightLayers([Rgb::ZERO; LightLayer::ALL.len()]);

    /// The sum of all layers.
    pub fn sum(&self) -> Rgb {
        self.0.into_iter().sum()
    }
}

impl Index<LightLayer> for LightLayers {
    type Output = Rgb;

    fn index(&self, layer: LightLayer) -> &Rgb {
        &self.0[layer as usize]
    }
}

impl IndexMut<LightLayer> for LightLayers {
    fn index_mut(&mut self, layer: LightLayer) -> &mut Rgb {
        &mut self.0[layer as usize]
    }
}

impl AddAssign for LightLayers {
    fn add_assign(&mut self, other: LightLayers) {
        self.0.iter_mut().zip(other.0).for_each(|(to, from)| *to += from);
    }
}

impl Mul<Rgb> for LightLayers {
    type Output = LightLayers;

    fn mul(self, share: Rgb) -> LightLayers {
        LightLayers(self.0.map(|light| light * share))
    }
}

/// The light of a sample by layer, and its noisy light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleLayers {
    /// All light by layer.
    pub layers: LightLayers,
    /// The light by part, as far as it is split.
    pub parts: SampleParts,
    /// The share of each noisy part that belongs to a direct layer.
    pub noisy_direct: NoisyLight,
}

impl SampleLayers {
    /// The light without noise by layer.
    pub fn exact(&self) -> LightLayers {
        let (noisy, direct) = (&self.parts.noisy, &self.noisy_direct);
        let mut exact = self.layers;
        let direct_diffuse = direct.direct + direct.indirect;
        exact[LightLayer::DiffuseDirect] -= direct_diffuse;
        exact[LightLayer::DiffuseIndirect] -= noisy.direct + noisy.indirect - direct_diffuse;
        exact[LightLayer::SpecularDirect] -= direct.specular;
        exact[LightLayer::SpecularIndirect] -= noisy.specular - direct.specular;
        exact
    }
}
