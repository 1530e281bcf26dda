//! The coefficients of the lecture's shading model at a point.

use crate::integrator::material::specular_layers::SpecularLayers;
use blinn_core::geometry::Rgb;

/// The lecture's coefficients at a point, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Ambient. Of a surface whose layers cover its base (see [`SpecularLayers`]) without the specular share, which is
    /// k_r L_r.
    pub k_a: Rgb,
    /// Diffuse.
    pub k_d: Rgb,
    /// Specular.
    pub k_s: Rgb,
    /// Shininess p, the exponent of the specular lobe.
    pub shininess: f32,
    /// Emitted radiance.
    pub k_e: Rgb,
    /// The surface's own colour: base × texture × vertex colour (AOV `albedo`, stage `color`).
    pub color: Rgb,
    /// Coverage: 1 is opaque, 0 not there.
    pub opacity: f32,
    /// Transmission of the covered part: `transmission_weight` × base colour.
    pub k_t: Rgb,
    /// Transmission × (1 − metallic), the share of light below the specular layers that is not scattered.
    pub transmission_weight: f32,
    /// The layers that reflect the surroundings.
    pub layers: SpecularLayers,
}

/// The coefficients of the radiance k_e + k_a I_a, and of the stage of colours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BaseTerms {
    pub k_a: Rgb,
    pub k_e: Rgb,
    pub color: Rgb,
}

impl Coefficients {
    /// A matte surface of that colour: k_a = k_d = colour.
    #[inline(always)]
    pub fn matte(color: Rgb, opacity: f32) -> Coefficients {
        Coefficients {
            k_a: color,
            k_d: color,
            k_s: Rgb::ZERO,
            shininess: 1.0,
            k_e: Rgb::ZERO,
            color,
            opacity,
            k_t: Rgb::ZERO,
            transmission_weight: 0.0,
            layers: SpecularLayers::NONE,
        }
    }

    #[inline(always)]
    pub(crate) fn base_terms(&self) -> BaseTerms {
        BaseTerms { k_a: self.k_a, k_e: self.k_e, color: self.color }
    }

    /// The tint of one surface of a body of glass: the square root, because light passes two of them. For a
    /// `transmission_weight` above 0.
    pub(crate) fn surface_tint(&self) -> Rgb {
        let color = (self.k_t / self.transmission_weight).max(Rgb::ZERO);
        Rgb::new(color.x.sqrt(), color.y.sqrt(), color.z.sqrt())
    }
}

/// Coefficients set for every material, in place of the material's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct MaterialOverrides {
    /// Replaces k_d, and the colour of unlit materials.
    pub k_d: Option<Rgb>,
    /// Replaces k_s.
    pub k_s: Option<Rgb>,
    /// Replaces p.
    pub shininess: Option<f32>,
    /// Replaces k_e, and with it the colour of unlit materials.
    pub k_e: Option<Rgb>,
}

impl MaterialOverrides {
    /// Replaces colours. The shininess stays the material's own, because
    /// [`SpecularAntialiasing`](super::specular_antialiasing::SpecularAntialiasing) scales k_s by it and replaces it then.
    #[inline(always)]
    pub(crate) fn apply_to_colors(&self, k: &mut Coefficients) {
        if let Some(k_d) = self.k_d {
            k.k_d = k_d;
        }
        if let Some(k_s) = self.k_s {
            k.k_s = k_s;
        }
        if let Some(k_e) = self.k_e {
            k.k_e = k_e;
        }
    }
}
