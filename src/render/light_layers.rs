//! Renders the light of a picture by layer. Noisy light is reconstructed as in the picture, whose light the layers add up to.

use std::ops::Range;

use crate::film::PixelRect;
use crate::integrator::{
    Frame, Integrator, LightLayer, LightLayers, LightSplit, LowDiscrepancySampler, NoisyLight, Sample,
    SampleLayers, SampleParts, Scratch,
};
use crate::memory::RenderMemory;
use crate::progress::ProgressMonitor;
use crate::reconstruction::{AllLight, PixelParts, filter_light};
use crate::rough_reflections::{ReflectingPixel, RoughReflections, smooth_reflections};
use crate::settings::{NoiseSources, RenderSettings};
use crate::strips::{Reconstruction, render_in_strips, strip_bytes};
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::Rgb;

/// Renders the light of the picture of a frame by layer: linear RGB premultiplied by alpha, row 0 on top. Every pixel has all
/// samples: [`RenderSettings::adaptive`] has no effect.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render_light_layers(
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<LightLayers>, Cancelled> {
    let memory = RenderMemory::default();
    let noise = NoiseSources::of_frame(frame);
    if settings.filters_all_light(&noise) {
        render_in_strips::<LayersOfAllLight>(&memory, frame, integrator, settings, monitor)
    } else if settings.filters_rough_reflections(&noise) {
        render_in_strips::<LayersWithRoughReflections>(&memory, frame, integrator, settings, monitor)
    } else {
        render_in_strips::<UnfilteredLayers>(&memory, frame, integrator, settings, monitor)
    }
}

/// Returns the bytes that [`render_light_layers`] takes where some or all of `noise` is in a frame.
pub fn light_layer_bytes(settings: &RenderSettings, noise: &NoiseSources) -> u64 {
    let bytes = |noise: &NoiseSources| {
        if settings.filters_all_light(noise) {
            strip_bytes::<LayersOfAllLight>(settings)
        } else if settings.filters_rough_reflections(noise) {
            strip_bytes::<LayersWithRoughReflections>(settings)
        } else {
            strip_bytes::<UnfilteredLayers>(settings)
        }
    };
    let PixelRect { width, height, .. } = settings.window();
    let pixels = u64::from(width) * u64::from(height);
    let picture = pixels.saturating_mul(size_of::<LightLayers>() as u64);
    picture.saturating_add(noise.each().iter().map(bytes).max().unwrap_or(0))
}

/// The light of a strip: filtered, that of direct layers as well, and by layer.
fn copied_light_bytes(width: u64, rows: u64, strip: u32) -> u64 {
    let bytes = 2 * size_of::<NoisyLight>() + size_of::<LightLayers>();
    width * rows.min(u64::from(strip)) * bytes as u64
}

/// The mean over the samples of a pixel.
fn mean(layers: impl ExactSizeIterator<Item = LightLayers>) -> LightLayers {
    let count = layers.len().max(1);
    let mut sum = LightLayers::ZERO;
    layers.for_each(|layers| sum += layers);
    sum * Rgb::splat(1.0 / count as f32)
}

fn exact_light(samples: &[SampleLayers]) -> LightLayers {
    mean(samples.iter().map(SampleLayers::exact))
}

fn all_parts(samples: &[SampleLayers]) -> Vec<SampleParts> {
    samples.iter().map(|sample| sample.parts).collect()
}

/// The noisy light that belongs to direct layers.
fn direct_parts(samples: &[SampleLayers]) -> Vec<SampleParts> {
    samples.iter().map(|sample| SampleParts { noisy: sample.noisy_direct, ..sample.parts }).collect()
}

/// Adds reconstructed light to the layers. `direct` is the reconstructed light of direct layers, of which not more counts than
/// there is in all.
fn add_light(layers: &mut LightLayers, all: &NoisyLight, direct: &NoisyLight) {
    let share = |direct: Rgb, all: Rgb| direct.clamp(all.min(Rgb::ZERO), all.max(Rgb::ZERO));
    let diffuse = share(direct.direct, all.direct) + share(direct.indirect, all.indirect);
    let specular = share(direct.specular, all.specular);
    layers[LightLayer::DiffuseDirect] += diffuse;
    layers[LightLayer::DiffuseIndirect] += all.direct + all.indirect - diffuse;
    layers[LightLayer::SpecularDirect] += specular;
    layers[LightLayer::SpecularIndirect] += all.specular - specular;
}

/// Layers whose noisy light is filtered as [`AllLight`] filters it.
struct LayersOfAllLight;

#[derive(Clone, Copy, Debug, Default)]
struct FilteredPixel {
    exact: LightLayers,
    parts: PixelParts,
    /// Means of the light of direct layers over the even and over the odd samples.
    direct: [NoisyLight; 2],
}

impl Reconstruction for LayersOfAllLight {
    type Sample = SampleLayers;
    type Pixel = FilteredPixel;
    type Output = LightLayers;

    const ROWS: u32 = AllLight::ROWS;
    const MARGIN: u32 = AllLight::MARGIN;

    fn render(
        integrator: &dyn Integrator,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [SampleLayers],
    ) {
        integrator.render_layers(frame, samples, sampler, scratch, Some(LightSplit::All), out);
    }

