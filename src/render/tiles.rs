//! Renders tiles in parallel and averages the samples of each pixel.

use glam::UVec2;
use rayon::prelude::*;

use crate::film::{Film, PixelRect, Pixels, TileBuffer};
use crate::integrator::{Frame, Integrator};
use crate::memory::{RenderMemory, TileScratch};
use crate::progress::ProgressMonitor;
use crate::round_sampling::{PixelSampling, border_settings};
use crate::sample_generator::SampleGenerator;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::Rgba;

/// Samples that are rendered at once: their shading points fit into the L2 cache.
pub(super) const BATCH_SAMPLES: usize = 1024;

/// Renders all pixels with the same number of samples, but those at borders of points and lines with more.
pub(super) fn render_uniform(
    memory: &RenderMemory,
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    let at_borders = border_settings(settings, frame);
    let sampling = PixelSampling::new(settings, at_borders.as_ref(), frame);
    render_tiles(memory, settings, monitor, |tile, scratch| {
        let [low, high] = sampling.generator.film_bounds(&tile.corners());
        if !integrator.may_hit(frame, low, high) {
            return Vec::new();
        }
        sampling.render(frame, tile, scratch, |generator, pixels, scratch| {
            render_pixels(generator, frame, integrator, pixels, scratch, monitor)
        })
    })
}

/// Renders a picture whose tiles `colors` computes, in the order of [`PixelRect::pixels`]; no colours are black. Each
/// thread takes the next tile when it has finished one, because the parts of a picture differ in cost.
pub(super) fn render_tiles(
    memory: &RenderMemory,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
    colors: impl Fn(PixelRect, &mut TileScratch) -> Vec<Rgba> + Sync,
) -> Result<Pixels, Cancelled> {
    let film = Film::with_memory(settings.window(), memory.take_film());
    for_each_tile(memory, settings, monitor, |tile, scratch| {
        let colors = colors(tile, scratch);
        if colors.is_empty() {
            film.clear(tile);
        } else {
            film.store(&TileBuffer { tile, colors });
        }
    })?;
    Ok(film.into_pixels())
}

/// Calls `render` with each tile of a picture, in parallel.
pub(super) fn for_each_tile(
    memory: &RenderMemory,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
    render: impl Fn(PixelRect, &mut TileScratch) + Sync,
) -> Result<(), Cancelled> {
    Film::cut(settings.window(), settings.tile).into_iter().par_bridge().for_each_init(
        || memory.scratch(),
        |guard, tile| {
            if monitor.is_cancelled() {
                return;
            }
            render(tile, &mut guard.scratch);
            monitor.pixels_done(u64::from(tile.width) * u64::from(tile.height));
        },
    );
    if monitor.is_cancelled() { Err(Cancelled) } else { Ok(()) }
}

/// Renders pixels: the mean of the samples of each. After a cancellation, the rest is black.
pub(super) fn render_pixels(
    generator: &SampleGenerator,
    frame: &Frame,
    integrator: &dyn Integrator,
    pixels: &[UVec2],
    scratch: &mut TileScratch,
    monitor: &dyn ProgressMonitor,
) -> Vec<Rgba> {
    let TileScratch { samples, colors, integrator: integrator_scratch } = scratch;
    let n = generator.samples_per_pixel();
    let mut means = Vec::with_capacity(pixels.len());
    for batch in pixels.chunks((BATCH_SAMPLES / n).max(1)) {
        // With many samples, a tile takes long.
        if monitor.is_cancelled() {
            means.resize(pixels.len(), Rgba::ZERO);
            break;
        }
        let [low, high] = generator.film_bounds(batch);
        if !integrator.may_hit(frame, low, high) {
            means.resize(means.len() + batch.len(), Rgba::ZERO);
            continue;
        }
        generator.generate(frame.simd(), batch, samples);
        colors.clear();
        colors.resize(samples.len(), Rgba::ZERO);
        integrator.render(frame, samples, &generator.sampler, integrator_scratch, colors);
        if n == 1 {
            // Added to zero as sums of more are, which makes −0 to 0.
            means.extend(colors.iter().map(|&color| Rgba::ZERO + color));
            continue;
        }
        let mean = |samples: &[Rgba]| samples.iter().fold(Rgba::ZERO, |a, &b| a + b) / n as f32;
        means.extend(colors.chunks_exact(n).map(mean));
    }
    means
}
