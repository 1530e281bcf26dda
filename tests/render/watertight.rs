//! Watertightness: no ray passes between adjacent triangles, at any scale, distance and angle, in the world
//! BVH and in instanced ones. All counts are exact.

use blinn::accel::{Accel, AccelSettings, Coherence, FlattenBudget, RayBatch};
use blinn::geometry::HitId;
use blinn::scene::PosedScene;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::common::scenes::{self, Placement, Plain, Rng};

/// Returns the number of `rays` that do not hit `instance`.
fn count_misses(
    accel: &Accel,
    instance: u32,
    coherence: Coherence,
    rays: impl Iterator<Item = (Vec3, Vec3)>,
) -> u64 {
    let mut batch = RayBatch { coherence, ..RayBatch::default() };
    for (o, d) in rays {
        batch.push(o, d);
    }
    let mut hits = Vec::new();
    accel.intersect(&batch, &Plain, &mut hits);
    assert_eq!(hits.len(), batch.len());
    hits.iter().filter(|hit| hit.id.instance != instance).count() as u64
}

/// A direction from `o` to within 2 ulps of a vertex, or to a point on an edge from it.
fn direction_towards(o: Vec3, from: Vec3, to: Vec3, along: f64, rng: &mut Rng) -> Vec3 {
    let (o, from, to) = (o.as_dvec3(), from.as_dvec3(), to.as_dvec3());
    let length = if rng.one_in(2) { 1.0 } else { 0.2 + rng.unit() };
    if rng.one_in(2) {
        let d = ((from - o) * length).as_vec3().to_array();
        Vec3::from(d.map(|x| scenes::ulps(x, rng.below(5) as i32 - 2)))
    } else {
        ((from.lerp(to, along * rng.unit()) - o) * length).as_vec3()
    }
}

/// Traces `count` rays from inside a closed mesh at its edges and vertices.
fn count_leaks(posed: &PosedScene, accel: &Accel, size: f64, count: u64) -> u64 {
    let triangles = posed.mesh(0).triangles.len();
    let centre = posed.instances[0].transform.affine.translation;
    let chunk = 5000;
    assert_eq!(count % chunk, 0);
    let trace_chunk = |seed: u64| {
        let mut rng = Rng::new(seed);
        let rays = (0..chunk).map(|_| {
            let o = (centre + rng.in_cube() * 0.5 * size).as_vec3();
            let triangle = rng.below(triangles) as u32;
            let v = posed.world_triangle(HitId { instance: 0, triangle });
            let edge = rng.below(3);
            (o, direction_towards(o, v[edge], v[(edge + 1) % 3], 1.0, &mut rng))
        });
        count_misses(accel, 0, Coherence::None, rays)
    };
    (0..count / chunk).into_par_iter().map(trace_chunk).sum()
}

/// Half a million rays at each placement, from inside a closed sphere at its edges and within 2 ulps of its
/// vertices; half of them at a sphere with a BLAS of its own.
#[test]
fn closed_meshes_do_not_leak() {
    for placement in scenes::placements() {
        let scene = scenes::scene(scenes::sphere(64), &placement.transforms(DVec3::X * 3.0));
        let posed = scenes::posed(&scene);
        for flatten in [FlattenBudget::default(), FlattenBudget::ZERO] {
            let accel = Accel::build(&posed, &AccelSettings { flatten, ..AccelSettings::default() }).0;
            let lost = count_leaks(&posed, &accel, placement.scale, 250_000);
            assert_eq!(lost, 0, "of 250,000 at {placement:?} {flatten:?}");
        }
    }
}

/// The same by packets at every SIMD level: 320,000 rays each at each placement. 256 rays share an origin and
/// aim at edges and vertices that are close together, each 16 at those of a few triangles.
#[test]
fn packets_do_not_leak() {
    for simd in scenes::simd_levels() {
        for placement in scenes::placements() {
            let scene = scenes::scene(scenes::sphere(64), &placement.transforms(DVec3::X * 3.0));
            let posed = scenes::posed(&scene);
            let accel = Accel::build(&posed, &AccelSettings { simd, ..AccelSettings::default() }).0;
            let triangles = posed.mesh(0).triangles.len();
            let centre = posed.instances[0].transform.affine.translation;
            let trace_chunk = |seed: u64| {
                let mut rng = Rng::new(seed);
                let o = (centre + rng.in_cube() * 0.5 * placement.scale).as_vec3();
                let near = rng.below(triangles);
                let rays = (0..256).map(|i| {
                    let triangle = ((near + i / 16 + rng.below(6)) % triangles) as u32;
                    let v = posed.world_triangle(HitId { instance: 0, triangle });
                    let edge = rng.below(3);
                    (o, direction_towards(o, v[edge], v[(edge + 1) % 3], 1.0, &mut rng))
                });
                count_misses(&accel, 0, Coherence::Origin(o), rays.collect::<Vec<_>>().into_iter())
            };
            let lost: u64 = (0..1250).into_par_iter().map(trace_chunk).sum();
            assert_eq!(lost, 0, "{simd:?} at {placement:?}");
        }
    }
}

