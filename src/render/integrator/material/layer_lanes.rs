//! The specular layers of a block of points, in structure of arrays.

use crate::integrator::material::specular_layers::SpecularLayers;
use crate::integrator::surface::soa::{LANES, set3, vec3};

/// [`SpecularLayers`] of [`LANES`] points.
#[derive(Clone)]
pub(crate) struct LayerLanes {
    pub reflects: [bool; LANES],
    covers_base: [bool; LANES],
    has_highlights: [bool; LANES],
    pub alpha: [f32; LANES],
    pub metallic: [f32; LANES],
    metal_f0: [[f32; LANES]; 3],
    metal_f90: [[f32; LANES]; 3],
    dielectric_f0: [[f32; LANES]; 3],
    dielectric_f90: [f32; LANES],
    pub ior: [f32; LANES],
    pub occlusion: [f32; LANES],
    pub coat: [f32; LANES],
    pub coat_alpha: [f32; LANES],
}

impl LayerLanes {
    pub const ZERO: LayerLanes = LayerLanes {
        reflects: [false; LANES],
        covers_base: [false; LANES],
        has_highlights: [false; LANES],
        alpha: [0.0; LANES],
        metallic: [0.0; LANES],
        metal_f0: [[0.0; LANES]; 3],
        metal_f90: [[0.0; LANES]; 3],
        dielectric_f0: [[0.0; LANES]; 3],
        dielectric_f90: [0.0; LANES],
        ior: [0.0; LANES],
        occlusion: [0.0; LANES],
        coat: [0.0; LANES],
        coat_alpha: [0.0; LANES],
    };

    /// Sets the layers of point `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, layers: &SpecularLayers) {
        self.reflects[i] = layers.reflects;
        self.covers_base[i] = layers.covers_base;
        self.has_highlights[i] = layers.has_highlights;
        self.alpha[i] = layers.alpha;
        self.metallic[i] = layers.metallic;
        set3(&mut self.metal_f0, i, layers.metal_f0.to_array());
        set3(&mut self.metal_f90, i, layers.metal_f90.to_array());
        set3(&mut self.dielectric_f0, i, layers.dielectric_f0.to_array());
        self.dielectric_f90[i] = layers.dielectric_f90;
        self.ior[i] = layers.ior;
        self.occlusion[i] = layers.occlusion;
        self.coat[i] = layers.coat;
        self.coat_alpha[i] = layers.coat_alpha;
    }

    /// The layers of point `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> SpecularLayers {
        SpecularLayers {
            reflects: self.reflects[i],
            covers_base: self.covers_base[i],
            has_highlights: self.has_highlights[i],
            alpha: self.alpha[i],
            metallic: self.metallic[i],
            metal_f0: vec3(&self.metal_f0, i),
            metal_f90: vec3(&self.metal_f90, i),
            dielectric_f0: vec3(&self.dielectric_f0, i),
            dielectric_f90: self.dielectric_f90[i],
            ior: self.ior[i],
            occlusion: self.occlusion[i],
            coat: self.coat[i],
            coat_alpha: self.coat_alpha[i],
        }
    }
}
