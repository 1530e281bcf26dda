//! Points and lines against every primitive, and against closed forms.

use glam::{DVec3, Vec3};

use super::items::{PointItem, Ray64, RoundItem, SegmentItem, spacing};
use super::*;
use crate::{Accel, AccelSettings, AcceptAll, BuildReport};
use blinn_core::geometry::Hit;
use blinn_scene::{Instance, Material, Mesh, Node, PoseSettings, Rounds as MeshRounds, Scene, pose};

/// A reproducible number from −1 to 1.
fn number(i: u32) -> f32 {
    (i.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(2_246_822_519) >> 8) as f32 / (1 << 23) as f32
        - 1.0
}

fn vector(i: u32) -> Vec3 {
    Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2))
}

/// A scene of points and of lines.
fn scene(points: Vec<Vec3>, lines: Vec<Vec3>) -> Scene {
    let segments = (0..lines.len() as u32 / 2).map(|i| [2 * i, 2 * i + 1]).collect();
    let mesh = |positions, rounds| Mesh { positions, rounds, ..Mesh::default() };
    let meshes = vec![mesh(points, MeshRounds::Points), mesh(lines, MeshRounds::Lines(segments))];
    let instance = |mesh| Instance { node: 0, mesh, object: 1, ..Instance::default() };
    Scene {
        meshes,
        materials: vec![Material::default()],
        nodes: vec![Node { visible: true, ..Node::default() }],
        instances: vec![instance(0), instance(1)],
        ..Scene::default()
    }
}

/// Rays from around the scene to points in it.
fn rays(count: u32, rounds: RoundSizes) -> RayBatch {
    let mut rays = RayBatch { rounds, ..RayBatch::default() };
    for i in 0..count {
        let o = vector(7 * i + 3).normalize_or(Vec3::X) * 4.0;
        rays.push(o, (vector(5 * i + 1) - o) * 0.5);
    }
    rays
}

/// The last two contain the origins of many rays.
const SIZES: [RoundSize; 5] = [
    RoundSize { in_scene: 0.02, min: 0.0, max: f32::INFINITY },
    RoundSize { in_scene: 0.0, min: 0.004, max: 0.004 },
    RoundSize { in_scene: 0.03, min: 0.002, max: 0.005 },
    RoundSize { in_scene: 3.9, min: 0.0, max: f32::INFINITY },
    RoundSize { in_scene: 0.0, min: 1.9, max: 1.9 },
];

#[test]
fn bvhs_find_the_same_hits_as_trying_all() {
    let points: Vec<Vec3> = (0..3000).map(vector).collect();
    let lines: Vec<Vec3> =
        (0..1500).flat_map(|i| [vector(i + 9000), vector(i + 9000) + 0.2 * vector(i)]).collect();
    let scene = scene(points, lines);
    let posed = pose(&scene, &PoseSettings::default()).unwrap();
    let rounds = Rounds::build(&posed, &CancelToken::default()).unwrap().unwrap();
    let (mut found, mut behind) = (0, 0);
    for size in SIZES {
        let mut batch = rays(400, RoundSizes { points: size, lines: size });
        for _ in 0..2 {
            let mut hits = vec![Hit::MISS; batch.len()];
            rounds.intersect(SimdLevel::default(), &batch, &AcceptAll, &mut hits);
            let any = rounds.hit_any(SimdLevel::default(), &batch, &AcceptAll);
            assert!(any.iter().zip(&hits).all(|(any, hit)| *any != hit.is_miss()));
            for (i, hit) in hits.iter().enumerate() {
                let (o, d) = (batch.origins[i].as_dvec3(), batch.directions[i].as_dvec3());
                let ray = Ray64 { o, d, dd: d.length_squared() };
                let all = |item: &dyn Fn() -> Option<f64>, id: u32| {
                    let t = item()? as f32;
                    let hit = Hit { t, id: rounds.ids.hit_id(id).0 };
                    (t > 0.0 && batch.after(i).before(&hit)).then_some(hit)
                };
                let of_points = rounds.points.items().iter().map(|p| all(&|| p.enter(&ray, &size), p.id));
                let of_lines = rounds.lines.items().iter().map(|l| all(&|| l.enter(&ray, &size), l.id));
                let first =
                    of_points.chain(of_lines).flatten().reduce(|a, b| if b.before(&a) { b } else { a });
                assert_eq!(*hit, first.unwrap_or(Hit::MISS), "ray {i}");
                found += usize::from(!hit.is_miss());
                behind += usize::from(!hit.is_miss() && !batch.after.is_empty());
            }
            let hit: Vec<usize> = (0..hits.len()).filter(|&i| !hits[i].is_miss()).collect();
            batch.continue_behind(&hit, &hits);
        }
    }
    assert!(found > 500 && behind > 100, "{found} {behind}");
}

