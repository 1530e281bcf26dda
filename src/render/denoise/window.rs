//! A tile of the picture with its margin, as planes of numbers.

use blinn_core::geometry::Rgb;
use glam::Vec3;

use super::features::Features;
use super::params::{Params, VARIANCE_RADIUS};
use super::part::{NoisyPart, mean_of_halves};
use super::spikes::limit_spikes;

/// A rectangle of pixels. Parts of it may be outside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rect {
    pub x: isize,
    pub y: isize,
    pub width: usize,
    pub height: usize,
}

impl Rect {
    /// Cuts a picture into tiles, row by row.
    pub fn tiles(width: usize, height: usize, [w, h]: [usize; 2]) -> impl Iterator<Item = Rect> {
        (0..height).step_by(h).flat_map(move |y| {
            (0..width).step_by(w).map(move |x| Rect {
                x: x as isize,
                y: y as isize,
                width: w.min(width - x),
                height: h.min(height - y),
            })
        })
    }

    /// Adds `margin` pixels on each side.
    pub fn expand(self, margin: usize) -> Rect {
        Rect {
            x: self.x - margin as isize,
            y: self.y - margin as isize,
            width: self.width + 2 * margin,
            height: self.height + 2 * margin,
        }
    }

    pub fn area(self) -> usize {
        self.width * self.height
    }
}

/// Light is at most so bright: squares of larger numbers overflow.
const MAX_LIGHT: f32 = 1e12;
/// Features of larger numbers are invalid: products of their squares overflow.
const MAX_FEATURE: f32 = 1e9;
/// Halves that differ by less, relative to the larger, agree within rounding.
const ROUNDING: f32 = 1e-5;

/// A tile of the picture with its margin. Outside the picture, pixels at its edge are repeated with weight 0.
pub(super) struct Window {
    pub rect: Rect,
    /// Column and row of the picture's first pixel in the whole picture.
    pub origin: [isize; 2],
    /// Mean of all samples, with spikes limited.
    pub light: [Vec<f32>; 3],
    /// Variance of `light`.
    pub variance: [Vec<f32>; 3],
    /// How far each pixel counts, 0–1.
    pub weight: Vec<f32>,
    /// Normal, position, and albedo or near occlusion.
    pub features: Vec<Vec<f32>>,
    /// The unfiltered mean.
    mean: Vec<Rgb>,
    /// The pixel has a surface with light of this part.
    lit: Vec<bool>,
    /// The halves differ.
    differs: Vec<bool>,
}

impl Window {
    /// A window of zeros.
    pub fn empty(rect: Rect, origin: [isize; 2], features: usize) -> Window {
        let plane = || vec![0.0f32; rect.area()];
        Window {
            rect,
            origin,
            light: [plane(), plane(), plane()],
            variance: [plane(), plane(), plane()],
            weight: plane(),
            features: vec![plane(); features],
            mean: Vec::new(),
            lit: Vec::new(),
            differs: Vec::new(),
        }
    }

