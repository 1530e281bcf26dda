//! Degenerate geometry and rays: nothing panics or hangs, invalid triangles are left out and counted, valid
//! ones are still hit.

use std::time::{Duration, Instant};

use blinn::accel::{Accel, AccelSettings, BuildReport, Coherence, Preset, RayBatch, ShadowRayBatch};
use blinn::geometry::{Hit, HitId};
use blinn::scene::{Mesh, PoseSettings, Scene, pose};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::scenes::{self, Plain};

/// Not recentred: invalid vertices would move the valid ones.
fn build(scene: &Scene) -> (Accel, BuildReport) {
    let at = PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() };
    let posed = pose(scene, &at).unwrap();
    let (accel, report) = Accel::build(&posed, &AccelSettings::default());
    // The report does not depend on the BVH.
    assert_eq!(
        BuildReport { coincident: report.coincident, ..BuildReport::count_degenerate(&posed) },
        report
    );
    (accel, report)
}

fn shoot(accel: &Accel, o: Vec3, d: Vec3) -> Hit {
    let mut batch = RayBatch::default();
    batch.push(o, d);
    let mut hits = Vec::new();
    accel.intersect(&batch, &Plain, &mut hits);
    hits[0]
}

const DOWN: (Vec3, Vec3) = (Vec3::new(0.1, 0.2, 4.0), Vec3::new(0.0, 0.0, -2.0));

#[test]
fn degenerate_triangles_are_rejected_and_counted() {
    for twice in [1, 2] {
        let mut mesh = scenes::grid(4, 2);
        let good = mesh.triangles.len() as u32;
        let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e20, -3e38];
        for x in bad {
            mesh.positions.push(Vec3::new(0.1, x, 0.2));
            mesh.triangles.push([0, 7, mesh.positions.len() as u32 - 1]);
        }
        mesh.triangles.extend([[3, 3, 9], [1, 1, 1], [0, 1, 2]]);
        let placed = [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::X * 5.0)];
        let (accel, report) = build(&scenes::scene(mesh, &placed[..twice]));
        let times = twice as u64;
        assert_eq!(
            report,
            BuildReport { non_finite: 5 * times, zero_area: 3 * times, ..BuildReport::default() }
        );
        let hit = shoot(&accel, DOWN.0, DOWN.1);
        assert!(hit.t == 2.0 && hit.id.triangle < good, "{hit:?}");
        assert_eq!(accel.stats().triangles, good as usize * twice);
    }
}

#[test]
fn degenerate_transforms_hide_only_their_instance() {
    let nan = DAffine3::from_translation(DVec3::splat(f64::NAN));
    let (accel, report) = build(&scenes::scene(scenes::grid(4, 2), &[DAffine3::IDENTITY, nan]));
    assert_eq!(report.non_finite, 32);
    assert_eq!(shoot(&accel, DOWN.0, DOWN.1).id.instance, 0);
    let flat = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0));
    let line = DAffine3::from_scale(DVec3::new(1.0, 0.0, 0.0));
    let (accel, report) = build(&scenes::scene(scenes::grid(4, 2), &[flat, flat, line]));
    // A triangle without area is left out.
    assert_eq!(report, BuildReport { coincident: 32, ..BuildReport::default() });
    assert!(shoot(&accel, DOWN.0, DOWN.1).t == 2.0);
    let huge = DAffine3::from_scale(DVec3::splat(1e30));
    let (_, report) = build(&scenes::scene(scenes::grid(4, 2), &[huge, huge]));
    assert_eq!(report.non_finite, 64);
}

