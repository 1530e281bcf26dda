//! The specular layers of a block of points, in structure of arrays.

use crate::geometry::Rgb;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::specular_layers::SpecularLayers;
use crate::integrator::surface::soa::{LANES, set3, vec3};

/// Inputs of the albedo of layers and of the light below them. Lanes of points that do not reflect hold any value.
pub(crate) struct LayerLanes {
    pub k_e: [[f32; LANES]; 3],
    pub k_a: [[f32; LANES]; 3],
    covers_base: [bool; LANES],
    has_highlights: [bool; LANES],
    pub alpha: [f32; LANES],
    metallic: [f32; LANES],
    metal_f0: [[f32; LANES]; 3],
    metal_f90: [[f32; LANES]; 3],
    dielectric_f0: [[f32; LANES]; 3],
    dielectric_f90: [f32; LANES],
    pub ior: [f32; LANES],
    pub occlusion: [f32; LANES],
    coat: [f32; LANES],
    pub coat_alpha: [f32; LANES],
    /// True if any point has a coat.
    pub has_coat: bool,
    /// The coefficients that all lanes are from; `None` if they differ.
    uniform: Option<u32>,
}

impl LayerLanes {
    pub const ZERO: LayerLanes = LayerLanes {
        k_e: [[0.0; LANES]; 3],
        k_a: [[0.0; LANES]; 3],
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
        has_coat: false,
        uniform: None,
    };

    /// Loads the coefficients of points, given their lanes and the indices of their coefficients. `all` has the coefficients.
    pub fn load(&mut self, points: impl Iterator<Item = (usize, u32)> + Clone, all: &[Coefficients]) {
        let Some((_, first)) = points.clone().next() else { return };
        if points.clone().all(|(_, index)| index == first) {
            // Consecutive blocks often have one material.
            if self.uniform != Some(first) {
                let k = &all[first as usize];
                (0..LANES).for_each(|lane| self.set(lane, k));
                self.has_coat = k.layers.coat > 0.0;
                self.uniform = Some(first);
            }
            return;
        }
        self.uniform = None;
        self.has_coat = false;
        for (lane, index) in points {
            let k = &all[index as usize];
            self.set(lane, k);
            self.has_coat |= k.layers.coat > 0.0;
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, k: &Coefficients) {
        let layers = &k.layers;
        set3(&mut self.k_e, i, k.k_e.to_array());
        set3(&mut self.k_a, i, k.k_a.to_array());
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

    /// The layers of point `i`, which reflects.
    #[inline(always)]
    pub fn get(&self, i: usize) -> SpecularLayers {
        let rgb = |lanes: &[[f32; LANES]; 3]| -> Rgb { vec3(lanes, i) };
        SpecularLayers {
            reflects: true,
            covers_base: self.covers_base[i],
            has_highlights: self.has_highlights[i],
            alpha: self.alpha[i],
            metallic: self.metallic[i],
            metal_f0: rgb(&self.metal_f0),
            metal_f90: rgb(&self.metal_f90),
            dielectric_f0: rgb(&self.dielectric_f0),
            dielectric_f90: self.dielectric_f90[i],
            ior: self.ior[i],
            occlusion: self.occlusion[i],
            coat: self.coat[i],
            coat_alpha: self.coat_alpha[i],
        }
    }
}
