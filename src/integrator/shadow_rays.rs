//! Shadow rays: how much of the way between a point and a light is free.

use glam::{DVec3, Vec3};

use crate::accel::{Coherence, SegmentBatch};
use crate::geometry::{HitId, Rgb};
use crate::integrator::direct_light::Reached;
use crate::integrator::sample_stream::{Draws, Purpose};
use crate::integrator::shading_batch::Seen;
use crate::integrator::surface::points::{narrow, vector};
use crate::integrator::{Frame, MaterialHitFilter, Scratch};
use crate::scene::PosedLightKind;

/// Fills `scratch.free` with how much of light `which`'s way to each lit point is free, by colour.
pub(crate) fn find_free(frame: &Frame, which: usize, seen: &Seen, draws: Draws, scratch: &mut Scratch) {
    let light = &frame.lights[which];
    if light.radius > 0.0 {
        return find_free_from_disc(frame, which, seen, draws, scratch);
    }
    let segments = &mut scratch.segments;
    segments.clear();
    segments.coherence = match light.kind {
        PosedLightKind::Directional { direction } => Coherence::Direction(-direction),
        PosedLightKind::Point { position } | PosedLightKind::Spot { position, .. } => {
            Coherence::Origin(position)
        }
    };
    let position = light.position().unwrap_or_default();
    let reached = &seen.reached;
    segments.from.extend(reached.iter().map(|to| to.start));
    segments.source.extend(reached.iter().map(|to| seen.source(to.point, to.above)));
    segments.to.resize(reached.len(), position);
    trace(frame, segments, &mut scratch.blocked, &mut scratch.free);
    if frame.solid_ground().is_none() {
        return;
    }
    for (k, to) in seen.reached.iter().enumerate() {
        let from = scratch.segments.from[k];
        let towards = light.position().map_or(to.l, |p| p.as_dvec3() - from.as_dvec3());
        if frame.below_ground(from, towards, light.position().is_none()) {
            scratch.free[k] = Rgb::ZERO;
        }
    }
}

/// The same for a light with a radius. Each sample looks at one place on the disc that the light is
/// to its point: so many samples, so many shadow rays, and their mean is how much of the light is
/// seen.
fn find_free_from_disc(frame: &Frame, which: usize, seen: &Seen, draws: Draws, scratch: &mut Scratch) {
    let light = &frame.lights[which];
    let segments = &mut scratch.segments;
    segments.clear();
    segments.coherence = Coherence::None;
    // Below the horizon of the smooth surface, where no ray need be asked.
    let mut hidden = Vec::with_capacity(seen.reached.len());
    for &Reached { point, l: to_centre, .. } in &seen.reached {
        let (group, at) = seen.columns.of(point);
        let off = light.disc_offset(to_centre, draws.one(seen.points[point].sample, Purpose::Light(which)));
        let p = narrow(&group.p, at).as_dvec3();
        let towards = match light.position() {
            Some(centre) => centre.as_dvec3() + off - p,
            None => to_centre + off,
        };
        let l = towards.normalize_or(to_centre);
        let (from, source) = seen.start(point, l);
        let to = match light.position() {
            Some(_) => (p + towards).as_vec3(),
            None => (from.as_dvec3() + l * frame.beyond(from)).as_vec3(),
        };
        segments.push(from, to, source);
        let towards = to.as_dvec3() - from.as_dvec3();
        let below = frame.below_ground(from, towards, light.position().is_none());
        hidden.push(below || vector(&group.n_v, at).dot(l) <= 0.0);
    }
    trace(frame, segments, &mut scratch.blocked, &mut scratch.free);
    for (free, _) in scratch.free.iter_mut().zip(&hidden).filter(|(_, hidden)| **hidden) {
        *free = Rgb::ZERO;
    }
    if let Some(centre) = light.position() {
        hold_back(frame, centre, scratch);
    }
}

/// A lamp that is wider than the fitting it hangs in, or nearer to a wall than its radius, would
/// shine on the far side: what its centre does not see of it, nobody sees.
fn hold_back(frame: &Frame, centre: Vec3, scratch: &mut Scratch) {
    let places = &scratch.segments.to;
    let seen: Vec<usize> = (0..places.len()).filter(|&i| scratch.free[i] != Rgb::ZERO).collect();
    let mut within = std::mem::take(&mut scratch.within);
    within.clear();
    within.coherence = Coherence::Origin(centre);
    for &i in &seen {
        within.push(places[i], centre, HitId::NONE);
    }
    trace(frame, &within, &mut scratch.blocked, &mut scratch.within_free);
    for (&i, &free) in seen.iter().zip(&scratch.within_free) {
        scratch.free[i] *= free;
    }
    scratch.within = within;
}

/// How much passes along every segment, by colour.
pub(crate) fn trace(frame: &Frame, segments: &SegmentBatch, blocked: &mut Vec<bool>, free: &mut Vec<Rgb>) {
    free.clear();
    let materials = MaterialHitFilter(frame.posed);
    if frame.accel.has_translucent() {
        frame.accel.transmittance(segments, &materials, free);
    } else {
        frame.accel.occluded(segments, &materials, blocked);
        free.extend(blocked.iter().map(|&b| if b { Rgb::ZERO } else { Rgb::ONE }));
    }
}

impl Frame<'_> {
    /// A distance from `p` beyond which there is nothing.
    pub(crate) fn beyond(&self, p: Vec3) -> f64 {
        1.01 * (p.as_dvec3().length() + self.posed.bounding_radius()) + f64::from(f32::MIN_POSITIVE)
    }

    /// Whether the ground stands between `from` and `from + towards`, or what is infinitely far
    /// that way. A ground that only catches shadows casts none.
    pub(crate) fn below_ground(&self, from: Vec3, towards: DVec3, infinitely: bool) -> bool {
        let Some(height) = self.solid_ground() else { return false };
        let from = f64::from(from.y);
        let end = match infinitely {
            true if towards.y == 0.0 => from,
            true => f64::INFINITY.copysign(towards.y),
            false => from + towards.y,
        };
        (from >= height) != (end >= height)
    }
}