fn many(n: u32, corners: impl Fn(u32) -> [Vec3; 3]) -> Mesh {
    scenes::mesh((0..n).flat_map(corners).collect(), (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Limit for the time of a hundred thousand triangles that coincide, relative to that of as many that do not. Both are the best
/// of up to five attempts, since other tests run at the same time.
const PLENTY: u32 = 8;

/// Coincident triangles are grouped: without that, the first case takes 19 s and overflows the stack.
#[test]
fn a_hundred_thousand_coincident_triangles_build_fast() {
    let one = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(3.0, -1.0, 0.0), Vec3::new(-1.0, 3.0, 0.0)];
    let n = 100_000;
    let same = many(n, |_| one);
    let turned = many(n, |i| [one[i as usize % 3], one[(i as usize + 1) % 3], one[(i as usize + 2) % 3]]);
    let clusters = many(n, |i| one.map(|p| p + (i % 10) as f32 * Vec3::Z * 0.1));
    // Different triangles with equal bounding boxes.
    let boxed = many(n, |i| [one[0], Vec3::new(3.0, 3.0, 0.0), Vec3::new(-1.0 + i as f32 * 1e-5, 3.0, 0.0)]);
    let grid = many(n, |i| one.map(|p| 0.01 * p + Vec3::new((i % 300) as f32, (i / 300) as f32, 0.0)));
    let mut ordinary = Duration::ZERO;
    for (name, mesh, places) in [
        ("ordinary", grid, n),
        ("same", same, 1),
        ("turned", turned, 1),
        ("clusters", clusters, 10),
        ("boxed", boxed, n),
    ] {
        for placed in [1, 2] {
            let scene = scenes::scene(mesh.clone(), &[DAffine3::IDENTITY; 2][..placed]);
            let mut batch = RayBatch { t_max: 1e9, ..RayBatch::default() };
            for i in 0..if name == "boxed" { 3 } else { 50 } {
                batch.push(Vec3::new(0.1, 0.2, 5.0 + i as f32), Vec3::NEG_Z);
            }
            let mut hits = Vec::new();
            let mut attempt = || {
                let start = Instant::now();
                let (accel, report) = build(&scene);
                accel.intersect(&batch, &Plain, &mut hits);
                (start.elapsed(), report)
            };
            let (mut took, report) = attempt();
            if name == "ordinary" {
                ordinary = (1..5).fold(took, |best, _| best.min(attempt().0));
                continue;
            }
            for _ in 1..5 {
                if took >= PLENTY * ordinary {
                    took = attempt().0;
                }
            }
            assert!(took < PLENTY * ordinary, "{name}: {took:?}, as many others {ordinary:?}");
            if name != "boxed" {
                assert!(!hits[0].is_miss());
                assert_eq!(report.coincident, u64::from(n) * placed as u64 - u64::from(places));
            }
        }
    }
}

/// Next-hit queries return every one of many coincident triangles.
#[test]
fn all_coincident_triangles_are_hit() {
    let corner = [Vec3::NEG_ONE.with_z(0.0), Vec3::new(3.0, -1.0, 0.0), Vec3::new(-1.0, 3.0, 0.0)];
    let scene = scenes::scene(many(1000, |_| corner), &[DAffine3::IDENTITY; 2]);
    let (accel, _) = build(&scene);
    let mut batch = RayBatch::default();
    batch.push(DOWN.0, DOWN.1);
    let mut hits = Vec::new();
    for i in 0..2000 {
        accel.intersect(&batch, &Plain, &mut hits);
        assert_eq!(hits[0], Hit { t: 2.0, id: HitId { instance: i / 1000, triangle: i % 1000 } });
        batch.after = hits.clone();
    }
    accel.intersect(&batch, &Plain, &mut hits);
    assert!(hits[0].is_miss());
}

#[test]
fn empty_scenes_and_single_triangles() {
    let (accel, report) = build(&Scene::default());
    assert_eq!((report, accel.stats().triangles), Default::default());
    assert!(shoot(&accel, DOWN.0, DOWN.1).is_miss());
    let (accel, _) = build(&scenes::scene(Mesh::default(), &[DAffine3::IDENTITY; 3]));
    assert!(shoot(&accel, DOWN.0, DOWN.1).is_miss());
    let one = many(1, |_| [Vec3::NEG_ONE.with_z(0.0), Vec3::X, Vec3::Y]);
    for instances in 1..4 {
        let (accel, _) = build(&scenes::scene(one.clone(), &[DAffine3::IDENTITY; 3][..instances]));
        assert_eq!(shoot(&accel, DOWN.0, DOWN.1).t, 2.0);
        assert!(shoot(&accel, -DOWN.0, DOWN.1).is_miss());
    }
}

/// Rays whose origin or direction is NaN, infinite or zero, or at the limits of f32.
#[test]
fn invalid_rays_miss() {
    for placed in [1, 2] {
        let (accel, _) = build(&scenes::scene(scenes::sphere(4), &[DAffine3::IDENTITY; 2][..placed]));
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        for x in odd {
            for k in 0..3 {
                let mut v = [0.5; 3];
                v[k] = x;
                assert!(shoot(&accel, Vec3::from(v), Vec3::X).is_miss());
                assert!(shoot(&accel, Vec3::ZERO, Vec3::from(v)).is_miss());
                let mut segments =
                    ShadowRayBatch { coherence: Coherence::Direction(Vec3::from(v)), ..Default::default() };
                segments.push(Vec3::ZERO, Vec3::ZERO, HitId::NONE);
                let mut out = Vec::new();
                accel.occluded(&segments, &Plain, &mut out);
                assert_eq!(out, [false]);
            }
        }
        assert!(shoot(&accel, Vec3::ZERO, Vec3::ZERO).is_miss());
        assert!(shoot(&accel, Vec3::ZERO, -Vec3::ZERO).is_miss());
        // Directions of any finite length are valid.
        for size in [1e-37, 1e-30, 1e30, 1e38] {
            for d in [Vec3::X, Vec3::new(0.3, -0.0, 0.9), Vec3::new(1e-7, 1.0, 0.0)] {
                assert!(!shoot(&accel, Vec3::ZERO, d * size).is_miss(), "{d} × {size}");
            }
        }
        shoot(&accel, Vec3::splat(3e38), Vec3::NEG_ONE);
        assert!(shoot(&accel, Vec3::ZERO, Vec3::new(f32::from_bits(1), 0.0, 0.0)).is_miss());
        // No hit is closer than a NaN limit.
        let mut batch = RayBatch { t_max: f32::NAN, ..RayBatch::default() };
        batch.push(Vec3::ZERO, Vec3::X);
        let mut hits = Vec::new();
        accel.intersect(&batch, &Plain, &mut hits);
        assert!(hits[0].is_miss());
    }
}

/// Packets with directions of any length, some of them invalid, return the same hits as single rays.
#[test]
fn invalid_directions_do_not_affect_their_packet() {
    let scene = scenes::scene(scenes::sphere(5), &[DAffine3::IDENTITY]);
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let o = Vec3::new(0.3, 0.2, 3.0);
    let rays: Vec<Vec3> = (0..64)
        .map(|i| Vec3::new((i % 8) as f32, (i / 8) as f32, 0.0) * 0.02 - Vec3::new(0.4, 0.3, 2.5))
        .collect();
    let mut found = 0;
    for simd in scenes::simd_levels() {
        let (accel, _) = Accel::build(&posed, &AccelSettings { simd, ..Default::default() });
        let mut check = |directions: &[Vec3]| {
            let ask = |shared: Coherence| {
                let mut batch = RayBatch { coherence: shared, ..RayBatch::default() };
                directions.iter().for_each(|&d| batch.push(o, d));
                let mut hits = Vec::new();
                accel.intersect(&batch, &Plain, &mut hits);
                hits
            };
            let hits = ask(Coherence::Origin(o));
            assert_eq!(hits, ask(Coherence::None), "{directions:?}");
            found += hits.iter().filter(|hit| !hit.is_miss()).count();
        };
        for size in [1e-37, 1e-30, 1e-12, 1e-4, 2e-4, 1.0, 4e3, 5e3, 1e12, 1e30, 1e37] {
            check(&rays.iter().map(|d| d * size).collect::<Vec<_>>());
        }
        // Unrelated lengths.
        check(&rays.iter().zip(-31..).map(|(d, i)| d * 2f32.powi(i)).collect::<Vec<_>>());
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0] {
            for place in [0, 17, 63] {
                for axis in 0..4 {
                    let mut some = rays.clone();
                    match axis {
                        3 => some[place] = Vec3::splat(odd),
                        _ => some[place][axis] = odd,
                    }
                    check(&some);
                }
            }
        }
    }
    assert!(found > 1000, "{found}");
}

/// The hit that all BVH presets and SIMD levels agree on, for triangles far larger than scenes. The others
/// make a BVH of more than one leaf.
fn huge(triangle: [Vec3; 3], others: [Vec3; 3], o: Vec3, d: Vec3) -> Hit {
    let all = many(24, |i| if i == 7 { triangle } else { others.map(|v| v * (1.0 + i as f32 / 64.0)) });
    let scene = scenes::scene(all, &[DAffine3::IDENTITY]);
    let posed = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..Default::default() }).unwrap();
    let mut answers = Vec::new();
    for preset in [Preset::BruteForce, Preset::Fast, Preset::Medium, Preset::Slow] {
        for simd in scenes::simd_levels() {
            let (accel, _) = Accel::build(&posed, &AccelSettings { preset, simd, ..Default::default() });
            answers.push(shoot(&accel, o, d));
            for shared in [Coherence::Origin(o), Coherence::Direction(d)] {
                let mut batch = RayBatch { coherence: shared, ..RayBatch::default() };
                (0..64).for_each(|_| batch.push(o, d));
                let mut hits = Vec::new();
                accel.intersect(&batch, &Plain, &mut hits);
                answers.extend(hits);
            }
        }
    }
    assert!(answers.iter().all(|hit| *hit == answers[0]), "{answers:?}");
    answers[0]
}

