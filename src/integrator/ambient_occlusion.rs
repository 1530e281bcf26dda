//! Ambient occlusion: how much of the light that comes from all sides arrives at a point.

use crate::accel::Coherence;
use crate::geometry::{Rgb, cosine_hemisphere};
use crate::integrator::sample_stream::{Draws, Purpose};
use crate::integrator::shading_batch::Seen;
use crate::integrator::surface::points::vector;
use crate::integrator::{Frame, Scratch};

/// Rays that find out how much ambient light arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientOcclusion {
    /// Rays for each pixel, shared out among its samples; each sample has one at least.
    pub samples: u32,
    /// What is farther than this many metres is not in the way; infinite: everything is.
    pub distance: f64,
}

/// How much of the ambient light arrives at each of the points `asked`, by colour: the mean over
/// directions as dense as their cosine to the shading normal.
pub(crate) fn ambient_free(
    frame: &Frame,
    occlusion: AmbientOcclusion,
    seen: &Seen,
    asked: &[usize],
    draws: Draws,
    scratch: &mut Scratch,
) -> Vec<Rgb> {
    let parts = occlusion.samples.div_ceil(draws.sampler.count.max(1)).max(1);
    let mut sums = vec![Rgb::ZERO; asked.len()];
    for part in 0..parts {
        let segments = &mut scratch.segments;
        segments.clear();
        segments.coherence = Coherence::None;
        for &i in asked {
            let (group, at) = seen.columns.of(i);
            let n_g = vector(&group.n_g, at);
            let draw = draws.part(seen.points[i].sample, Purpose::Ambient, part, parts);
            let l = cosine_hemisphere(seen.n(i), draw);
            // Where the shading normal leans over, what would go into the surface is mirrored out.
            let l = l - n_g * (2.0 * l.dot(n_g).min(0.0));
            let (from, source) = seen.start(i, l);
            let far = occlusion.distance.min(frame.beyond(from));
            segments.push(from, (from.as_dvec3() + l * far).as_vec3(), source);
        }
        crate::integrator::shadow_rays::trace(frame, segments, &mut scratch.blocked, &mut scratch.free);
        for (k, sum) in sums.iter_mut().enumerate() {
            let (from, to) = (scratch.segments.from[k], scratch.segments.to[k]);
            let infinitely = occlusion.distance == f64::INFINITY;
            if !frame.below_ground(from, to.as_dvec3() - from.as_dvec3(), infinitely) {
                *sum += scratch.free[k];
            }
        }
    }
    sums.iter().map(|&sum| sum / parts as f32).collect()
}
