//! The light of shading points by layer: what each step of shading has added to their radiance.

use crate::integrator::light_layers::{LightLayer, LightLayers};
use blinn_core::geometry::Rgb;

/// The light of the points of a batch by layer; empty where that is not wanted.
#[derive(Default)]
pub(crate) struct PointLayers(Vec<PointLayer>);

struct PointLayer {
    layers: LightLayers,
    /// The radiance that is in a layer.
    assigned: Rgb,
}

impl PointLayers {
    /// Adds a point with the radiance k_e + k_a I_a, of which `emission` is k_e.
    pub fn push(&mut self, radiance: Rgb, emission: Rgb) {
        let mut layers = LightLayers::ZERO;
        layers[LightLayer::Emission] = emission;
        layers[LightLayer::DiffuseIndirect] = radiance - emission;
        self.0.push(PointLayer { layers, assigned: radiance });
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The light of point `i`.
    pub fn get(&self, i: usize) -> LightLayers {
        self.0[i].layers
    }

    /// Adds light to point `i`, whose sum is `radiance`.
    pub fn add(&mut self, i: usize, layers: LightLayers, radiance: Rgb) {
        self.0[i].layers += layers;
        self.0[i].assigned += radiance;
    }

    /// Adds what is in no layer yet of the radiance of point `i` to `layer`.
    pub fn assign(&mut self, i: usize, radiance: Rgb, layer: LightLayer) {
        let point = &mut self.0[i];
        point.layers[layer] += radiance - point.assigned;
        point.assigned = radiance;
    }

    /// Adds what is in no layer yet of the radiance of point `i` to the direct layers. `specular` is the share of specular lobes.
    pub fn assign_direct(&mut self, i: usize, radiance: Rgb, specular: Rgb) {
        self.0[i].layers[LightLayer::SpecularDirect] += specular;
        self.assign(i, radiance - specular, LightLayer::DiffuseDirect);
        self.0[i].assigned = radiance;
    }
}
