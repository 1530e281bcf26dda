//! Features of a pixel's surfaces in half precision: pictures hold those of many rows while they are reconstructed.

use glam::Vec3;
use half::f16;

use crate::denoise::PartKind;
use crate::integrator::{SampleParts, SeenFeatures, SurfaceFeatures};
use blinn_core::geometry::Rgb;

/// Means over the samples of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelFeatures {
    /// Colours of the light by part, in the order of [`PartKind::ALL`].
    colors: [Half3; 3],
    /// Shading normal, mean over what surfaces cover.
    normal: Half3,
    /// Colour and normal of what mirrors and glass show, and of other surfaces themselves; mean over what is known.
    seen_albedo: Half3,
    seen_normal: Half3,
    /// Position relative to the scene's centre, mean over what surfaces cover.
    pub position: Vec3,
    /// Share of the pixel that surfaces cover.
    pub coverage: f32,
}

impl PixelFeatures {
    /// Averages the features of `count` samples, whose sum is given.
    pub fn of_sum(sum: &SampleParts, count: usize) -> PixelFeatures {
        let SurfaceFeatures { albedo, normal, position, seen, coverage, .. } = sum.surface;
        let share = 1.0 / count.max(1) as f32;
        let covered = if coverage > 0.0 { 1.0 / coverage } else { 0.0 };
        // Samples whose rays are left out do not count: they would mix the surface itself in, by chance.
        let SeenFeatures { known, .. } = seen;
        let [seen_albedo, seen_normal] = match known > 0.0 {
            true => [seen.albedo / known, seen.normal / known],
            false => [albedo * covered, normal * covered],
        };
        PixelFeatures {
            colors: PartKind::ALL.map(|kind| Half3::new(color_of(&sum.surface, kind) * share)),
            normal: Half3::new(normal * covered),
            seen_albedo: Half3::new(seen_albedo),
            seen_normal: Half3::new(seen_normal),
            position: position * covered,
            coverage: coverage * share,
        }
    }

    /// The colour that a part of the light is divided by.
    pub fn color(&self, kind: PartKind) -> Rgb {
        self.colors[kind as usize].get()
    }

    /// The shading normal.
    pub fn normal(&self) -> Vec3 {
        self.normal.get()
    }

    /// The colour of what is seen.
    pub fn seen_albedo(&self) -> Rgb {
        self.seen_albedo.get()
    }

    /// The normal of what is seen.
    pub fn seen_normal(&self) -> Vec3 {
        self.seen_normal.get()
    }
}

/// The colour of surfaces that a part of the light is divided by.
pub(super) fn color_of(surface: &SurfaceFeatures, kind: PartKind) -> Rgb {
    match kind {
        PartKind::DirectDiffuse => surface.diffuse_color,
        // Bounced light reaches the fibres of a sheen as it reaches the base; their highlights are among the reflections.
        PartKind::IndirectDiffuse => surface.diffuse_color + surface.sheen_color,
        PartKind::Specular => surface.specular_color + surface.sheen_color,
    }
}

/// Three numbers in half precision. Larger ones become the largest.
#[derive(Clone, Copy, Debug, Default)]
struct Half3([f16; 3]);

impl Half3 {
    fn new(v: Vec3) -> Half3 {
        let most = Vec3::splat(f16::MAX.to_f32());
        Half3(v.clamp(-most, most).to_array().map(f16::from_f32))
    }

    fn get(self) -> Vec3 {
        Vec3::from_array(self.0.map(f16::to_f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Rgba;

    /// A sample of a blue mirror that shows red, as far as that is known.
    fn mirror(known: f32) -> SampleParts {
        let seen = SeenFeatures { albedo: Rgb::X * known, normal: Vec3::Y * known, coverage: 1.0, known };
        let surface =
            SurfaceFeatures { albedo: Rgb::Z, normal: Vec3::Z, seen, coverage: 1.0, ..Default::default() };
        SampleParts { exact: Rgba::ZERO, surface, ..SampleParts::default() }
    }

    fn mean(samples: &[SampleParts]) -> PixelFeatures {
        let mut sum = SampleParts::default();
        samples.iter().for_each(|sample| sum.add(sample));
        PixelFeatures::of_sum(&sum, samples.len())
    }

    #[test]
    fn samples_whose_view_is_unknown_do_not_count() {
        let all = mean(&[mirror(1.0); 4]);
        assert_eq!([all.seen_albedo(), all.seen_normal()], [Rgb::X, Vec3::Y]);
        let few = mean(&[mirror(0.0), mirror(1.0), mirror(0.0), mirror(0.0)]);
        assert_eq!([few.seen_albedo(), few.seen_normal()], [Rgb::X, Vec3::Y]);
        assert_eq!([few.normal(), few.coverage * Vec3::ONE], [Vec3::Z, Vec3::ONE]);
        // Where nothing is known, the surface itself is seen.
        let none = mean(&[mirror(0.0); 4]);
        assert_eq!([none.seen_albedo(), none.seen_normal()], [Rgb::Z, Vec3::Z]);
    }
}
