//! The light of samples by layer: by what sends it, and by how the first surface reflects it.

use std::ops::{AddAssign, Index, IndexMut, Mul};

use crate::integrator::light_parts::{NoisyLight, SampleParts};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::soa::vec3;
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
        exact[LightLayer::DiffuseDirect] -= noisy.direct + direct.indirect;
        exact[LightLayer::DiffuseIndirect] -= noisy.indirect - direct.indirect;
        exact[LightLayer::SpecularDirect] -= direct.specular;
        exact[LightLayer::SpecularIndirect] -= noisy.specular - direct.specular;
        exact
    }
}

/// The light of the points of a batch by layer.
#[derive(Default)]
pub(crate) struct PointLayers {
    layers: Vec<LightLayers>,
    /// The light of each point that is in a layer.
    assigned: Vec<Rgb>,
}

impl PointLayers {
    /// The light of point `i`.
    pub fn get(&self, i: usize) -> LightLayers {
        self.layers[i]
    }
}

impl ShadingBatch<'_> {
    /// Starts the layers of all points with k_e and k_a I_a, their light so far.
    pub fn start_layers(&mut self) {
        let mut layers = PointLayers::default();
        for i in 0..self.points.len() {
            let (radiance, (emission, _)) = (self.radiance(i), self.layered_ke_ka(i));
            let mut light = LightLayers::ZERO;
            light[LightLayer::Emission] = emission;
            light[LightLayer::DiffuseIndirect] = radiance - emission;
            layers.layers.push(light);
            layers.assigned.push(radiance);
        }
        self.layers = layers;
    }

    /// Adds the light of all points that is in no layer yet to `layer`.
    pub fn assign_light_to(&mut self, layer: LightLayer) {
        for i in 0..self.layers.layers.len() {
            let light = self.take_unassigned(i);
            self.layers.layers[i][layer] += light;
        }
    }

    /// Adds the light of a source, which is in no layer yet, to the direct layers.
    pub fn assign_direct_light(&mut self) {
        for i in 0..self.layers.layers.len() {
            let light = self.take_unassigned(i);
            let (block, lane) = self.soa.lane(i);
            let specular: Rgb = vec3(&block.current_specular, lane);
            self.layers.layers[i][LightLayer::DiffuseDirect] += light - specular;
            self.layers.layers[i][LightLayer::SpecularDirect] += specular;
        }
    }

    fn take_unassigned(&mut self, i: usize) -> Rgb {
        let radiance = self.radiance(i);
        let light = radiance - self.layers.assigned[i];
        self.layers.assigned[i] = radiance;
        light
    }
}
