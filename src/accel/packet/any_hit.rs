//! Segments by the packet: is anything in the way?

use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::triangle4::Triangle4;
use crate::accel::packet::{GROUP, Packet, PacketStack, PerRay, Rays, Sure, Verdict, fetch, whole};
use crate::accel::ray_batch::{AnyHitFilter, Coherence, SegmentBatch};
use crate::accel::single_ray_tracer::segment_query;
use crate::accel::traverse::bvh8_traversal::TraversalStack;
use crate::accel::traverse::error_bounds::LIGHT;
use crate::accel::traverse::transmittance::Transmittance;
use crate::simd::{Lanes, Simd};

/// What is known of the segments of a packet.
pub(crate) struct Answers<'p> {
    /// Those that are blocked.
    pub blocked: Rays,
    /// What passes through what does not block them, if that is asked.
    pub passing: Option<&'p mut [Transmittance]>,
}

impl Answers<'_> {
    /// Whether a segment is blocked.
    #[inline(always)]
    pub fn blocked(&self, ray: usize) -> bool {
        self.blocked[ray / GROUP] >> (ray % GROUP) & 1 == 1
    }
}

/// Asks what of several trees is in the way of segments `first..first + count` (at most a packet of
/// them), if they go together well enough; else false comes back, and some of the trees may have been
/// asked.
#[inline(always)]
pub fn occluded<S: Simd>(
    trees: &[Blas],
    (segments, first, count): (&SegmentBatch, usize, usize),
    cutouts: &dyn AnyHitFilter,
    answers: &mut Answers<'_>,
    (packet, packets, stack): (&mut Packet, &mut PacketStack, &mut TraversalStack),
) -> bool {
    let mut room = None;
    fetch(segments.from.get(first + count..));
    let Some(from) = whole(&segments.from[first..first + count], &mut room) else { return false };
    let (lines, end) = match segments.coherence {
        Coherence::Origin(light) => (packet.take_directions::<S>(light, (from, count), light), 1.0),
        Coherence::Direction(d) => (packet.take_origins::<S>(d, (from, count)), f32::INFINITY),
        Coherence::None => return false,
    };
    let Some(lines) = lines else { return false };
    packet.begin::<S>(count, 0.0, end);
    if let Coherence::Origin(_) = segments.coherence {
        packet.sure_start = LIGHT * packet.size as f32;
    }
    for triangles in trees.iter().filter(|tree| !tree.is_empty()) {
        let mut sources = PerRay::splat(u32::MAX);
        triangles
            .ids
            .indices(&segments.source[first..first + count], sources.0.as_flattened_mut().as_flattened_mut());
        let segments = (segments, first);
        let mut verdict = Blocked { triangles, segments, cutouts, sources, answers: &mut *answers, stack };
        if !packet.lead::<S, _>(triangles, &lines, &mut verdict, packets) {
            return false;
        }
    }
    true
}

/// A packet of segments at triangles.
struct Blocked<'a, 's, 'p, 'q> {
    triangles: &'a Blas,
    segments: (&'a SegmentBatch, usize),
    cutouts: &'a dyn AnyHitFilter,
    /// The triangle that each starts on.
    sources: PerRay<u32>,
    answers: &'s mut Answers<'p>,
    stack: &'q mut TraversalStack,
}

impl Blocked<'_, '_, '_, '_> {
    fn block(&mut self, packet: &mut Packet, ray: usize) {
        packet.finish(ray);
        self.answers.blocked[ray / GROUP] |= 1 << (ray % GROUP);
    }
}

impl<S: Simd> Verdict<S> for Blocked<'_, '_, '_, '_> {
    #[inline(always)]
    fn plain(&self, block: &Triangle4) -> u8 {
        block.opaque_mask()
    }

    #[inline(always)]
    fn ignores(&self, block: &Triangle4, lane: usize, g: usize) -> u32 {
        S::F32x16::eq_u32(self.sources.group(g), block.ids[lane])
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        false
    }

    /// Rays from a lamp are together near it, and those of the sun nowhere.
    #[inline(always)]
    fn by_odds(&self) -> bool {
        matches!(self.segments.0.coherence, Coherence::Direction(_))
    }

    #[inline(always)]
    fn take(&mut self, packet: &mut Packet, g: usize, mask: u32, _: u32, _: Sure<S::F32x16>) {
        self.answers.blocked[g] |= mask;
        packet.live[g] &= !mask;
        let done = S::F32x16::splat(-1.0);
        for limit in [packet.lower.group_mut(g), packet.upper.group_mut(g)] {
            done.select(mask, S::F32x16::load(limit)).store(limit);
        }
    }

    fn judge(&mut self, packet: &mut Packet, ray: usize, entry: u32, sure: bool) {
        let (block, lane) = self.triangles.locate(entry);
        let passing = self.answers.passing.as_mut().map(|passing| &mut passing[ray]);
        let (line, mut query) = segment_query(self.segments.0, self.segments.1 + ray, self.cutouts, passing);
        let Some(met) = line.and_then(|line| line.intersect(&block.vertices(lane), sure)) else { return };
        self.triangles.report_hit(block, lane, met, None, &mut query);
        if query.blocked {
            self.block(packet, ray);
        }
    }

    #[inline(always)]
    fn go_alone(&mut self, packet: &mut Packet, ray: usize, child: u32) -> bool {
        let passing = self.answers.passing.as_mut().map(|passing| &mut passing[ray]);
        let (line, mut query) = segment_query(self.segments.0, self.segments.1 + ray, self.cutouts, passing);
        let Some(line) = line else { return false };
        self.triangles.traverse::<S, _>(child, &line, None, &mut query, self.stack);
        let blocked = query.blocked;
        if blocked {
            self.block(packet, ray);
        }
        blocked
    }
}
