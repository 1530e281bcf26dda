//! Rays to points of edges, which find out if a surface hides them.

use crate::integrator::first_hit::is_hole;
use crate::integrator::frame::Frame;
use crate::integrator::material::opacity::opacity;
use crate::integrator::path_rays::{MAX_SURFACES_PER_RAY, PathRayHit, PathRays};
use crate::integrator::sample::Sample;
use crate::integrator::scratch::Scratch;
use crate::integrator::surface::surface_point::SurfacePoint;
use blinn_core::geometry::HitId;
use blinn_scene::AlphaMode;

/// Surfaces hide what is behind them by more than this fraction of the distance: what rounding to f32 moves a point by where
/// the camera sees its surface at a small angle.
const SLACK: f64 = 1e-4;
/// Surfaces with less opacity hide no edges.
const HIDING_OPACITY: f32 = 0.5;

/// A point of an edge, and the eye ray through it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgePoint {
    /// Its position on the film.
    pub sample: Sample,
    /// Its depth in metres.
    pub depth: f64,
    /// The triangles beside the edge.
    pub beside: [HitId; 2],
}

/// Returns for each point true if nothing lies in front of it. Transparent surfaces do not hide edges.
pub(crate) fn visible_points(frame: &Frame, points: &[EdgePoint], scratch: &mut Scratch) -> Vec<bool> {
    let samples: Vec<Sample> = points.iter().map(|point| point.sample).collect();
    let depth_per_t = frame.camera.depth_per_t();
    let mut rays = PathRays::new(frame, &samples, &mut scratch.rays, &mut scratch.hits);
    // Many samples are nearest to the end of an edge, and edges share their ends.
    let paths = rays.merge_equal();
    let mut visible = vec![true; points.len()];
    let mut passes = vec![false; points.len()];
    let mut eyes: Vec<Option<PathRayHit>> = vec![None; points.len()];
    // The points behind transparent surfaces.
    let mut open: Vec<usize> = (0..points.len()).collect();
    for _ in 0..MAX_SURFACES_PER_RAY {
        rays.intersect(frame);
        rays.iter().for_each(|eye| eyes[eye.path] = Some(eye));
        passes.fill(false);
        open.retain(|&i| {
            let (point, path) = (&points[i], paths[i]);
            let Some(eye) = &eyes[path] else { return false };
            let is_in_front = !eye.hit.is_miss()
                && f64::from(eye.hit.t) * depth_per_t < point.depth * (1.0 - SLACK)
                && !point.beside.contains(&eye.hit.id);
            let is_passed = is_in_front && is_transparent(frame, eye);
            visible[i] = !is_in_front || is_passed;
            passes[path] |= is_passed;
            is_passed
        });
        rays.continue_behind(|path| passes[path]);
        if rays.is_empty() {
            break;
        }
    }
    visible
}

/// Returns true if a surface shows what is behind it.
fn is_transparent(frame: &Frame, eye: &PathRayHit) -> bool {
    let material = frame.material(eye.hit.id);
    if material.transmits() {
        return true;
    }
    if material.alpha_mode == AlphaMode::Opaque {
        return false;
    }
    let surface = SurfacePoint::at(frame.posed, &eye.hit, eye.ray);
    is_hole(frame, &surface)
        || (material.alpha_mode == AlphaMode::Blend
            && opacity(frame.posed, material, &surface.ctx) < HIDING_OPACITY)
}
