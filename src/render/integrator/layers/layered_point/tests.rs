use std::f64::consts::{PI, TAU};

use super::*;
use crate::integrator::material::highlight_lobe::highlight_lobe;

/// A direction at an angle to z, in the plane at an angle about it.
fn at(angle: f64, turn: f64) -> DVec3 {
    DVec3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos())
}

/// A white metal around z without a coat, seen from `v`.
fn view(v: DVec3, alpha: f32) -> LayerView {
    let layers = SpecularLayers {
        alpha,
        metallic: 1.0,
        metal_f0: Rgb::ONE,
        metal_f90: Rgb::ONE,
        ..SpecularLayers::COVERING
    };
    LayerView { n: DVec3::Z, v, layers, alpha, alpha2_increase: 0.0 }
}

fn point(coat: DVec3) -> LayeredPoint {
    LayeredPoint { k_d: Rgb::ONE, coat: CoatNormal { n: coat, alpha2_increase: 0.0 } }
}

/// The integral over the directions around `n` of a share of π f cos, divided by π.
fn integral(n: DVec3, share: impl Fn(Vec3) -> Rgb) -> Rgb {
    let (x, y) = n.any_orthonormal_pair();
    let steps = 400;
    let mut sum = Rgb::ZERO;
    for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
        let [z, phi] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(steps));
        let r = (1.0 - z * z).sqrt();
        let l = x * (r * (TAU * phi).cos()) + y * (r * (TAU * phi).sin()) + n * z;
        sum += share(l.as_vec3());
    }
    sum * (TAU / PI / f64::from(steps * steps)) as f32
}

/// The coat reflects in the lobe around its own normal, and the facets in theirs.
#[test]
fn coats_reflect_about_their_own_normal() {
    let (v, n_coat) = (at(0.5, 0.0), at(0.3, 1.0));
    let mut view = view(v, 0.3);
    (view.layers.coat, view.layers.coat_alpha) = (0.75, 0.2);
    let lobes = point(n_coat).lobes(&view);
    let l = (n_coat * (2.0 * n_coat.dot(v)) - v).as_vec3();
    let coat = lobes.reflect(l, l.z, false).coat.x;
    let [lobe, weight] =
        highlight_lobe(n_coat.as_vec3(), l, v.as_vec3(), n_coat.dot(l.as_dvec3()) as f32, 0.04);
    // Scattering between facets adds at most a hundredth.
    let expected = 0.75 * lobe * (0.04 + 0.96 * weight);
    assert!((coat / expected - 1.0).abs() < 0.01, "{coat} {expected}");
    let straight = point(DVec3::Z).lobes(&view).reflect(l, l.z, false).coat.x;
    assert!(straight < 0.7 * coat, "{straight} {coat}");
}

/// What the layers reflect of all directions is their share, and all shares of a white surface add up to 1.
#[test]
fn shares_are_the_integrals_of_the_lobes() {
    for (angle, alpha) in [(0.2, 0.3), (0.9, 0.6), (1.2, 0.2)] {
        let (v, n_coat) = (at(angle, 0.0), at(0.25, 2.0));
        let mut view = view(v, alpha);
        (view.layers.coat, view.layers.coat_alpha) = (1.0, 0.3);
        let lobes = point(n_coat).lobes(&view);
        let shares = lobes.shares();
        let facets = integral(DVec3::Z, |l| lobes.reflect(l, l.z, true).facets);
        let coat = integral(n_coat, |l| lobes.reflect(l, l.z.max(1e-3), true).coat).x;
        assert!((shares.facets - facets).abs().max_element() < 0.015, "{angle} {alpha}: {facets} {shares:?}");
        assert!((shares.coat - coat).abs() < 0.01, "{angle} {alpha}: {coat} {shares:?}");
        let sum = shares.facets.max_element() + shares.coat;
        assert!((0.99..1.0 + 1e-6).contains(&sum), "{angle} {alpha}: {sum}");
    }
}

/// Behind a diffuse bounce only the base is left.
#[test]
fn points_without_specular_layers_have_their_base() {
    let mut view = view(at(0.7, 0.0), 0.3);
    (view.layers.coat, view.layers.reflects) = (1.0, false);
    let shares = point(at(0.3, 0.0)).lobes(&view).shares();
    assert_eq!((shares.facets, shares.coat, shares.base, shares.k_d), (Rgb::ZERO, 0.0, 1.0, Rgb::ONE));
}
