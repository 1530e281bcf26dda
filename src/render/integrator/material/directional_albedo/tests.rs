use glam::DVec3;

use super::tables::Table;
use super::*;
use crate::integrator::material::fresnel::{
    dielectric_curve, f0_from_ior, fresnel_dielectric, schlick_weight,
};
use crate::integrator::material::ggx::{sample_visible_normal, shadowing_ratio};

/// The mean of `f(v·h) · G2/G1` over visible normals, on a grid of n² of them.
fn integrate(cos: f64, alpha: f64, n: usize, f: impl Fn(f64) -> f64) -> f64 {
    // The limit at grazing views: without extent in z, visible normals are the same as those of a tiny cosine.
    let cos = cos.max(1e-4);
    let v = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            // φ from 0 to π: the lobe is symmetric.
            let u = [0.5 * (i as f64 + 0.5) / n as f64, (j as f64 + 0.5) / n as f64];
            let h = sample_visible_normal(v, alpha.max(1e-5), u);
            let v_h = v.dot(h);
            sum += f(v_h) * shadowing_ratio(v.z, 2.0 * v_h * h.z - v.z, alpha);
        }
    }
    sum / (n * n) as f64
}

fn node(i: usize, count: usize) -> f64 {
    let x = i as f64 / (count - 1) as f64;
    x * x
}

fn table(f: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
    (0..ROWS).map(|i| (0..COLUMNS).map(|j| at_node(i, j, &f)).collect()).collect()
}

fn at_node(i: usize, j: usize, f: impl Fn(f64) -> f64) -> f64 {
    integrate(node(j, COLUMNS), node(i, ROWS), 96, f)
}

/// 2 ∫ E cos d(cos) for a row, by the midpoint rule.
fn mean_albedo(row: usize) -> f64 {
    let cosines = (0..200).map(|i| (f64::from(i) + 0.5) / 200.0);
    cosines.map(|c| 2.0 * c * integrate(c, node(row, ROWS), 24, |_| 1.0) / 200.0).sum()
}

fn quantised(v: f64) -> u16 {
    (v * 65535.0).round() as u16
}

fn ior(r: f32) -> f64 {
    let r = f64::from(r);
    (1.0 + r) / (1.0 - r).max(1e-3)
}

fn write_row(out: &mut String, indent: &str, row: &[f64]) {
    let numbers: Vec<String> = row.iter().map(|v| quantised(*v).to_string()).collect();
    out.push_str(&format!("{indent}[{}],\n", numbers.join(", ")));
}

/// The start of the file, which the tables do not change.
const HEADER: &str = r"//! Tables of directional albedo. The test `the_tables_are_those_of_the_source` generates this file.

/// Nodes of the tables along the perceptual roughness √α, 0…1.
pub(super) const ROWS: usize = 24;
/// Nodes of the tables along √(cos θ), 0…1.
pub(super) const COLUMNS: usize = 32;
/// Nodes along r = |η − 1|/(η + 1), the square root of the reflectance at normal incidence. 0.2 is η = 1.5.
pub(super) const R_NODES: [f32; 8] = [0.0, 0.1, 0.14, 0.2, 0.3, 0.42, 0.6, 1.0];

/// A table over roughness (rows) and √(cos θ), in 65535ths.
pub(super) type Table = [[u16; COLUMNS]; ROWS];

";

fn source() -> String {
    let mut out = String::from(HEADER);
    let e = table(|_| 1.0);
    let tables = [
        ("E, facets that reflect everything.", "ALBEDO", &e),
        ("Facets that reflect (1 − v·h)⁵.", "SCHLICK", &table(schlick_weight)),
    ];
    for (what, name, table) in tables {
        out.push_str(&format!("/// {what}\n#[rustfmt::skip]\npub(super) const {name}: Table = [\n"));
        table.iter().for_each(|row| write_row(&mut out, "    ", row));
        out.push_str("];\n\n");
    }
    out.push_str("/// Facets that reflect the dielectric curve, for each of the `R_NODES`.\n#[rustfmt::skip]\npub(super) const DIELECTRIC: [Table; R_NODES.len()] = [\n");
    for r in R_NODES {
        out.push_str("    [\n");
        table(|c| dielectric_curve(c, ior(r))).iter().for_each(|row| write_row(&mut out, "        ", row));
        out.push_str("    ],\n");
    }
    out.push_str("];\n\n/// Mean of E over directions, weighted by the cosine, for each roughness.\n#[rustfmt::skip]\npub(super) const MEAN_ALBEDO: [u16; ROWS] = [\n    ");
    for row in 0..ROWS {
        out.push_str(&format!("{}, ", quantised(mean_albedo(row))));
    }
    out.truncate(out.trim_end().len());
    out.push_str("\n];\n");
    out
}

