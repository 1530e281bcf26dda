//! The mean direction and the width of GGX lobes, as those of lobes at normal incidence that prefiltered environments are
//! averaged over.
//!
//! A lobe seen at a slope leans towards the normal from the mirror's direction, and its width changes. A lobe at normal
//! incidence with the same mean direction and the same length of the mean vector comes close to it, except for its stretch.

use std::sync::OnceLock;

use glam::{DVec3, Vec4};

use crate::integrator::material::fresnel::schlick_weight;
use crate::integrator::material::ggx::{sample_visible_normal_at, shadowing_ratio};
use blinn_core::geometry::golden_angle;

/// Nodes by the square root of α, and by that of the cosine to the viewer.
const NODES: usize = 16;
/// Nodes by the square root of α of lobes at normal incidence.
const NORMAL_NODES: usize = 32;
/// Directions of a lobe.
const DIRECTIONS: u32 = 128;
/// Smallest cosine to the viewer.
const MIN_COS: f64 = 1e-3;
/// Reflectance at normal incidence of a dielectric, whose lobes are weak enough to be looked up this way.
const F0: f64 = 0.04;

/// A lobe in the frame of its surface, whose z is the normal and whose x points away from the viewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobeMoments {
    /// Mean direction, not normalised.
    pub x: f32,
    pub z: f32,
    /// α of the lobe at normal incidence.
    pub alpha: f32,
}

/// A place between four nodes of the table.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TablePosition {
    /// Index of the first node.
    first: u32,
    /// Weight of the next column.
    u: f32,
    /// Weight of the next row.
    v: f32,
}

impl TablePosition {
    /// The place of a lobe of roughness `alpha` seen at cosine `cos`.
    #[inline(always)]
    pub fn new(cos: f32, alpha: f32) -> TablePosition {
        let node = |x: f32| {
            let x = x.clamp(0.0, 1.0).sqrt() * (NODES - 1) as f32;
            // NaN becomes index 0.
            let i = (x as u32).min(NODES as u32 - 2);
            (i, x - i as f32)
        };
        let ((row, v), (column, u)) = (node(alpha), node(cos));
        TablePosition { first: row * NODES as u32 + column, u, v }
    }
}

impl LobeMoments {
    /// Returns the moments of a lobe, linear between the nodes of the table.
    #[inline(always)]
    pub fn at(position: TablePosition) -> LobeMoments {
        static TABLE: OnceLock<Vec<Vec4>> = OnceLock::new();
        let table = TABLE.get_or_init(table);
        let TablePosition { first, u, v } = position;
        let nodes = &table[first as usize..][..NODES + 2];
        let upper = nodes[0] + (nodes[1] - nodes[0]) * u;
        let lower = nodes[NODES] + (nodes[NODES + 1] - nodes[NODES]) * u;
        let [x, z, alpha, _] = (upper + (lower - upper) * v).to_array();
        LobeMoments { x, z, alpha }
    }
}

/// Rows of α, each with a column for each cosine.
fn table() -> Vec<Vec4> {
    let square = |i: usize, count: usize| (i as f64 / (count - 1) as f64).powi(2);
    let lengths: Vec<f64> = (0..NORMAL_NODES).map(|i| mean(square(i, NORMAL_NODES), 1.0).length()).collect();
    let moments = |k: usize| {
        let (alpha, cos) = (square(k / NODES, NODES), square(k % NODES, NODES).max(MIN_COS));
        let mean = mean(alpha, cos);
        let [x, _, z] = mean.normalize_or(DVec3::Z).to_array();
        Vec4::new(x as f32, z as f32, normal_alpha(&lengths, mean.length()) as f32, 0.0)
    };
    (0..NODES * NODES).map(moments).collect()
}

/// The mean vector of the directions that a lobe reflects.
fn mean(alpha: f64, cos: f64) -> DVec3 {
    let v = DVec3::new(-(1.0 - cos * cos).sqrt(), 0.0, cos);
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for i in 0..DIRECTIONS {
        let u = (f64::from(i) + 0.5) / f64::from(DIRECTIONS);
        let h = sample_visible_normal_at(v, [alpha; 2], golden_angle(i, 0.0), u);
        let v_h = v.dot(h);
        let l = h * (2.0 * v_h) - v;
        let weight = shadowing_ratio(cos, l.z, alpha) * (F0 + (1.0 - F0) * schlick_weight(v_h));
        sum += l * weight;
        total += weight;
    }
    // Lobes at normal incidence and others alike are symmetric about the plane of the viewer.
    let mean = if total > 0.0 { sum / total } else { DVec3::new(-v.x, 0.0, v.z) };
    DVec3::new(mean.x, 0.0, mean.z)
}

/// The α of the lobe at normal incidence whose mean vector has that length. Lengths decrease with the node.
fn normal_alpha(lengths: &[f64], length: f64) -> f64 {
    let last = lengths.len() - 1;
    let i = lengths[1..last].iter().filter(|&&node| length < node).count();
    let t = ((lengths[i] - length) / (lengths[i] - lengths[i + 1])).clamp(0.0, 1.0);
    ((i as f64 + t) / last as f64).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_at_normal_incidence_are_their_own() {
        for alpha in [0.0, 0.04, 0.25, 0.7, 1.0] {
            let moments = LobeMoments::at(TablePosition::new(1.0, alpha));
            assert!((moments.alpha - alpha).abs() < 0.02 && moments.x.abs() < 0.05, "{alpha}: {moments:?}");
        }
    }

    #[test]
    fn smooth_lobes_point_in_the_direction_of_the_mirror() {
        for cos in [0.1f32, 0.4, 0.8] {
            let LobeMoments { x, z, alpha } = LobeMoments::at(TablePosition::new(cos, 0.001));
            assert!((x / z - (1.0 - cos * cos).sqrt() / cos).abs() < 0.1 / cos, "{cos}: {x} {z}");
            assert!(alpha < 0.01, "{cos}: {alpha}");
        }
    }

    #[test]
    fn rough_lobes_lean_towards_the_normal() {
        let cos = 0.4f32;
        let [smooth, rough] = [0.01, 0.6].map(|alpha| LobeMoments::at(TablePosition::new(cos, alpha)));
        assert!(rough.x / rough.z < 0.7 * smooth.x / smooth.z, "{smooth:?} {rough:?}");
    }
}
