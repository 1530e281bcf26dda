//! Rays and shadow segments of NumPy arrays.
//!
//! They are traced in an order in which neighbours take similar ways through the scene. Hits do not depend on it.

use anyhow::{Result, anyhow};
use glam::{DVec3, Vec3};
use numpy::ndarray::ArrayView2;
use rayon::prelude::*;

use super::ray_order::coherent_order;
use blinn_accel::{Accel, Coherence, HitFilter, RayBatch, RoundSizes, ShadowRayBatch};
use blinn_core::geometry::{Hit, HitId, Ray};
use blinn_render::integrator::{MaterialHitFilter, barycentrics, nearest_on_axis};
use blinn_scene::{Mesh, Rounds};
use blinn_session::{PosedFrame, ray_sizes};

/// Rays that one task traces.
const TASK_RAYS: usize = 1 << 12;

/// The closest hits of rays, parallel to them.
pub struct RayHits {
    /// In lengths of the direction; +∞ for a miss.
    pub t: Vec<f32>,
    /// Object ids from 1; 0 for a miss.
    pub object: Vec<u32>,
    /// Index into the instances of the scene, and of the triangle, point or line in the instance's mesh; −1 for a miss.
    pub instance: Vec<i32>,
    pub triangle: Vec<i32>,
    /// Barycentric coordinates of the triangle's corners, or of a line's ends; 0 for a miss.
    pub barycentrics: Vec<[f32; 3]>,
    /// The points in the world, in front of their surface by their error bound; NaN for a miss.
    pub points: Vec<[f64; 3]>,
    /// Kinds of primitives: [`HitKind`].
    pub kind: Vec<u8>,
}

/// The kinds of primitives that rays hit, as numbers of the Python package.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
enum HitKind {
    #[default]
    Miss,
    Triangle,
    Point,
    Line,
}

impl HitKind {
    /// The kind of the primitives of a mesh.
    fn of(mesh: &Mesh) -> HitKind {
        match mesh.rounds {
            Rounds::None => HitKind::Triangle,
            Rounds::Points => HitKind::Point,
            Rounds::Lines(_) => HitKind::Line,
        }
    }
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
            points: vec![[f64::NAN; 3]; count],
            kind: vec![HitKind::Miss as u8; count],
        }
    }
}

/// Reads rows of positions relative to the centre of the posed scene, or of vectors with a centre of 0.
fn read_rows(rows: &ArrayView2<f64>, centre: DVec3) -> Vec<Vec3> {
    let row = |i: usize| (DVec3::new(rows[[i, 0]], rows[[i, 1]], rows[[i, 2]]) - centre).as_vec3();
    (0..rows.nrows()).into_par_iter().with_min_len(TASK_RAYS).map(row).collect()
}

/// Reads the sizes in which rays meet points and lines: see [`ray_sizes`].
///
/// # Errors
/// A size is wrong.
pub fn sizes(frame: &PosedFrame, point_size: &str, line_width: &str) -> Result<RoundSizes, String> {
    let accel = accel(frame).map_err(|error| error.to_string())?;
    ray_sizes(point_size, line_width, accel)
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
    rounds: RoundSizes,
) -> Result<RayHits> {
    let PosedFrame { posed, .. } = frame;
    let accel = accel(frame)?;
    let (origins, directions) = (read_rows(origins, posed.centre), read_rows(directions, DVec3::ZERO));
    let trace = |order: &[u32]| {
        let mut rays = RayBatch { cull_back_faces, rounds, ..Default::default() };
        for &i in order {
            rays.push(origins[i as usize], directions[i as usize]);
        }
        rays.coherence = shared_origin(&rays.origins);
        let mut hits = Vec::new();
        accel.intersect(&rays, &MaterialHitFilter(posed), &mut hits);
        let point = |(i, hit): (usize, &Hit)| match hit.is_miss() {
            true => HitPoint::default(),
            false => {
                let ray = Ray { o: rays.origins[i], d: rays.directions[i] };
                let corners = posed.world_triangle(hit.id);
                match HitKind::of(posed.mesh(hit.id.instance)) {
                    HitKind::Point | HitKind::Line => HitPoint::on_round(corners, ray, hit.t),
                    HitKind::Triangle | HitKind::Miss => HitPoint::new(corners, ray),
                }
            }
        };
        let points: Vec<HitPoint> = hits.iter().enumerate().map(point).collect();
        (hits, points)
    };
    let order = coherent_order(&origins, &directions, posed.centred_bounds());
    let tasks: Vec<(Vec<Hit>, Vec<HitPoint>)> = order.par_chunks(TASK_RAYS).map(trace).collect();
    let mut out = RayHits::misses(origins.len());
    for (order, (hits, points)) in order.chunks(TASK_RAYS).zip(&tasks) {
        for ((&i, hit), point) in order.iter().zip(hits).zip(points) {
            if let (i, false) = (i as usize, hit.is_miss()) {
                out.t[i] = hit.t;
                out.object[i] = posed.scene.instances[hit.id.instance as usize].object;
                out.instance[i] = hit.id.instance as i32;
                out.triangle[i] = hit.id.triangle as i32;
                out.barycentrics[i] = point.barycentrics;
                out.points[i] = (point.p + posed.centre).to_array();
                out.kind[i] = HitKind::of(posed.mesh(hit.id.instance)) as u8;
            }
        }
    }
    Ok(out)
}

