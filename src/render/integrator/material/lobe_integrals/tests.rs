use glam::{DVec3, Vec3};

use super::*;
use crate::integrator::material::fresnel::schlick_weight;
use crate::integrator::material::ggx::{sample_visible_normal, shadowing_ratio};
use crate::integrator::material::ggx_lobe::LobeBasis;
use crate::integrator::material::lobe_lookups::LobeLookups;

/// A dark room with two soft boxes, smooth at their edges.
fn studio(d: Vec3) -> Rgb {
    let spot = |axis: Vec3, width: f32| {
        let x = ((1.0 - d.dot(axis.normalize())) / width).min(1.0);
        (1.0 - x) * (1.0 - x) * (1.0 + 2.0 * x)
    };
    Rgb::new(0.2, 0.25, 0.3)
        + Rgb::new(4.0, 3.5, 3.0) * spot(Vec3::new(0.5, 1.0, 0.3), 0.25)
        + Rgb::new(1.0, 2.0, 3.0) * spot(Vec3::new(-1.0, 0.2, 0.5), 0.4)
}

fn view(cos: f64) -> DVec3 {
    DVec3::new((1.0 - cos * cos).sqrt(), cos, 0.0)
}

/// The mean over a pixel's samples.
fn integrated_radiance(lobe: &Lobe, environment: &Environment, samples: u32) -> Rgb {
    let mut integrals = LobeIntegrals::default();
    (0..samples).for_each(|index| integrals.push(lobe, index, samples));
    integrals.radiance(SimdLevel::Portable, environment, samples).into_iter().sum::<Rgb>() / samples as f32
}

/// The lobe integrated with a million directions.
fn reference(lobe: &Lobe, radiance: impl Fn(Vec3) -> Rgb) -> Rgb {
    let basis = LobeBasis::new(lobe.n, lobe.v);
    let n = 400;
    let mut sum = DVec3::ZERO;
    let mut weights = 0.0;
    for i in 0..n * n {
        let u = [(i % n) as f64 + 0.5, (i / n) as f64 + 0.5].map(|x| x / n as f64);
        let m = sample_visible_normal(basis.v, lobe.alpha, u);
        let v_m = basis.v.dot(m);
        let l = m * (2.0 * v_m) - basis.v;
        let weight =
            shadowing_ratio(basis.v.z, l.z, lobe.alpha) * (lobe.f0 + (1.0 - lobe.f0) * schlick_weight(v_m));
        sum += radiance((basis.x * l.x + basis.y * l.y + basis.z * l.z).as_vec3()).as_dvec3() * weight;
        weights += weight;
    }
    (sum / weights).as_vec3()
}

/// In percent: the mean error of single lookups of the lobes of dielectrics.
fn mean_error_of_single_lookups(radiance: impl Fn(Vec3) -> Rgb + Sync + Copy, alpha: f64) -> f32 {
    let environment = Environment::from_function(256, 2, radiance);
    let cosines = [0.15, 0.3, 0.5, 0.7, 0.9, 1.0];
    let error = |cos: f64| {
        let lobe = Lobe { n: DVec3::Y, v: view(cos), alpha, f0: 0.04 };
        let expected = reference(&lobe, radiance);
        let mut lookups = LobeLookups::default();
        lookups.push(&lobe);
        let found = lookups.radiance(SimdLevel::Portable, &environment)[0];
        ((found - expected) / expected).abs().max_element()
    };
    100.0 * cosines.map(error).iter().sum::<f32>() / cosines.len() as f32
}

#[test]
fn single_lookups_come_close_to_integration() {
    for alpha in [0.01, 0.04, 0.16, 0.25, 0.4, 0.8] {
        let error = mean_error_of_single_lookups(studio, alpha);
        assert!(error < 15.0, "α {alpha}: {error} %");
    }
}