/// The product of three lengths of 1e13 overflows f32: depths were infinite, and hits lay behind the ray.
#[test]
fn depths_that_overflow_f32_are_tested_in_f64() {
    let triangle = [
        Vec3::new(1.164e12, 0.0, 3.492e12),
        Vec3::new(-4.656e12, -5.046e12, -5.245e12),
        Vec3::new(-2.328e12, 7.458e12, -3.492e12),
    ];
    let aside = triangle.map(|v| v * Vec3::new(0.5, 0.5, -0.5) + Vec3::new(8e12, -2e13, 1e13));
    let hit = huge(triangle, aside, Vec3::new(0.5, 2.0, 3.5), Vec3::new(-1.44, 1.5, 1.0));
    assert_eq!(hit.id.triangle, 7);
    assert!((hit.t / 4.36e11 - 1.0).abs() < 1e-2, "{hit:?}");
}

/// From a distance of 1e18, the edge functions of a triangle of 1e11 by .02 are below the rounding error of
/// f64. The ray misses it by the whole distance.
#[test]
fn triangles_below_f64_precision_are_not_hit_outside_their_bounds() {
    let thin = [
        Vec3::new(1e18, 1.5, -1.277832),
        Vec3::new(1e18, 1.5, -1.2993164),
        Vec3::new(9.999989e17, 1.4946289, -1.2939453),
    ];
    let aside = [Vec3::new(-1.0, 9.0, 2.0), Vec3::new(-3.0, 8.0, 2.0), Vec3::new(-2.0, 9.0, 4.0)];
    let o = Vec3::new(-3.68, -1.36, -1.0);
    assert!(huge(thin, aside, o, Vec3::ONE).is_miss());
}

