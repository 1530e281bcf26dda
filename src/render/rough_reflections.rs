//! Reconstruction of what rough metals reflect, in pictures whose other light has little noise.

use std::ops::Range;

use glam::Vec3;

use crate::denoise::{SmoothKind, WAVELET_PIXEL, WaveletLight, smooth_light};
use crate::film::PixelRect;
use crate::integrator::{Frame, Integrator, LightSplit, LowDiscrepancySampler, Sample, SampleParts, Scratch};
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use crate::strips::Reconstruction;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{Rgb, Rgba};
use blinn_core::simd::SimdLevel;

/// Reconstruction of reflections by [`smooth_light`].
pub(super) struct RoughReflections;

/// Least colour that light is divided by.
const MIN_COLOR: f32 = 0.02;

/// A pixel with what its rough surfaces reflect.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ReflectingPixel {
    /// The mean colour of the other light.
    exact: Rgba,
    /// Means of reflected light over the even and over the odd samples.
    pub halves: [Rgb; 2],
    /// The mean colour that reflects.
    color: Rgb,
    normal: Vec3,
    position: Vec3,
    /// Mean GGX α.
    alpha: f32,
}

impl Reconstruction for RoughReflections {
    type Sample = SampleParts;
    type Pixel = ReflectingPixel;
    type Output = Rgba;

    const ROWS: u32 = 256;
    const MARGIN: u32 = SmoothKind::RoughReflections.margin() as u32;

    fn render(
        integrator: &dyn Integrator,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [SampleParts],
    ) {
        integrator.render_parts(frame, samples, sampler, scratch, LightSplit::RoughReflections, out);
    }

    fn pixel(samples: &[SampleParts]) -> ReflectingPixel {
        ReflectingPixel::of_samples(samples)
    }

    fn work_bytes(width: u64, rows: u64) -> u64 {
        let strip = u64::from(RoughReflections::ROWS).min(rows) * width;
        width * rows * WAVELET_PIXEL + strip * (size_of::<Rgb>() + size_of::<Rgba>()) as u64
    }

    fn reconstruct(
        pixels: &[ReflectingPixel],
        held: PixelRect,
        rows: Range<usize>,
        settings: &RenderSettings,
        frame: &Frame,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<Rgba>, Cancelled> {
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        let width = held.width as usize;
        let wanted = &pixels[rows.start * width..rows.end * width];
        let smooth = smooth_reflections(pixels, held, rows, settings.samples, frame.simd());
        Ok(wanted.iter().zip(smooth).map(|(pixel, light)| pixel.exact + light.extend(0.0)).collect())
    }
}

impl ReflectingPixel {
    /// Averages the samples of a pixel.
    pub fn of_samples(samples: &[SampleParts]) -> ReflectingPixel {
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
        // Factors, because the compiler packs divisions with lanes of any bits, and subnormal numbers are slow.
        let (even, odd) = (count.div_ceil(2) as f32, (count / 2).max(1) as f32);
        let share = 1.0 / count as f32;
        let covered = if coverage > 0.0 { 1.0 / coverage } else { 0.0 };
        ReflectingPixel {
            exact: pixel.exact * share,
            halves: [pixel.halves[0] * (1.0 / even), pixel.halves[1] * (1.0 / odd)],
            color: pixel.color * share,
            normal: pixel.normal * covered,
            position: pixel.position * covered,
            alpha: pixel.alpha * covered,
        }
    }
}

/// Smooths the reflected light of `rows` of the pixels in `held`.
pub(super) fn smooth_reflections(
    pixels: &[ReflectingPixel],
    held: PixelRect,
    rows: Range<usize>,
    samples: u32,
    simd: SimdLevel,
) -> Vec<Rgb> {
    let width = held.width as usize;
    let wanted = &pixels[rows.start * width..rows.end * width];
    let is_rough = |pixel: &ReflectingPixel| pixel.halves != [Rgb::ZERO; 2];
    if !pixels.iter().any(is_rough) {
        return vec![Rgb::ZERO; wanted.len()];
    }
    let divisor = |pixel: &ReflectingPixel| pixel.color.max(Rgb::splat(MIN_COLOR));
    let half = |i: usize| pixels.iter().map(|pixel| pixel.halves[i] / divisor(pixel)).collect();
    let light = WaveletLight {
        kind: SmoothKind::RoughReflections,
        width,
        samples,
        halves: [half(0), half(1)],
        is_noisy: pixels.iter().map(is_rough).collect(),
        normal: pixels.iter().map(|pixel| pixel.normal).collect(),
        position: pixels.iter().map(|pixel| pixel.position).collect(),
        alpha: pixels.iter().map(|pixel| pixel.alpha).collect(),
    };
    let smooth = smooth_light(&light, simd, rows);
    wanted.iter().zip(smooth).map(|(pixel, light)| light * divisor(pixel)).collect()
}
