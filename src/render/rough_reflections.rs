//! Reconstruction of what rough metals reflect, in pictures whose other light has little noise.

use std::ops::Range;

use glam::Vec3;

use crate::denoise::{RoughLight, WAVELET_MARGIN, smooth_rough_light};
use crate::film::PixelRect;
use crate::integrator::{Frame, LightSplit, SampleParts};
use crate::progress::ProgressMonitor;
use crate::strips::Reconstruction;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{Rgb, Rgba};

/// Reconstruction of reflections by [`smooth_rough_light`].
pub(super) struct RoughReflections;

/// Least colour that light is divided by.
const MIN_COLOR: f32 = 0.02;

/// A pixel with what its rough surfaces reflect.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ReflectingPixel {
    /// The mean colour of the other light.
    exact: Rgba,
    /// Means of reflected light over the even and over the odd samples.
    halves: [Rgb; 2],
    /// The mean colour that reflects.
    color: Rgb,
    normal: Vec3,
    position: Vec3,
    /// Mean GGX α.
    alpha: f32,
}

impl Reconstruction for RoughReflections {
    type Pixel = ReflectingPixel;

    const ROWS: u32 = 256;
    const MARGIN: u32 = WAVELET_MARGIN as u32;
    const SPLIT: LightSplit = LightSplit::RoughReflections;

    fn pixel(samples: &[SampleParts]) -> ReflectingPixel {
        let mut pixel = ReflectingPixel::default();
        let mut coverage = 0.0;
        for (i, sample) in samples.iter().enumerate() {
            pixel.exact += sample.exact;
            pixel.halves[i % 2] += sample.noisy.specular;
            pixel.color += sample.surface.specular_color;
            pixel.normal += sample.surface.normal;
            pixel.position += sample.surface.position;
            pixel.alpha += sample.surface.alpha;
            coverage += sample.surface.coverage;
        }
        let count = samples.len().max(1);
        let share = 1.0 / count as f32;
        let covered = if coverage > 0.0 { 1.0 / coverage } else { 0.0 };
        ReflectingPixel {
            exact: pixel.exact * share,
            halves: [pixel.halves[0] / count.div_ceil(2) as f32, pixel.halves[1] / (count / 2).max(1) as f32],
            color: pixel.color * share,
            normal: pixel.normal * covered,
            position: pixel.position * covered,
            alpha: pixel.alpha * covered,
        }
    }

    fn reconstruct(
        pixels: &[ReflectingPixel],
        held: PixelRect,
        rows: Range<usize>,
        samples: u32,
        frame: &Frame,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<Rgba>, Cancelled> {
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        let width = held.width as usize;
        let wanted = &pixels[rows.start * width..rows.end * width];
        let is_rough = |pixel: &ReflectingPixel| pixel.halves != [Rgb::ZERO; 2];
        if !pixels.iter().any(is_rough) {
            return Ok(wanted.iter().map(|pixel| pixel.exact).collect());
        }
        let divisor = |pixel: &ReflectingPixel| pixel.color.max(Rgb::splat(MIN_COLOR));
        let half = |i: usize| pixels.iter().map(|pixel| pixel.halves[i] / divisor(pixel)).collect();
        let light = RoughLight {
            width,
            samples,
            halves: [half(0), half(1)],
            is_rough: pixels.iter().map(is_rough).collect(),
            normal: pixels.iter().map(|pixel| pixel.normal).collect(),
            position: pixels.iter().map(|pixel| pixel.position).collect(),
            alpha: pixels.iter().map(|pixel| pixel.alpha).collect(),
        };
        let smooth = smooth_rough_light(&light, frame.simd(), rows);
        Ok(wanted
            .iter()
            .zip(smooth)
            .map(|(pixel, light)| pixel.exact + (light * divisor(pixel)).extend(0.0))
            .collect())
    }
}
