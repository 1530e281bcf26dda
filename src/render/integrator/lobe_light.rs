//! The environment's light over the lobes of a batch: collected while rays are spawned, and computed together.

use crate::integrator::layers::facets::{AnisotropicFacets, LobeDirections};
use crate::integrator::material::ggx_lobe::Lobe;
use crate::integrator::material::lobe_integrals::LobeIntegrals;
use crate::integrator::material::lobe_lookups::LobeLookups;
use blinn_core::geometry::Rgb;
use blinn_core::simd::SimdLevel;
use blinn_scene::Environment;

/// Receivers of the light of a lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightReceiver {
    /// A point of the batch, by its index.
    Point(usize),
    /// A ray of the next wave, by its index: its light without occlusion.
    Ray(usize),
}

/// A lobe and the receiver of its light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobeRequest {
    pub lobe: Lobe,
    pub receiver: LightReceiver,
    /// Factor from the radiance of the environment to the light that is received.
    pub weight: Rgb,
}

impl LobeRequest {
    /// The same request for anisotropic facets in place of the lobe.
    pub fn anisotropic(&self, facets: AnisotropicFacets, directions: LobeDirections) -> AnisotropicRequest {
        let &LobeRequest { lobe, receiver, weight } = self;
        AnisotropicRequest { facets, f0: lobe.f0 as f32, directions, receiver, weight }
    }
}

/// The lobes of a batch whose light is requested.
pub(crate) struct LobeLight {
    /// Samples of a pixel.
    samples: u32,
    lookups: LobeLookups,
    integrals: LobeIntegrals,
    lookup_receivers: Vec<(LightReceiver, Rgb)>,
    integral_receivers: Vec<(LightReceiver, Rgb)>,
    /// Lobes that reflect one direction.
    mirrors: Vec<LobeRequest>,
    anisotropic: Vec<AnisotropicRequest>,
}

/// An anisotropic lobe and the receiver of its light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnisotropicRequest {
    pub facets: AnisotropicFacets,
    /// Mean reflectance at normal incidence, which weights the directions.
    pub f0: f32,
    /// The directions over which the light is averaged.
    pub directions: LobeDirections,
    pub receiver: LightReceiver,
    /// Factor from the radiance of the environment to the light that is received.
    pub weight: Rgb,
}

impl LobeLight {
    /// No lobes, of pixels with `samples` samples.
    pub fn new(samples: u32) -> LobeLight {
        LobeLight {
            samples,
            lookups: LobeLookups::default(),
            integrals: LobeIntegrals::default(),
            lookup_receivers: Vec::new(),
            integral_receivers: Vec::new(),
            mirrors: Vec::new(),
            anisotropic: Vec::new(),
        }
    }

    /// Requests the light of a lobe by one lookup.
    pub fn look_up(&mut self, request: LobeRequest) {
        self.lookups.push(&request.lobe);
        self.lookup_receivers.push((request.receiver, request.weight));
    }

    /// Requests the light of a lobe by the directions of the sample of index `sample`.
    pub fn integrate(&mut self, request: LobeRequest, sample: u32) {
        if request.lobe.is_mirror() {
            self.mirrors.push(request);
            return;
        }
        self.integrals.push(&request.lobe, sample, self.samples);
        self.integral_receivers.push((request.receiver, request.weight));
    }

    /// Requests the light of an anisotropic lobe.
    pub fn integrate_anisotropic(&mut self, request: AnisotropicRequest) {
        self.anisotropic.push(request);
    }

    /// Computes the light of all lobes, and calls `receive` with each.
    pub fn compute(
        &self,
        simd: SimdLevel,
        environment: &Environment,
        mut receive: impl FnMut(LightReceiver, Rgb),
    ) {
        let looked_up = self.lookups.radiance(simd, environment);
        let integrated = self.integrals.radiance(simd, environment, self.samples);
        let lookups = self.lookup_receivers.iter().zip(looked_up);
        let integrals = self.integral_receivers.iter().zip(integrated);
        for (&(receiver, weight), radiance) in lookups.chain(integrals) {
            receive(receiver, weight * radiance);
        }
        for mirror in &self.mirrors {
            receive(mirror.receiver, mirror.weight * mirror.lobe.mirrored_radiance(environment));
        }
        for request in &self.anisotropic {
            let AnisotropicRequest { facets, f0, directions, receiver, weight } = *request;
            receive(receiver, weight * facets.radiance(environment, f0, directions));
        }
    }
}
