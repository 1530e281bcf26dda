//! Adaptive sampling: all samples only where a few show a difference between neighbouring pixels.
//!
//! Every pixel gets four samples. Where a pixel and one of its eight neighbours differ on the display, its block of 2 × 2
//! pixels gets all samples; their rays are still traced together. The variance of a pixel's own samples is no
//! criterion, because edges and small shadows are missed by all of them at once. docs/explanation/antialiasing.md has cost
//! and benefit.

use glam::UVec2;
use rayon::prelude::*;

use crate::film::{PixelRect, Pixels};
use crate::integrator::{Frame, Integrator};
use crate::memory::RenderMemory;
use crate::progress::{CancelOnly, ProgressMonitor};
use crate::sample_generator::SampleGenerator;
use crate::settings::{AdaptiveSampling, RenderSettings};
use crate::tiles::{render_pixels, render_tiles, render_uniform};
use blinn_core::cancellation::Cancelled;
use blinn_core::geometry::Rgba;

/// Samples that every pixel gets.
pub(super) const FIRST_SAMPLES: u32 = 4;

/// Pixels for each parallel task of the comparison.
const PIXELS_PER_TASK: usize = 1 << 12;

/// Renders a picture with all samples only where neighbours differ.
pub(super) fn render_adaptive(
    memory: &RenderMemory,
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    adaptive: AdaptiveSampling,
    monitor: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    let window = expanded_window(settings);
    let first_settings = RenderSettings { samples: FIRST_SAMPLES, crop: Some(window), ..*settings };
    let first = render_uniform(memory, frame, integrator, &first_settings, &CancelOnly(monitor))?;
    let differs = differing_pixels(&first, adaptive);
    let index = |p: UVec2| (p.y - window.y) as usize * window.width as usize + (p.x - window.x) as usize;
    let block_differs = |p: UVec2| {
        let corner = UVec2::new(p.x & !1, p.y & !1);
        [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE]
            .map(|offset| corner + offset)
            .iter()
            .filter(|p| p.x < settings.width && p.y < settings.height)
            .any(|&p| differs[index(p)])
    };
    // Another seed: other positions than the first samples'.
    let more_settings = RenderSettings { seed: settings.seed.wrapping_add(1), ..*settings };
    let generator = SampleGenerator::new(&more_settings, frame.camera.lens);
    let more_samples = settings.samples as f32;
    let all_samples = (FIRST_SAMPLES + settings.samples) as f32;
    render_tiles(memory, settings, monitor, |tile, scratch| {
        let refined: Vec<bool> = tile.pixels().map(block_differs).collect();
        let pixels: Vec<UVec2> =
            tile.pixels().zip(&refined).filter(|(_, refined)| **refined).map(|(p, _)| p).collect();
        let mut more = render_pixels(&generator, frame, integrator, &pixels, scratch, monitor).into_iter();
        let colors = tile.pixels().zip(refined).map(|(p, refined)| {
            let first = first.colors[index(p)];
            match refined.then(|| more.next()).flatten() {
                Some(more) => (first * FIRST_SAMPLES as f32 + more * more_samples) / all_samples,
                None => first,
            }
        });
        colors.collect()
    })
}

/// The rendered window with all blocks that it touches, and all their neighbours: a crop is sampled as the whole picture is.
fn expanded_window(settings: &RenderSettings) -> PixelRect {
    let window = settings.window();
    let first = |from: u32| (from & !1).saturating_sub(1);
    let end = |from: u32, len: u32, max: u32| (from + len).next_multiple_of(2).saturating_add(1).min(max);
    let x = first(window.x);
    let y = first(window.y);
    PixelRect {
        x,
        y,
        width: end(window.x, window.width, settings.width).saturating_sub(x),
        height: end(window.y, window.height, settings.height).saturating_sub(y),
    }
}

/// For each pixel, true if it differs from one of its neighbours on the display.
fn differing_pixels(pixels: &Pixels, adaptive: AdaptiveSampling) -> Vec<bool> {
    let AdaptiveSampling { threshold, ev } = adaptive;
    let exposure = libm::exp2(ev) as f32;
    let exposure = Rgba::new(exposure, exposure, exposure, 1.0);
    // The square root approximates the display's transfer function.
    let displayed = |c: &Rgba| (*c * exposure).clamp(Rgba::ZERO, Rgba::ONE).to_array().map(f32::sqrt);
    let displayed: Vec<[f32; 4]> =
        pixels.colors.par_iter().with_min_len(PIXELS_PER_TASK).map(displayed).collect();
    let width = pixels.width as usize;
    let height = pixels.height as usize;
    let neighbours = |i: usize, len: usize| i.saturating_sub(1)..(i + 2).min(len);
    let differs = |i: usize| {
        neighbours(i / width, height)
            .flat_map(|y| neighbours(i % width, width).map(move |x| y * width + x))
            .any(|other| displayed[other].iter().zip(displayed[i]).any(|(&a, b)| (a - b).abs() > threshold))
    };
    (0..displayed.len()).into_par_iter().with_min_len(PIXELS_PER_TASK).map(differs).collect()
}
