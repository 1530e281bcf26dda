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
use blinn_core::geometry::Rgb;

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

/// The lobe of facets seen at an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacetLobe {
    /// Share of the light from the direction of view that the facets reflect in total.
    pub albedo: Rgb,
    /// Reflectance of a facet at normal incidence, scaled by what other facets scatter on. It exceeds 1 where F0 is near 1.
    pub f0: Rgb,
    /// Its rise to grazing incidence, by Schlick's weight.
    pub rise: Rgb,
}

impl FacetLobe {
    /// No facets.
    pub const NONE: FacetLobe = FacetLobe { albedo: Rgb::ZERO, f0: Rgb::ZERO, rise: Rgb::ZERO };

    /// Facets of which the share `t` has the lobe `other`.
    #[inline(always)]
    pub fn mixed(self, other: FacetLobe, t: f32) -> FacetLobe {
        let mix = |a: Rgb, b: Rgb| a + (b - a) * t;
        let albedo = mix(self.albedo, other.albedo);
        FacetLobe { albedo, f0: mix(self.f0, other.f0), rise: mix(self.rise, other.rise) }
    }

    /// The same facets, of which only the share `t` reflects.
    #[inline(always)]
    pub fn scaled(self, t: f32) -> FacetLobe {
        FacetLobe { albedo: self.albedo * t, f0: self.f0 * t, rise: self.rise * t }
    }
}

/// The tables for the indices of refraction between two of the `R_NODES`, one after the other, each row by row: E, Schlick,
/// and the two dielectric curves.
fn ior_tables() -> &'static [Vec4] {
    static TABLES: OnceLock<Vec<Vec4>> = OnceLock::new();
    TABLES.get_or_init(|| {
        let node = |k: usize| {
            let (i, row, column) = (k / TABLE_NODES, k / COLUMNS % ROWS, k % COLUMNS);
            let tables = [&ALBEDO, &SCHLICK, &DIELECTRIC[i], &DIELECTRIC[i + 1]];
            Vec4::from_array(tables.map(|table| f32::from(table[row][column])))
        };
        (0..TABLE_NODES * (R_NODES.len() - 1)).map(node).collect()
    })
}

/// Nodes of a table.
const TABLE_NODES: usize = ROWS * COLUMNS;

/// [`FacetAlbedo`] of N facets in structure of arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetAlbedos<const N: usize> {
    e: [f32; N],
    e_mean: [f32; N],
    schlick: [f32; N],
    curve: [f32; N],
}

impl<const N: usize> FacetAlbedos<N> {
    /// Returns the values for facets of index of refraction `ior` and roughness `alpha`, seen at cosine `cos`.
    #[inline(always)]
    pub fn new(cos: &[f32; N], alpha: &[f32; N], ior: &[f32; N]) -> FacetAlbedos<N> {
        let node = |x: f32, count: usize| {
            let x = x.clamp(0.0, 1.0).sqrt() * (count - 1) as f32;
            // NaN becomes index 0.
            let i = (x as u32).min(count as u32 - 2);
            (i, x - i as f32)
        };
        let mut first = [0; N];
        let mut rows = [0; N];
        let [mut column_weight, mut row_weight, mut w] = [[0.0; N]; 3];
        for k in 0..N {
            let row = node(alpha[k], ROWS);
            let column = node(cos[k], COLUMNS);
            let r = ((ior[k] - 1.0) / (ior[k] + 1.0)).abs().min(1.0);
            // NaN, of no valid index, takes the first node.
            let mut i = 0;
            let [mut from, mut to] = [R_NODES[0], R_NODES[1]];
            for node in 1..R_NODES.len() - 1 {
                let beyond = r >= R_NODES[node];
                i += u32::from(beyond);
                from = if beyond { R_NODES[node] } else { from };
                to = if beyond { R_NODES[node + 1] } else { to };
            }
            w[k] = ((r - from) / (to - from)).clamp(0.0, 1.0);
            rows[k] = row.0;
            (column_weight[k], row_weight[k]) = (column.1, row.1);
            first[k] = i * TABLE_NODES as u32 + row.0 * COLUMNS as u32 + column.0;
        }
        // Outside of the vectorised loops, because of the tables.
        let tables = ior_tables();
        let mut values = [[0.0; N]; 4];
        let mut mean = [[0.0; N]; 2];
        for k in 0..N {
            let nodes = &tables[first[k] as usize..][..COLUMNS + 2];
            let upper = nodes[0] + (nodes[1] - nodes[0]) * column_weight[k];
            let lower = nodes[COLUMNS] + (nodes[COLUMNS + 1] - nodes[COLUMNS]) * column_weight[k];
            let value = (upper + (lower - upper) * row_weight[k]) * (1.0 / 65535.0);
            for (values, value) in values.iter_mut().zip(value.to_array()) {
                values[k] = value;
            }
            let row = rows[k] as usize % (ROWS - 1);
            mean[0][k] = f32::from(MEAN_ALBEDO[row]);
            mean[1][k] = f32::from(MEAN_ALBEDO[row + 1]);
        }
        let [e, schlick, a, b] = values;
        let mut out = FacetAlbedos { e, e_mean: [0.0; N], schlick, curve: [0.0; N] };
        for k in 0..N {
            out.e_mean[k] = (mean[0][k] + (mean[1][k] - mean[0][k]) * row_weight[k]) * (1.0 / 65535.0);
            out.curve[k] = a[k] + (b[k] - a[k]) * w[k];
        }
        out
    }

