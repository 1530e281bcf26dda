//! Pictures whose noisy light is reconstructed: rendered in parts, filtered, and put together again.

use std::ops::Range;
use std::sync::Mutex;

use glam::{UVec2, Vec3};

use crate::denoise::{Features, MARGIN, NoisyPart, PartKind, denoise};
use crate::film::{PixelRect, Pixels};
use crate::integrator::{Frame, Integrator, NoisyLight, SampleParts, SeenFeatures, SurfaceFeatures};
use crate::memory::RenderMemory;
use crate::progress::{CancelOnly, ProgressMonitor};
use crate::sample_generator::SampleGenerator;
use crate::settings::RenderSettings;
use crate::tiles::{for_each_tile, parts_of_pixels};
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
    pub surface: SurfaceFeatures,
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
        let SurfaceFeatures { diffuse_color, specular_color, albedo, normal, position, seen, coverage } =
            all.surface;
        // Features are means over what surfaces cover.
        let covered = if coverage > 0.0 { 1.0 / coverage } else { 0.0 };
        PixelParts {
            exact: all.exact * share,
            noisy,
            surface: SurfaceFeatures {
                diffuse_color: diffuse_color * share,
                specular_color: specular_color * share,
                albedo: albedo * covered,
                normal: normal * covered,
                position: position * covered,
                seen: SeenFeatures {
                    albedo: seen.albedo * covered,
                    normal: seen.normal * covered,
                    coverage: seen.coverage * share,
                },
                coverage: coverage * share,
            },
        }
    }
}

fn scaled(light: &NoisyLight, by: f32) -> NoisyLight {
    let NoisyLight { direct, indirect, specular } = *light;
    NoisyLight { direct: direct * by, indirect: indirect * by, specular: specular * by }
}

/// Rows that are reconstructed at once: memory does not grow with the height of a picture.
const STRIP: u32 = 64;

/// Renders a picture and reconstructs its noisy light.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub(super) fn render_reconstructed(
    memory: &RenderMemory,
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    let window = settings.window();
    let rendered = with_margin(window, settings);
    let (bottom, margin) = (rendered.y + rendered.height, MARGIN as u32);
    // The rows that the current strip depends on.
    let mut held = PixelRect { height: 0, ..rendered };
    let mut parts: Vec<PixelParts> = Vec::new();
    let mut colors = Vec::with_capacity(window.width as usize * window.height as usize);
    for first in (window.y..window.y + window.height).step_by(STRIP as usize) {
        let end = (first + STRIP).min(window.y + window.height);
        let from = first.saturating_sub(margin).max(rendered.y);
        parts.drain(..(from - held.y) as usize * rendered.width as usize);
        let start = held.y + held.height;
        let rows = PixelRect { y: start, height: (end + margin).min(bottom) - start, ..rendered };
        held = PixelRect { y: from, height: rows.y + rows.height - from, ..rendered };
        let settings = RenderSettings { crop: Some(rows), ..*settings };
        parts.extend(render_parts(memory, frame, integrator, &settings, monitor)?);
        let strip = (first - held.y) as usize..(end - held.y) as usize;
        let reconstructed = reconstruct(&parts, held, strip, settings.samples, frame, monitor)?;
        let left = (window.x - rendered.x) as usize;
        for row in reconstructed.chunks_exact(rendered.width as usize) {
            colors.extend_from_slice(&row[left..left + window.width as usize]);
        }
        monitor.pixels_done(u64::from(window.width) * u64::from(end - first));
    }
    Ok(Pixels { width: window.width, height: window.height, colors })
}

