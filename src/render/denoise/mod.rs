//! Reconstruction of noisy light by regression on noise-free features (Bitterli et al., “Nonlinearly Weighted
//! First-order Regression for Denoising Monte Carlo Renderings”, 2016; NFOR).
//!
//! Light comes in parts, each divided by its surface colour, so that textures stay out of the filter. Around each pixel
//! (or block of pixels) a part is fitted by a linear function of surface position, normal and, for specular parts,
//! colour or, for bounced light, near occlusion. Neighbours count by non-local means: how alike the patches around two pixels
//! are, given their variance.
//!
//! A tile of the picture is filtered with a margin of its own, so that memory does not grow with the picture, and a
//! pixel depends on those within [`MARGIN`] only.

mod blocks;
mod coarse;
mod features;
mod linear_fit;
mod near_occlusion;
mod params;
mod part;
mod pixels;
mod similarity;
mod spikes;
#[cfg(test)]
mod tests;
mod wavelets;
mod window;

use std::ops::Range;

use blinn_core::geometry::Rgb;
use blinn_core::simd::SimdLevel;
use rayon::prelude::*;

pub(crate) use features::Features;
pub(crate) use params::PartKind;
pub(crate) use part::NoisyPart;
pub(crate) use wavelets::{SmoothKind, WAVELET_PIXEL, WaveletLight, smooth_light};

use near_occlusion::near_occlusion;
use params::{Params, RANGE_RADIUS};
use window::Rect;

/// Pixels around a crop that its reconstruction depends on.
pub(crate) const MARGIN: usize = 33 + near_occlusion::REACH;

/// Reconstructs a part of the light of a picture from its noisy means.
///
/// `samples` is the number of samples per pixel. With fewer than two there is no estimate of variance, and the noisy
/// means are returned. So are those of pixels around which the halves of all samples agree within rounding.
///
/// The result has the same bits for any number of threads and at any SIMD level. That of a crop equals the crop of the
/// result, where the picture goes on for at least [`MARGIN`] pixels.
///
/// Only `rows` are reconstructed, and returned from the first of them on.
///
/// # Panics
/// Panics if the planes of `features` and `part` do not have width × height pixels, or if `rows` are not in the picture.
pub(crate) fn denoise(
    features: &Features,
    part: &NoisyPart,
    kind: PartKind,
    samples: u32,
    simd: SimdLevel,
    rows: Range<usize>,
) -> Vec<Rgb> {
    denoise_with(features, part, &Params::new(kind), samples, simd, rows)
}

fn denoise_with(
    features: &Features,
    part: &NoisyPart,
    params: &Params,
    samples: u32,
    simd: SimdLevel,
    rows: Range<usize>,
) -> Vec<Rgb> {
    let (width, height) = (features.width, features.height);
    features.check_len();
    part.check_len(width * height);
    let mut out = part.mean(samples)[rows.start * width..rows.end * width].to_vec();
    if samples < 2 {
        return out;
    }
    let occlusion = if params.occlusion { near_occlusion(features, simd) } else { Vec::new() };
    let first = rows.start as isize;
    let moved = |tile: Rect| Rect { y: tile.y + first, ..tile };
    let tiles: Vec<Rect> = Rect::tiles(width, rows.len(), params.tile).map(moved).collect();
    let fit = |tile: &Rect| filter_tile(features, &occlusion, part, params, samples, simd, *tile);
    let results: Vec<Vec<Rgb>> = tiles.par_iter().map(fit).collect();
    for (tile, result) in tiles.iter().zip(results) {
        for (y, row) in result.chunks_exact(tile.width).enumerate() {
            let start = ((tile.y - first) as usize + y) * width + tile.x as usize;
            out[start..start + tile.width].copy_from_slice(row);
        }
    }
    out
}

fn filter_tile(
    features: &Features,
    occlusion: &[Vec<f32>],
    part: &NoisyPart,
    params: &Params,
    samples: u32,
    simd: SimdLevel,
    tile: Rect,
) -> Vec<Rgb> {
    let window = window::Window::new(features, occlusion, part, params, samples, tile);
    let mut out = window.means(tile);
    let noisy = window.noisy_pixels(tile, params.reach());
    if !noisy.contains(&true) {
        return out;
    }
    let fitted = if params.blocks() {
        blocks::fit(&window, params, simd, tile)
    } else {
        pixels::fit(&window, params, simd, tile)
    };
    let ranges = window.ranges(tile, RANGE_RADIUS);
    for (((out, fitted), noisy), [low, high]) in out.iter_mut().zip(fitted).zip(noisy).zip(ranges) {
        if noisy {
            // A fit to few pixels beside something bright goes far beyond all of them.
            *out = if fitted.is_finite() { fitted.clamp(low, high) } else { Rgb::ZERO };
        }
    }
    out
}