    /// The values of facet `k`.
    #[inline(always)]
    pub fn get(&self, k: usize) -> FacetAlbedo {
        FacetAlbedo { e: self.e[k], e_mean: self.e_mean[k], schlick: self.schlick[k], curve: self.curve[k] }
    }
}

impl FacetAlbedo {
    /// Returns the values for facets of index of refraction `ior` and roughness `alpha`, seen at cosine `cos`.
    #[inline]
    pub fn new(cos: f32, alpha: f32, ior: f32) -> FacetAlbedo {
        FacetAlbedos::new(&[cos], &[alpha], &[ior]).get(0)
    }

    /// Returns the values of facets that reflect everything once, Schlick's weight or the curve of a dielectric, known from
    /// integration. `alpha` is that of isotropic facets that are as rough.
    pub fn integrated([e, schlick, curve]: [f32; 3], alpha: f32) -> FacetAlbedo {
        // The mean of E does not depend on the angle or on the index of refraction.
        FacetAlbedo { e, schlick, curve, ..FacetAlbedo::new(1.0, alpha, COAT_IOR) }
    }

    /// The factor of the lobe for light scattered between facets of mean reflectance `f_ss`.
    #[inline(always)]
    fn compensation(&self, f_ss: Rgb) -> Rgb {
        let f_ms = f_ss * self.e_mean / (Rgb::ONE - f_ss * (1.0 - self.e_mean)).max(Rgb::splat(1e-6));
        Rgb::ONE + f_ms * ((1.0 - self.e) / self.e)
    }

    /// Returns the lobe of a metal with Schlick's Fresnel term between `f0` and `f90`.
    #[inline(always)]
    pub fn metal(&self, f0: Rgb, f90: Rgb) -> FacetLobe {
        let rise = f90 - f0;
        let once = f0 * self.e + rise * self.schlick;
        // The mean of (1 − cos)⁵, weighted by the cosine, is 1/21.
        let compensation = self.compensation(f0 + rise * (1.0 / 21.0));
        let albedo = (once * compensation).min(Rgb::ONE);
        FacetLobe { albedo, f0: f0 * compensation, rise: rise * compensation }
    }

    /// Returns the lobe of a dielectric whose reflectance goes from `f0` to `f90`.
    #[inline(always)]
    pub fn dielectric(&self, f0: Rgb, f90: f32) -> FacetLobe {
        let rise = Rgb::splat(f90) - f0;
        let once = f0 * self.e + rise * self.curve;
        let compensation = self.compensation(f0 + rise * MEAN_CURVE);
        let albedo = (once * compensation).clamp(Rgb::ZERO, Rgb::ONE);
        FacetLobe { albedo, f0: f0 * compensation, rise: rise * compensation }
    }

    /// Returns the albedo of facets of mean reflectance `mean` over the lobe, and the factor of their reflectance for light
    /// scattered between them.
    pub fn of_mean_reflectance(&self, mean: Rgb) -> (Rgb, Rgb) {
        let compensation = self.compensation(mean);
        ((mean * self.e * compensation).min(Rgb::ONE), compensation)
    }

    /// Returns the lobe of a clear coat, whose index of refraction is [`COAT_IOR`]. It is grey.
    #[inline(always)]
    pub fn coat(&self) -> FacetLobe {
        self.dielectric(Rgb::splat(COAT_F0), 1.0)
    }
}

/// Returns the albedos of facets that reflect light once, with Schlick's Fresnel term from `f0` to 1.
#[inline(always)]
pub(crate) fn single_scattering_albedos<const N: usize>(
    cos: &[f32; N],
    alpha: &[f32; N],
    f0: &[f32; N],
) -> [f32; N] {
    let FacetAlbedos { e, schlick, .. } = FacetAlbedos::new(cos, alpha, &[COAT_IOR; N]);
    let mut albedos = [0.0; N];
    for k in 0..N {
        albedos[k] = f0[k] * (e[k] - schlick[k]) + schlick[k];
    }
    albedos
}

/// Mean of the dielectric curve at η = 1.5, weighted by the cosine. Between η = 1.1 and 2.4 it differs by less than 0.04.
const MEAN_CURVE: f32 = 0.054;

/// Index of refraction of a clear coat (KHR_materials_clearcoat).
pub(crate) const COAT_IOR: f32 = 1.5;
/// Reflectance of a clear coat at normal incidence.
pub(crate) const COAT_F0: f32 = 0.04;

#[cfg(test)]
mod tests;
