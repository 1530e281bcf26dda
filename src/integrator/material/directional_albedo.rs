//! Directional albedo of GGX microfacets with scattering between facets: the share of light from a direction that leaves
//! the surface again.
//!
//! E is the albedo of facets that reflect everything once. The light that they block is scattered on, and most of it
//! leaves later: the lobe is scaled by 1 + F_ms (1 − E)/E (Turquin, “Practical multiple scattering compensation for
//! microfacet models”, 2019), with F_ms = F_ss Ē/(1 − F_ss (1 − Ē)) for the light that facets of mean reflectance F_ss
//! absorb on the way (Kulla and Conty, “Revisiting Physically Based Shading at Imageworks”, 2017). Cycles does the same.

mod tables;

use self::tables::{ALBEDO, COLUMNS, DIELECTRIC, MEAN_ALBEDO, R_NODES, ROWS, SCHLICK, Table};
use crate::geometry::Rgb;

/// A place between four nodes of a [`Table`].
#[derive(Clone, Copy)]
struct TablePosition {
    row: usize,
    column: usize,
    /// Weight of the next row.
    row_weight: f32,
    /// Weight of the next column.
    column_weight: f32,
}

impl TablePosition {
    #[inline(always)]
    fn new(cos: f32, alpha: f32) -> TablePosition {
        let node = |x: f32, count: usize| {
            let x = x.clamp(0.0, 1.0).sqrt() * (count - 1) as f32;
            // NaN becomes index 0.
            let i = (x as usize).min(count - 2);
            (i, x - i as f32)
        };
        let (row, row_weight) = node(alpha, ROWS);
        let (column, column_weight) = node(cos, COLUMNS);
        TablePosition { row, column, row_weight, column_weight }
    }

    #[inline(always)]
    fn get(self, table: &Table) -> f32 {
        let TablePosition { row, column, row_weight, column_weight } = self;
        let at = |i: usize| {
            let row = &table[i];
            let [a, b] = [f32::from(row[column]), f32::from(row[column + 1])];
            a + (b - a) * column_weight
        };
        let [a, b] = [at(row), at(row + 1)];
        (a + (b - a) * row_weight) * (1.0 / 65535.0)
    }

    /// Mean of E over the directions of a row.
    #[inline(always)]
    fn mean(self) -> f32 {
        let [a, b] = [self.row, self.row + 1].map(|i| f32::from(MEAN_ALBEDO[i]));
        (a + (b - a) * self.row_weight) * (1.0 / 65535.0)
    }
}

/// The factor of the lobe for light scattered between facets of mean reflectance `f_ss`.
#[inline(always)]
fn compensation(f_ss: Rgb, e: f32, e_mean: f32) -> Rgb {
    let f_ms = f_ss * e_mean / (Rgb::ONE - f_ss * (1.0 - e_mean)).max(Rgb::splat(1e-6));
    Rgb::ONE + f_ms * ((1.0 - e) / e)
}

/// Returns the albedo of facets that reflect light once, with Schlick's Fresnel term from `f0` to 1.
#[inline(always)]
pub(crate) fn single_scattering_albedo(cos: f32, alpha: f32, f0: f32) -> f32 {
    let at = TablePosition::new(cos, alpha);
    let schlick = at.get(&SCHLICK);
    f0 * (at.get(&ALBEDO) - schlick) + schlick
}

/// Returns the albedo of a metal with Schlick's Fresnel term between `f0` and `f90`, seen at cosine `cos`.
#[inline(always)]
pub(crate) fn metal_albedo(cos: f32, alpha: f32, f0: Rgb, f90: Rgb) -> Rgb {
    let at = TablePosition::new(cos, alpha);
    let e = at.get(&ALBEDO);
    let once = f0 * e + (f90 - f0) * at.get(&SCHLICK);
    // The mean of (1 − cos)⁵, weighted by the cosine, is 1/21.
    let f_ss = f0 + (f90 - f0) * (1.0 / 21.0);
    (once * compensation(f_ss, e, at.mean())).min(Rgb::ONE)
}

/// Returns the albedo of a dielectric of index `ior` whose reflectance goes from `f0` to `f90`, seen at cosine `cos`.
#[inline(always)]
pub(crate) fn dielectric_albedo(cos: f32, alpha: f32, ior: f32, f0: Rgb, f90: f32) -> Rgb {
    let at = TablePosition::new(cos, alpha);
    let e = at.get(&ALBEDO);
    let r = ((ior - 1.0) / (ior + 1.0)).abs().min(1.0);
    // NaN, of no valid index, takes the first node.
    let i = R_NODES[1..R_NODES.len() - 1].iter().filter(|&&node| r >= node).count();
    let w = ((r - R_NODES[i]) / (R_NODES[i + 1] - R_NODES[i])).clamp(0.0, 1.0);
    let [a, b] = [at.get(&DIELECTRIC[i]), at.get(&DIELECTRIC[i + 1])];
    let curve = a + (b - a) * w;
    let rise = Rgb::splat(f90) - f0;
    let once = f0 * e + rise * curve;
    let f_ss = f0 + rise * MEAN_CURVE;
    (once * compensation(f_ss, e, at.mean())).clamp(Rgb::ZERO, Rgb::ONE)
}

/// Mean of the dielectric curve at η = 1.5, weighted by the cosine. Between η = 1.1 and 2.4 it differs by less than 0.04.
const MEAN_CURVE: f32 = 0.054;

/// Index of refraction of a clear coat (KHR_materials_clearcoat).
const COAT_IOR: f32 = 1.5;
/// Reflectance of a clear coat at normal incidence.
pub(crate) const COAT_F0: f32 = 0.04;

/// Returns the albedo of a clear coat.
#[inline(always)]
pub(crate) fn coat_albedo(cos: f32, alpha: f32) -> f32 {
    dielectric_albedo(cos, alpha, COAT_IOR, Rgb::splat(COAT_F0), 1.0).x
}

#[cfg(test)]
mod tests;
