//! The light sources of an environment: the directions that are much brighter than the rest, such as the sun, lamps and windows.
//!
//! An environment is the sum of its sources and of what is left, its ambient part. The ambient part has little contrast, so that
//! a few directions of the cosine estimate its light well. Sources are sampled in proportion to their radiance.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Panorama;
use super::diffuse::{DiffuseTable, irradiance};
use super::octahedral::to_square;
use blinn_core::geometry::Rgb;

/// Panoramas that are wider are halved before their sources are found.
const MAX_WIDTH: u32 = 2048;
/// Sources are what is brighter than this multiple of the mean of the ambient part.
const CONTRAST: f64 = 6.0;
/// Sources with a smaller share of the light are left in the ambient part.
const MIN_SHARE: f64 = 0.02;
/// Cells of directions on a side of the unit square, whose sources count as one light for irradiance.
const CELLS: f32 = 64.0;
/// Sources of up to so many cells are summed: a table is not exact at the terminator of a small source.
const MAX_SUMMED: usize = 16;
/// The threshold is found in at most so many steps.
const MAX_STEPS: usize = 16;
/// Relative change of the threshold in the last step.
const TOLERANCE: f64 = 0.02;

/// The light sources of a panorama.
#[derive(Clone)]
pub(super) struct LightSources {
    rows: Vec<SourceRow>,
    texels: Vec<SourceTexel>,
    /// Columns of the panorama.
    width: usize,
}

/// The irradiance that sources give to matte surfaces.
#[derive(Clone)]
pub(super) enum SourceIrradiance {
    /// A sum over a few directional lights.
    Sum(Vec<(Vec3, Rgb)>),
    /// A table for many lights.
    Table(DiffuseTable),
}

impl SourceIrradiance {
    pub fn new(sources: &LightSources) -> SourceIrradiance {
        let lights = sources.as_lights();
        if lights.len() <= MAX_SUMMED {
            SourceIrradiance::Sum(lights)
        } else {
            SourceIrradiance::Table(DiffuseTable::of_lights(&lights))
        }
    }

    /// Returns the irradiance over π for the unit normal `n`.
    pub fn at(&self, n: Vec3) -> Rgb {
        match self {
            SourceIrradiance::Sum(lights) => irradiance(lights, n),
            SourceIrradiance::Table(table) => table.irradiance(n),
        }
    }
}

/// A row of texels with sources.
#[derive(Clone)]
struct SourceRow {
    /// Probability of this row and those above it.
    cumulative: f64,
    /// Cosines of the angles from straight up to the upper and the lower edge.
    edges: [f64; 2],
    /// Index behind the last texel.
    end: usize,
}

/// A texel that is a source.
#[derive(Clone)]
struct SourceTexel {
    column: u32,
    /// Probability, within the row, of this texel and those to the left of it.
    cumulative: f64,
    /// Radiance on top of the ambient part.
    radiance: Rgb,
    /// Density of its directions per steradian.
    density: f32,
}

/// A random direction to a light source of an environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceDirection {
    /// Unit length.
    pub direction: Vec3,
    /// Radiance of the source, without the ambient part.
    pub radiance: Rgb,
    /// Density of the direction per steradian.
    pub density: f32,
}

impl LightSources {
    /// Finds the sources of a panorama, and returns them with the panorama without them. `None` if no sources are worth sampling.
    pub fn find(panorama: &Panorama) -> Option<(LightSources, Panorama)> {
        let mut reduced;
        let mut panorama = panorama;
        while panorama.width() > MAX_WIDTH {
            reduced = panorama.halved();
            panorama = &reduced;
        }
        let (width, height) = (panorama.width() as usize, panorama.height() as usize);
        let total = mean_below(panorama, f64::INFINITY);
        let threshold = threshold(panorama, total);
        if !(total > 0.0) || total - mean_below(panorama, threshold) < MIN_SHARE * total {
            return None;
        }
        let mut sources = LightSources { rows: Vec::new(), texels: Vec::new(), width };
        let edge = |row: usize| libm::cos(PI * row as f64 / height as f64);
        // Sum over all rows so far, in means over the sphere.
        let mut power = 0.0;
        for y in 0..height {
            let first = sources.texels.len();
            let mut sum = 0.0;
            for x in 0..width {
                let texel = panorama.texel(x as u32, y as u32);
                let radiance = texel * (1.0 - ambient_share(texel, threshold));
                if brightness(radiance) > 0.0 {
                    sum += brightness(radiance);
                    // The density follows when all are known.
                    let texel = SourceTexel { column: x as u32, cumulative: sum, radiance, density: 0.0 };
                    sources.texels.push(texel);
                }
            }
            if sum > 0.0 {
                for texel in &mut sources.texels[first..] {
                    texel.cumulative /= sum;
                }
                power += sum / width as f64 * panorama.row_solid_angle(y);
                let edges = [edge(y), edge(y + 1)];
                sources.rows.push(SourceRow { cumulative: power, edges, end: sources.texels.len() });
            }
        }
        for row in &mut sources.rows {
            row.cumulative /= power;
        }
        // In proportion to brightness; the sphere has 4π steradians.
        for texel in &mut sources.texels {
            texel.density = (brightness(texel.radiance) / (power * 4.0 * PI)) as f32;
        }
        Some((sources, panorama.map_texels(|texel| texel * ambient_share(texel, threshold))))
    }