/// Rays with short directions through a grid of side 0.2 about the origin, from a common origin or in a common direction.
fn bundle(count: u32, o: Vec3, is_parallel: bool, rounds: RoundSizes) -> RayBatch {
    let mut rays = RayBatch { rounds, ..RayBatch::default() };
    for i in 0..count {
        let at = |k: u32| 0.2 * ((k as f32 + 0.5) / 8.0 - 0.5);
        let target = Vec3::new(at(i % 8), at(i / 8 % 8), 0.05 * at(i % 3));
        if is_parallel {
            rays.push(target - 2.0 * o, 0.007 * o);
        } else {
            rays.push(o, (target - o) * (0.01 + 0.01 * at(i % 5)));
        }
    }
    rays
}

/// Neighbouring rays are traced as packets, the last of which has fewer rays, from outside and inside of the cloud.
#[test]
fn packets_find_the_same_hits_as_single_rays() {
    let points: Vec<Vec3> = (0..4000).map(|i| vector(i) * 0.5).collect();
    let ends = (0..2000).flat_map(|i| [vector(i + 9000) * 0.5, vector(i + 9000) * 0.5 + 0.1 * vector(i)]);
    let scene = scene(points, ends.collect());
    let posed = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }).unwrap();
    let rounds = Rounds::build(&posed, &CancelToken::default()).unwrap().unwrap();
    let sizes = [
        RoundSize::in_scene(0.004),
        // Contains many origins.
        RoundSize::in_scene(0.09),
        RoundSize { in_scene: 0.0, min: 2e-5, max: 2e-5 },
        RoundSize { in_scene: 0.01, min: 2e-5, max: 5e-5 },
    ];
    let origins = [Vec3::new(1.1, 0.4, 1.5), Vec3::new(0.0, 0.0, -2.0), Vec3::new(0.25, 0.35, 0.4)];
    let levels = || SimdLevel::ALL.into_iter().filter(|level| level.is_supported());
    let (mut found, mut missed) = (0, 0);
    for (size, o) in sizes.into_iter().flat_map(|size| origins.map(|o| (size, o))) {
        for (count, is_parallel) in [(64, false), (41, false), (5, false), (61, true)] {
            let mut batch = bundle(count, o, is_parallel, RoundSizes { points: size, lines: size });
            for t_max in [f32::INFINITY, 90.0] {
                batch.t_max = t_max;
                let mut alone = vec![Hit::MISS; batch.len()];
                let mut stats = vec![TraversalStats::default(); batch.len()];
                rounds.intersect_with_stats(SimdLevel::default(), &batch, &AcceptAll, &mut alone, &mut stats);
                for level in levels() {
                    let mut hits = vec![Hit::MISS; batch.len()];
                    rounds.intersect(level, &batch, &AcceptAll, &mut hits);
                    assert_eq!(hits, alone, "{level:?} {size:?} {o} {count} {is_parallel}");
                    let any = rounds.hit_any(level, &batch, &AcceptAll);
                    assert!(any.iter().zip(&hits).all(|(any, hit)| *any != hit.is_miss()));
                }
                found += alone.iter().filter(|hit| !hit.is_miss()).count();
                missed += alone.iter().filter(|hit| hit.is_miss()).count();
                let hit: Vec<usize> = (0..alone.len()).filter(|&i| !alone[i].is_miss()).collect();
                batch.continue_behind(&hit, &alone);
            }
        }
    }
    assert!(found > 1000 && missed > 100, "{found} {missed}");
}

