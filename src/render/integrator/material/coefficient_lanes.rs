//! The coefficients of a block of points, in structure of arrays.

use crate::integrator::material::coefficients::{BaseTerms, Coefficients};
use crate::integrator::material::layer_lanes::LayerLanes;
use crate::integrator::surface::soa::{LANES, set3, vec3};

/// [`Coefficients`] of [`LANES`] points.
#[derive(Clone)]
pub(crate) struct CoefficientLanes {
    pub k_a: [[f32; LANES]; 3],
    pub k_d: [[f32; LANES]; 3],
    pub k_s: [[f32; LANES]; 3],
    pub shininess: [f32; LANES],
    pub k_e: [[f32; LANES]; 3],
    color: [[f32; LANES]; 3],
    pub opacity: [f32; LANES],
    k_t: [[f32; LANES]; 3],
    pub transmission_weight: [f32; LANES],
    pub layers: LayerLanes,
}

impl CoefficientLanes {
    pub const ZERO: CoefficientLanes = CoefficientLanes {
        k_a: [[0.0; LANES]; 3],
        k_d: [[0.0; LANES]; 3],
        k_s: [[0.0; LANES]; 3],
        shininess: [0.0; LANES],
        k_e: [[0.0; LANES]; 3],
        color: [[0.0; LANES]; 3],
        opacity: [0.0; LANES],
        k_t: [[0.0; LANES]; 3],
        transmission_weight: [0.0; LANES],
        layers: LayerLanes::ZERO,
    };

    /// Sets the coefficients of point `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, k: &Coefficients) {
        set3(&mut self.k_a, i, k.k_a.to_array());
        set3(&mut self.k_d, i, k.k_d.to_array());
        set3(&mut self.k_s, i, k.k_s.to_array());
        self.shininess[i] = k.shininess;
        set3(&mut self.k_e, i, k.k_e.to_array());
        set3(&mut self.color, i, k.color.to_array());
        self.opacity[i] = k.opacity;
        set3(&mut self.k_t, i, k.k_t.to_array());
        self.transmission_weight[i] = k.transmission_weight;
        self.layers.set(i, &k.layers);
    }

    /// Makes point `i` opaque to transmitted light.
    pub fn remove_transmission(&mut self, i: usize) {
        set3(&mut self.k_t, i, [0.0; 3]);
    }

    /// The coefficients of point `i`. The compiler drops what the caller does not use.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Coefficients {
        Coefficients {
            k_a: vec3(&self.k_a, i),
            k_d: vec3(&self.k_d, i),
            k_s: vec3(&self.k_s, i),
            shininess: self.shininess[i],
            k_e: vec3(&self.k_e, i),
            color: vec3(&self.color, i),
            opacity: self.opacity[i],
            k_t: vec3(&self.k_t, i),
            transmission_weight: self.transmission_weight[i],
            layers: self.layers.get(i),
        }
    }

    /// The base terms of point `i`.
    #[inline(always)]
    pub fn base_terms(&self, i: usize) -> BaseTerms {
        BaseTerms { k_a: vec3(&self.k_a, i), k_e: vec3(&self.k_e, i), color: vec3(&self.color, i) }
    }

    /// Replaces the coefficients of the points from `first` on by those of the same lanes of `other`.
    #[inline(always)]
    pub fn copy_from(&mut self, first: usize, other: &CoefficientLanes) {
        if first == 0 {
            self.clone_from(other);
        } else {
            for i in first..LANES {
                self.set(i, &other.get(i));
            }
        }
    }
}
