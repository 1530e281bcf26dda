//! Reconstruction of all noisy light of a picture: filtered by parts, and put together again.

use std::ops::Range;

use glam::Vec3;

use crate::denoise::{Features, MARGIN, NoisyPart, PartKind, denoise};
use crate::film::PixelRect;
use crate::integrator::{
    Frame, Integrator, LightSplit, LowDiscrepancySampler, NoisyLight, Sample, SampleParts, Scratch,
};
use crate::pixel_features::PixelFeatures;
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use crate::strips::Reconstruction;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::{Rgb, Rgba};

/// Least colour that light is divided by.
const MIN_COLOR: f32 = 0.02;

/// A pixel in parts: sums over its even and its odd samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelParts {
    /// The mean colour of the light without noise.
    pub exact: Rgba,
    /// Means over the even and over the odd samples.
    pub noisy: [NoisyLight; 2],
    /// Means over all samples.
    pub surface: PixelFeatures,
}

impl AsRef<PixelParts> for PixelParts {
    fn as_ref(&self) -> &PixelParts {
        self
    }
}

impl PixelParts {
    /// Averages the samples of a pixel.
    pub fn of_samples(samples: &[SampleParts]) -> PixelParts {
        let mut sums = [SampleParts::default(); 2];
        for (i, sample) in samples.iter().enumerate() {
            sums[i % 2].add(sample);
        }
        let even = samples.len().div_ceil(2).max(1) as f32;
        let odd = (samples.len() / 2).max(1) as f32;
        let noisy = [scaled(&sums[0].noisy, 1.0 / even), scaled(&sums[1].noisy, 1.0 / odd)];
        let mut all = sums[0];
        all.add(&sums[1]);
        let share = 1.0 / samples.len().max(1) as f32;
        let surface = PixelFeatures::of_sum(&all, samples.len());
        PixelParts { exact: all.exact * share, noisy, surface }
    }
}

fn scaled(light: &NoisyLight, by: f32) -> NoisyLight {
    let NoisyLight { direct, indirect, specular } = *light;
    NoisyLight { direct: direct * by, indirect: indirect * by, specular: specular * by }
}

/// Reconstruction of all noisy light by [`denoise`].
pub(super) struct AllLight;

impl Reconstruction for AllLight {
    type Sample = SampleParts;
    type Pixel = PixelParts;
    type Output = Rgba;

    const ROWS: u32 = 64;
    const MARGIN: u32 = MARGIN as u32;

    fn render(
        integrator: &dyn Integrator,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [SampleParts],
    ) {
        integrator.render_parts(frame, samples, sampler, scratch, LightSplit::All, out);
    }

    fn pixel(samples: &[SampleParts]) -> PixelParts {
        PixelParts::of_samples(samples)
    }

    fn work_bytes(width: u64, rows: u64) -> u64 {
        let strip = u64::from(AllLight::ROWS).min(rows) * width;
        band_bytes(width, rows) + strip * (size_of::<NoisyLight>() + size_of::<Rgba>()) as u64
    }