/// The bounds of leaves and of their items hold for directions of any length, far from the origin and near it.
#[test]
fn long_and_short_directions_hit_the_same() {
    for extent in [1e-3, 1.0, 1e4] {
        let points: Vec<Vec3> = (0..2000).map(|i| vector(i) * extent).collect();
        let ends = (0..1000).flat_map(|i| [vector(i + 9000), vector(i + 9000) + 0.2 * vector(i)]);
        let scene = scene(points, ends.map(|p| p * extent).collect());
        let posed =
            pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }).unwrap();
        let rounds = Rounds::build(&posed, &CancelToken::default()).unwrap().unwrap();
        let size = RoundSize::in_scene(0.02 * extent);
        let ids = |scale: f32| {
            let mut batch = rays(300, RoundSizes { points: size, lines: size });
            batch.origins.iter_mut().for_each(|o| *o *= extent);
            batch.directions.iter_mut().for_each(|d| *d *= extent * scale);
            let mut hits = vec![Hit::MISS; batch.len()];
            rounds.intersect(SimdLevel::default(), &batch, &AcceptAll, &mut hits);
            hits.iter().map(|hit| hit.id).collect::<Vec<_>>()
        };
        let expected = ids(1.0);
        assert!(expected.iter().filter(|id| **id != HitId::NONE).count() > 50);
        // Powers of two scale without rounding.
        for scale in [-80, 40, 100] {
            assert!(ids(2.0f32.powi(scale)) == expected, "{extent} 2^{scale}");
        }
    }
}

#[test]
fn spheres_and_capsules_are_entered_where_closed_forms_say() {
    let ray = |y: f64| {
        let d = DVec3::new(0.0, 0.0, -2.0);
        Ray64 { o: DVec3::new(0.0, y, 10.0), d, dd: d.length_squared() }
    };
    let size = RoundSize::in_scene(0.5);
    let point = PointItem { p: Vec3::ZERO, id: 0 };
    let along = SegmentItem { a: Vec3::new(-3.0, 0.0, 0.0), b: Vec3::new(3.0, 0.0, 0.0), id: 0 };
    let to_eye = SegmentItem { a: Vec3::new(0.0, 0.0, -3.0), b: Vec3::new(0.0, 0.0, 2.0), id: 0 };
    for y in [0.0f64, 0.1, 0.3, 0.49] {
        let front = |z: f64| (10.0 - z - (0.25 - y * y).sqrt()) / 2.0;
        for (t, expected) in [
            (point.enter(&ray(y), &size), front(0.0)),
            (along.enter(&ray(y), &size), front(0.0)),
            (to_eye.enter(&ray(y), &size), front(2.0)),
        ] {
            assert!((t.unwrap() - expected).abs() < 1e-12, "{y}: {t:?} {expected}");
        }
    }
    for item in [along, to_eye] {
        assert_eq!(item.enter(&ray(0.5001), &size), None);
    }
    // Half a pixel at t is min · t: the same share of the view at every distance.
    let cone = RoundSize { in_scene: 0.0, min: 0.05, max: 0.05 };
    let far = PointItem { p: Vec3::new(0.0, 0.0, -90.0), id: 0 };
    let near_hit = |y: f64| point.enter(&ray(y), &cone).is_some();
    let far_hit = |y: f64| far.enter(&ray(y), &cone).is_some();
    assert!(near_hit(0.249) && !near_hit(0.251) && far_hit(2.49) && !far_hit(2.51));
}

