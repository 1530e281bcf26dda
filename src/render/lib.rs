//! From a frame to pixels: the film is cut into tiles, which all threads share.
//!
//! The pixels do not depend on the number of threads or the size of tiles: a pixel's samples depend on the pixel alone, and
//! are added in the order of their indices.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod adaptive;
mod aov_layers;
mod denoise;
pub mod display;
mod edges;
mod film;
mod filter;
mod filter_memory;
mod hit_pixels;
pub mod integrator;
mod lens_blur;
mod light_layers;
mod mask_outlines;
mod mattes;
mod memory;
mod meter;
mod noisy_picture;
mod object_masks;
mod pixel_features;
mod pixel_mask;
mod progress;
mod reconstruction;
mod rough_reflections;
mod round_sampling;
mod sample_generator;
mod settings;
mod strips;
mod surface_tracks;
mod tiles;

use crate::integrator::{Frame, Integrator};
use crate::lens_blur::LensBlur;
use crate::reconstruction::AllLight;
use crate::rough_reflections::RoughReflections;
use crate::strips::render_in_strips;

pub use crate::integrator::{LowDiscrepancySampler, Sampler};
pub use aov_layers::{render_aovs, render_moving_aovs};
pub use blinn_core::cancellation::Cancelled;
pub use edges::{EdgeCache, EdgeKinds, EdgeStyle, EdgeWidth, HiddenEdges, draw_edges, render_edges};
pub use film::{AovLayer, Film, PixelRect, Pixels, TileBuffer};
pub use filter::{FilterSampler, PixelFilter};
pub use filter_memory::noise_filter_bytes;
pub use hit_pixels::count_hit_pixels;
pub use light_layers::{light_layer_bytes, render_light_layers};
pub use mattes::{MATTE_RANKS, Matte, render_mattes};
pub use memory::RenderMemory;
pub use meter::{METER_WIDTH, MID_GREY, Metering, meter};
pub use noisy_picture::NoisyPicture;
pub use object_masks::{ObjectMask, render_object_masks};
pub use pixel_mask::{MaskRect, PixelMask};
pub use progress::ProgressMonitor;
pub use settings::{AdaptiveSampling, Denoise, NoiseSources, RenderSettings};
pub use surface_tracks::{SurfaceTrack, trace_surface_tracks};

/// Renders a picture: linear RGB premultiplied by alpha, without background, row 0 on top.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render(
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    render_with_memory(&RenderMemory::default(), frame, integrator, settings, monitor)
}

/// Renders a picture as [`render`] does, in the memory of earlier ones.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn render_with_memory(
    memory: &RenderMemory,
    frame: &Frame,
    integrator: &dyn Integrator,
    settings: &RenderSettings,
    monitor: &dyn ProgressMonitor,
) -> Result<Pixels, Cancelled> {
    let PixelRect { width, height, .. } = settings.window();
    let picture = |colors| Pixels { width, height, colors };
    let noise = NoiseSources::of_frame(frame);
    if settings.filters_lens_blur(&noise) {
        render_in_strips::<LensBlur>(memory, frame, integrator, settings, monitor).map(picture)
    } else if settings.filters_all_light(&noise) {
        render_in_strips::<AllLight>(memory, frame, integrator, settings, monitor).map(picture)
    } else if settings.filters_rough_reflections(&noise) {
        render_in_strips::<RoughReflections>(memory, frame, integrator, settings, monitor).map(picture)
    } else {
        match settings.adaptive {
            Some(adaptive) if settings.samples > adaptive::FIRST_SAMPLES => {
                adaptive::render_adaptive(memory, frame, integrator, settings, adaptive, monitor)
            }
            _ => tiles::render_uniform(memory, frame, integrator, settings, monitor),
        }
    }
}
