use std::f64::consts::{PI, TAU};

use super::*;
use crate::integrator::layers::dielectric_boundary::{BoundaryFilm, DielectricBoundary};
use crate::integrator::layers::facets::LobeDirections;
use crate::integrator::material::highlight_lobe::highlight_lobe;
use blinn_scene::{AnisotropyModel, Environment, SheenModel};

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
    let coat = CoatNormal { n: coat, alpha2_increase: 0.0 };
    LayeredPoint {
        k_d: Rgb::ONE,
        transmitted: Rgb::ZERO,
        coat,
        anisotropy: None,
        sheen: None,
        film: None,
        stretched_albedo: None,
        film_mean: None,
        k_a: Rgb::ZERO,
    }
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

/// Light that the layers reflect of all directions is their share, and all shares of a white surface add up to 1.
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

/// Facets stretched along x by KHR_materials_anisotropy, in f64 and by the formulas of its specification.
fn stretched_lobe(v: DVec3, l: DVec3, alpha: f64, strength: f64) -> f64 {
    let [t, b] = [alpha + (1.0 - alpha) * strength * strength, alpha];
    let h = (v + l).normalize();
    let d = 1.0 / (PI * t * b * ((h.x / t).powi(2) + (h.y / b).powi(2) + h.z * h.z).powi(2));
    let length = |w: DVec3| DVec3::new(t * w.x, b * w.y, w.z).length();
    let visibility = 0.5 / (l.z * length(v) + v.z * length(l));
    PI * d * visibility * l.z
}

fn stretched(direction: DVec3, strength: f32) -> LayeredPoint {
    let anisotropy = Anisotropy { direction, strength, model: AnisotropyModel::Gltf };
    LayeredPoint { anisotropy: Some(anisotropy), ..point(DVec3::Z) }
}

/// The aspect of a strength of 1 is √0.1, and α never exceeds 1.
#[test]
fn the_principled_bsdf_stretches_by_its_aspect() {
    let alphas = |strength: f32, alpha: f32| {
        Anisotropy { direction: DVec3::X, strength, model: AnisotropyModel::Principled }.alphas(alpha)
    };
    for (strength, alpha, [along, across]) in [
        (0.0, 0.3, [0.3, 0.3]),
        (0.5, 0.2, [0.26968, 0.148324]),
        (1.0, 0.1, [0.316228, 0.0316228]),
        (1.0, 0.5, [1.0, 0.158114]),
    ] {
        let found = alphas(strength, alpha);
        assert!(
            (found[0] - along).abs() < 1e-5 && (found[1] - across).abs() < 1e-5,
            "{strength} {alpha}: {found:?}"
        );
    }
}

#[test]
fn stretched_highlights_are_those_of_the_specification() {
    for (alpha, strength) in [(0.1, 0.5), (0.3, 1.0), (0.5, 0.3)] {
        let v = at(0.6, 0.4);
        let lobes = stretched(DVec3::X, strength as f32).lobes(&view(v, alpha as f32));
        for l in [at(0.6, 0.4 + PI), at(0.3, 2.0), at(1.1, -1.0), at(1.3, 3.3)] {
            let shares = lobes.reflect(l.as_vec3(), l.z as f32, false);
            let expected = stretched_lobe(v, l, alpha, strength);
            // The factor of light scattered between facets.
            let factor = lobes.facets.f0.x;
            assert!(
                (f64::from(shares.facets.x / factor) - expected).abs() < 1e-3 * expected.max(0.01),
                "{l}"
            );
            assert!((1.0..2.5).contains(&factor), "{factor}");
        }
    }
}

/// A white metal reflects all light, whatever the stretch, also of lights without size.
#[test]
fn stretched_metals_vanish_in_a_white_world() {
    for (alpha, strength) in [(0.1, 0.5), (0.25, 1.0), (0.6, 0.8)] {
        for (angle, turn) in [(0.2, 0.0), (0.8, 0.7), (1.2, 1.5), (1.2, 0.1)] {
            let lobes = stretched(DVec3::X, strength).lobes(&view(at(angle, turn), alpha));
            let sum = integral(DVec3::Z, |l| lobes.reflect(l, l.z, true).facets).x;
            assert!((sum - 1.0).abs() < 0.01, "{alpha} {strength} {angle} {turn}: {sum}");
            assert!((lobes.shares().facets.x - 1.0).abs() < 1e-6);
        }
    }
}