/// A point where a ray hits a triangle, point or line.
#[derive(Clone, Copy, Default)]
struct HitPoint {
    barycentrics: [f32; 3],
    /// Relative to the centre of the posed scene.
    p: DVec3,
}

/// Error bound of a point, relative to the sum of its terms: rounding of the corners, of a transform and of the point.
const POINT_ERROR: f64 = 16.0 * 0.5 * f32::EPSILON as f64;

impl HitPoint {
    /// The point of a ray on a triangle, moved towards the ray's origin by its error bound.
    fn new(corners: [Vec3; 3], ray: Ray) -> HitPoint {
        let b = barycentrics(corners, ray);
        let corners = corners.map(|corner| corner.as_dvec3());
        let terms = [0, 1, 2].map(|i| corners[i] * b[i]);
        let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let n = if n.dot(ray.d.as_dvec3()) > 0.0 { -n } else { n };
        let error = terms.iter().map(|term| term.abs()).sum::<DVec3>() * POINT_ERROR;
        let p = terms.iter().sum::<DVec3>() + n * n.abs().dot(error);
        HitPoint { barycentrics: b.map(|b| b as f32), p }
    }

    /// The point of a ray on the sphere or capsule about `corners`, moved away from their axis by its error bound.
    fn on_round(corners: [Vec3; 3], ray: Ray, t: f32) -> HitPoint {
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let p = o + d * f64::from(t);
        let (barycentrics, from_axis) = nearest_on_axis(corners.map(|corner| corner.as_dvec3()), p);
        let n = from_axis.normalize_or(-d.normalize_or_zero());
        // t is rounded as well.
        let error = (p.abs() + (p - o).abs()) * POINT_ERROR;
        HitPoint { barycentrics, p: p + n * n.abs().dot(error) }
    }
}

/// Length at the ends of a way in which nothing blocks it, relative to the size of the scene: points that callers compute
/// from distances in single precision lie so far beside their surfaces.
const END_CLEARANCE: f32 = 16.0 * f32::EPSILON;

/// Shortens a way at both ends, so that it does not meet the surfaces on which they lie.
fn clear_ends(from: Vec3, to: Vec3, scene_size: f32) -> (Vec3, Vec3) {
    let clearance = |p: Vec3| END_CLEARANCE * p.abs().max_element().max(scene_size);
    let (direction, length) = (to - from).normalize_and_length();
    let (start, end) = (clearance(from), length - clearance(to));
    match start < end {
        true => (from + direction * start, from + direction * end),
        false => (from, from),
    }
}

/// Finds whether something blocks the way between two points. Translucent surfaces block nothing, and nothing blocks a
/// way of no length or one that is not finite. The triangles, points and lines of `sources`, on which ways start, do not
/// block them.
///
/// # Errors
/// The scene has no acceleration structure.
pub fn occluded(
    frame: &PosedFrame,
    from: &ArrayView2<f64>,
    to: &ArrayView2<f64>,
    sources: Option<&[HitId]>,
    rounds: RoundSizes,
) -> Result<Vec<bool>> {
    let PosedFrame { posed, .. } = frame;
    let accel = accel(frame)?;
    let (mut from, mut to) = (read_rows(from, posed.centre), read_rows(to, posed.centre));
    let bounds = posed.centred_bounds();
    let scene_size = bounds.min.abs().max(bounds.max.abs()).max_element() as f32;
    for (from, to) in from.iter_mut().zip(&mut to) {
        let (start, end) = clear_ends(*from, *to, scene_size);
        // Exact points of hits need no clearance.
        (*from, *to) = (if sources.is_none() { start } else { *from }, end);
    }
    let directions: Vec<Vec3> = from.iter().zip(&to).map(|(from, to)| to - from).collect();
    let trace = |order: &[u32]| {
        let mut segments = ShadowRayBatch { rounds, ..Default::default() };
        for &i in order {
            let source = sources.map_or(HitId::NONE, |sources| sources[i as usize]);
            segments.push(from[i as usize], to[i as usize], source);
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
