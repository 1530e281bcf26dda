//! Analytic light on simple surfaces, and what holds for any input.

use blinn_core::geometry::Rgb;
use blinn_core::simd::SimdLevel;
use glam::Vec3;

use super::near_occlusion::near_occlusion;
use super::params::Params;
use super::{Features, MARGIN, NoisyPart, PartKind, denoise, denoise_with};

const KINDS: [PartKind; 3] = [PartKind::DirectDiffuse, PartKind::IndirectDiffuse, PartKind::Specular];
const SAMPLES: u32 = 16;

/// A plane that faces the camera, of one pixel per unit.
fn plane(width: usize, height: usize) -> Features {
    let position =
        (0..width * height).map(|i| Vec3::new((i % width) as f32, (i / width) as f32, 0.0)).collect();
    Features {
        width,
        height,
        origin: [0, 0],
        albedo: vec![Rgb::splat(0.5); width * height],
        normal: vec![Vec3::Z; width * height],
        position,
        coverage: vec![1.0; width * height],
    }
}

/// Noise of variance 1 for a pixel, from its number and a seed.
fn noise(pixel: usize, seed: u64) -> f32 {
    let uniform = |k: u64| {
        let mut x = (pixel as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ (seed * 16 + k).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    };
    // Four uniform numbers have variance 4 / 12.
    ((0..4).map(uniform).sum::<f32>() - 2.0) * 3f32.sqrt()
}

/// Light with noise whose mean has standard deviation `sigma`.
fn noisy(light: &[Rgb], sigma: f32) -> NoisyPart {
    let half = |seed: u64| {
        let add = |(i, c): (usize, &Rgb)| *c + sigma * 2f32.sqrt() * noise(i, seed);
        light.iter().enumerate().map(add).collect()
    };
    NoisyPart { halves: [half(1), half(2)], reliability: vec![1.0; light.len()] }
}

fn filter(features: &Features, part: &NoisyPart, kind: PartKind) -> Vec<Rgb> {
    denoise(features, part, kind, SAMPLES, SimdLevel::detect(), 0..features.height)
}

fn bits(picture: &[Rgb]) -> Vec<[u32; 3]> {
    picture.iter().map(|c| c.to_array().map(f32::to_bits)).collect()
}

/// Root mean square and mean of the difference between two pictures.
fn errors(a: &[Rgb], b: &[Rgb]) -> (f32, f32) {
    let n = a.len() as f32 * 3.0;
    let differences = || a.iter().zip(b).flat_map(|(a, b)| (*a - *b).to_array());
    ((differences().map(|d| d * d).sum::<f32>() / n).sqrt(), differences().sum::<f32>() / n)
}

#[test]
fn a_gradient_is_reconstructed_without_bias() {
    let features = plane(96, 64);
    let light: Vec<Rgb> =
        features.position.iter().map(|p| Rgb::new(1.0, 2.0, 3.0) + 0.01 * p.x + 0.02 * p.y).collect();
    let sigma = 0.1;
    for kind in KINDS {
        let (error, bias) = errors(&filter(&features, &noisy(&light, sigma), kind), &light);
        // A fit to n pixels has 3 / n of the variance of one; 100 pixels or more count.
        assert!(error < 0.3 * sigma, "{kind:?}: {error}");
        assert!(bias.abs() < 0.01 * sigma, "{kind:?}: {bias}");
    }
}

#[test]
fn edges_between_surfaces_stay_sharp() {
    // Two walls with a corner at x = 32, of different light.
    let mut features = plane(64, 48);
    let side = |p: &Vec3| p.x >= 32.0;
    for (p, n) in features.position.iter_mut().zip(&mut features.normal) {
        if side(p) {
            (p.z, *n) = (p.x - 32.0, Vec3::X);
            p.x = 32.0;
        }
    }
    let light: Vec<Rgb> =
        features.normal.iter().map(|n| Rgb::splat(if n.x > 0.5 { 1.5 } else { 1.0 })).collect();
    let columns = |picture: &[Rgb], x: usize| (0..48).map(|y| picture[y * 64 + x].x).sum::<f32>() / 48.0;
    for kind in KINDS {
        let out = filter(&features, &noisy(&light, 0.1), kind);
        assert!((columns(&out, 31) - 1.0).abs() < 0.03, "{kind:?}: {}", columns(&out, 31));
        assert!((columns(&out, 32) - 1.5).abs() < 0.03, "{kind:?}: {}", columns(&out, 32));
    }
}

/// Two walls that meet at x = 32.
fn corner(is_concave: bool) -> Features {
    let mut features = plane(64, 48);
    for (p, n) in features.position.iter_mut().zip(&mut features.normal) {
        if p.x >= 32.0 {
            let depth = p.x - 31.5;
            (p.z, *n) = if is_concave { (depth, Vec3::NEG_X) } else { (-depth, Vec3::X) };
            p.x = 31.5;
        }
    }
    features
}

#[test]
fn near_occlusion_is_that_of_what_lies_above_a_surface() {
    let occlusion = |features: &Features| near_occlusion(features, SimdLevel::detect());
    let row = |plane: &[f32]| plane[24 * 64..25 * 64].to_vec();
    for open in [plane(64, 48), corner(false)] {
        assert!(occlusion(&open).concat().iter().all(|&o| o == 0.0));
    }
    let [wide, near] = <[Vec<f32>; 2]>::try_from(occlusion(&corner(true))).unwrap();
    let (wide, near) = (row(&wide), row(&near));
    for x in 20..31 {
        assert!(wide[x] <= wide[x + 1] && near[x] <= near[x + 1], "{x}: {wide:?} {near:?}");
    }
    assert!(wide[31] > 0.1 && near[31] > 0.1, "{} {}", wide[31], near[31]);
    assert!(wide[24] > 0.0 && near[24] == 0.0, "4 pixels do not reach the corner: {} {}", wide[24], near[24]);
    let mut without = corner(true);
    without.coverage.iter_mut().enumerate().filter(|(i, _)| i % 64 >= 32).for_each(|(_, share)| *share = 0.0);
    assert!(occlusion(&without).concat().iter().all(|&o| o == 0.0), "the background does not occlude");
}

#[test]
fn creases_stay_dark() {
    let features = corner(true);
    let light: Vec<Rgb> = (0..64 * 48)
        .map(|i| {
            let distance = ((i % 64) as f32 - 31.5).abs();
            Rgb::splat(1.0 - 0.5 * (-distance / 4.0).exp())
        })
        .collect();
    let part = noisy(&light, 0.05);
    let bias = |occlusion: bool| {
        let params = Params { occlusion, ..Params::new(PartKind::IndirectDiffuse) };
        let out = denoise_with(&features, &part, &params, SAMPLES, SimdLevel::detect(), 0..48);
        let at_corner = |i: &usize| (30..34).contains(&(i % 64));
        let pixels: Vec<usize> = (0..64 * 48).filter(at_corner).collect();
        pixels.iter().map(|&i| (out[i] - light[i]).x).sum::<f32>() / pixels.len() as f32
    };
    let (with, without) = (bias(true), bias(false));
    assert!(with.abs() < 0.6 * without.abs(), "{with}, without occlusion {without}");
}

#[test]
fn hard_shadows_stay_sharp() {
    // No feature shows the shadow's edge at x = 32.
    let features = plane(64, 48);
    let light: Vec<Rgb> =
        features.position.iter().map(|p| Rgb::splat(if p.x < 32.0 { 0.2 } else { 2.0 })).collect();
    let out = filter(&features, &noisy(&light, 0.05), PartKind::DirectDiffuse);
    let (error, _) = errors(&out, &light);
    assert!(error < 0.05, "{error}");
}

#[test]
fn fits_stay_within_the_light_around_them() {
    // Few pixels of each colour and normal are alike, and some are lamps.
    let mut features = plane(64, 48);
    let mut light = Vec::new();
    for i in 0..64 * 48 {
        let tilt = 0.3 * Vec3::new(noise(i, 5), noise(i, 6), noise(i, 7));
        features.normal[i] = (Vec3::Z + tilt).normalize();
        features.albedo[i] = Rgb::splat(0.5 + 0.2 * noise(i, 8));
        light.push(Rgb::splat(if noise(i, 9) > 1.8 { 200.0 } else { 0.1 }));
    }
    let part = noisy(&light, 0.01);
    let mean = part.mean(SAMPLES);
    for kind in KINDS {
        let out = filter(&features, &part, kind);
        for (i, c) in out.iter().enumerate() {
            let (x, y) = (i % 64, i / 64);
            let rows = y.saturating_sub(2)..(y + 3).min(48);
            let near = rows.flat_map(|y| mean[y * 64 + x.saturating_sub(2)..y * 64 + (x + 3).min(64)].iter());
            let (low, high) =
                near.fold((Rgb::INFINITY, Rgb::NEG_INFINITY), |(l, h), m| (l.min(*m), h.max(*m)));
            assert!(
                c.cmpge(low - 1e-4).all() && c.cmple(high * 1.0001).all(),
                "{kind:?} {i}: {c} in {low} to {high}"
            );
        }
    }
}

#[test]
fn light_without_noise_keeps_its_bits() {
    let features = plane(48, 40);
    let light: Vec<Rgb> = (0..48 * 40).map(|i| Rgb::splat(0.1 + noise(i, 9).abs())).collect();
    let part = NoisyPart { halves: [light.clone(), light.clone()], reliability: vec![1.0; light.len()] };
    for kind in KINDS {
        assert_eq!(bits(&filter(&features, &part, kind)), bits(&light), "{kind:?}");
    }
    let noisy = noisy(&light, 0.1);
    let first = denoise(&features, &noisy, PartKind::Specular, 1, SimdLevel::detect(), 0..features.height);
    assert_eq!(bits(&first), bits(&noisy.halves[0]), "one sample has no variance");
}

#[test]
fn noise_is_not_spread_beyond_its_reach() {
    let features = plane(64, 16);
    let mut part = noisy(&vec![Rgb::ONE; 64 * 16], 0.0);
    let changed = 7 * 64 + 5;
    part.halves[0][changed] = Rgb::splat(3.0);
    for kind in KINDS {
        let out = filter(&features, &part, kind);
        let reach = Params::new(kind).reach();
        for (i, c) in out.iter().enumerate().filter(|(i, _)| i % 64 > 5 + reach) {
            assert_eq!(*c, Rgb::ONE, "{kind:?}: pixel {i}");
        }
    }
}

#[test]
fn the_margin_covers_what_a_pixel_depends_on() {
    for kind in KINDS {
        assert!(Params::new(kind).dependence() <= MARGIN, "{kind:?}: {}", Params::new(kind).dependence());
    }
}

/// A curved surface with a texture and noise, of any size.
fn bumps(width: usize, height: usize) -> (Features, NoisyPart) {
    let mut features = plane(width, height);
    for (i, n) in features.normal.iter_mut().enumerate() {
        let p = features.position[i];
        *n = Vec3::new((p.x * 0.1).sin(), (p.y * 0.13).sin(), 2.0).normalize();
        features.albedo[i] = Rgb::splat(0.4 + 0.3 * noise(i / 5, 3).clamp(-1.0, 1.0));
    }
    let light: Vec<Rgb> = features.normal.iter().map(|n| Rgb::new(0.5, 0.7, 0.9) * n.z + n.x * 0.3).collect();
    let part = noisy(&light, 0.1);
    (features, part)
}

#[test]
fn crops_equal_the_whole() {
    let (width, height) = (150, 110);
    let (features, part) = bumps(width, height);
    // The crop begins at an odd row and ends anywhere.
    let (left, top, w, h) = (2, 7, 143, 101);
    let pixels: Vec<usize> = (0..w * h).map(|i| (top + i / w) * width + left + i % w).collect();
    let pick = |plane: &[Vec3]| -> Vec<Vec3> { pixels.iter().map(|i| plane[*i]).collect() };
    let crop = Features {
        width: w,
        height: h,
        origin: [left, top],
        albedo: pick(&features.albedo),
        normal: pick(&features.normal),
        position: pick(&features.position),
        coverage: vec![1.0; w * h],
    };
    let halves = [pick(&part.halves[0]), pick(&part.halves[1])];
    let crop_part = NoisyPart { halves, reliability: vec![1.0; w * h] };
    for kind in KINDS {
        let whole = filter(&features, &part, kind);
        let out = filter(&crop, &crop_part, kind);
        for y in MARGIN..h - MARGIN {
            for x in MARGIN..w - MARGIN {
                let expected = whole[(top + y) * width + left + x];
                assert_eq!(bits(&[out[y * w + x]]), bits(&[expected]), "{kind:?}: {x}, {y}");
            }
        }
    }
}

#[test]
fn threads_and_simd_levels_have_the_same_bits() {
    let (features, part) = bumps(140, 70);
    for kind in KINDS {
        let expected = bits(&filter(&features, &part, kind));
        for threads in 1..=3 {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            assert_eq!(
                bits(&pool.install(|| filter(&features, &part, kind))),
                expected,
                "{kind:?}: {threads} threads"
            );
        }
        for simd in SimdLevel::ALL.into_iter().filter(|level| level.is_supported()) {
            assert_eq!(
                bits(&denoise(&features, &part, kind, SAMPLES, simd, 0..features.height)),
                expected,
                "{kind:?}: {}",
                simd.name()
            );
        }
    }
}

#[test]
fn invalid_and_huge_light_is_not_spread() {
    let features = plane(64, 48);
    let clean = noisy(&vec![Rgb::ONE; 64 * 48], 0.1);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e20] {
        for kind in KINDS {
            let mut part = clean.clone();
            part.halves[1][20 * 64 + 30] = Rgb::new(value, 1.0, 1.0);
            let out = filter(&features, &part, kind);
            assert!(out.iter().all(|c| c.is_finite()), "{kind:?}: {value}");
            let changed = out.iter().filter(|c| (**c - Rgb::ONE).abs().max_element() > 0.5).count();
            assert!(changed <= 1, "{kind:?}: {value} changes {changed} pixels");
        }
    }
}

