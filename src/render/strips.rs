//! Pictures in strips: pixels are rendered in parts, strip by strip from the top, and put together from those around them.

use std::ops::Range;
use std::sync::Mutex;

use glam::UVec2;

use crate::film::PixelRect;
use crate::integrator::{Frame, Integrator, LowDiscrepancySampler, Sample, Scratch};
use crate::memory::{RenderMemory, TileScratch};
use crate::progress::{CancelOnly, ProgressMonitor};
use crate::round_sampling::{PixelSampling, border_settings};
use crate::sample_generator::SampleGenerator;
use crate::settings::RenderSettings;
use crate::tiles::{BATCH_SAMPLES, for_each_tile};
use blinn_core::cancellation::Cancelled;

/// A way to put pictures together from their noisy parts.
pub(super) trait Reconstruction {
    /// The light of a sample by part.
    type Sample: Clone + Default;
    /// Data that is kept of the samples of a pixel. The default is that of a pixel that hits nothing.
    type Pixel: Clone + Default + Send;
    /// A pixel of the picture.
    type Output: Copy;

    /// Rows that are reconstructed at once: memory does not grow with the height of a picture.
    const ROWS: u32;
    /// Pixels to each side that a pixel depends on.
    const MARGIN: u32;

    /// Writes the light of each sample to `out`.
    fn render(
        integrator: &dyn Integrator,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Self::Sample],
    );

    /// The pixel of these samples.
    fn pixel(samples: &[Self::Sample]) -> Self::Pixel;

    /// Bytes that [`Reconstruction::reconstruct`] takes for rows of so many held pixels, beside those pixels.
    fn work_bytes(width: u64, rows: u64) -> u64;

    /// `rows` of the pixels in `held`, of a picture with these settings.
    ///
    /// # Errors
    /// [`Cancelled`] if `monitor` cancels.
    fn reconstruct(
        pixels: &[Self::Pixel],
        held: PixelRect,
        rows: Range<usize>,
        settings: &RenderSettings,
        frame: &Frame,
        monitor: &dyn ProgressMonitor,
    ) -> Result<Vec<Self::Output>, Cancelled>;
}

/// Renders a picture and reconstructs its noisy light: the pixels of the window, row by row from the top.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub(super) fn render_in_strips<R: Reconstruction>(
    memory: &RenderMemory,
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<R::Output>, Cancelled> {
    let window = settings.window();
    let rendered = with_margin(window, settings, R::MARGIN);
    let bottom = rendered.y + rendered.height;
    // The rows that the current strip depends on.
    let mut held = PixelRect { height: 0, ..rendered };
    let most_rows = rendered.height.min(R::ROWS.saturating_add(2 * R::MARGIN));
    let mut pixels: Vec<R::Pixel> = Vec::with_capacity(rendered.width as usize * most_rows as usize);
    let mut picture = Vec::with_capacity(window.width as usize * window.height as usize);
    for first in (window.y..window.y + window.height).step_by(R::ROWS as usize) {
        let end = (first + R::ROWS).min(window.y + window.height);
        let from = first.saturating_sub(R::MARGIN).max(rendered.y);
        pixels.drain(..(from - held.y) as usize * rendered.width as usize);
        let start = held.y + held.height;
        let rows = PixelRect { y: start, height: (end + R::MARGIN).min(bottom) - start, ..rendered };
        held = PixelRect { y: from, height: rows.y + rows.height - from, ..rendered };
        let of_rows = RenderSettings { crop: Some(rows), ..*settings };
        let known = pixels.len();
        pixels.resize(known + rows.width as usize * rows.height as usize, R::Pixel::default());
        render_rows::<R>(memory, frame, integrator, &of_rows, window, &mut pixels[known..], monitor)?;
        let strip = (first - held.y) as usize..(end - held.y) as usize;
        let reconstructed = R::reconstruct(&pixels, held, strip, settings, frame, monitor)?;
        let left = (window.x - rendered.x) as usize;
        for row in reconstructed.chunks_exact(rendered.width as usize) {
            picture.extend_from_slice(&row[left..left + window.width as usize]);
        }
    }
    Ok(picture)
}

