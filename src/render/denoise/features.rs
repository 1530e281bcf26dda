//! Noise-free features of a picture.

use blinn_core::geometry::Rgb;
use glam::Vec3;

/// Features of the first hits of a picture: means over the samples of each pixel, row by row from the top.
#[derive(Clone, Debug, Default)]
pub struct Features {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Column and row of the first pixel in the whole picture, for crops.
    pub origin: [usize; 2],
    /// Surface colour, mean over the samples that hit a surface. Empty where no light depends on it.
    pub albedo: Vec<Rgb>,
    /// Shading normal, mean over the samples that hit a surface. Shorter than 1 where samples differ.
    pub normal: Vec<Vec3>,
    /// Position in world space in any unit, mean over the samples that hit a surface.
    pub position: Vec<Vec3>,
    /// Share of samples that hit a surface, 0–1. Pixels without any keep their light.
    pub coverage: Vec<f32>,
}

impl Features {
    pub(super) fn check_len(&self) {
        let pixels = self.width * self.height;
        let lengths = [self.normal.len(), self.position.len(), self.coverage.len()];
        assert!(lengths.iter().all(|n| *n == pixels), "features of {lengths:?} pixels, expected {pixels}");
        assert!(
            [0, pixels].contains(&self.albedo.len()),
            "albedos of {} pixels of {pixels}",
            self.albedo.len()
        );
    }
}