    /// Returns the bytes of the sources.
    pub fn memory_size(&self) -> usize {
        self.rows.capacity() * size_of::<SourceRow>() + self.texels.capacity() * size_of::<SourceTexel>()
    }

    /// The sources as directional lights: unit directions in the frame of the map, and the irradiance across them. Texels
    /// within a cell are one light.
    pub fn as_lights(&self) -> Vec<(Vec3, Rgb)> {
        let mut cells: BTreeMap<[u32; 2], (DVec3, DVec3)> = BTreeMap::new();
        let mut first = 0;
        for row in &self.rows {
            let y = 0.5 * (row.edges[0] + row.edges[1]);
            let solid_angle = TAU * (row.edges[0] - row.edges[1]) / self.width as f64;
            for texel in &self.texels[first..row.end] {
                let d = self.direction(y, f64::from(texel.column) + 0.5);
                let cell = (to_square(d.as_vec3()) * CELLS).as_uvec2().to_array();
                let (direction, irradiance) = cells.entry(cell).or_default();
                *direction += d * (brightness(texel.radiance) * solid_angle);
                *irradiance += texel.radiance.as_dvec3() * solid_angle;
            }
            first = row.end;
        }
        cells.into_values().map(|(d, e)| (d.normalize_or_zero().as_vec3(), e.as_vec3())).collect()
    }

    /// The unit direction at height `y` and a column of the panorama.
    fn direction(&self, y: f64, column: f64) -> DVec3 {
        let angle = TAU * (column / self.width as f64 - 0.5);
        let radius = (1.0 - y * y).max(0.0).sqrt();
        DVec3::new(radius * libm::cos(angle), y, radius * libm::sin(angle))
    }

    /// The direction for a point of the unit square, in the frame of the map.
    pub fn sample(&self, u: [f32; 2]) -> SourceDirection {
        let [u, v] = u.map(f64::from);
        let i = self.rows.partition_point(|row| row.cumulative <= u).min(self.rows.len() - 1);
        let row = &self.rows[i];
        let above = i.checked_sub(1).map(|above| &self.rows[above]);
        let down = share_of(u, above.map_or(0.0, |above| above.cumulative), row.cumulative);
        let texels = &self.texels[above.map_or(0, |above| above.end)..row.end];
        let j = texels.partition_point(|texel| texel.cumulative <= v).min(texels.len() - 1);
        let texel = &texels[j];
        let left = if j > 0 { texels[j - 1].cumulative } else { 0.0 };
        let across = share_of(v, left, texel.cumulative);
        let y = row.edges[0] + (row.edges[1] - row.edges[0]) * down;
        let direction = self.direction(y, f64::from(texel.column) + across).as_vec3();
        SourceDirection { direction, radiance: texel.radiance, density: texel.density }
    }
}

/// The position of `u` between two sums, from 0 to 1.
fn share_of(u: f64, from: f64, to: f64) -> f64 {
    if to > from { ((u - from) / (to - from)).clamp(0.0, 1.0) } else { 0.5 }
}

fn brightness(radiance: Rgb) -> f64 {
    f64::from(radiance.element_sum()) * (1.0 / 3.0)
}

/// The share of a texel that is left in the ambient part.
fn ambient_share(texel: Rgb, threshold: f64) -> f32 {
    let brightness = brightness(texel);
    if brightness > threshold { (threshold / brightness) as f32 } else { 1.0 }
}

/// The mean brightness over the sphere where texels count up to `limit`.
fn mean_below(panorama: &Panorama, limit: f64) -> f64 {
    let row = |y: usize| {
        let texels = (0..panorama.width()).map(|x| brightness(panorama.texel(x, y as u32)).min(limit));
        texels.sum::<f64>() / f64::from(panorama.width()) * panorama.row_solid_angle(y)
    };
    // In the order of rows: the same sum for any number of threads.
    let rows: Vec<f64> = (0..panorama.height() as usize).into_par_iter().map(row).collect();
    rows.iter().sum()
}

/// The brightness that is [`CONTRAST`] times the mean of what is left below it.
fn threshold(panorama: &Panorama, mean: f64) -> f64 {
    let mut threshold = CONTRAST * mean;
    for _ in 0..MAX_STEPS {
        let next = CONTRAST * mean_below(panorama, threshold);
        let is_found = next > threshold * (1.0 - TOLERANCE);
        threshold = next;
        if is_found {
            break;
        }
    }
    threshold
}
