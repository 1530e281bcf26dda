use glam::{DMat3, Vec3};

use super::kernel::Kernel;
use super::{Environment, Panorama};
use blinn_core::geometry::Rgb;
use blinn_core::simd::SimdLevel;

/// A panorama with a smooth red gradient from below to above, and blue towards +Z.
fn gradient() -> Panorama {
    let (width, height) = (64, 32);
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let angle = (f64::from(x) + 0.5) / f64::from(width) * std::f64::consts::TAU;
        let down = (f64::from(y) + 0.5) / f64::from(height) * std::f64::consts::PI;
        [(1.0 + down.cos()) as f32, 0.5, (1.0 - angle.sin() * down.sin()) as f32]
    };
    Panorama::new(width, height, (0..width * height).map(texel).collect()).unwrap()
}

fn directions() -> impl Iterator<Item = Vec3> {
    (0..200).map(|i| {
        let y = 1.0 - (2 * i + 1) as f32 / 200.0;
        let (sin, cos) = (i as f32 * 2.4).sin_cos();
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * cos, y, r * sin)
    })
}

#[test]
fn a_uniform_environment_is_the_same_everywhere() {
    let color = Rgb::new(0.1, 0.2, 0.3);
    let environment = Environment::uniform(color).scaled(Rgb::splat(2.0));
    assert!(directions().all(|d| environment.radiance(d, 0.5) == color * 2.0));
    assert_eq!(environment.as_uniform(), Some(color * 2.0));
}

#[test]
fn sharp_lookups_are_those_of_the_picture() {
    let environment = Environment::from_panorama(gradient());
    for d in directions() {
        let expected = Rgb::new(1.0 + d.y, 0.5, 1.0 + d.z);
        let found = environment.radiance(d, 0.0);
        assert!(found.abs_diff_eq(expected, 0.005), "{d}: {found} {expected}");
    }
}

/// The mean over all directions is the mean of the levels: 1, 0.5, 1 for this picture.
#[test]
fn levels_keep_the_mean() {
    let environment = Environment::from_panorama(gradient());
    assert!(environment.mean().abs_diff_eq(Rgb::new(1.0, 0.5, 1.0), 0.01), "{}", environment.mean());
    let sum: Rgb = directions().map(|d| environment.radiance(d, 0.2)).sum();
    assert!((sum / 200.0).abs_diff_eq(Rgb::new(1.0, 0.5, 1.0), 0.01), "{}", sum / 200.0);
}

#[test]
fn a_rotation_turns_the_light() {
    let environment = Environment::from_panorama(gradient());
    let rotation = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.4);
    let rotated = environment.clone().rotated(rotation);
    for d in directions() {
        let [a, b] = [environment.radiance(d, 0.1), rotated.radiance(rotation.as_mat3() * d, 0.1)];
        assert!(a.abs_diff_eq(b, 1e-3), "{d}: {a} {b}");
    }
}

/// Negative values, NaN and infinities are black.
#[test]
fn invalid_pixels_are_black() {
    let texels = vec![[f32::NAN, -1.0, f32::INFINITY]; 8];
    let environment = Environment::from_panorama(Panorama::new(4, 2, texels).unwrap());
    assert_eq!(environment.radiance(Vec3::X, 0.3), Rgb::ZERO);
    assert!(Panorama::new(4, 2, vec![[0.0; 3]; 7]).is_none());
}

/// +Z turns towards +X, and a quarter turn is exact.
#[test]
fn a_positive_angle_turns_counterclockwise_seen_from_above() {
    let environment = Environment::from_panorama(gradient());
    let turned = environment.clone().rotated_about_y(std::f64::consts::FRAC_PI_2);
    // Blue comes from +Z in the picture.
    assert!(environment.radiance(Vec3::Z, 0.0).z > 1.99 && turned.radiance(Vec3::X, 0.0).z > 1.99);
    assert!(turned.radiance(Vec3::Z, 0.0).abs_diff_eq(Rgb::new(1.0, 0.5, 1.0), 0.01));
}

