//! Directional albedo of GGX microfacets with scattering between facets: the share of light from a direction that leaves
//! the surface again.
//!
//! E is the albedo of facets that reflect everything once. The light that they block is scattered on, and most of it
//! leaves later: the lobe is scaled by 1 + F_ms (1 − E)/E (Turquin, “Practical multiple scattering compensation for
//! microfacet models”, 2019), with F_ms = F_ss Ē/(1 − F_ss (1 − Ē)) for the light that facets of mean reflectance F_ss
//! absorb on the way (Kulla and Conty, “Revisiting Physically Based Shading at Imageworks”, 2017). Cycles does the same.

mod tables;

use std::sync::OnceLock;

use glam::Vec4;

use self::tables::{ALBEDO, COLUMNS, DIELECTRIC, MEAN_ALBEDO, R_NODES, ROWS, SCHLICK};
use crate::geometry::Rgb;

/// Values of the tables for facets of a roughness, seen at an angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetAlbedo {
    /// E, of facets that reflect everything once.
    e: f32,
    /// Mean of E over all directions.
    e_mean: f32,
    /// Albedo of facets that reflect (1 − v·h)⁵.
    schlick: f32,
    /// Albedo of facets that reflect the curve of a dielectric.
    curve: f32,
}

/// The tables for an index of refraction between two of the `R_NODES`: E, Schlick, and the two dielectric curves.
type IorTable = [[Vec4; COLUMNS]; ROWS];

/// The tables between all `R_NODES`.
fn ior_tables() -> &'static [IorTable] {
    static TABLES: OnceLock<Vec<IorTable>> = OnceLock::new();
    TABLES.get_or_init(|| {
        let node = |i: usize, row: usize, column: usize| {
            let tables = [&ALBEDO, &SCHLICK, &DIELECTRIC[i], &DIELECTRIC[i + 1]];
            Vec4::from_array(tables.map(|table| f32::from(table[row][column])))
        };
        let table = |i| std::array::from_fn(|row| std::array::from_fn(|column| node(i, row, column)));
        (0..R_NODES.len() - 1).map(table).collect()
    })
}

impl FacetAlbedo {
    /// Returns the values for facets of index of refraction `ior` and roughness `alpha`, seen at cosine `cos`.
    #[inline]
    pub fn new(cos: f32, alpha: f32, ior: f32) -> FacetAlbedo {
        let node = |x: f32, count: usize| {
            let x = x.clamp(0.0, 1.0).sqrt() * (count - 1) as f32;
            // NaN becomes index 0.
            let i = (x as usize).min(count - 2);
            (i, x - i as f32)
        };
        let (row, row_weight) = node(alpha, ROWS);
        let (column, column_weight) = node(cos, COLUMNS);
        let r = ((ior - 1.0) / (ior + 1.0)).abs().min(1.0);
        // NaN, of no valid index, takes the first node.
        let i = R_NODES[1..R_NODES.len() - 1].iter().filter(|&&node| r >= node).count();
        let w = ((r - R_NODES[i]) / (R_NODES[i + 1] - R_NODES[i])).clamp(0.0, 1.0);
        let table = &ior_tables()[i];
        let [upper, lower] = [&table[row], &table[row + 1]]
            .map(|row| row[column] + (row[column + 1] - row[column]) * column_weight);
        let [e, schlick, a, b] = ((upper + (lower - upper) * row_weight) * (1.0 / 65535.0)).to_array();
        let [upper, lower] = [row, row + 1].map(|row| f32::from(MEAN_ALBEDO[row]));
        let e_mean = (upper + (lower - upper) * row_weight) * (1.0 / 65535.0);
        FacetAlbedo { e, e_mean, schlick, curve: a + (b - a) * w }
    }

    /// The factor of the lobe for light scattered between facets of mean reflectance `f_ss`.
    #[inline(always)]
    fn compensation(&self, f_ss: Rgb) -> Rgb {
        let f_ms = f_ss * self.e_mean / (Rgb::ONE - f_ss * (1.0 - self.e_mean)).max(Rgb::splat(1e-6));
        Rgb::ONE + f_ms * ((1.0 - self.e) / self.e)
    }

    /// Returns the albedo of a metal with Schlick's Fresnel term between `f0` and `f90`.
    #[inline(always)]
    pub fn metal(&self, f0: Rgb, f90: Rgb) -> Rgb {
        let once = f0 * self.e + (f90 - f0) * self.schlick;
        // The mean of (1 − cos)⁵, weighted by the cosine, is 1/21.
        let f_ss = f0 + (f90 - f0) * (1.0 / 21.0);
        (once * self.compensation(f_ss)).min(Rgb::ONE)
    }

    /// Returns the albedo of a dielectric whose reflectance goes from `f0` to `f90`.
    #[inline(always)]
    pub fn dielectric(&self, f0: Rgb, f90: f32) -> Rgb {
        let rise = Rgb::splat(f90) - f0;
        let once = f0 * self.e + rise * self.curve;
        let f_ss = f0 + rise * MEAN_CURVE;
        (once * self.compensation(f_ss)).clamp(Rgb::ZERO, Rgb::ONE)
    }
}

/// Returns the albedo of facets that reflect light once, with Schlick's Fresnel term from `f0` to 1.
#[inline(always)]
pub(crate) fn single_scattering_albedo(cos: f32, alpha: f32, f0: f32) -> f32 {
    let FacetAlbedo { e, schlick, .. } = FacetAlbedo::new(cos, alpha, COAT_IOR);
    f0 * (e - schlick) + schlick
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
    FacetAlbedo::new(cos, alpha, COAT_IOR).dielectric(Rgb::splat(COAT_F0), 1.0).x
}

#[cfg(test)]
mod tests;