    fn reconstruct(
        parts: &[PixelParts],
        held: PixelRect,
        strip: Range<usize>,
        settings: &RenderSettings,
        frame: &Frame,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<Rgba>, Cancelled> {
        let width = held.width as usize;
        let strip_parts = &parts[strip.start * width..strip.end * width];
        let light = filter_light(parts, held, strip, settings.samples, frame, monitor)?;
        let color = |(pixel, light): (&PixelParts, NoisyLight)| {
            let NoisyLight { direct, indirect, specular } = light;
            pixel.exact + direct.extend(0.0) + indirect.extend(0.0) + specular.extend(0.0)
        };
        Ok(strip_parts.iter().zip(light).map(color).collect())
    }
}

/// Number of columns that are filtered at once: memory does not grow with the width of a picture.
const BAND: usize = 512;
/// Bytes for each pixel of a band: its features, halves and occlusion.
const BAND_PIXEL: u64 = 144;

/// Bytes that [`filter_light`] takes for a band of so many held pixels.
pub(super) fn band_bytes(width: u64, rows: u64) -> u64 {
    width.min((BAND + 2 * MARGIN) as u64) * rows * BAND_PIXEL
}

/// Filters the noisy light of the rows `strip` of the pixels in `held`.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub(super) fn filter_light(
    parts: &[impl AsRef<PixelParts>],
    held: PixelRect,
    strip: Range<usize>,
    samples: u32,
    frame: &Frame,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<NoisyLight>, Cancelled> {
    let width = held.width as usize;
    let mut filtered = vec![NoisyLight::default(); strip.len() * width];
    for first in (0..width).step_by(BAND) {
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        let end = (first + BAND).min(width);
        let columns = first.saturating_sub(MARGIN)..(end + MARGIN).min(width);
        let pixels: Vec<&PixelParts> =
            parts.chunks_exact(width).flat_map(|row| &row[columns.clone()]).map(AsRef::as_ref).collect();
        let band = PixelRect { x: held.x + columns.start as u32, width: columns.len() as u32, ..held };
        let light = filter_band(&pixels, band, strip.clone(), samples, frame, monitor)?;
        let rows = filtered.chunks_exact_mut(width).zip(light.chunks_exact(columns.len()));
        for (to, from) in rows {
            to[first..end].copy_from_slice(&from[first - columns.start..end - columns.start]);
        }
    }
    Ok(filtered)
}

/// Filters the noisy light of the rows `strip` of the pixels in `held`, all at once.
fn filter_band(
    parts: &[&PixelParts],
    held: PixelRect,
    strip: Range<usize>,
    samples: u32,
    frame: &Frame,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<NoisyLight>, Cancelled> {
    let width = held.width as usize;
    let strip_parts = &parts[strip.start * width..strip.end * width];
    let mut filtered = vec![NoisyLight::default(); strip_parts.len()];
    for kind in PartKind::ALL {
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        let is_dark = |pixel: &&PixelParts| pixel.noisy.iter().all(|half| light_of(half, kind) == Rgb::ZERO);
        if parts.iter().all(is_dark) {
            continue;
        }
        let divisor = |pixel: &PixelParts| divisor_of(pixel.surface.color(kind));
        let half =
            |i: usize| parts.iter().map(|pixel| light_of(&pixel.noisy[i], kind) / divisor(pixel)).collect();
        let reliability = parts.iter().map(|pixel| reliability(pixel.surface.color(kind))).collect();
        let part = NoisyPart { halves: [half(0), half(1)], reliability };
        let light = denoise(&features(parts, held, kind), &part, kind, samples, frame.simd(), strip.clone());
        for ((to, pixel), light) in filtered.iter_mut().zip(strip_parts).zip(light) {
            let to = match kind {
                PartKind::DirectDiffuse => &mut to.direct,
                PartKind::IndirectDiffuse => &mut to.indirect,
                PartKind::Specular => &mut to.specular,
            };
            *to = light * divisor(pixel);
        }
    }
    Ok(filtered)
}

fn light_of(light: &NoisyLight, kind: PartKind) -> Rgb {
    match kind {
        PartKind::DirectDiffuse => light.direct,
        PartKind::IndirectDiffuse => light.indirect,
        PartKind::Specular => light.specular,
    }
}

/// A colour that is not too dark to divide by.
pub(super) fn divisor_of(color: Rgb) -> Rgb {
    color.max(Rgb::splat(MIN_COLOR))
}

/// How far a pixel counts for its neighbours: less where light was divided by a colour that is nearly black.
fn reliability(color: Rgb) -> f32 {
    (color.element_sum() * (1.0 / 3.0) / MIN_COLOR).clamp(0.0, 1.0)
}

/// The features of all pixels in `held` that a part of the light is fitted by: of reflected light, those of what mirrors and
/// glass show.
fn features(parts: &[&PixelParts], held: PixelRect, kind: PartKind) -> Features {
    let all = |feature: fn(&PixelFeatures) -> Vec3| parts.iter().map(|p| feature(&p.surface)).collect();
    let is_specular = kind == PartKind::Specular;
    Features {
        width: held.width as usize,
        height: held.height as usize,
        origin: [held.x as usize, held.y as usize],
        albedo: if is_specular { all(PixelFeatures::seen_albedo) } else { Vec::new() },
        normal: all(if is_specular { PixelFeatures::seen_normal } else { PixelFeatures::normal }),
        position: all(|surface| surface.position),
        coverage: parts.iter().map(|pixel| pixel.surface.coverage).collect(),
    }
}
