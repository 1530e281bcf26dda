//! What the rays of a packet share, and how that leads them through a tree.

use glam::Vec3;

use super::super::batch::Shared;
use super::super::bounds::Bounds;
use super::super::hit::inverse;
use super::super::simd::{Lanes, Simd};
use super::super::triangles::Triangles;
use super::super::wide::{LEAST, reciprocal};
use super::beam::{Direction, Origin};
use super::frustum::Frustum;
use super::{GROUP, GROUPS, Packet, PacketStack, Verdict};

/// The lines that a packet's rays are on, in its own parameter.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lines {
    /// From one place.
    From {
        o: Vec3,
        /// At least the length of every direction.
        length: f64,
        /// Which end of boxes comes first on each axis, where all rays agree on it.
        near_end: Option<[usize; 3]>,
    },
    /// Along one direction.
    Along(Vec3),
}

impl Lines {
    /// The origin that is shared, or the direction.
    pub fn shared(&self) -> (Option<Vec3>, Option<Vec3>) {
        match *self {
            Lines::From { o, .. } => (Some(o), None),
            Lines::Along(d) => (None, Some(d)),
        }
    }
}

impl Packet {
    /// Prepares what rays do not share, whose longest component is `most`, for tracing. `None` where
    /// they share nothing.
    #[inline(always)]
    pub(super) fn lines<S: Simd>(&mut self, shared: Shared, most: f32) -> Option<Lines> {
        let shrink = inverse(self.size) as f32;
        match shared {
            Shared::Origin(o) => {
                let length = f64::from(most * shrink) * 3f64.sqrt();
                Some(Lines::From { o, length, near_end: self.invert::<S>(shrink) })
            }
            Shared::Direction(d) => Some(Lines::Along(d * shrink)),
            Shared::None => None,
        }
    }

    /// Leads the rays through a tree. False where they are too far apart for that, and nothing is done.
    #[inline(always)]
    pub(super) fn lead<S: Simd, V: Verdict<S>>(
        &mut self,
        triangles: &Triangles,
        lines: &Lines,
        verdict: &mut V,
        stack: &mut PacketStack,
    ) -> bool {
        let (centre, radius, size) = (triangles.centre, triangles.radius, triangles.size());
        match *lines {
            Lines::From { o, length, near_end } => {
                let Some(frustum) = Frustum::from_origin::<S>(self, o, size) else { return false };
                let far = o.as_dvec3().distance(centre) + radius;
                let beam = Origin { o, pad: Vec3::ZERO, bounds: Bounds::new(length, far, 0.0), near_end };
                self.trace::<S, _, _>(triangles, &beam, &frustum, verdict, stack);
            }
            Lines::Along(d) => {
                let Some(frustum) = Frustum::along::<S>(self, d, size, radius as f32) else { return false };
                let far = self.reach::<S>(centre) + radius;
                let beam = Direction {
                    d,
                    reciprocal: reciprocal(d),
                    pad: Vec3::ZERO,
                    bounds: Bounds::new(d.as_dvec3().length(), far, 0.0),
                };
                self.trace::<S, _, _>(triangles, &beam, &frustum, verdict, stack);
            }
        }
        true
    }

    /// Multiplies the rays' own directions by `shrink` and fills in the reciprocals. Which end of
    /// boxes comes first on each axis, where they agree on it.
    #[inline(always)]
    fn invert<S: Simd>(&mut self, shrink: f32) -> Option<[usize; 3]> {
        let (mut ends, mut agree) = ([0; 3], true);
        let least = S::F16::splat(LEAST);
        for (axis, end) in ends.iter_mut().enumerate() {
            let (mut some, mut all) = (0, u32::MAX);
            for g in 0..GROUPS {
                let d = S::F16::load(&self.own[axis].0[g]) * S::F16::splat(shrink);
                d.store(&mut self.own[axis].0[g]);
                let r = S::F16::splat(1.0).div(d.abs().max(least)).flipped_by(d);
                r.store(&mut self.reciprocal[axis].0[g]);
                let negative = r.lt(S::F16::splat(0.0));
                some |= negative;
                all &= negative;
            }
            *end = usize::from(some != 0);
            agree &= some == 0 || all == (1 << GROUP) - 1;
        }
        agree.then_some(ends)
    }
}
