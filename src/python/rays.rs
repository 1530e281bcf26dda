//! Rays and shadow segments of NumPy arrays.
//!
//! They are traced in an order in which neighbours take similar ways through the scene. Hits do not depend on it.

use anyhow::{Result, anyhow};
use glam::{DVec3, Vec3};
use numpy::ndarray::ArrayView2;
use rayon::prelude::*;

use super::ray_order::coherent_order;
use blinn_accel::{Accel, Coherence, HitFilter, RayBatch, ShadowRayBatch};
use blinn_core::geometry::{Hit, HitId, Ray};
use blinn_render::integrator::{MaterialHitFilter, barycentrics};
use blinn_session::PosedFrame;

/// Rays that one task traces.
const TASK_RAYS: usize = 1 << 12;

/// The closest hits of rays, parallel to them.
pub struct RayHits {
    /// In lengths of the direction; +∞ for a miss.
    pub t: Vec<f32>,
    /// Object ids from 1; 0 for a miss.
    pub object: Vec<u32>,
    /// Index into the instances of the scene, and of the triangle in the instance's mesh; −1 for a miss.
    pub instance: Vec<i32>,
    pub triangle: Vec<i32>,
    /// Barycentric coordinates of the triangle's corners; 0 for a miss.
    pub barycentrics: Vec<[f32; 3]>,
}

impl RayHits {
    /// Misses of all rays.
    fn misses(count: usize) -> RayHits {
        RayHits {
            t: vec![f32::INFINITY; count],
            object: vec![0; count],
            instance: vec![-1; count],
            triangle: vec![-1; count],
            barycentrics: vec![[0.0; 3]; count],
        }
    }
}

/// Reads rows of positions relative to the centre of the posed scene, or of vectors with a centre of 0.
fn read_rows(rows: &ArrayView2<f64>, centre: DVec3) -> Vec<Vec3> {
    let row = |i: usize| (DVec3::new(rows[[i, 0]], rows[[i, 1]], rows[[i, 2]]) - centre).as_vec3();
    (0..rows.nrows()).into_par_iter().with_min_len(TASK_RAYS).map(row).collect()
}

/// Finds the closest hits of rays. Rays that are not finite or have no direction miss.
///
/// # Errors
/// The scene has no acceleration structure.
pub fn intersect(
    frame: &PosedFrame,
    origins: &ArrayView2<f64>,
    directions: &ArrayView2<f64>,
    cull_back_faces: bool,
) -> Result<RayHits> {
    let PosedFrame { posed, .. } = frame;
    let accel = accel(frame)?;
    let (origins, directions) = (read_rows(origins, posed.centre), read_rows(directions, DVec3::ZERO));
    let trace = |order: &[u32]| {
        let mut rays = RayBatch { cull_back_faces, ..Default::default() };
        for &i in order {
            rays.push(origins[i as usize], directions[i as usize]);
        }
        rays.coherence = shared_origin(&rays.origins);
        let mut hits = Vec::new();
        accel.intersect(&rays, &MaterialHitFilter(posed), &mut hits);
        let coordinates = |(i, hit): (usize, &Hit)| {
            let ray = Ray { o: rays.origins[i], d: rays.directions[i] };
            match hit.is_miss() {
                true => [0.0; 3],
                false => barycentrics(posed.world_triangle(hit.id), ray).map(|b| b as f32),
            }
        };
        let coordinates: Vec<[f32; 3]> = hits.iter().enumerate().map(coordinates).collect();
        (hits, coordinates)
    };
    let order = coherent_order(&origins, &directions, posed.centred_bounds());
    let tasks: Vec<(Vec<Hit>, Vec<[f32; 3]>)> = order.par_chunks(TASK_RAYS).map(trace).collect();
    let mut out = RayHits::misses(origins.len());
    for (order, (hits, coordinates)) in order.chunks(TASK_RAYS).zip(&tasks) {
        for ((&i, hit), coordinates) in order.iter().zip(hits).zip(coordinates) {
            if let (i, false) = (i as usize, hit.is_miss()) {
                out.t[i] = hit.t;
                out.object[i] = posed.scene.instances[hit.id.instance as usize].object;
                out.instance[i] = hit.id.instance as i32;
                out.triangle[i] = hit.id.triangle as i32;
                out.barycentrics[i] = *coordinates;
            }
        }
    }
    Ok(out)
}

/// Finds whether something blocks the way between two points. Translucent surfaces block nothing, and nothing blocks a
/// way of no length or one that is not finite.
///
/// # Errors
/// The scene has no acceleration structure.
pub fn occluded(frame: &PosedFrame, from: &ArrayView2<f64>, to: &ArrayView2<f64>) -> Result<Vec<bool>> {
    let PosedFrame { posed, .. } = frame;
    let accel = accel(frame)?;
    let (from, to) = (read_rows(from, posed.centre), read_rows(to, posed.centre));
    let directions: Vec<Vec3> = from.iter().zip(&to).map(|(from, to)| to - from).collect();
    let trace = |order: &[u32]| {
        let mut segments = ShadowRayBatch::default();
        for &i in order {
            segments.push(from[i as usize], to[i as usize], HitId::NONE);
        }
        let mut occluded = Vec::new();
        let filter: &dyn HitFilter = &MaterialHitFilter(posed);
        accel.occluded(&segments, filter, &mut occluded);
        occluded
    };
    let order = coherent_order(&from, &directions, posed.centred_bounds());
    let tasks: Vec<Vec<bool>> = order.par_chunks(TASK_RAYS).map(trace).collect();
    let mut out = vec![false; from.len()];
    for (&i, &occluded) in order.iter().zip(tasks.iter().flatten()) {
        out[i as usize] = occluded;
    }
    Ok(out)
}

fn accel<'a>(frame: &'a PosedFrame) -> Result<&'a Accel> {
    frame.accel.as_ref().ok_or_else(|| anyhow!("the scene has no acceleration structure"))
}

/// The origin that all rays share, if they do: such rays are traced as packets.
fn shared_origin(origins: &[Vec3]) -> Coherence {
    match origins.first() {
        Some(first) if origins.iter().all(|o| o == first) => Coherence::Origin(*first),
        _ => Coherence::None,
    }
}