/// `GOLDEN=update` writes the tables. Otherwise some of their numbers are computed again.
#[test]
fn the_tables_are_those_of_the_source() {
    if std::env::var_os("GOLDEN").is_some_and(|v| v == "update") {
        let path = "/integrator/material/directional_albedo/tables.rs";
        let path = format!("{}{path}", env!("CARGO_MANIFEST_DIR"));
        return std::fs::write(path, source()).unwrap();
    }
    for i in (0..ROWS).step_by(5) {
        assert_eq!(MEAN_ALBEDO[i], quantised(mean_albedo(i)), "mean of row {i}");
        for j in (0..COLUMNS).step_by(6) {
            let check = |name: &str, table: &Table, f: &dyn Fn(f64) -> f64| {
                assert_eq!(table[i][j], quantised(at_node(i, j, f)), "{name} {i} {j}");
            };
            check("E", &ALBEDO, &|_| 1.0);
            check("Schlick", &SCHLICK, &schlick_weight);
            for (r, table) in R_NODES.into_iter().zip(&DIELECTRIC) {
                check("dielectric", table, &|c| dielectric_curve(c, ior(r)));
            }
        }
    }
}

const COSINES: [f32; 7] = [0.01, 0.07, 0.2, 0.45, 0.7, 0.93, 1.0];

/// White furnace: facets that reflect everything lose nothing, at any roughness.
#[test]
fn white_metal_reflects_everything() {
    for alpha in [0.0, 1e-3, 0.03, 0.17, 0.5, 0.83, 1.0] {
        for cos in COSINES {
            let albedo = FacetAlbedo::new(cos, alpha, 1.5).metal(Rgb::ONE, Rgb::ONE).albedo;
            assert!(albedo.x <= 1.0 && albedo.x > 1.0 - 1e-5, "{alpha} {cos}: {albedo}");
        }
    }
}

#[test]
fn interpolated_tables_agree_with_integration() {
    let compensated = |once: f64, f_ss: f64, cos: f64, alpha: f64| {
        let e = integrate(cos, alpha, 128, |_| 1.0);
        let mean: f64 = (0..50)
            .map(|i| (f64::from(i) + 0.5) / 50.0)
            .map(|c| c * integrate(c, alpha, 48, |_| 1.0) / 25.0)
            .sum();
        once * (1.0 + f_ss * mean / (1.0 - f_ss * (1.0 - mean)) * (1.0 - e) / e)
    };
    for alpha in [0.002f32, 0.03, 0.17, 0.5, 0.83] {
        for cos in COSINES {
            let (c, a) = (f64::from(cos), f64::from(alpha));
            let f0 = 0.6;
            let once = integrate(c, a, 128, |h| f0 + (1.0 - f0) * schlick_weight(h));
            let expected = compensated(once, f0 + (1.0 - f0) / 21.0, c, a);
            let ours =
                f64::from(FacetAlbedo::new(cos, alpha, 1.5).metal(Rgb::splat(f0 as f32), Rgb::ONE).albedo.x);
            assert!((ours / expected - 1.0).abs() < 0.01, "metal {alpha} {cos}: {ours} {expected}");
            for eta in [1.33, 1.5, 1.8, 2.42] {
                let f0 = f0_from_ior(eta);
                let once = integrate(c, a, 128, |h| fresnel_dielectric(h, eta));
                let mean: f64 = (0..500)
                    .map(|i| (f64::from(i) + 0.5) / 500.0)
                    .map(|c| c * fresnel_dielectric(c, eta) / 250.0)
                    .sum();
                let expected = compensated(once, mean, c, a);
                let ours = f64::from(
                    FacetAlbedo::new(cos, alpha, eta as f32).dielectric(Rgb::splat(f0 as f32), 1.0).albedo.x,
                );
                assert!(
                    (ours - expected).abs() < 0.01 * expected + 0.002,
                    "{eta} {alpha} {cos}: {ours} {expected}"
                );
            }
        }
    }
}

#[test]
fn albedos_are_finite_for_any_input() {
    for cos in [f32::NAN, -1.0, 0.0, 2.0, f32::INFINITY] {
        for alpha in [f32::NAN, -1.0, 0.0, 2.0] {
            for ior in [f32::NAN, 0.0, 1.0, f32::INFINITY] {
                let facets = FacetAlbedo::new(cos, alpha, ior);
                let _ = (facets.dielectric(Rgb::splat(0.04), 1.0), facets.metal(Rgb::ONE, Rgb::ONE));
            }
        }
    }
}

/// Facets of all roughnesses, angles and indices of refraction, valid or not.
#[test]
fn facets_in_lanes_equal_single_ones() {
    let inputs = [0.0, 0.003, 0.1, 0.37, 0.5, 0.99, 1.0, 1.7, -0.2, f32::NAN, f32::INFINITY];
    let iors = [1.0, 1.3, 1.5, 2.4, 99.0, 0.5, f32::NAN, f32::INFINITY];
    for shift in 0..inputs.len() * iors.len() {
        let cos: [f32; 16] = std::array::from_fn(|i| inputs[(i + shift) % inputs.len()]);
        let alpha: [f32; 16] = std::array::from_fn(|i| inputs[(3 * i + shift / iors.len()) % inputs.len()]);
        let ior: [f32; 16] = std::array::from_fn(|i| iors[(i + shift) % iors.len()]);
        let lanes = FacetAlbedos::new(&cos, &alpha, &ior);
        for i in 0..16 {
            // Compares as text, because NaN differs from itself.
            let single = FacetAlbedo::new(cos[i], alpha[i], ior[i]);
            assert_eq!(
                format!("{:?}", lanes.get(i)),
                format!("{single:?}"),
                "{} {} {}",
                cos[i],
                alpha[i],
                ior[i]
            );
        }
    }
}
