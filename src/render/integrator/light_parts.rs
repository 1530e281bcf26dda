//! The light of samples by part, for reconstruction: what is exact, and what random estimators find.

use glam::Vec3;

use blinn_core::geometry::{Rgb, Rgba};

/// The noisy light that is split from the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSplit {
    /// All that random estimators find.
    All,
    /// Light of other surfaces that rough surfaces reflect.
    RoughReflections,
}

/// The light of a sample by part. The sum of `exact` and the noisy parts is the sample's colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleParts {
    /// Light without noise, premultiplied by alpha, with the background.
    pub exact: Rgba,
    /// Light that random estimators find.
    pub noisy: NoisyLight,
    /// The surfaces that the sample sees.
    pub surface: SurfaceFeatures,
}

/// Light that random estimators find, by the way in which it is reconstructed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoisyLight {
    /// Light of sources with an extent, reflected by matte surfaces.
    pub direct: Rgb,
    /// Light of other surfaces, reflected by matte surfaces.
    pub indirect: Rgb,
    /// Light that is reflected or refracted.
    pub specular: Rgb,
}

impl NoisyLight {
    /// The sum of all parts.
    pub fn sum(&self) -> Rgb {
        self.direct + self.indirect + self.specular
    }
}

/// Features of the surfaces that a sample sees, weighted by the share of their light that arrives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceFeatures {
    /// k_d: the colour of light on matte surfaces.
    pub diffuse_color: Rgb,
    /// k_r: the colour of reflected and refracted light.
    pub specular_color: Rgb,
    /// The colour of light on the fibres of a sheen, which reflect light sources and other surfaces diffusely.
    pub sheen_color: Rgb,
    /// The surface's own colour.
    pub albedo: Rgb,
    /// Shading normal.
    pub normal: Vec3,
    /// Position relative to the scene's centre.
    pub position: Vec3,
    /// GGX α of the surface's lobes.
    pub alpha: f32,
    /// Colour and normal of what mirrors and glass show, and of other surfaces themselves.
    pub seen: SeenFeatures,
    /// Share of the sample that surfaces cover.
    pub coverage: f32,
}

/// Features of what is seen in a mirror, or behind glass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeenFeatures {
    /// Colour of the surface, or the light of what has none, from 0 to 1.
    pub albedo: Rgb,
    /// Shading normal.
    pub normal: Vec3,
    /// Share of the sample that surfaces cover.
    pub coverage: f32,
    /// Share of the sample of which is known what is seen: not of rays that are left out by chance.
    pub known: f32,
}

impl SeenFeatures {
    /// Adds a share of what is seen.
    pub fn add(&mut self, other: &SeenFeatures, share: f32) {
        self.albedo += other.albedo * share;
        self.normal += other.normal * share;
        self.coverage += other.coverage * share;
        self.known += other.known * share;
    }

    /// Adds a share of a light with this radiance, which is no surface.
    pub fn add_light(&mut self, radiance: Rgb, share: f32) {
        self.albedo += radiance / (Rgb::ONE + radiance) * share;
    }
}

impl SampleParts {
    /// A sample without noise.
    pub fn exact(color: Rgba) -> SampleParts {
        SampleParts { exact: color, ..SampleParts::default() }
    }

    /// Adds another sample of the pixel.
    pub fn add(&mut self, other: &SampleParts) {
        self.exact += other.exact;
        self.noisy.direct += other.noisy.direct;
        self.noisy.indirect += other.noisy.indirect;
        self.noisy.specular += other.noisy.specular;
        let (to, from) = (&mut self.surface, &other.surface);
        to.diffuse_color += from.diffuse_color;
        to.specular_color += from.specular_color;
        to.sheen_color += from.sheen_color;
        to.albedo += from.albedo;
        to.normal += from.normal;
        to.position += from.position;
        to.alpha += from.alpha;
        to.seen.add(&from.seen, 1.0);
        to.coverage += from.coverage;
    }
}
