//! Segments by the packet: is anything in the way?

use glam::Vec3;

use super::super::batch::{Cutout, SegmentBatch, Shared};
use super::super::block::Block;
use super::super::blocking;
use super::super::hit::{Bounds, power_of_two};
use super::super::simd::{Lanes, Simd};
use super::super::triangles::Triangles;
use super::super::wide::{Stack, reciprocal};
use super::beam::{Direction, Origin};
use super::frustum::Frustum;
use super::{GROUP, Packet, PacketStack, PerRay, RAYS, Sure, Verdict};
use crate::geometry::Hit;

/// What is known of the segments of a packet.
pub(in crate::accel) struct Answers<'p> {
    /// A bit for each that is blocked.
    pub blocked: u64,
    /// What does not block them, if that is asked.
    pub passing: Option<&'p mut [Vec<Hit>; RAYS]>,
}

/// Asks what is in the way of segments `first..first + count` (at most a packet of them), if they
/// go together well enough; else nothing is done and false comes back.
#[inline(always)]
pub fn occluded<S: Simd>(
    triangles: &Triangles,
    (segments, first, count): (&SegmentBatch, usize, usize),
    cutouts: &dyn Cutout,
    answers: &mut Answers<'_>,
    (packets, stack): (&mut PacketStack, &mut Stack),
) -> bool {
    let from = &segments.from[first..first + count];
    let farthest = from.iter().fold(Vec3::ZERO, |most, o| most.max(o.abs())).max_element();
    if !(farthest < 1e30 && from.iter().all(|o| o.is_finite())) {
        return false;
    }
    let (centre, radius, size) = (triangles.centre, triangles.radius, triangles.size());
    // The longest of what is divided by a power of two to be about 1.
    let longest = match segments.shared {
        Shared::Origin(light) => {
            let far = from.iter().fold(Vec3::ZERO, |most, &p| most.max((p - light).abs()));
            if from.contains(&light) {
                return false;
            }
            far.max_element()
        }
        Shared::Direction(d) if d.is_finite() => d.abs().max_element(),
        _ => return false,
    };
    if !(longest > 1e-30 && longest < 1e30) {
        return false;
    }
    let power = power_of_two(f64::from(longest));
    let mut packet = Packet::new(1.0 / power);
    let mut verdict = Blocked {
        triangles,
        segments: (segments, first),
        cutouts,
        sources: PerRay::splat(u32::MAX),
        answers,
        stack,
    };
    let end = match segments.shared {
        Shared::Origin(_) => power as f32,
        _ => f32::INFINITY,
    };
    for ray in 0..RAYS {
        let of = ray.min(count - 1);
        let own = match segments.shared {
            Shared::Origin(light) => ((from[of].as_dvec3() - light.as_dvec3()) / power).as_vec3(),
            _ => from[of],
        };
        (0..3).for_each(|axis| packet.own[axis].set(ray, own[axis]));
        if ray < count {
            packet.lower.set(ray, end);
            packet.upper.set(ray, end);
            packet.live[ray / GROUP] |= 1 << (ray % GROUP);
            if let Some(index) = triangles.spans.index(segments.source[first + ray]) {
                verdict.sources.set(ray, index);
            }
        }
    }
    match segments.shared {
        Shared::Origin(o) => {
            let near_end = packet.invert::<S>();
            let Some(frustum) = Frustum::from_origin::<S>(&packet, o, size) else { return false };
            let length = f64::from(longest) / power * 3f64.sqrt();
            let far = o.as_dvec3().distance(centre) + radius;
            let beam = Origin { o, pad: Vec3::ZERO, bounds: Bounds::new(length, far, 0.0), near_end };
            packet.trace::<S, _, _>(triangles, &beam, &frustum, &mut verdict, packets);
        }
        Shared::Direction(d) => {
            let d = d * (1.0 / power) as f32;
            let Some(frustum) = Frustum::along::<S>(&packet, d, size, radius as f32) else { return false };
            let far = from.iter().fold(0f64, |far, o| far.max(o.as_dvec3().distance(centre))) + radius;
            let beam = Direction {
                d,
                reciprocal: reciprocal(d),
                pad: Vec3::ZERO,
                bounds: Bounds::new(d.as_dvec3().length(), far, 0.0),
            };
            packet.trace::<S, _, _>(triangles, &beam, &frustum, &mut verdict, packets);
        }
        Shared::None => return false,
    }
    true
}

/// A packet of segments at triangles.
struct Blocked<'a, 's, 'p, 'q> {
    triangles: &'a Triangles,
    segments: (&'a SegmentBatch, usize),
    cutouts: &'a dyn Cutout,
    /// The triangle that each starts on.
    sources: PerRay<u32>,
    answers: &'s mut Answers<'p>,
    stack: &'q mut Stack,
}

impl Blocked<'_, '_, '_, '_> {
    fn block(&mut self, packet: &mut Packet, ray: usize) {
        packet.finish(ray);
        self.answers.blocked |= 1 << ray;
    }
}

impl<S: Simd> Verdict<S> for Blocked<'_, '_, '_, '_> {
    #[inline(always)]
    fn plain(&self, block: &Block) -> u8 {
        block.opaque
    }

    #[inline(always)]
    fn ignores(&self, block: &Block, lane: usize, g: usize) -> u32 {
        S::F16::matching(&self.sources.0[g], block.ids[lane])
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        false
    }

    #[inline(always)]
    fn take(&mut self, packet: &mut Packet, g: usize, mask: u32, _: u32, _: Sure<S::F16>) {
        self.answers.blocked |= u64::from(mask) << (g * GROUP);
        packet.live[g] &= !mask;
        let done = S::F16::splat(-1.0);
        for limit in [&mut packet.lower.0[g], &mut packet.upper.0[g]] {
            done.or_else(mask, S::F16::load(limit)).store(limit);
        }
    }

    fn judge(&mut self, packet: &mut Packet, ray: usize, entry: u32) {
        let (block, lane) = self.triangles.at(entry);
        let passing = self.answers.passing.as_mut().map(|passing| &mut passing[ray]);
        let (line, mut query) = blocking(self.segments.0, self.segments.1 + ray, self.cutouts, passing);
        let Some(met) = line.and_then(|line| line.judge(&block.corners(lane))) else { return };
        self.triangles.tell(block, lane, met, None, &mut query);
        if query.blocked {
            self.block(packet, ray);
        }
    }

    #[inline(always)]
    fn go_alone(&mut self, packet: &mut Packet, ray: usize, child: u32) {
        let passing = self.answers.passing.as_mut().map(|passing| &mut passing[ray]);
        let (line, mut query) = blocking(self.segments.0, self.segments.1 + ray, self.cutouts, passing);
        let Some(line) = line else { return };
        self.triangles.visit::<S, _>(child, &line, None, &mut query, self.stack);
        if query.blocked {
            self.block(packet, ray);
        }
    }
}