/// The count is sensitive: without one of 1,536 triangles, rays are lost.
#[test]
fn a_missing_triangle_leaks() {
    for twice in [false, true] {
        let placement = Placement { scale: 1.0, offset: 0.0, twice };
        let mut mesh = scenes::sphere(16);
        mesh.triangles.remove(700);
        let scene = scenes::scene(mesh, &placement.transforms(DVec3::X * 3.0));
        let posed = scenes::posed(&scene);
        let lost = count_leaks(&posed, &scenes::build(&posed), 1.0, 100_000);
        assert!((10..1000).contains(&lost), "{lost} of 100,000 lost through the hole");
    }
}

/// A million rays at each elevation over all placements, at the edges and centres of irregular fans, from
/// perpendicular to nearly in their plane.
#[test]
fn fans_do_not_leak_however_grazing() {
    for elevation in [1.0, 1e-2, 1e-3, 1e-4, 1e-5] {
        for placement in scenes::placements() {
            let (fans, chunk) = (100, 1000);
            let lost: u64 =
                (0..fans).into_par_iter().map(|seed| fan(placement, elevation, seed, chunk)).sum();
            assert_eq!(lost, 0, "of {} at {placement:?}, elevation {elevation}", fans * chunk);
        }
    }
}

fn fan(placement: Placement, elevation: f64, seed: u64, count: u64) -> u64 {
    let mut rng = Rng::new(seed);
    let normal = match seed % 4 {
        3 => [DVec3::X, DVec3::Y, DVec3::Z][rng.below(3)],
        _ => rng.direction(),
    };
    let spokes = 5 + rng.below(60);
    let scene =
        scenes::scene(scenes::fan(spokes as u32, normal, &mut rng), &placement.transforms(normal * -9.0));
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let transform = posed.instances[0].transform;
    let (x, y) = (normal.any_orthonormal_vector(), normal.cross(normal.any_orthonormal_vector()));
    let vertices: Vec<Vec3> = posed.mesh(0).positions.iter().map(|&p| transform.point(p)).collect();
    let rays = (0..count).map(|_| {
        let (sin, cos) = (std::f64::consts::TAU * rng.unit()).sin_cos();
        let flat = if elevation < 1.0 { 1.0 } else { 0.4 * rng.unit() };
        let height = elevation * (0.5 + rng.unit());
        let above = 3.0 * (flat * (x * cos + y * sin) + height * normal);
        let o = transform.affine.transform_point3(above).as_vec3();
        (o, direction_towards(o, vertices[0], vertices[1 + rng.below(spokes)], 0.7, &mut rng))
    });
    count_misses(&accel, 0, Coherence::None, rays.collect::<Vec<_>>().into_iter())
}

/// 160,000 rays along the axes at vertices, edges and borders of grids and boxes, with zeros of either sign
/// in their directions. Bounding boxes are flat here.
#[test]
fn axis_parallel_rays_do_not_leak() {
    let mut rng = Rng::new(7);
    let mut ray_count = 0;
    // Rays along a border must stay on it in the instance's frame: powers of two are exact.
    let once = [(1.0, DVec3::ZERO), (1e-4, DVec3::ONE), (1e6, DVec3::ONE), (0.1, DVec3::splat(1e3))];
    let twice = [
        (1.0, DVec3::ZERO),
        (1.0 / 8192.0, DVec3::ONE),
        (1048576.0, DVec3::ONE),
        (0.125, DVec3::splat(1024.0)),
    ];
    let placements = once.map(|p| (p, false)).into_iter().chain(twice.map(|p| (p, true)));
    for ((scale, at), twice) in placements {
        for (axis, closed) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
            let mesh = if closed { scenes::cube(16) } else { scenes::grid(20, axis) };
            let transform = |at: DVec3| {
                glam::DAffine3::from_scale_rotation_translation(
                    DVec3::splat(scale),
                    glam::DQuat::IDENTITY,
                    at,
                )
            };
            // No ray hits the second one.
            let aside = DVec3::splat(8.0 * scale);
            let mut transforms = vec![transform(at)];
            if twice {
                transforms.push(transform(at + aside));
            }
            let scene = scenes::scene(mesh, &transforms);
            let posed = scenes::posed(&scene);
            let accel = scenes::build(&posed);
            let vertices: Vec<Vec3> =
                posed.mesh(0).positions.iter().map(|&p| posed.instances[0].transform.point(p)).collect();
            let rays: Vec<(Vec3, Vec3)> = (0..160_000 / 48 + 1)
                .map(|_| {
                    let p = vertices[rng.below(vertices.len())];
                    let q = vertices[rng.below(vertices.len())];
                    // Along grid lines: two coordinates of vertices, not always of the same one.
                    let mut o = if closed || rng.one_in(2) { p } else { p.with_x(q.x) };
                    if !closed {
                        o[axis] = p[axis];
                    }
                    let sign = if rng.one_in(2) { 1.0 } else { -1.0 };
                    let mut d = [0.0, 0.0, 0.0].map(|x: f32| if rng.one_in(2) { -x } else { x });
                    d[axis] = sign;
                    let centre = posed.instances[0].transform.affine.translation.as_vec3();
                    o[axis] = centre[axis] - sign * 3.0 * scale as f32;
                    (o, Vec3::from(d))
                })
                .collect();
            ray_count += rays.len();
            let lost = count_misses(&accel, 0, Coherence::None, rays.into_iter());
            assert_eq!(lost, 0, "axis {axis}, scale {scale}, closed {closed}, twice {twice}");
        }
    }
    assert!(ray_count >= 160_000);
}