/// The samples of a pixel share the directions of a stretched lobe: their mean is the light of the whole lobe.
#[test]
fn samples_of_stretched_metals_reflect_the_whole_environment() {
    let white = Environment::from_function(32, 1, |_| Vec3::ONE);
    let brighter_above = Environment::from_function(32, 1, |d| Vec3::splat(1.0 + d.z));
    for (alpha, strength) in [(0.25, 0.5), (0.1, 1.0), (1.0, 0.5)] {
        for angle in [0.1, 0.8, 1.3] {
            let view = view(at(angle, 0.4), alpha);
            let facets = stretched(DVec3::X, strength).anisotropic_facets(&view).unwrap();
            let radiance = |environment: &Environment, samples: u32| {
                let of_sample =
                    |i| facets.radiance(environment, 0.9, LobeDirections::of_sample(i, samples)).x;
                (0..samples).map(of_sample).sum::<f32>() / samples as f32
            };
            for samples in [1, 4, 16, 64, 256] {
                let sum = radiance(&white, samples);
                assert!((sum - 1.0).abs() < 0.02, "{alpha} {strength} {angle} {samples}: {sum}");
            }
            let [few, many] = [1, 128].map(|samples| radiance(&brighter_above, samples));
            assert!((few / many - 1.0).abs() < 0.05, "{alpha} {strength} {angle}: {few} {many}");
        }
    }
}

/// The mean of 1/pdf over the sampled directions of a cap is its solid angle.
#[test]
fn stretched_lobes_spawn_rays_with_their_density() {
    let (v, count, cap) = (at(0.5, 0.3), 200, 0.8);
    let view = view(v, 0.4);
    let facets = stretched(DVec3::new(1.0, 1.0, 0.0), 0.8).anisotropic_facets(&view).unwrap();
    let mut inside = 0.0;
    for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
        let sampled = facets.sample([i, j].map(|k| (k as f32 + 0.5) / count as f32));
        if sampled.l.z > cap {
            inside += 1.0 / sampled.density / f64::from(count * count);
            assert!((f64::from(facets.pdf(sampled.l.as_vec3())) / sampled.density - 1.0).abs() < 1e-3);
        }
    }
    assert!((inside / (TAU * (1.0 - cap)) - 1.0).abs() < 0.02, "{inside}");
}

/// Sheen by the formulas of KHR_materials_sheen, in f64: D V, without the factor n·l.
fn sheen_of_the_specification(v: DVec3, l: DVec3, roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    let lambda = |cos: f64| {
        let t = (1.0 - alpha) * (1.0 - alpha);
        let mix = |x: f64, y: f64| x * (1.0 - t) + y * t;
        let curve = |x: f64| {
            mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)))
                + mix(-1.97760, -1.27393) * x
                + mix(-4.32054, -4.85967)
        };
        if cos < 0.5 { curve(cos).exp() } else { (2.0 * curve(0.5) - curve(1.0 - cos)).exp() }
    };
    let n_h = (v + l).normalize().z;
    let d = (2.0 + 1.0 / alpha) * (1.0 - n_h * n_h).powf(0.5 / alpha) / TAU;
    d / ((1.0 + lambda(v.z) + lambda(l.z)) * 4.0 * v.z * l.z)
}

fn with_sheen(model: SheenModel, color: Rgb, roughness: f32) -> LayeredPoint {
    LayeredPoint { sheen: Some(Sheen { color, roughness, model }), ..point(DVec3::Z) }
}

#[test]
fn sheen_is_that_of_the_specification() {
    for roughness in [0.2, 0.5, 1.0] {
        let v = at(0.8, 0.0);
        let sheen = with_sheen(SheenModel::Charlie, Rgb::new(1.0, 0.5, 0.0), roughness as f32);
        let lobes = sheen.lobes(&view(v, 0.5));
        for l in [at(0.3, 1.0), at(1.2, 3.0), at(0.8, 0.1)] {
            let reflected = lobes.reflect(l.as_vec3(), l.z as f32, false).diffuse;
            let expected = PI * sheen_of_the_specification(v, l, roughness) * l.z;
            assert!((f64::from(reflected.x) / expected - 1.0).abs() < 1e-3, "{roughness} {l}: {reflected}");
            assert!((reflected.y / reflected.x - 0.5).abs() < 1e-5 && reflected.z == 0.0);
        }
    }
}

