//! An equirectangular picture of an environment.

use std::f64::consts::{PI, TAU};

use glam::Vec3;
use rayon::prelude::*;

use super::octahedral::quadrant_angle;
use blinn_core::geometry::Rgb;

/// Largest value of a channel: sums of such values stay finite.
const MAX_RADIANCE: f32 = 1e30;

/// An equirectangular picture of linear radiance. Rows go from straight up to straight down. The centre column faces +X,
/// and columns to the right of it turn towards +Z, as in Blender and three.js.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
    /// Means of the first and the last row: the radiance at the poles.
    poles: [Rgb; 2],
}

impl Panorama {
    /// Makes a panorama of `width` × `height` texels, row by row. Negative values and NaN become black. `None` unless
    /// both sides are at least 1 and there are as many texels.
    pub fn new(width: u32, height: u32, mut texels: Vec<[f32; 3]>) -> Option<Panorama> {
        let (width, height) = (width as usize, height as usize);
        if width == 0 || height == 0 || texels.len() != width.checked_mul(height)? {
            return None;
        }
        texels.par_iter_mut().for_each(|texel| *texel = texel.map(valid_radiance));
        Some(Panorama::from_valid(width, height, texels))
    }

    fn from_valid(width: usize, height: usize, texels: Vec<[f32; 3]>) -> Panorama {
        let mean = |row: &[[f32; 3]]| {
            let sum = row
                .iter()
                .fold([0.0; 3], |sum: [f64; 3], t| std::array::from_fn(|c| sum[c] + f64::from(t[c])));
            Rgb::from(sum.map(|v| (v / width as f64) as f32))
        };
        let poles = [mean(&texels[..width]), mean(&texels[(height - 1) * width..])];
        Panorama { width, height, texels, poles }
    }

    /// Returns the width in texels.
    pub fn width(&self) -> u32 {
        self.width as u32
    }

    /// Returns the height in texels.
    pub fn height(&self) -> u32 {
        self.height as u32
    }

    /// Returns a texel.
    pub fn texel(&self, x: u32, y: u32) -> Rgb {
        self.row(y as usize)[x as usize].into()
    }