/// The rendered window with all pixels that its reconstruction depends on.
fn with_margin(window: PixelRect, settings: &RenderSettings) -> PixelRect {
    let margin = MARGIN as u32;
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

/// Reconstructs the rows `strip` of the pixels in `held`.
fn reconstruct(
    parts: &[PixelParts],
    held: PixelRect,
    strip: Range<usize>,
    samples: u32,
    frame: &Frame,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<Rgba>, Cancelled> {
    let width = held.width as usize;
    let strip_parts = &parts[strip.start * width..strip.end * width];
    let mut colors: Vec<Rgba> = strip_parts.iter().map(|pixel| pixel.exact).collect();
    let surfaces = features(parts, held, |surface| surface.albedo, |surface| surface.normal);
    // For reflected light, features of what mirrors and glass show.
    let seen = features(parts, held, |surface| surface.seen.albedo, |surface| surface.seen.normal);
    for kind in [PartKind::DirectDiffuse, PartKind::IndirectDiffuse, PartKind::Specular] {
        if monitor.is_cancelled() {
            return Err(Cancelled);
        }
        let is_dark = |pixel: &PixelParts| pixel.noisy.iter().all(|half| light_of(half, kind) == Rgb::ZERO);
        if parts.iter().all(is_dark) {
            continue;
        }
        let divisor = |pixel: &PixelParts| color_of(&pixel.surface, kind).max(Rgb::splat(MIN_COLOR));
        let half =
            |i: usize| parts.iter().map(|pixel| light_of(&pixel.noisy[i], kind) / divisor(pixel)).collect();
        let reliability = parts.iter().map(|pixel| reliability(color_of(&pixel.surface, kind))).collect();
        let part = NoisyPart { halves: [half(0), half(1)], reliability };
        let features = if kind == PartKind::Specular { &seen } else { &surfaces };
        let light = denoise(features, &part, kind, samples, frame.simd(), strip.clone());
        for ((to, pixel), light) in colors.iter_mut().zip(strip_parts).zip(light) {
            *to += (light * divisor(pixel)).extend(0.0);
        }
    }
    Ok(colors)
}

fn light_of(light: &NoisyLight, kind: PartKind) -> Rgb {
    match kind {
        PartKind::DirectDiffuse => light.direct,
        PartKind::IndirectDiffuse => light.indirect,
        PartKind::Specular => light.specular,
    }
}

/// The colour that a part of the light is divided by.
fn color_of(surface: &SurfaceFeatures, kind: PartKind) -> Rgb {
    match kind {
        PartKind::DirectDiffuse | PartKind::IndirectDiffuse => surface.diffuse_color,
        PartKind::Specular => surface.specular_color,
    }
}

/// How far a pixel counts for its neighbours: less where light was divided by a colour that is nearly black.
fn reliability(color: Rgb) -> f32 {
    (color.element_sum() * (1.0 / 3.0) / MIN_COLOR).clamp(0.0, 1.0)
}

/// Renders all pixels in parts, row by row from the top.
fn render_parts(
    memory: &RenderMemory,
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Vec<PixelParts>, Cancelled> {
    let window = settings.window();
    let generator = SampleGenerator::new(settings);
    let film = Mutex::new(vec![PixelParts::default(); window.width as usize * window.height as usize]);
    for_each_tile(memory, settings, &CancelOnly(monitor), |tile, scratch| {
        let [low, high] = generator.film_bounds(&tile.corners());
        if !integrator.may_hit(frame, low, high) {
            return;
        }
        let pixels: Vec<UVec2> = tile.pixels().collect();
        let parts =
            parts_of_pixels(&generator, frame, integrator, &pixels, scratch, monitor, PixelParts::of_samples);
        let mut film = film.lock().unwrap_or_else(|e| e.into_inner());
        for (p, parts) in pixels.iter().zip(parts) {
            film[(p.y - window.y) as usize * window.width as usize + (p.x - window.x) as usize] = parts;
        }
    })?;
    Ok(film.into_inner().unwrap_or_else(|e| e.into_inner()))
}

/// The features of all pixels in `held`, with these as albedo and normal.
fn features(
    parts: &[PixelParts],
    held: PixelRect,
    albedo: fn(&SurfaceFeatures) -> Vec3,
    normal: fn(&SurfaceFeatures) -> Vec3,
) -> Features {
    let all = |feature: fn(&SurfaceFeatures) -> Vec3| parts.iter().map(|p| feature(&p.surface)).collect();
    Features {
        width: held.width as usize,
        height: held.height as usize,
        origin: [held.x as usize, held.y as usize],
        albedo: all(albedo),
        normal: all(normal),
        position: all(|surface| surface.position),
        coverage: parts.iter().map(|pixel| pixel.surface.coverage).collect(),
    }
}