/// The sheen reflects its albedo, and leaves the rest to what is below.
#[test]
fn a_white_sheen_over_a_white_surface_conserves_light() {
    for model in [SheenModel::Charlie, SheenModel::Microfibres] {
        for roughness in [0.3, 0.55, 0.8, 1.0] {
            for angle in [0.1, 0.6, 1.1, 1.4] {
                let lobes = with_sheen(model, Rgb::ONE, roughness).lobes(&view(at(angle, 0.0), 0.5));
                let sheen = integral(DVec3::Z, |l| lobes.reflect(l, l.z, true).diffuse).x;
                let shares = lobes.shares();
                let at = format!("{model:?} {roughness} {angle}");
                assert!((sheen - shares.k_a.x).abs() < 0.01, "{at}: {sheen} {shares:?}");
                assert!(
                    sheen < 1.0 && (shares.k_a.x + shares.facets.x - 1.0).abs() < 1e-5,
                    "{at}: {shares:?}"
                );
            }
        }
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

/// The reflectance of a film by the code of KHR_materials_iridescence, in f64, channel by channel.
fn film_of_the_specification(film: ThinFilm, cos: f64, f0: DVec3) -> DVec3 {
    let sensitivity = |path: f64, shift: DVec3| {
        let phase = TAU * path * 1e-9;
        let curve = |a: f64, x: f64, v: f64, shift: f64| {
            a * (TAU * v).sqrt() * (x * phase + shift).cos() * (-phase * phase * v).exp()
        };
        let x =
            curve(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + curve(9.7470e-14, 2.2399e6, 4.5282e9, shift.x);
        let y = curve(4.4201e-13, 1.7953e6, 9.3046e9, shift.y);
        let z = curve(5.2481e-13, 2.2084e6, 6.6121e9, shift.z);
        let rgb = |m: [f64; 3]| (m[0] * x + m[1] * y + m[2] * z) / 1.0685e-7;
        DVec3::new(
            rgb([3.2404542, -1.5371385, -0.4985314]),
            rgb([-0.9692660, 1.8760108, 0.0415560]),
            rgb([0.0556434, -0.2040259, 1.0572252]),
        )
    };
    let ior = f64::from(film.ior);
    let f0_of = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let schlick = |f0: f64, cos: f64| f0 + (1.0 - f0) * (1.0 - cos).powi(5);
    let cos2 = (1.0 - (1.0 - cos * cos) / (ior * ior)).sqrt();
    let r12 = schlick(f0_of(ior, 1.0), cos);
    let t121 = 1.0 - r12;
    let (mut r23, mut phi) = (DVec3::ZERO, DVec3::ZERO);
    for i in 0..3 {
        let root = f0[i].min(0.9999).sqrt();
        let base = (1.0 + root) / (1.0 - root);
        r23[i] = schlick(f0_of(base, ior), cos2);
        phi[i] = PI + if base < ior { PI } else { 0.0 };
    }
    let path = 2.0 * ior * f64::from(film.thickness) * cos2;
    let r123 = (r23 * r12).clamp(DVec3::splat(1e-5), DVec3::splat(0.9999));
    let rs = r23 * t121 * t121 / (1.0 - r123);
    let mut sum = rs + r12;
    let mut c = rs - t121;
    for m in [1.0, 2.0] {
        c *= DVec3::from(r123.to_array().map(f64::sqrt));
        sum += c * 2.0 * sensitivity(m * path, phi * m);
    }
    sum.clamp(DVec3::ZERO, DVec3::ONE)
}

fn filmed(film: ThinFilm) -> LayeredPoint {
    LayeredPoint { film: Some(film), ..point(DVec3::Z) }
}

/// A surface of a dielectric around z, seen from `v`.
fn dielectric_view(v: DVec3, alpha: f32) -> LayerView {
    let layers = SpecularLayers {
        alpha,
        dielectric_f0: Rgb::splat(0.04),
        dielectric_f90: 1.0,
        ior: 1.5,
        ..SpecularLayers::COVERING
    };
    LayerView { layers, ..view(v, alpha) }
}

#[test]
fn films_reflect_by_the_formulas_of_the_specification() {
    let mut compared = 0;
    for (ior, thickness) in [(1.3, 100.0), (1.33, 400.0), (1.8, 550.0), (2.4, 1200.0)] {
        let film = ThinFilm { share: 1.0, ior, thickness };
        for f0 in [Rgb::splat(0.04), Rgb::new(0.9, 0.5, 0.02), Rgb::ONE] {
            let layers =
                SpecularLayers { dielectric_f0: f0, dielectric_f90: 1.0, ..SpecularLayers::COVERING };
            for i in 0..=20 {
                let cos = f64::from(i) / 20.0;
                let found = film.over(&layers).reflectance(cos as f32).dielectric.as_dvec3();
                let expected = film_of_the_specification(film, cos, f0.as_dvec3());
                assert!(
                    (found - expected).abs().max_element() < 2e-4,
                    "{film:?} {f0} {cos}: {found} {expected}"
                );
                compared += usize::from(expected.max_element() - expected.min_element() > 0.05);
            }
        }
    }
    assert!(compared > 50, "{compared} colours");
}

/// The light of a source is reflected in the lobe, by the reflectance of the facets that send it to the viewer.
#[test]
fn highlights_have_the_colour_of_the_film() {
    let film = ThinFilm { share: 0.75, ior: 1.4, thickness: 500.0 };
    let (v, l) = (at(0.7, 0.0), at(0.5, PI));
    let view = dielectric_view(v, 0.3);
    let bare = point(DVec3::Z).lobes(&view);
    let shares = filmed(film).lobes(&view).reflect(l.as_vec3(), l.z as f32, true);
    let [lobe, _] = highlight_lobe(Vec3::Z, l.as_vec3(), v.as_vec3(), l.z as f32, 0.09);
    let of_film = film_of_the_specification(film, v.dot((v + l).normalize()), DVec3::splat(0.04));
    let of_bare = bare.reflect(l.as_vec3(), l.z as f32, true).facets / lobe;
    let expected = of_bare * 0.25 + of_film.as_vec3() * 0.75;
    let found = shares.facets / lobe;
    // Scattering between facets adds a few percent of a small reflectance.
    assert!((found / expected - Rgb::ONE).abs().max_element() < 0.02, "{found} {expected}");
}

/// The share of the film is what it reflects of all directions; the base has the rest of the brightest channel.
#[test]
fn films_and_their_bases_conserve_light() {
    for (alpha, angle) in [(0.1, 0.3), (0.35, 0.9), (0.7, 0.5), (0.2, 1.3)] {
        let film = ThinFilm { share: 1.0, ior: 1.33, thickness: 420.0 };
        let v = at(angle, 0.4);
        let lobes = filmed(film).lobes(&dielectric_view(v, alpha));
        let shares = lobes.shares();
        let facets = integral(DVec3::Z, |l| lobes.reflect(l, l.z, true).facets);
        assert!((shares.facets - facets).abs().max_element() < 0.015, "{alpha} {angle}: {facets} {shares:?}");
        assert!((shares.facets.max_element() + shares.base - 1.0).abs() < 1e-5, "{shares:?}");
        // A white metal under a film of soap reflects everything.
        let lobes = filmed(film).lobes(&view(v, alpha));
        let white = integral(DVec3::Z, |l| lobes.reflect(l, l.z, true).facets);
        assert!((white - Rgb::ONE).abs().max_element() < 0.01, "{alpha} {angle}: {white}");
        assert!((lobes.shares().facets - Rgb::ONE).abs().max_element() < 0.01);
    }
}

/// Light that leaves a body meets the film at the angle outside.
#[test]
fn films_reflect_as_much_on_both_sides_of_refracted_light() {
    let film = ThinFilm { share: 1.0, ior: 1.33, thickness: 300.0 };
    let over = film.over(&dielectric_view(DVec3::Z, 0.0).layers);
    let boundary = |eta: f64, entering: bool| DielectricBoundary {
        eta,
        f90: 1.0,
        film: Some(BoundaryFilm { film: over, share: 1.0, entering }),
    };
    for cos in [1.0, 0.8, 0.3] {
        let cos_inside = (1.0 - (1.0 - cos * cos) / 2.25f64).sqrt();
        let [out, inside] =
            [boundary(1.5, true).reflectance(cos), boundary(1.0 / 1.5, false).reflectance(cos_inside)];
        assert!((out - inside).abs().max_element() < 1e-5, "{cos}: {out} {inside}");
        assert!(out.max_element() - out.min_element() > 0.005, "{out}");
    }
    assert_eq!(boundary(1.0 / 1.5, false).reflectance(0.5), Rgb::ONE, "total reflection");
}