#[test]
fn invalid_features_are_not_spread() {
    let mut features = plane(64, 48);
    let part = noisy(&vec![Rgb::ONE; 64 * 48], 0.1);
    for (i, value) in [f32::NAN, f32::INFINITY, f32::MAX].into_iter().enumerate() {
        features.position[20 * 64 + 15 * (i + 1)].x = value;
        features.normal[30 * 64 + 15 * (i + 1)].y = value;
        features.albedo[10 * 64 + 15 * (i + 1)].y = value;
    }
    for kind in KINDS {
        let out = filter(&features, &part, kind);
        assert!(out.iter().all(|c| c.is_finite() && (*c - Rgb::ONE).abs().max_element() < 1.0), "{kind:?}");
    }
}

#[test]
fn any_size_and_brightness_is_filtered() {
    for (width, height) in [(1, 1), (1, 7), (3, 200), (200, 3), (9, 9)] {
        for brightness in [1e-20, 1.0, 1e10] {
            let features = plane(width, height);
            let part = noisy(&vec![Rgb::splat(brightness); width * height], 0.1 * brightness);
            for kind in KINDS {
                let out = filter(&features, &part, kind);
                let near = |c: &Rgb| (*c / brightness - 1.0).abs().max_element() < 0.5;
                assert!(out.iter().all(near), "{kind:?}: {width}×{height}, brightness {brightness}");
            }
        }
    }
    let none = Features::default();
    assert!(filter(&none, &NoisyPart::default(), PartKind::DirectDiffuse).is_empty());
}

#[test]
fn a_background_keeps_its_light() {
    let mut features = plane(40, 30);
    let part = noisy(&vec![Rgb::ONE; 40 * 30], 0.1);
    features.coverage[..40 * 15].fill(0.0);
    let part = NoisyPart { reliability: features.coverage.clone(), ..part };
    for kind in KINDS {
        let out = filter(&features, &part, kind);
        let (error, _) = errors(&out[40 * 15..], &vec![Rgb::ONE; 40 * 15]);
        assert!(error < 0.04, "{kind:?}: {error}");
        assert_eq!(bits(&out[..40 * 15]), bits(&part.mean(SAMPLES)[..40 * 15]), "{kind:?}");
    }
}
