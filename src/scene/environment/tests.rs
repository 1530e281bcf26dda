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
fn the_memory_of_a_map_is_that_of_its_picture_and_its_levels() {
    assert_eq!(Environment::uniform(Rgb::ONE).memory_size(), 0);
    let plain = Environment::from_panorama(gradient()).memory_size();
    // A level has a border of one texel.
    let levels = [16, 8, 4, 2, 1].map(|side: u64| 16 * (side + 2).pow(2)).iter().sum::<u64>();
    let tables = super::LOOKUP_TABLES as u64;
    assert_eq!(plain, 64 * 32 * 12 + levels + tables);
    let lamp = gradient().map_texels(|texel| if texel.x > 1.99 { Rgb::splat(1e4) } else { texel });
    let lit = Environment::from_panorama(lamp);
    assert!(lit.has_light_sources() && lit.memory_size() > plain + levels + tables);
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

/// A dim sky with a gradient, and a sun of `radius` radians at azimuth 1 rad and elevation 0.6 rad.
fn sunny(width: u32, radius: f64) -> (Panorama, Vec3) {
    let height = width / 2;
    let (sun_azimuth, sun_elevation) = (1.0f64, 0.6f64);
    let direction = |azimuth: f64, elevation: f64| {
        let (sin, cos) = azimuth.sin_cos();
        Vec3::new((elevation.cos() * cos) as f32, elevation.sin() as f32, (elevation.cos() * sin) as f32)
    };
    let sun = direction(sun_azimuth, sun_elevation);
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let azimuth = ((f64::from(x) + 0.5) / f64::from(width) - 0.5) * std::f64::consts::TAU;
        let elevation = (0.5 - (f64::from(y) + 0.5) / f64::from(height)) * std::f64::consts::PI;
        let is_sun = f64::from(direction(azimuth, elevation).dot(sun)) > radius.cos();
        if is_sun { [3000.0, 2500.0, 1500.0] } else { [0.2, 0.25, 0.3 + 0.1 * elevation as f32] }
    };
    (Panorama::new(width, height, (0..width * height).map(texel).collect()).unwrap(), sun)
}

fn grid(n: u32) -> impl Iterator<Item = [f32; 2]> {
    let centre = move |i: u32| (i as f32 + 0.5) / n as f32;
    (0..n * n).map(move |i| [centre(i % n), centre(i / n)])
}

#[test]
fn environments_with_little_contrast_have_no_light_sources() {
    for environment in
        [Environment::from_panorama(gradient()), Environment::uniform(Rgb::ONE), Environment::studio()]
    {
        assert!(!environment.has_light_sources() && environment.sample_light_sources([0.5; 2]).is_none());
        assert_eq!(environment.diffuse_of_light_sources(Vec3::Y), Rgb::ZERO);
        assert!(environment.ambient_part() == environment);
        assert!(environment.ambient_irradiance() == environment.irradiance());
    }
    let black = Panorama::new(4, 2, vec![[0.0; 3]; 8]).unwrap();
    assert!(!Environment::from_panorama(black).has_light_sources());
}

#[test]
fn light_sources_and_the_ambient_part_add_up_to_the_environment() {
    // The wide one is halved before its sources are found.
    for (width, radius) in [(512, 0.05), (2048, 0.0047), (4096, 0.01)] {
        let (panorama, sun) = sunny(width, radius);
        let rotation = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.4);
        let environment =
            Environment::from_panorama(panorama).scaled(Rgb::new(1.0, 2.0, 3.0)).rotated(rotation);
        let sun = rotation.as_mat3() * sun;
        assert!(environment.has_light_sources());
        let ambient = environment.ambient_part();
        // Irradiance of surfaces that face the sun, and of others.
        for n in [sun, (sun + Vec3::new(0.3, 1.0, -0.2)).normalize(), -sun, sun.any_orthonormal_vector()] {
            let sample = |u: [f32; 2]| environment.sample_light_sources(u).unwrap();
            let light = |u: [f32; 2]| {
                let sample = sample(u);
                assert!(sample.direction.dot(sun) > (radius + 0.02).cos() as f32, "{sample:?}");
                sample.radiance * (sample.direction.dot(n).max(0.0) / sample.density)
            };
            let of_sources = grid(64).map(light).sum::<Rgb>() / (4096.0 * std::f32::consts::PI);
            let scale = environment.diffuse(sun).max_element();
            let is_near = |a: Rgb, b: Rgb| (a - b).abs().max_element() < 0.02 * scale;
            let expected = environment.diffuse_of_light_sources(n);
            assert!(is_near(of_sources, expected), "{n}: {of_sources} {expected}");
            let [found, expected] = [of_sources + ambient.diffuse(n), environment.diffuse(n)];
            assert!(is_near(found, expected), "{n}: {found} {expected}");
        }
        // The harmonics of the ambient part have no ringing from the sun.
        let away = environment.ambient_irradiance().ambient(-sun.as_dvec3());
        let exact = ambient.diffuse(-sun);
        assert!((away - exact).abs().max_element() < 0.02 * exact.max_element(), "{away} {exact}");
    }
}

#[test]
fn light_sources_are_sampled_in_proportion_to_their_brightness() {
    let mut texels = vec![[0.1; 3]; 64 * 32];
    // Two lamps on one row, and one of half the radiance on another.
    (texels[10 * 64 + 5], texels[10 * 64 + 40], texels[20 * 64 + 63]) =
        ([200.0; 3], [400.0; 3], [0.0, 600.0, 0.0]);
    let environment = Environment::from_panorama(Panorama::new(64, 32, texels).unwrap());
    let mut counts = [0; 3];
    let mut power: Vec<f32> = Vec::new();
    for sample in grid(100).map(|u| environment.sample_light_sources(u).unwrap()) {
        let lamp = match sample.radiance.to_array() {
            [0.0, g, _] => usize::from(g > 590.0) * 2,
            [r, ..] => usize::from(r > 300.0),
        };
        counts[lamp] += 1;
        // The same light for each direction.
        power.push(sample.radiance.element_sum() / sample.density);
    }
    assert!(power.iter().all(|p| (p / power[0] - 1.0).abs() < 1e-3));
    let total: i32 = counts.iter().sum();
    // Rows 10 and 20 have nearly the same solid angle.
    let share = |i: usize| f64::from(counts[i]) / f64::from(total);
    assert!((share(1) - 2.0 * share(0)).abs() < 0.02 && (share(2) - share(0)).abs() < 0.04, "{counts:?}");
}