/// Texels of the mip levels, looked up at their centres, against the mean of the picture over their part of the sphere.
#[test]
fn levels_agree_with_brute_force_integration() {
    use super::octahedral::to_direction;
    let panorama = gradient();
    let environment = Environment::from_panorama(gradient());
    for side in [2, 4, 8] {
        let steps = 64 / side * 4;
        for texel in 0..side * side {
            let (i, j) = (texel % side, texel / side);
            let mut sum = glam::DVec3::ZERO;
            for k in 0..steps * steps {
                let at =
                    |cell: usize, k: usize| (cell as f64 + (k as f64 + 0.5) / steps as f64) / side as f64;
                let d = to_direction(at(i, k % steps), at(j, k / steps));
                sum += panorama.radiance(d.as_vec3()).as_dvec3();
            }
            let expected = (sum / (steps * steps) as f64).as_vec3();
            let centre = to_direction((i as f64 + 0.5) / side as f64, (j as f64 + 0.5) / side as f64);
            let solid_angle = 4.0 * std::f32::consts::PI / (side * side) as f32;
            let found = environment.radiance(centre.as_vec3(), solid_angle);
            let error = ((found - expected) / environment.mean()).abs().max_element();
            assert!(error < 0.01, "{side} {i} {j}: {found} {expected}");
        }
    }
}

/// A small light keeps its power, and its blurred image has the width of the blur.
#[test]
fn a_blur_spreads_light_and_keeps_its_power() {
    let spot = |d: Vec3| if d.z > 0.999 { Rgb::ONE } else { Rgb::ZERO };
    let environment = Environment::from_function(256, 2, spot);
    for blur in [0.4f32, 0.7, 1.0] {
        let blurred = environment.blurred(blur);
        let ratio = blurred.mean().x / environment.mean().x;
        assert!((ratio - 1.0).abs() < 0.03, "{blur}: {ratio}");
        let kappa = 1.0 / f64::from(blur).powi(4);
        let peak = blurred.radiance(Vec3::Z, 0.0).x;
        for angle in [0.5, 1.0, 1.5].map(|k| k * f64::from(blur * blur)) {
            let d = Vec3::new(angle.sin() as f32, 0.0, angle.cos() as f32);
            let found = f64::from(blurred.radiance(d, 0.0).x / peak);
            let expected = (kappa * (angle.cos() - 1.0)).exp();
            assert!((found - expected).abs() < 0.06, "{blur} {angle}: {found} {expected}");
        }
    }
    assert_eq!(environment.blurred(0.0), environment);
    assert_eq!(Environment::uniform(Rgb::ONE).blurred(0.7), Environment::uniform(Rgb::ONE));
}

/// Fingerprints of images hash the debug form of settings.
#[test]
fn the_debug_form_is_short_and_tells_pictures_apart() {
    let text = |panorama: Panorama| format!("{:?}", Environment::from_panorama(panorama));
    let other = Panorama::new(64, 32, vec![[0.5; 3]; 64 * 32]).unwrap();
    assert!(text(gradient()).len() < 2000 && text(gradient()) == text(gradient()));
    assert!(text(gradient()) != text(other));
}

/// The irradiance of a small light, against its cosine.
#[test]
fn diffuse_light_agrees_with_integration() {
    let spot = |d: Vec3| if d.z > 0.9 { Rgb::ONE } else { Rgb::ZERO };
    let environment = Environment::from_function(256, 2, spot);
    let third = 1.0 / 3.0;
    for n in [
        Vec3::Z,
        Vec3::new(0.6, 0.0, 0.8),
        Vec3::new(0.0, 0.8, 0.6),
        Vec3::new(-third, 2.0 * third, 2.0 * third),
    ] {
        // Light on one side of the surface: the solid angle's projection, sin² of the radius times the cosine.
        let expected = (1.0 - 0.9 * 0.9) * n.z;
        let found = environment.diffuse(n).x;
        assert!((found / expected - 1.0).abs() < 0.01, "{n}: {found} {expected}");
    }
    assert_eq!(environment.diffuse(Vec3::NEG_Z), Rgb::ZERO);
}

/// The scenes of a batch share one blurred map; another blur has one of its own.
#[test]
fn a_blur_is_computed_once() {
    let environment = Environment::from_panorama(gradient());
    let map = |blur: f32| environment.clone().scaled(Rgb::splat(2.0)).blurred(blur).map.unwrap();
    assert!(std::sync::Arc::ptr_eq(&map(0.8), &map(0.8)));
    assert!(map(0.8) != map(0.5));
}

#[test]
fn averages_are_the_same_at_every_simd_level() {
    for environment in [Environment::studio(), Environment::from_panorama(gradient())] {
        let map = environment.map.as_ref().unwrap();
        for kernel in [Kernel::ggx(0.25), Kernel::von_mises_fisher(20.0)] {
            let directions: Vec<Vec3> = directions().collect();
            let portable = kernel.means(SimdLevel::Portable, map, &directions);
            for simd in SimdLevel::ALL {
                assert_eq!(kernel.means(simd, map, &directions), portable, "{simd:?}");
            }
        }
    }
}
