//! More samples where a few do not say enough.
//!
//! Every pixel gets four. Where those of a pixel and of one of its eight neighbours are apart on the
//! screen, its block of 2 × 2 pixels gets all that were asked for, whose rays then still go together. A
//! pixel's own samples say less of what is missing: edges and small shadows are overlooked by all of
//! them at once. docs/explanation/antialiasing.md has what that costs and brings.

use glam::UVec2;
use rayon::prelude::*;

use super::{
    Cancelled, PixelRect, Pixels, ProgressMonitor, RenderSettings, Sampling, by_tile, equally, means,
};
use crate::geometry::Rgba;
use crate::integrator::{Frame, Integrator};

/// Samples that every pixel gets.
pub(super) const FIRST: u32 = 4;

/// Where pixels get all their samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveSampling {
    /// How far apart neighbours have to be, black 0 and white 1 on a screen.
    pub threshold: f32,
    /// Stops by which the picture will be exposed.
    pub ev: f64,
}

/// Tells nobody of progress, and asks whether to go on.
struct Quiet<'a>(&'a dyn ProgressMonitor);

impl ProgressMonitor for Quiet<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

/// Renders a picture with few samples where these do.
pub(super) fn render(
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    adaptive: AdaptiveSampling,
    watch: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    let around = around(settings);
    let first = RenderSettings { samples: FIRST, crop: Some(around), ..*settings };
    let few = equally(frame, integrator, &first, &Quiet(watch))?;
    let apart = apart(&few, adaptive);
    let at = |p: UVec2| (p.y - around.y) as usize * around.width as usize + (p.x - around.x) as usize;
    let blocks_apart = |p: UVec2| {
        let (x, y) = (p.x & !1, p.y & !1);
        let inside = |p: &UVec2| p.x < settings.width && p.y < settings.height;
        [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]
            .map(UVec2::from)
            .iter()
            .filter(|p| inside(p))
            .any(|&p| apart[at(p)])
    };
    // Other places than the first ones.
    let others = RenderSettings { seed: settings.seed.wrapping_add(1), ..*settings };
    let sampling = Sampling::of(&others);
    let (n, all) = (settings.samples as f32, (FIRST + settings.samples) as f32);
    by_tile(settings, watch, |tile, work| {
        let chosen: Vec<bool> = tile.pixels().map(blocks_apart).collect();
        let pixels = tile.pixels().zip(&chosen).filter(|(_, chosen)| **chosen).map(|(p, _)| p);
        let pixels: Vec<UVec2> = pixels.collect();
        let mut more = means(&sampling, frame, integrator, &pixels, work).into_iter();
        let colors = tile.pixels().zip(chosen).map(|(p, chosen)| {
            let few = few.colors[at(p)];
            match chosen.then(|| more.next()).flatten() {
                Some(more) => (few * FIRST as f32 + more * n) / all,
                None => few,
            }
        });
        colors.collect()
    })
}

/// What is rendered with all blocks that it touches and all their neighbours: a part of a picture is
/// sampled as the whole is.
fn around(settings: &RenderSettings) -> PixelRect {
    let window = settings.window();
    let span = |from: u32, len: u32, most: u32| {
        let first = (from & !1).saturating_sub(1);
        let end = (from + len).next_multiple_of(2).saturating_add(1).min(most);
        (first, end.saturating_sub(first))
    };
    let (x, width) = span(window.x, window.width, settings.width);
    let (y, height) = span(window.y, window.height, settings.height);
    PixelRect { x, y, width, height }
}

/// For each pixel whether it and a neighbour are apart.
fn apart(pixels: &Pixels, AdaptiveSampling { threshold, ev }: AdaptiveSampling) -> Vec<bool> {
    let exposure = libm::exp2(ev) as f32;
    // The square root is near enough to what screens show.
    let shown = |c: &Rgba| (*c * Rgba::new(exposure, exposure, exposure, 1.0)).clamp(Rgba::ZERO, Rgba::ONE);
    let shown = |c: &Rgba| shown(c).to_array().map(f32::sqrt);
    let shown: Vec<[f32; 4]> = pixels.colors.par_iter().with_min_len(1 << 12).map(shown).collect();
    let (width, height) = (pixels.width as usize, pixels.height as usize);
    let near = |i: usize, most: usize| i.saturating_sub(1)..(i + 2).min(most);
    let apart = |i: usize| {
        let (x, y) = (i % width, i / width);
        near(y, height)
            .flat_map(|y| near(x, width).map(move |x| y * width + x))
            .any(|other| shown[other].iter().zip(shown[i]).any(|(&a, b)| (a - b).abs() > threshold))
    };
    (0..shown.len()).into_par_iter().with_min_len(1 << 12).map(apart).collect()
}
