use glam::{DMat3, Vec3};

use super::{Environment, Panorama};
use crate::geometry::Rgb;

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