/// In percent: the mean error over views and reflectances, for the samples of a pixel together.
fn mean_error(radiance: impl Fn(Vec3) -> Rgb + Sync + Copy, alpha: f64) -> f32 {
    let environment = Environment::from_function(256, 2, radiance);
    let mut errors = Vec::new();
    for f0 in [0.04, 0.7] {
        for cos in [0.15, 0.3, 0.5, 0.7, 0.9, 1.0] {
            let lobe = Lobe { n: DVec3::Y, v: view(cos), alpha, f0 };
            let expected = reference(&lobe, radiance);
            for count in [1, 4, 16] {
                let found = integrated_radiance(&lobe, &environment, count);
                errors.push(((found - expected) / expected).abs().max_element());
            }
        }
    }
    100.0 * errors.iter().sum::<f32>() / errors.len() as f32
}

#[test]
fn integrals_over_a_smooth_environment_agree_with_integration() {
    let smooth = |d: Vec3| Rgb::splat(2.0) + d + Rgb::splat(0.7 * d.x * d.y);
    for alpha in [0.01, 0.04, 0.16, 0.4] {
        let error = mean_error(smooth, alpha);
        assert!(error < 2.5, "α {alpha}: {error} %");
    }
}

#[test]
fn integrals_over_soft_boxes_agree_with_integration() {
    for alpha in [0.01, 0.04, 0.16, 0.4] {
        let error = mean_error(studio, alpha);
        assert!(error < 4.0, "α {alpha}: {error} %");
    }
}

#[test]
fn a_white_environment_gives_white() {
    let environment = Environment::uniform(Rgb::ONE);
    for alpha in [0.0, 0.003, 0.02, 0.3, 1.0] {
        for cos in [-0.2, 0.0, 0.1, 0.5, 1.0] {
            let lobe = Lobe { n: DVec3::Y, v: view(cos), alpha, f0: 0.04 };
            for count in [1, 4, 16, 100] {
                let found = integrated_radiance(&lobe, &environment, count);
                assert_eq!(found, Rgb::ONE, "α {alpha} cos {cos}, {count}");
            }
        }
    }
}

#[test]
fn mirrors_reflect_the_mirrored_direction() {
    let environment = Environment::from_function(256, 2, |d| d * 0.5 + 0.5);
    let v = DVec3::new(0.6, 0.64, -0.48);
    let lobe = Lobe { n: DVec3::Y, v, alpha: 0.0, f0: 1.0 };
    let found = lobe.mirrored_radiance(&environment) * 2.0 - 1.0;
    assert!(found.abs_diff_eq(Vec3::new(-0.6, 0.64, 0.48), 1e-3), "{found}");
}

/// Lobes are independent of those in the same block, and of the SIMD level.
#[test]
fn blocks_give_the_bytes_of_single_lobes() {
    let environment = Environment::from_function(64, 2, studio);
    let lobes: Vec<Lobe> = (0..21)
        .map(|i| f64::from(i) / 20.0)
        .map(|t| Lobe { n: DVec3::Y, v: view(t - 0.1), alpha: 0.005 + 0.99 * t, f0: 0.04 + 0.9 * t })
        .collect();
    let alone: Vec<[Rgb; 2]> = lobes
        .iter()
        .map(|lobe| {
            let (mut lookups, mut integrals) = (LobeLookups::default(), LobeIntegrals::default());
            lookups.push(lobe);
            integrals.push(lobe, 1, 4);
            let level = SimdLevel::Portable;
            [lookups.radiance(level, &environment)[0], integrals.radiance(level, &environment, 4)[0]]
        })
        .collect();
    for level in SimdLevel::ALL.into_iter().filter(|level| level.is_supported()) {
        let (mut lookups, mut integrals) = (LobeLookups::default(), LobeIntegrals::default());
        lobes.iter().for_each(|lobe| lookups.push(lobe));
        lobes.iter().for_each(|lobe| integrals.push(lobe, 1, 4));
        let looked_up = lookups.radiance(level, &environment);
        let integrated = integrals.radiance(level, &environment, 4);
        let together: Vec<[Rgb; 2]> = looked_up.into_iter().zip(integrated).map(Into::into).collect();
        assert_eq!(together, alone, "{level:?}");
    }
}
