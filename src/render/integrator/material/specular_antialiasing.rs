//! Specular antialiasing: highlights widen with the variance of the normals that a sample covers (Tokuyoshi and
//! Kaplanyan, “Improved Geometric Specular Antialiasing”, I3D 2019).

use crate::integrator::material::coefficients::MaterialOverrides;
use blinn_scene::{Material, Reflectance};

/// How the highlights of a material change with the normals of a footprint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpecularAntialiasing {
    enabled: bool,
    /// The exponent set for all materials.
    shininess_override: Option<f32>,
    /// True if k_s is set for all materials, and so not scaled.
    k_s_overridden: bool,
}

/// A widened specular lobe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WidenedLobe {
    pub shininess: f32,
    /// Factor for k_s that keeps the reflected light the same.
    pub k_s_scale: f32,
}

impl SpecularAntialiasing {
    pub fn new(material: &Material, overrides: &MaterialOverrides) -> SpecularAntialiasing {
        SpecularAntialiasing {
            enabled: widens_highlights(material),
            shininess_override: overrides.shininess,
            k_s_overridden: overrides.k_s.is_some(),
        }
    }

    /// True if every lobe stays the material's own.
    pub fn is_identity(&self) -> bool {
        !self.enabled && self.shininess_override.is_none()
    }

    /// Widens a lobe of the material's own exponent by the increase of its α², which
    /// [`SurfacePoint::filtered_normal`](crate::integrator::SurfacePoint::filtered_normal) computes. The mean of lobes
    /// around many normals is nearly one lobe with a smaller exponent and as much light.
    #[inline(always)]
    pub fn widen(&self, shininess: f32, alpha2_increase: f32) -> WidenedLobe {
        // Free of branches, so that loops over it are vectorised.
        let alpha_squared = (2.0 / (shininess + 2.0) + alpha2_increase).min(1.0);
        let wider = 2.0 / alpha_squared - 2.0;
        let widens = self.enabled & (alpha2_increase > 0.0);
        let p = if widens { wider } else { shininess };
        let k_s_scale = if widens & !self.k_s_overridden { (wider + 2.0) / (shininess + 2.0) } else { 1.0 };
        WidenedLobe { shininess: self.shininess_override.unwrap_or(p), k_s_scale }
    }
}

/// True if highlights widen with the normals in a footprint. MTL's exponent is the lecture's p and stays exact.
pub(crate) fn widens_highlights(material: &Material) -> bool {
    !matches!(material.reflectance, Reflectance::Mtl(_))
}