#[test]
fn bad_points_and_lines_are_left_out_and_dots_are_hit() {
    let far = Vec3::splat(1e30);
    let points = vec![Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, far, Vec3::ZERO];
    let lines = vec![Vec3::X, Vec3::X, Vec3::X, Vec3::NAN, far, Vec3::X];
    let scene = scene(points, lines);
    let posed = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }).unwrap();
    let (accel, report) = Accel::build(&posed, &AccelSettings::default());
    // The coincident point is behind the first one for every ray.
    assert_eq!(accel.round_counts(), [1, 1]);
    assert_eq!((report.non_finite_rounds, BuildReport::count_degenerate(&posed).non_finite_rounds), (5, 5));
    let size = RoundSize::in_scene(0.1);
    let mut rays = RayBatch { rounds: RoundSizes { points: size, lines: size }, ..RayBatch::default() };
    rays.push(Vec3::Z * 3.0, -Vec3::Z);
    rays.push(Vec3::Z * 3.0 + Vec3::X, -Vec3::Z);
    rays.push(Vec3::Z * 3.0 + Vec3::Y, -Vec3::Z);
    // From inside and behind.
    rays.push(Vec3::ZERO, -Vec3::Z);
    rays.push(Vec3::Z * 3.0, Vec3::ZERO);
    let mut hits = Vec::new();
    accel.intersect(&rays, &AcceptAll, &mut hits);
    let hit = |instance, triangle| Hit { t: 2.9, id: HitId { instance, triangle } };
    assert_eq!(hits, [hit(0, 0), hit(1, 0), Hit::MISS, Hit::MISS, Hit::MISS]);
    rays.continue_behind(&[0], &hits);
    accel.intersect(&rays, &AcceptAll, &mut hits);
    assert_eq!(hits, [Hit::MISS]);
}

/// Rays that go on behind a transparent point find those of the same place, one after the other.
#[test]
fn coincident_points_are_kept_where_they_blend() {
    let mut scene = scene(vec![Vec3::ZERO; 3], Vec::new());
    scene.materials[0].alpha_mode = AlphaMode::Blend;
    let posed = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    assert_eq!(accel.round_counts(), [3, 0]);
    let size = RoundSize::in_scene(0.1);
    let mut rays = RayBatch { rounds: RoundSizes { points: size, lines: size }, ..RayBatch::default() };
    rays.push(Vec3::Z * 3.0, -Vec3::Z);
    let mut hits = Vec::new();
    for triangle in 0..3 {
        accel.intersect(&rays, &AcceptAll, &mut hits);
        assert_eq!(hits, [Hit { t: 2.9, id: HitId { instance: 0, triangle } }]);
        rays.continue_behind(&[0], &hits);
    }
}

/// Many points in one place are as quick as one: of each place, the first is left.
#[test]
fn coincident_opaque_points_are_one() {
    let points = (0..100_000).map(|i| Vec3::splat((i % 2) as f32)).collect();
    let scene = scene(points, Vec::new());
    let posed = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }).unwrap();
    let (accel, report) = Accel::build(&posed, &AccelSettings::default());
    assert_eq!((accel.round_counts(), report.non_finite_rounds), ([2, 0], 0));
}

#[test]
fn the_spacing_of_a_grid_is_its_cell() {
    let grid = |count: u32| (0..count).map(|i| Vec3::new((i % 64) as f32, (i / 64) as f32, 0.0) * 0.25);
    let items = |points: Vec<Vec3>| {
        RoundBvh::build((0..).zip(points).map(|(id, p)| PointItem { p, id }).collect(), |_, _| false)
    };
    let of = |points: Vec<Vec3>| spacing(items(points).items());
    assert_eq!(of(grid(4096).collect()), Some(0.25));
    // A far outlier and repeated points change nothing.
    let repeated = grid(4096).flat_map(|p| [p; 2]).chain([Vec3::splat(1e6)]).collect();
    assert_eq!(of(repeated), Some(0.25));
    assert_eq!(of(vec![Vec3::ONE; 100]), None);
    assert_eq!(of(grid(4).collect()), None);
}

#[test]
fn bvhs_do_not_depend_on_threads() {
    let points: Vec<PointItem> = (0..50_000).map(|id| PointItem { p: vector(id), id }).collect();
    let ids = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let bvh = pool.install(|| RoundBvh::build(points.clone(), |_, _| false));
        bvh.items().iter().map(|point| point.id).collect::<Vec<u32>>()
    };
    let one = ids(1);
    assert!(one == ids(2) && one == ids(7));
}

