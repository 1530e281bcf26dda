//! No surface shadows itself at any scale or distance, and close occluders still cast shadows.

use blinn::accel::{Coherence, ShadowRayBatch};
use blinn::geometry::{HitId, offset_ray_origin, point_error};
use blinn::scene::{Scene, SurfaceClass};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use crate::common::scenes::{self, Placement, Plain, Rng};

const RAYS: u64 = 200_000;

/// Returns the number of occluded segments of `RAYS` from points on a flat grid to lights above it. The points are
/// computed as in shading: interpolated in f64, rounded, and offset by their error bound.
fn count_occluded(placement: Placement, occluder: bool, sun: bool) -> u64 {
    let transforms = placement.transforms(DVec3::new(2.0, 0.0, 0.0));
    let mut scene = Scene::default();
    let opaque = scenes::material(SurfaceClass::Opaque, true);
    scenes::add(&mut scene, scenes::grid(40, 2), opaque.clone(), &transforms);
    if occluder {
        // One sheet above the grid, at 1e-4 of its size.
        let mut sheet = scenes::grid(3, 2);
        sheet.positions.iter_mut().for_each(|p| *p = *p * 4.0 + Vec3::new(1.0, 0.0, 1e-4));
        scenes::add(&mut scene, sheet, opaque, &transforms[..1]);
    }
    let posed = scenes::posed(&scene);
    let accel = scenes::build(&posed);
    let triangles = posed.mesh(0).triangles.len();
    let to_world: DAffine3 = posed.instances[0].transform.affine;
    let chunk = 5000;
    let trace_chunk = |seed: u64| {
        let mut rng = Rng::new(seed);
        let mut segments = ShadowRayBatch::default();
        let random_point_above = |rng: &mut Rng| {
            let elevation = 10f64.powf(-2.0 * rng.unit());
            let around = std::f64::consts::TAU * rng.unit();
            DVec3::new(around.cos(), around.sin(), elevation)
        };
        if sun {
            let l = to_world.transform_vector3(random_point_above(&mut rng));
            segments.coherence = Coherence::Direction(l.normalize().as_vec3());
        }
        for _ in 0..chunk {
            let id = HitId { instance: 0, triangle: rng.below(triangles) as u32 };
            let (world, local) = (posed.world_triangle(id), posed.local_triangle(id));
            let [a, b, c] = world.map(|v| v.as_dvec3());
            // Often on or close to an edge, next to its neighbours.
            let u = if rng.one_in(3) { 1e-6 * rng.unit() } else { rng.unit() };
            let (u, v) = (u, rng.unit() * (1.0 - u));
            let p = (a + (b - a) * u + (c - a) * v).as_vec3();
            let n_g = (b - a).cross(c - a).normalize().as_vec3();
            let error = point_error(world, local, &to_world);
            let light = to_world.transform_point3(random_point_above(&mut rng) * 3.0).as_vec3();
            let l = match segments.coherence {
                Coherence::Direction(l) => l,
                _ => light - p,
            };
            segments.push(offset_ray_origin(p, error, n_g, l), light, id);
        }
        let mut out = Vec::new();
        accel.occluded(&segments, &Plain, &mut out);
        assert_eq!(out.len(), chunk as usize);
        out.iter().filter(|&&occluded| occluded).count() as u64
    };
    (0..RAYS / chunk).into_par_iter().map(trace_chunk).sum()
}

/// 200,000 points of a flat grid at each placement, and as many under a sun: none is in shadow.
#[test]
fn flat_surfaces_do_not_shadow_themselves() {
    for placement in scenes::placements() {
        for sun in [false, true] {
            assert_eq!(count_occluded(placement, false, sun), 0, "false shadows at {placement:?}, sun {sun}");
        }
    }
}

/// The same points with a sheet 1e-4 of their size above them: all are in shadow. A larger offset would pass
/// through the sheet.
#[test]
fn near_occluders_still_shadow() {
    for placement in scenes::placements() {
        assert_eq!(count_occluded(placement, true, false), RAYS, "shadows at {placement:?}");
    }
}
