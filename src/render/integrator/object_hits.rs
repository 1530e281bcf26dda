//! All objects along eye rays, front to back.

use crate::integrator::first_hit::is_hole;
use crate::integrator::frame::Frame;
use crate::integrator::path_rays::{MAX_SURFACES_PER_RAY, PathRays};
use crate::integrator::sample::Sample;
use crate::integrator::scratch::Scratch;
use crate::integrator::surface::surface_point::SurfacePoint;

/// A surface of an object along an eye ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjectHit {
    /// Number of the object, from 1.
    pub object: u32,
    /// True for the first surface along the ray.
    pub is_first: bool,
}

/// Calls `add` with the index of a sample and each surface along its eye ray, nearest first. The same surfaces count as for
/// [`first_hits`](super::first_hits).
pub fn trace_objects(
    frame: &Frame,
    samples: &[Sample],
    scratch: &mut Scratch,
    mut add: impl FnMut(usize, ObjectHit),
) {
    let mut is_open = vec![true; samples.len()];
    let mut rays = PathRays::new(frame, samples, &mut scratch.rays, &mut scratch.hits);
    for _ in 0..MAX_SURFACES_PER_RAY {
        rays.intersect(frame);
        for eye in rays.iter().filter(|eye| !eye.hit.is_miss()) {
            let surface = SurfacePoint::at(frame.posed, &eye.hit, eye.ray);
            if is_hole(frame, &surface) {
                continue;
            }
            let object = frame.posed.scene.instances[eye.hit.id.instance as usize].object;
            add(eye.path, ObjectHit { object, is_first: std::mem::take(&mut is_open[eye.path]) });
        }
        rays.continue_behind(|_| true);
        if rays.is_empty() {
            break;
        }
    }
}