/// The share of a grid of parallel rays over a square of side 4 that hit, as an area.
fn covered_area(scene: &Scene, size: RoundSize) -> f64 {
    const SIDE: u32 = 400;
    let posed = pose(scene, &PoseSettings::default()).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let mut rays = RayBatch { rounds: RoundSizes { points: size, lines: size }, ..RayBatch::default() };
    for i in 0..SIDE * SIDE {
        let at = |k: u32| (f64::from(k) + 0.5) * 4.0 / f64::from(SIDE) - 2.0;
        rays.push(Vec3::new(at(i % SIDE) as f32, at(i / SIDE) as f32, 5.0), -Vec3::Z);
    }
    let mut hits = Vec::new();
    accel.intersect(&rays, &AcceptAll, &mut hits);
    let count = hits.iter().filter(|hit| !hit.is_miss()).count();
    16.0 * count as f64 / f64::from(SIDE * SIDE)
}

#[test]
fn spheres_and_capsules_cover_the_area_of_discs_and_stadiums() {
    use std::f64::consts::PI;
    let size = RoundSize::in_scene(0.5);
    let sphere = scene(vec![Vec3::new(0.3, -0.2, 1.0)], Vec::new());
    let capsule = scene(Vec::new(), vec![Vec3::new(-1.0, 0.3, 0.0), Vec3::new(0.8, -0.5, -2.0)]);
    let length = f64::hypot(1.8, 0.8);
    for (scene, expected) in [(sphere, PI * 0.25), (capsule, length + PI * 0.25)] {
        let area = covered_area(&scene, size);
        assert!((area / expected - 1.0).abs() < 0.003, "{area} {expected}");
    }
}

/// Only sizes in metres are there for shadow rays, and no ray hits what it starts on.
#[test]
fn solid_points_and_lines_block_shadow_rays() {
    let scene = scene(vec![Vec3::ZERO], vec![Vec3::new(2.0, -1.0, 0.0), Vec3::new(2.0, 1.0, 0.0)]);
    let posed = pose(&scene, &PoseSettings { centre: Some(DVec3::ZERO), ..PoseSettings::default() }).unwrap();
    let (mut accel, _) = Accel::build(&posed, &AccelSettings::default());
    let point = HitId { instance: 0, triangle: 0 };
    let mut rays = ShadowRayBatch::default();
    for (x, source) in
        [(0.0, HitId::NONE), (0.4, HitId::NONE), (0.6, HitId::NONE), (2.0, HitId::NONE), (0.0, point)]
    {
        rays.push(Vec3::new(x, 0.5 * x.min(0.1), -3.0), Vec3::new(x, 0.0, 3.0), source);
    }
    let occluded = |accel: &Accel, rays: &ShadowRayBatch| {
        let (mut occluded, mut transmittance) = (Vec::new(), Vec::new());
        accel.occluded(rays, &AcceptAll, &mut occluded);
        accel.transmittance(rays, &AcceptAll, &mut transmittance);
        assert!(occluded.iter().zip(&transmittance).all(|(dark, light)| *dark == (light.x == 0.0)));
        occluded
    };
    assert_eq!(occluded(&accel, &rays), [false; 5]);
    let size = RoundSize::in_scene(0.5);
    accel.set_solid_rounds(RoundSizes { points: size, lines: size });
    assert_eq!(occluded(&accel, &rays), [true, true, false, true, false]);
    // The light is nearer, or in the other direction.
    let shorter = ShadowRayBatch { to: vec![Vec3::new(0.0, 0.0, -1.0); 5], ..rays.clone() };
    assert_eq!(occluded(&accel, &shorter), [false; 5]);
    let away = ShadowRayBatch { coherence: Coherence::Direction(-Vec3::Z), ..rays.clone() };
    assert_eq!(occluded(&accel, &away), [false; 5]);
    let toward = ShadowRayBatch { coherence: Coherence::Direction(Vec3::Z), ..rays };
    assert_eq!(occluded(&accel, &toward), [true, true, false, true, false]);
    // Secondary rays meet them, too.
    let mut secondary = RayBatch::default();
    secondary.push(Vec3::Z * 3.0, -Vec3::Z);
    let mut hits = Vec::new();
    accel.intersect(&secondary, &AcceptAll, &mut hits);
    assert_eq!(hits, [Hit { t: 2.5, id: point }]);
}
