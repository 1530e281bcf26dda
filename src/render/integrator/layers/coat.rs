//! A clear coat with normals of its own.

use glam::{DVec3, Vec3};

use crate::integrator::material::directional_albedo::{COAT_IOR, FacetAlbedo, FacetLobe};
use crate::integrator::material::fresnel::dielectric_weight;
use crate::integrator::material::highlight_lobe::{highlight_lobe, reflection_pdf};
use crate::integrator::surface::highlights::{HighlightWidth, widened};
use blinn_core::geometry::Rgb;

/// The normals of a coat at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoatNormal {
    /// The mean normal over the sample's footprint.
    pub n: DVec3,
    /// Increase of α² by the normals that the sample covers.
    pub alpha2_increase: f32,
}

/// A coat seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoatLobe {
    n: Vec3,
    width: HighlightWidth,
    /// α, widened by the normals that the sample covers.
    pub alpha: f32,
    /// The lobe, as far as the surface is coated.
    pub lobe: FacetLobe,
}

impl CoatLobe {
    /// The coat of the share `share` of a surface, with perceptual roughness √`alpha`, seen from direction `v`.
    pub fn new(normal: CoatNormal, v: DVec3, share: f32, alpha: f32) -> CoatLobe {
        let CoatNormal { n, alpha2_increase } = normal;
        let wide = widened(alpha, alpha2_increase);
        let lobe = match share > 0.0 {
            true => FacetAlbedo::new(n.dot(v) as f32, wide, COAT_IOR).coat().scaled(share),
            false => FacetLobe::NONE,
        };
        CoatLobe { n: n.as_vec3(), width: HighlightWidth::new(alpha, alpha2_increase), alpha: wide, lobe }
    }

    /// π f cos: the share of the lecture's irradiance from direction `l` that the coat reflects to `v`.
    pub fn reflect(&self, l: Vec3, v: Vec3, has_exact_fresnel: bool) -> Rgb {
        let n_l = self.n.dot(l);
        if !(n_l > 0.0 && self.lobe.albedo != Rgb::ZERO) {
            return Rgb::ZERO;
        }
        let [lobe, schlick] = highlight_lobe(self.n, l, v, n_l, self.width.alpha2);
        let weight =
            if has_exact_fresnel { dielectric_weight(0.5 * (l + v).length(), COAT_IOR) } else { schlick };
        (self.lobe.f0 + self.lobe.rise * weight) * (lobe * self.width.scale)
    }

    /// Density per steradian with which a ray of the lobe is reflected to `l`.
    pub fn pdf(&self, l: Vec3, v: Vec3) -> f32 {
        reflection_pdf(self.n, l, v, self.alpha * self.alpha)
    }
}