    /// Reads a tile and its margin.
    pub fn new(
        features: &Features,
        occlusion: &[Vec<f32>],
        part: &NoisyPart,
        params: &Params,
        samples: u32,
        tile: Rect,
    ) -> Window {
        let rect = tile.expand(params.margin());
        let (width, height) = (features.width as isize, features.height as isize);
        let [_, odd] = NoisyPart::shares(samples);
        let origin = features.origin.map(|x| x as isize);
        let mut w = Window::empty(rect, origin, params.features());
        w.mean = vec![Rgb::ZERO; rect.area()];
        w.lit = vec![false; rect.area()];
        w.differs = vec![false; rect.area()];
        let plane = || vec![0.0f32; rect.area()];
        let mut halves = [plane(), plane(), plane(), plane(), plane(), plane()];
        let mut i = 0;
        for y in rect.y..rect.y + rect.height as isize {
            let row = y.clamp(0, height - 1) * width;
            for x in rect.x..rect.x + rect.width as isize {
                let p = (row + x.clamp(0, width - 1)) as usize;
                let inside = (0..width).contains(&x) && (0..height).contains(&y);
                let [a, b] = [part.halves[0][p], part.halves[1][p]];
                w.mean[i] = mean_of_halves(a, b, odd);
                let albedo = features.albedo.get(p).copied().unwrap_or(Rgb::ZERO);
                let planes = [features.normal[p], features.position[p], albedo];
                let known = planes.iter().all(|f| f.is_finite() && f.abs().max_element() < MAX_FEATURE);
                let (of_surface, of_occlusion) = w.features.split_at_mut(params.features() - occlusion.len());
                for (to, from) in of_occlusion.iter_mut().zip(occlusion) {
                    to[i] = from[p];
                }
                for (to, f) in of_surface.chunks_mut(3).zip(planes) {
                    let f = if known { f } else { Vec3::ZERO };
                    (to[0][i], to[1][i], to[2][i]) = (f.x, f.y, f.z);
                }
                let weight = features.coverage[p] * part.reliability[p];
                w.lit[i] = weight > 0.0;
                w.differs[i] = w.lit[i] && differ(a, b);
                let known = known && a.is_finite() && b.is_finite();
                w.weight[i] = if inside && known && w.lit[i] { weight.clamp(1e-3, 1.0) } else { 0.0 };
                if known {
                    for c in 0..3 {
                        halves[c][i] = a[c].clamp(-MAX_LIGHT, MAX_LIGHT);
                        halves[3 + c][i] = b[c].clamp(-MAX_LIGHT, MAX_LIGHT);
                    }
                }
                i += 1;
            }
        }
        if params.spikes > 0.0 {
            limit_spikes(&mut halves, &w.weight, rect.width, params.spikes);
        }
        w.set_statistics(&halves, odd);
        w
    }