/// Bytes that [`render_in_strips`] takes beside the picture.
pub(super) fn strip_bytes<R: Reconstruction>(settings: &RenderSettings) -> u64 {
    let rendered = with_margin(settings.window(), settings, R::MARGIN);
    let width = u64::from(rendered.width);
    let rows = u64::from(rendered.height.min(R::ROWS.saturating_add(2 * R::MARGIN)));
    width * rows * size_of::<R::Pixel>() as u64 + R::work_bytes(width, rows)
}

/// Number of pixels that are in both rectangles.
fn common_pixels(a: PixelRect, b: PixelRect) -> u64 {
    let common = |a: u32, a_len: u32, b: u32, b_len: u32| {
        u64::from((a + a_len).min(b + b_len).saturating_sub(a.max(b)))
    };
    common(a.x, a.width, b.x, b.width) * common(a.y, a.height, b.y, b.height)
}

/// The rendered window with all pixels that its reconstruction depends on.
fn with_margin(window: PixelRect, settings: &RenderSettings, margin: u32) -> PixelRect {
    let x = window.x.saturating_sub(margin);
    let y = window.y.saturating_sub(margin);
    let end = |from: u32, len: u32, max: u32| from.saturating_add(len).saturating_add(margin).min(max);
    PixelRect {
        x,
        y,
        width: end(window.x, window.width, settings.width).saturating_sub(x),
        height: end(window.y, window.height, settings.height).saturating_sub(y),
    }
}

/// Renders all pixels of the settings' window to `film`, row by row from the top. Those in `wanted` are reported as done:
/// the margin around a crop is no progress.
pub(super) fn render_rows<R: Reconstruction>(
    memory: &RenderMemory,
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    wanted: PixelRect,
    film: &mut [R::Pixel],
    monitor: &dyn ProgressMonitor,
) -> Result<(), Cancelled> {
    let window = settings.window();
    let at_borders = border_settings(settings, frame);
    let sampling = PixelSampling::new(settings, at_borders.as_ref(), frame);
    let film = Mutex::new(film);
    for_each_tile(memory, settings, &CancelOnly(monitor), |tile, scratch| {
        let [low, high] = sampling.generator.film_bounds(&tile.corners());
        if integrator.may_hit(frame, low, high) {
            let rendered = sampling.render(frame, tile, scratch, |generator, pixels, scratch| {
                parts_of_pixels::<R>(generator, frame, integrator, pixels, scratch, monitor)
            });
            let mut film = film.lock().unwrap_or_else(|e| e.into_inner());
            for (p, pixel) in tile.pixels().zip(rendered) {
                film[(p.y - window.y) as usize * window.width as usize + (p.x - window.x) as usize] = pixel;
            }
        }
        monitor.pixels_done(common_pixels(tile, wanted));
    })
}

/// Renders pixels in parts. After a cancellation, the rest is black.
fn parts_of_pixels<R: Reconstruction>(
    generator: &SampleGenerator,
    frame: &Frame,
    integrator: &dyn Integrator,
    pixels: &[UVec2],
    scratch: &mut TileScratch,
    monitor: &dyn ProgressMonitor,
) -> Vec<R::Pixel> {
    let TileScratch { samples, integrator: integrator_scratch, .. } = scratch;
    let n = generator.samples_per_pixel();
    let mut means = Vec::with_capacity(pixels.len());
    let mut light = Vec::new();
    for batch in pixels.chunks((BATCH_SAMPLES / n).max(1)) {
        if monitor.is_cancelled() {
            means.resize(pixels.len(), R::Pixel::default());
            break;
        }
        let [low, high] = generator.film_bounds(batch);
        if !integrator.may_hit(frame, low, high) {
            means.resize(means.len() + batch.len(), R::Pixel::default());
            continue;
        }
        generator.generate(frame.simd(), batch, samples);
        light.clear();
        light.resize(samples.len(), R::Sample::default());
        R::render(integrator, frame, samples, &generator.sampler, integrator_scratch, &mut light);
        means.extend(light.chunks_exact(n).map(R::pixel));
    }
    means
}