    /// Returns the texels as bytes.
    pub(super) fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.texels)
    }

    fn row(&self, y: usize) -> &[[f32; 3]] {
        &self.texels[y * self.width..][..self.width]
    }

    /// Returns the radiance from the unit direction `d`, linear between texels.
    #[inline]
    pub(super) fn radiance(&self, d: Vec3) -> Rgb {
        let around = quadrant_angle(d.x.abs(), d.z.abs()) * 0.25;
        let around = if d.x < 0.0 { 0.5 - around } else { around };
        let u = 0.5 + around.copysign(d.z);
        let down = quadrant_angle(d.y.abs(), (d.x * d.x + d.z * d.z).sqrt()) * 0.5;
        let v = if d.y < 0.0 { 1.0 - down } else { down };
        let x = u * self.width as f32 - 0.5;
        let left = x.floor();
        let fx = x - left;
        let x0 = if left < 0.0 { self.width - 1 } else { (left as usize).min(self.width - 1) };
        let x1 = if x0 + 1 == self.width { 0 } else { x0 + 1 };
        let across = |row: usize| {
            let row = self.row(row);
            Rgb::from(row[x0]).lerp(Rgb::from(row[x1]), fx)
        };
        let y = v * self.height as f32 - 0.5;
        let last = self.height - 1;
        // Half a texel from the poles, all columns meet in the mean of their row.
        if y < 0.0 {
            return across(0).lerp(self.poles[0], -2.0 * y);
        }
        let top = y as usize;
        if top >= last {
            return across(last).lerp(self.poles[1], (2.0 * (y - last as f32)).clamp(0.0, 1.0));
        }
        across(top).lerp(across(top + 1), y - top as f32)
    }

    /// Returns the panorama with other texels.
    pub(super) fn map_texels(&self, texel: impl Fn(Rgb) -> Rgb + Sync) -> Panorama {
        let texels = self.texels.par_iter().map(|&old| texel(old.into()).to_array().map(valid_radiance));
        Panorama::from_valid(self.width, self.height, texels.collect())
    }

    /// Returns the panorama with half as many rows and columns: means weighted by solid angle. Odd sides lose their last
    /// texel to its neighbours.
    pub(super) fn halved(&self) -> Panorama {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut texels = vec![[0.0; 3]; width * height];
        let columns = |i: usize| {
            let last = if i + 1 == width { self.width } else { 2 * i + 2 };
            (2 * i).min(self.width - 1)..last
        };
        texels.par_chunks_exact_mut(width).enumerate().for_each(|(j, out)| {
            let last = if j + 1 == height { self.height } else { 2 * j + 2 };
            let rows = (2 * j).min(self.height - 1)..last;
            let weights: Vec<f32> = rows.clone().map(|row| self.row_solid_angle(row) as f32).collect();
            let total: f32 = weights.iter().sum();
            for (i, out) in out.iter_mut().enumerate() {
                let columns = columns(i);
                let mut sum = Rgb::ZERO;
                for (row, weight) in rows.clone().zip(&weights) {
                    let texels = &self.row(row)[columns.clone()];
                    let texels: Rgb = texels.iter().map(|&texel| Rgb::from(texel)).sum();
                    sum += texels * *weight;
                }
                *out = (sum / (total * columns.len() as f32)).to_array();
            }
        });
        Panorama::from_valid(width, height, texels)
    }

    /// The solid angle of a row of texels, as a share of the sphere.
    pub(super) fn row_solid_angle(&self, row: usize) -> f64 {
        let edge = |row: usize| libm::cos(PI * row as f64 / self.height as f64);
        0.5 * (edge(row) - edge(row + 1))
    }

    /// Blurs rows near the poles along themselves, so that texels cover about the same angle in both directions.
    pub(super) fn blur_poles(&mut self) {
        let (width, height) = (self.width, self.height);
        self.texels.par_chunks_exact_mut(width).enumerate().for_each(|(j, row)| {
            let sin = libm::sin(PI * (j as f64 + 0.5) / height as f64);
            let texel_angle = TAU / width as f64 * sin;
            let radius = (0.5 * PI / height as f64 / texel_angle) as usize;
            let radius = radius.min((width - 1) / 2);
            if radius > 0 {
                blur_row(row, radius);
            }
        });
        *self = Panorama::from_valid(width, height, std::mem::take(&mut self.texels));
    }
}

/// Replaces each texel by the mean of its neighbours up to `radius` texels away, around the row.
fn blur_row(row: &mut [[f32; 3]], radius: usize) {
    let n = row.len();
    let source: Vec<[f64; 3]> = row.iter().map(|texel| texel.map(f64::from)).collect();
    // Sums of the first i texels, which start again after each turn, hold the means without rounding errors that grow.
    let mut sums = Vec::with_capacity(2 * n + 1);
    let mut sum = [0.0; 3];
    sums.push(sum);
    for i in 0..2 * n {
        for (sum, v) in sum.iter_mut().zip(source[i % n]) {
            *sum += v;
        }
        sums.push(sum);
    }
    let count = (2 * radius + 1) as f64;
    for (i, out) in row.iter_mut().enumerate() {
        let first = (i + n - radius) % n;
        let last = first + 2 * radius + 1;
        *out = std::array::from_fn(|c| (((sums[last][c] - sums[first][c]) / count) as f32).max(0.0));
    }
}

/// Replaces values that are no radiance: NaN, infinite, negative and subnormal ones become 0, huge ones the largest
/// allowed.
pub(super) fn valid_radiance(v: f32) -> f32 {
    if v.is_normal() { v.clamp(0.0, MAX_RADIANCE) } else { 0.0 }
}