/// Far away along one axis, f64 cannot tell the edge functions of a triangle of 1e-32 from zero. Across that
/// axis the ray clearly misses, and so must every BVH.
#[test]
fn distant_triangles_below_f64_precision_are_not_hit_outside_their_bounds() {
    let tiny = [
        Vec3::new(3.347_341_8e-32, -2.677_873_4e-32, 2.677_873_4e-32),
        Vec3::new(-6.348_181_6e-33, 5.355_747e-32, 8.033_62e-32),
        Vec3::new(2.488_931_8e-32, 0.0, 1.338_936_7e-32),
    ];
    let aside = [Vec3::new(9.0, 9.0, 2.0), Vec3::new(8.0, 8.0, 2.0), Vec3::new(9.0, 9.0, 4.0)];
    let o = Vec3::new(2.677_873_4e-32, 2.677_873_4e-32, -5_688.127_4);
    let d = Vec3::new(3.369_530_2e-20, 3.369_530_2e-20, 0.087_949_984);
    assert!(huge(tiny, aside, o, d).is_miss());
}

/// The quotient of an origin's coordinate and the smallest direction overflows f32, too: a fused
/// multiply-subtract then placed the exit of the box before its entry.
#[test]
fn axis_aligned_rays_enter_boxes_from_any_distance() {
    let upright = [
        Vec3::new(1.4946289, 0.27661133, 1e18),
        Vec3::new(2.5, -3.7579346, -0.43103027),
        Vec3::new(-2.6763916, -3.0, -2.3046875),
    ];
    let aside = [Vec3::new(9.0, 9.0, 2.0), Vec3::new(8.0, 8.0, 2.0), Vec3::new(9.0, 9.0, 4.0)];
    let o = Vec3::new(1.4990234, -3.526001, 4.2687242e8);
    for d in [Vec3::new(0.115600586, -2.0, 0.0), Vec3::new(1.2834473, -1.5635986, -0.0)] {
        let hit = huge(upright, aside, o, d);
        assert!(hit.id.triangle == 7 && hit.t > 0.04 && hit.t < 0.07, "{hit:?}");
    }
}