    fn set_statistics(&mut self, halves: &[Vec<f32>; 6], odd: f32) {
        for c in 0..3 {
            let (a, b) = (&halves[c], &halves[3 + c]);
            for i in 0..a.len() {
                self.light[c][i] = a[i] + (b[i] - a[i]) * odd;
            }
            // Halves of n/2 samples have twice the variance of the mean, their difference four times.
            let squared: Vec<f32> = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b) * 0.25).collect();
            self.variance[c] = box_mean(&squared, self.rect.width, VARIANCE_RADIUS);
            let squares: Vec<f32> = self.light[c].iter().map(|e| e * e).collect();
            for (v, s) in
                self.variance[c].iter_mut().zip(box_mean(&squares, self.rect.width, VARIANCE_RADIUS))
            {
                *v += 1e-6 * s + 1e-30;
            }
        }
    }

    /// Returns the index of a pixel.
    pub fn index(&self, x: isize, y: isize) -> usize {
        (y - self.rect.y) as usize * self.rect.width + (x - self.rect.x) as usize
    }

    /// Returns the rectangle from the first to the last centre of a block in `rect`. Blocks lie the same in each crop.
    pub fn block_centers(&self, rect: Rect, step: usize) -> Rect {
        let size = step as isize;
        let first = |start: isize, origin: isize| start + (size / 2 - start - origin).rem_euclid(size);
        let (x, y) = (first(rect.x, self.origin[0]), first(rect.y, self.origin[1]));
        let length = |skipped: isize, n: usize| (n as isize - skipped - 1).max(0) as usize / step * step + 1;
        Rect { x, y, width: length(x - rect.x, rect.width), height: length(y - rect.y, rect.height) }
    }

    /// Returns the unfiltered means of `rect`.
    pub fn means(&self, rect: Rect) -> Vec<Rgb> {
        let rows = rect.y..rect.y + rect.height as isize;
        rows.flat_map(|y| &self.mean[self.index(rect.x, y)..][..rect.width]).copied().collect()
    }

    /// Returns for each pixel of `rect` the least and the most light, by colour, of the pixels that count within `radius`;
    /// all numbers from 0 on where none does.
    pub fn ranges(&self, rect: Rect, radius: usize) -> Vec<[Rgb; 2]> {
        let width = self.rect.width;
        let none = [Rgb::INFINITY, Rgb::NEG_INFINITY];
        let wider = |a: [Rgb; 2], b: [Rgb; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let of_pixel = |i: usize| match self.weight[i] > 0.0 {
            true => [Rgb::new(self.light[0][i], self.light[1][i], self.light[2][i]); 2],
            false => none,
        };
        let start = self.index(rect.x, rect.y);
        let rows: Vec<Vec<[Rgb; 2]>> = (0..rect.height + 2 * radius)
            .map(|y| {
                let row = start + y * width - radius * width - radius;
                let pixels: Vec<[Rgb; 2]> = (row..row + rect.width + 2 * radius).map(of_pixel).collect();
                pixels.windows(2 * radius + 1).map(|near| near.iter().copied().fold(none, wider)).collect()
            })
            .collect();
        let mut out = Vec::with_capacity(rect.area());
        for near in rows.windows(2 * radius + 1) {
            out.extend((0..rect.width).map(|x| {
                let [low, high] = near.iter().map(|row| row[x]).fold(none, wider);
                if low.cmple(high).all() { [low, high] } else { [Rgb::ZERO, Rgb::splat(MAX_LIGHT)] }
            }));
        }
        out
    }

    /// Returns for each pixel of `rect` whether it has light, and the halves differ at any pixel in reach.
    pub fn noisy_pixels(&self, rect: Rect, radius: usize) -> Vec<bool> {
        let width = self.rect.width;
        let mut columns = vec![false; self.rect.area()];
        let rows = self.index(rect.x, rect.y) / width..self.index(rect.x, rect.y) / width + rect.height;
        for y in rows {
            for dy in 0..2 * radius + 1 {
                let from = &self.differs[(y + dy - radius) * width..][..width];
                for (to, from) in columns[y * width..][..width].iter_mut().zip(from) {
                    *to |= from;
                }
            }
        }
        let mut out = Vec::with_capacity(rect.area());
        for y in rect.y..rect.y + rect.height as isize {
            let start = self.index(rect.x, y) - radius;
            let reached = |x: usize| columns[x..=x + 2 * radius].contains(&true);
            out.extend((start..start + rect.width).map(|x| self.lit[x + radius] && reached(x)));
        }
        out
    }
}

/// Returns true if two halves differ by more than rounding.
fn differ(a: Rgb, b: Rgb) -> bool {
    let tolerance = ROUNDING * a.abs().max(b.abs());
    // NaN differs from everything.
    a != b && !(a - b).abs().cmple(tolerance).all()
}

/// Averages a plane over `radius` pixels to each side, 0 beyond its edges. Sums have a fixed order for each pixel.
pub(super) fn box_mean(plane: &[f32], width: usize, radius: usize) -> Vec<f32> {
    let mut out = box_sum(plane, width, radius);
    let scale = 1.0 / ((2 * radius + 1) * (2 * radius + 1)) as f32;
    out.iter_mut().for_each(|x| *x *= scale);
    out
}

/// Sums a plane over `radius` pixels to each side, 0 beyond its edges. Sums have a fixed order for each pixel.
pub(super) fn box_sum(plane: &[f32], width: usize, radius: usize) -> Vec<f32> {
    let height = plane.len() / width;
    let mut rows = vec![0.0f32; plane.len()];
    for (from, to) in plane.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        for k in 0..(2 * radius + 1).min(width) {
            let (lead, skip) = (radius.saturating_sub(k), k.saturating_sub(radius));
            for (to, from) in to[lead..].iter_mut().zip(&from[skip..]) {
                *to += from;
            }
        }
    }
    let mut out = vec![0.0f32; plane.len()];
    for y in 0..height {
        for v in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            for (to, from) in out[y * width..][..width].iter_mut().zip(&rows[v * width..][..width]) {
                *to += from;
            }
        }
    }
    out
}