    fn pixel(samples: &[SampleLayers]) -> FilteredPixel {
        FilteredPixel {
            exact: exact_light(samples),
            parts: PixelParts::of_samples(&all_parts(samples)),
            direct: PixelParts::of_samples(&direct_parts(samples)).noisy,
        }
    }

    fn work_bytes(width: u64, rows: u64) -> u64 {
        let parts = width * rows * size_of::<PixelParts>() as u64;
        parts + copied_light_bytes(width, rows, Self::ROWS) + AllLight::work_bytes(width, rows)
    }

    fn reconstruct(
        pixels: &[FilteredPixel],
        held: PixelRect,
        rows: Range<usize>,
        settings: &RenderSettings,
        frame: &Frame,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<LightLayers>, Cancelled> {
        let width = held.width as usize;
        let wanted = &pixels[rows.start * width..rows.end * width];
        let mut parts: Vec<PixelParts> = pixels.iter().map(|pixel| pixel.parts).collect();
        let all = filter_light(&parts, held, rows.clone(), settings.samples, frame, monitor)?;
        parts.iter_mut().zip(pixels).for_each(|(parts, pixel)| parts.noisy = pixel.direct);
        let direct = filter_light(&parts, held, rows, settings.samples, frame, monitor)?;
        let layers = |((pixel, all), direct): ((&FilteredPixel, NoisyLight), NoisyLight)| {
            let mut layers = pixel.exact;
            add_light(&mut layers, &all, &direct);
            layers
        };
        Ok(wanted.iter().zip(all).zip(direct).map(layers).collect())
    }
}

/// Layers in which what rough metals reflect is smoothed as [`RoughReflections`] smooths it.
struct LayersWithRoughReflections;

#[derive(Clone, Copy, Debug, Default)]
struct SmoothedPixel {
    exact: LightLayers,
    reflecting: ReflectingPixel,
    /// Means of the light of direct layers over the even and over the odd samples.
    direct: [Rgb; 2],
}

impl Reconstruction for LayersWithRoughReflections {
    type Sample = SampleLayers;
    type Pixel = SmoothedPixel;
    type Output = LightLayers;

    const ROWS: u32 = RoughReflections::ROWS;
    const MARGIN: u32 = RoughReflections::MARGIN;

    fn render(
        integrator: &dyn Integrator,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [SampleLayers],
    ) {
        let split = Some(LightSplit::RoughReflections);
        integrator.render_layers(frame, samples, sampler, scratch, split, out);
    }

    fn pixel(samples: &[SampleLayers]) -> SmoothedPixel {
        SmoothedPixel {
            exact: exact_light(samples),
            reflecting: ReflectingPixel::of_samples(&all_parts(samples)),
            direct: ReflectingPixel::of_samples(&direct_parts(samples)).halves,
        }
    }

    fn work_bytes(width: u64, rows: u64) -> u64 {
        let reflecting = width * rows * size_of::<ReflectingPixel>() as u64;
        reflecting + copied_light_bytes(width, rows, Self::ROWS) + RoughReflections::work_bytes(width, rows)
    }

    fn reconstruct(
        pixels: &[SmoothedPixel],
        held: PixelRect,
        rows: Range<usize>,
        settings: &RenderSettings,
        frame: &Frame,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<LightLayers>, Cancelled> {
        let width = held.width as usize;
        let wanted = &pixels[rows.start * width..rows.end * width];
        let mut reflecting: Vec<ReflectingPixel> = pixels.iter().map(|pixel| pixel.reflecting).collect();
        let all = smooth_reflections(&reflecting, held, rows.clone(), settings.samples, frame.simd());
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        reflecting.iter_mut().zip(pixels).for_each(|(reflecting, pixel)| reflecting.halves = pixel.direct);
        let direct = smooth_reflections(&reflecting, held, rows, settings.samples, frame.simd());
        let noisy = |specular: Rgb| NoisyLight { specular, ..NoisyLight::default() };
        let layers = |((pixel, all), direct): ((&SmoothedPixel, Rgb), Rgb)| {
            let mut layers = pixel.exact;
            add_light(&mut layers, &noisy(all), &noisy(direct));
            layers
        };
        Ok(wanted.iter().zip(all).zip(direct).map(layers).collect())
    }
}

/// Layers as they are.
struct UnfilteredLayers;

impl Reconstruction for UnfilteredLayers {
    type Sample = SampleLayers;
    type Pixel = LightLayers;
    type Output = LightLayers;

    const ROWS: u32 = AllLight::ROWS;
    const MARGIN: u32 = 0;

    fn render(
        integrator: &dyn Integrator,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [SampleLayers],
    ) {
        integrator.render_layers(frame, samples, sampler, scratch, None, out);
    }

    fn pixel(samples: &[SampleLayers]) -> LightLayers {
        mean(samples.iter().map(|sample| sample.layers))
    }

    fn work_bytes(width: u64, rows: u64) -> u64 {
        copied_light_bytes(width, rows, Self::ROWS)
    }

    fn reconstruct(
        pixels: &[LightLayers],
        held: PixelRect,
        rows: Range<usize>,
        _settings: &RenderSettings,
        _frame: &Frame,
        _monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<LightLayers>, Cancelled> {
        let width = held.width as usize;
        Ok(pixels[rows.start * width..rows.end * width].to_vec())
    }
}
