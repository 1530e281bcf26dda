//! From a frame to pixels: tiles over all threads, samples, film.
//!
//! The same bytes on any number of threads and for any tile size: a pixel's samples depend on the
//! pixel alone, and are added in the order of their index.

mod adaptive;
mod film;
mod filter;
mod mattes;
mod meter;
mod sampling;

use std::sync::atomic::{AtomicBool, Ordering};

use glam::UVec2;
use rayon::prelude::*;

use crate::geometry::Rgba;
use crate::integrator::{Aov, Frame, Integrator, Sample, Scratch, first_hits};

pub use crate::integrator::{LowDiscrepancySampler, Sampler};
pub use adaptive::AdaptiveSampling;
pub use film::{AovLayer, Film, PixelRect, Pixels, TileBuffer};
pub use filter::PixelFilter;
pub use mattes::{MATTE_RANKS, Matte, render_mattes};
pub use meter::{METER_WIDTH, MID_GREY, Metering, meter};
use sampling::Sampling;

/// How a picture is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Pixels to the right, n_x.
    pub width: u32,
    /// Pixels downwards, n_y.
    pub height: u32,
    /// Samples for each pixel; 1 is the pixel's centre.
    pub samples: u32,
    /// How samples spread about the pixel's centre.
    pub filter: PixelFilter,
    /// Varies the samples' places.
    pub seed: u32,
    /// Only some pixels get more than four samples; `None`: all do.
    pub adaptive: Option<AdaptiveSampling>,
    /// The part that is rendered; `None` for all.
    pub crop: Option<PixelRect>,
    /// Side of a tile in pixels. The picture never depends on it.
    pub tile: u32,
}

impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            width: 1280,
            height: 720,
            samples: 4,
            filter: PixelFilter::BlackmanHarris,
            seed: 0,
            adaptive: None,
            crop: None,
            tile: 32,
        }
    }
}

impl RenderSettings {
    /// What is rendered: the crop, or everything.
    pub fn window(&self) -> PixelRect {
        self.crop.unwrap_or(PixelRect { x: 0, y: 0, width: self.width, height: self.height })
    }

    /// A pixel's sample at `offset` pixels from its upper left corner.
    #[inline(always)]
    fn sample(&self, pixel: UVec2, index: u32, offset: (f64, f64)) -> Sample {
        let x = (f64::from(pixel.x) + offset.0) / f64::from(self.width);
        let down = (f64::from(pixel.y) + offset.1) / f64::from(self.height);
        Sample { x, y: 1.0 - down, size: [0.0; 2], pixel, index }
    }
}

/// Who watches a render: told of progress, asked whether to go on.
pub trait ProgressMonitor: Sync {
    /// So many pixels more are done.
    fn pixels_done(&self, count: u64) {
        let _ = count;
    }

    /// True ends the render early.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Nobody watches.
impl ProgressMonitor for () {}

/// A flag that cancels.
impl ProgressMonitor for AtomicBool {
    fn is_cancelled(&self) -> bool {
        self.load(Ordering::Relaxed)
    }
}

/// The render was is_cancelled; there are no pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("is_cancelled")]
pub struct Cancelled;

/// Renders a picture: linear RGB premultiplied by alpha, without background, row 0 on top.
///
/// # Errors
/// [`Cancelled`] when `watch` says so.
pub fn render(
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    watch: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    match settings.adaptive {
        Some(adaptive) if settings.samples > adaptive::FIRST => {
            adaptive::render(frame, integrator, settings, adaptive, watch)
        }
        _ => equally(frame, integrator, settings, watch),
    }
}

/// Renders with as many samples for every pixel.
fn equally(
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    watch: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    let sampling = Sampling::of(settings);
    by_tile(settings, watch, |tile, work| {
        let pixels: Vec<UVec2> = tile.pixels().collect();
        means(&sampling, frame, integrator, &pixels, work)
    })
}

/// A picture of what `colors` says of each tile, in the order of [`Tile::pixels`]. Threads take the
/// next tile when they are done with one: halves of a picture are seldom as much work.
fn by_tile(
    settings: &RenderSettings,
    watch: &dyn ProgressMonitor,
    colors: impl Fn(PixelRect, &mut Work) -> Vec<Rgba> + Sync,
) -> Result<Pixels, Cancelled> {
    let film = Film::new(settings.window());
    film.tiles(settings.tile).into_iter().par_bridge().for_each_init(Work::default, |work, tile| {
        if watch.is_cancelled() {
            return;
        }
        film.put(&TileBuffer { tile, colors: colors(tile, work) });
        watch.pixels_done(u64::from(tile.width) * u64::from(tile.height));
    });
    if watch.is_cancelled() { Err(Cancelled) } else { Ok(film.finish()) }
}

/// The colours of pixels: the means of their samples.
fn means(
    sampling: &Sampling,
    frame: &Frame,
    integrator: &dyn Integrator,
    pixels: &[UVec2],
    work: &mut Work,
) -> Vec<Rgba> {
    let n = sampling.count();
    let mut means = Vec::with_capacity(pixels.len());
    // Pixels go together as far as what is known of their points stays in a processor's cache.
    for some in pixels.chunks((IN_CACHE / n).max(1)) {
        let [low, high] = sampling.film_of(some);
        if !integrator.may_hit(frame, low, high) {
            means.resize(means.len() + some.len(), Rgba::ZERO);
            continue;
        }
        sampling.samples(frame.accel, some, &mut work.samples);
        work.colors.clear();
        work.colors.resize(work.samples.len(), Rgba::ZERO);
        integrator.render(frame, &work.samples, &sampling.sampler, &mut work.scratch, &mut work.colors);
        let mean = |samples: &[Rgba]| samples.iter().fold(Rgba::ZERO, |a, &b| a + b) / n as f32;
        means.extend(work.colors.chunks_exact(n).map(mean));
    }
    means
}

/// Renders layers of what lies behind each pixel's centre.
///
/// # Errors
/// [`Cancelled`] when `watch` says so.
pub fn render_aovs(
    frame: &Frame,
    aovs: &[Aov],
    settings: &RenderSettings,
    watch: &dyn ProgressMonitor,
) -> Result<Vec<AovLayer>, Cancelled> {
    // Without layers no ray need be traced.
    if aovs.is_empty() {
        return Ok(Vec::new());
    }
    let window = settings.window();
    let rows: Vec<Vec<Vec<f32>>> = (window.y..window.y + window.height)
        .into_par_iter()
        .map_init(Scratch::default, |scratch, y| {
            let mut layers = vec![Vec::new(); aovs.len()];
            if watch.is_cancelled() {
                return layers;
            }
            let row = window.x..window.x + window.width;
            let samples: Vec<Sample> =
                row.map(|x| settings.sample(UVec2::new(x, y), 0, (0.5, 0.5))).collect();
            for first in first_hits(frame, &samples, scratch) {
                for (aov, out) in aovs.iter().zip(&mut layers) {
                    aov.evaluate(frame, &first, out);
                }
            }
            layers
        })
        .collect();
    if watch.is_cancelled() {
        return Err(Cancelled);
    }
    let layer = |i: usize| rows.iter().flat_map(|row| row[i].iter().copied()).collect();
    Ok(aovs.iter().enumerate().map(|(i, &aov)| AovLayer { aov, values: layer(i) }).collect())
}

/// Samples whose points fit into a processor's second cache.
const IN_CACHE: usize = 1024;

/// What a thread keeps from tile to tile.
#[derive(Default)]
struct Work {
    samples: Vec<Sample>,
    colors: Vec<Rgba>,
    scratch: Scratch,
}
