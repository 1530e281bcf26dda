//! First hits: the first visible surface along each eye ray, which layers describe.

use glam::DVec3;

use crate::integrator::frame::Frame;
use crate::integrator::material::hit_filter::MaterialHitFilter;
use crate::integrator::material::opacity::opacity;
use crate::integrator::path_rays::{MAX_SURFACES_PER_RAY, PathRayHit, PathRays};
use crate::integrator::sample::Sample;
use crate::integrator::scratch::Scratch;
use crate::integrator::surface::surface_point::SurfacePoint;
use blinn_accel::{RayBatch, TraversalStats};
use blinn_core::geometry::Hit;
use blinn_scene::AlphaMode;

/// The first surface along an eye ray. Alpha masks and the fully transparent texels of a blended material are holes; a
/// surface that is partly transparent counts.
#[derive(Clone, Debug)]
pub struct FirstHit<'s> {
    pub(crate) sample: Sample,
    pub(crate) surface: Option<(Hit, SurfacePoint<'s>)>,
    /// Motion to the frames before and after; 0 unless it was computed.
    pub(crate) flow: Flow,
}

/// The motion of a point in the picture: pixels to the right and downward, and 1 where the other frame sees the point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Flow {
    /// To the next frame.
    pub forward: [f32; 3],
    /// To the previous frame.
    pub backward: [f32; 3],
}

impl FirstHit<'_> {
    /// Direction of the eye ray in the coordinates of the posed scene. It is not normalised: t counts its lengths.
    pub(crate) fn direction(&self, frame: &Frame) -> DVec3 {
        frame.eye_ray(&self.sample).d.as_dvec3()
    }

    /// Cost of the eye ray up to its first hit. Traces the ray again, because only this layer counts the steps.
    pub(crate) fn traversal_stats(&self, frame: &Frame) -> TraversalStats {
        let mut ray = RayBatch::default();
        frame.generate_eye_rays(std::slice::from_ref(&self.sample), &mut ray);
        let hits = frame.accel.intersect_with_stats(&ray, &MaterialHitFilter(frame.posed));
        hits.first().map(|(_, stats)| *stats).unwrap_or_default()
    }
}

/// The first hits of the eye rays of `samples`.
pub fn first_hits<'s>(frame: &Frame<'s>, samples: &[Sample], scratch: &mut Scratch) -> Vec<FirstHit<'s>> {
    let miss = |&sample: &Sample| FirstHit { sample, surface: None, flow: Flow::default() };
    let mut first: Vec<FirstHit> = samples.iter().map(miss).collect();
    trace_first(frame, samples, scratch, |eye| {
        let surface = SurfacePoint::at(frame.posed, &eye.hit, eye.ray);
        let is_seen = !is_hole(frame, &surface);
        if is_seen {
            first[eye.path].surface = Some((eye.hit, surface));
        }
        is_seen
    });
    first
}

/// True for each eye ray of `samples` that has a first hit.
pub(crate) fn have_hits(frame: &Frame, samples: &[Sample], scratch: &mut Scratch) -> Vec<bool> {
    trace_first(frame, samples, scratch, |eye| {
        // Only textures make holes.
        frame.material(eye.hit.id).alpha_mode == AlphaMode::Opaque
            || !is_hole(frame, &SurfacePoint::at(frame.posed, &eye.hit, eye.ray))
    })
}

/// Follows the eye rays of `samples` up to a hit that `is_seen`. Returns whether each has one.
fn trace_first(
    frame: &Frame,
    samples: &[Sample],
    scratch: &mut Scratch,
    mut is_seen: impl FnMut(PathRayHit) -> bool,
) -> Vec<bool> {
    let mut found = vec![false; samples.len()];
    let mut rays = PathRays::new(frame, samples, &mut scratch.rays, &mut scratch.hits);
    for _ in 0..MAX_SURFACES_PER_RAY {
        rays.intersect(frame);
        for eye in rays.iter().filter(|eye| !eye.hit.is_miss()) {
            found[eye.path] = is_seen(eye);
        }
        rays.continue_behind(|path| !found[path]);
        if rays.is_empty() {
            break;
        }
    }
    found
}

/// Less opacity than an 8-bit picture can show.
const MIN_OPACITY: f32 = 1.0 / 512.0;

/// True where a texture makes a surface fully transparent.
pub(crate) fn is_hole(frame: &Frame, surface: &SurfacePoint) -> bool {
    let material = &frame.posed.materials[surface.material as usize];
    let opacity = || opacity(frame.posed, material, &surface.ctx);
    match material.alpha_mode {
        AlphaMode::Opaque => false,
        AlphaMode::Mask(_) => opacity() == 0.0,
        // A material that is transparent everywhere is an object nevertheless.
        AlphaMode::Blend => material.alpha.factor > MIN_OPACITY && opacity() < MIN_OPACITY,
    }
}
