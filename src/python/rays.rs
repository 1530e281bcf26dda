//! Rays and shadow segments of NumPy arrays.

use anyhow::{Result, anyhow};
use glam::{DVec3, Vec3};
use numpy::ndarray::ArrayView2;
use rayon::prelude::*;

use crate::accel::{Accel, HitFilter, Coherence, RayBatch, ShadowRayBatch};
use crate::cli::embed::PosedFrame;
use crate::geometry::{Hit, HitId, Ray};
use crate::integrator::{MaterialHitFilter, barycentrics};

/// Rays that one task traces.
const TASK_RAYS: usize = 1 << 12;

/// The closest hits of rays, parallel to them.
#[derive(Default)]
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

/// The position of row `i`, relative to the centre of the posed scene.
fn position(rows: &ArrayView2<f64>, i: usize, centre: DVec3) -> Vec3 {
    (DVec3::new(rows[[i, 0]], rows[[i, 1]], rows[[i, 2]]) - centre).as_vec3()
}

/// Finds the closest hits of rays.
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
    let count = origins.nrows();
    let trace = |task: usize| {
        let range = task * TASK_RAYS..count.min((task + 1) * TASK_RAYS);
        let mut rays = RayBatch { cull_back_faces, ..Default::default() };
        for i in range {
            rays.push(position(origins, i, posed.centre), position(directions, i, DVec3::ZERO));
        }
        rays.coherence = shared_origin(&rays.origins);
        let mut hits = Vec::new();
        accel.intersect(&rays, &MaterialHitFilter(posed), &mut hits);
        let coordinates: Vec<[f32; 3]> = hits
            .iter()
            .enumerate()
            .map(|(i, hit)| {
                let ray = Ray { o: rays.origins[i], d: rays.directions[i] };
                if hit.is_miss() {
                    [0.0; 3]
                } else {
                    barycentrics(posed.world_triangle(hit.id), ray).map(|b| b as f32)
                }
            })
            .collect();
        (hits, coordinates)
    };
    let tasks: Vec<(Vec<Hit>, Vec<[f32; 3]>)> =
        (0..count.div_ceil(TASK_RAYS)).into_par_iter().map(trace).collect();
    let mut out = RayHits::default();
    for (hits, coordinates) in tasks {
        for hit in &hits {
            out.t.push(hit.t);
            let instance = posed.scene.instances.get(hit.id.instance as usize);
            out.object.push(instance.map_or(0, |instance| instance.object));
            let index = |id: u32| if hit.is_miss() { -1 } else { id as i32 };
            out.instance.push(index(hit.id.instance));
            out.triangle.push(index(hit.id.triangle));
        }
        out.barycentrics.extend(coordinates);
    }
    Ok(out)
}

/// Finds whether something blocks the way between two points. Translucent surfaces block nothing.
///
/// # Errors
/// The scene has no acceleration structure.
pub fn occluded(frame: &PosedFrame, from: &ArrayView2<f64>, to: &ArrayView2<f64>) -> Result<Vec<bool>> {
    let PosedFrame { posed, .. } = frame;
    let accel = accel(frame)?;
    let count = from.nrows();
    let trace = |task: usize| {
        let mut segments = ShadowRayBatch::default();
        for i in task * TASK_RAYS..count.min((task + 1) * TASK_RAYS) {
            segments.push(position(from, i, posed.centre), position(to, i, posed.centre), HitId::NONE);
        }
        let mut occluded = Vec::new();
        let filter: &dyn HitFilter = &MaterialHitFilter(posed);
        accel.occluded(&segments, filter, &mut occluded);
        occluded
    };
    Ok((0..count.div_ceil(TASK_RAYS)).into_par_iter().flat_map_iter(trace).collect())
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
