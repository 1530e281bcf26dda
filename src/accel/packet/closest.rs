//! ClosestHit hits by the packet.

use glam::Vec3;

use super::{FOUR, GROUP, Packet, PacketStack, PerRay, Sure, Verdict, fetch, whole};
use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::accel::packet::exact_hits::{BLOCKS, GroupHits, Places};
use crate::accel::packet::shared_ray::Lines;
use crate::accel::ray_batch::{AnyHitFilter, Coherence, RayBatch};
use crate::accel::traverse::bvh8_traversal::TraversalStack;
use crate::accel::traverse::hit::LocalRay;
use crate::accel::traverse::query::{ClosestHit, RayContext, RayQuery};
use crate::geometry::{EPSILON, Hit, HitId};
use crate::simd::{Lanes, Simd};

/// No triangle yet.
const NONE: u32 = u32::MAX;
/// The hit is known exactly.
const EXACT: u32 = u32::MAX - 1;

/// Finds the closest hits of rays `first..first + count` (at most a packet of them) in several trees,
/// if they go together well enough, and puts those that are hits into `out`, which holds misses; else
/// false comes back, and `out` may hold hits in some of the trees.
#[inline(always)]
pub fn intersect<S: Simd>(
    trees: &[Blas],
    (rays, first, count): (&RayBatch, usize, usize),
    cutouts: &dyn AnyHitFilter,
    out: &mut [Hit],
    (packet, packets, stack): (&mut Packet, &mut PacketStack, &mut TraversalStack),
) -> bool {
    let range = first..first + count;
    let mut room = None;
    fetch(match rays.coherence {
        Coherence::Direction(_) => rays.origins.get(range.end..),
        _ => rays.directions.get(range.end..),
    });
    // What is shared is told once for all of them, and so the same to the bit.
    let lines = match rays.coherence {
        Coherence::Origin(o) => whole(&rays.directions[range.clone()], &mut room)
            .and_then(|directions| packet.take_directions::<S>(o, (directions, count), Vec3::ZERO)),
        Coherence::Direction(_) => whole(&rays.origins[range.clone()], &mut room)
            .and_then(|origins| packet.take_origins::<S>(rays.directions[first], (origins, count))),
        Coherence::None => None,
    };
    let Some(lines) = lines.filter(|_| rays.t_max > 0.0) else { return false };
    packet.begin::<S>(count, rays.before_first().t, rays.t_max);
    if let Some(after) = rays.after.get(range) {
        let by = packet.size as f32;
        after.iter().enumerate().for_each(|(i, after)| packet.start.set(i, after.t * by));
    }
    for (nth, triangles) in trees.iter().filter(|tree| !tree.is_empty()).enumerate() {
        let mut best = PerRay::splat(NONE);
        if nth > 0 {
            let known = |ray: usize| if out[ray].is_miss() { NONE } else { EXACT };
            (0..count).for_each(|ray| best.set(ray, known(ray)));
        }
        let mut verdict = Nearest { triangles, rays: (rays, first), cutouts, best, hits: &mut *out, stack };
        if !packet.lead::<S, _>(triangles, &lines, &mut verdict, packets) {
            return false;
        }
        verdict.settle::<S>(packet, &lines);
    }
    true
}

/// The closest hits of a packet, as far as it has got.
struct Nearest<'a, 's> {
    triangles: &'a Blas,
    rays: (&'a RayBatch, usize),
    cutouts: &'a dyn AnyHitFilter,
    /// What each ray hit: [`NONE`], [`EXACT`] or the place of a plain triangle in the blocks.
    best: PerRay<u32>,
    /// Where hits go: at once for those that are [`EXACT`].
    hits: &'s mut [Hit],
    stack: &'s mut TraversalStack,
}

impl<'a> Nearest<'a, '_> {
    /// A ray's origin and direction. A shared origin is at hand; each ray's own of it is far off in memory.
    #[inline(always)]
    fn ray(&self, ray: usize) -> (Vec3, Vec3) {
        let (rays, first) = self.rays;
        let d = rays.directions[first + ray];
        match rays.coherence {
            Coherence::Origin(o) => (o, d),
            _ => (rays.origins[first + ray], d),
        }
    }

    #[inline(always)]
    fn line(&self, ray: usize) -> Option<LocalRay> {
        let (o, d) = self.ray(ray);
        LocalRay::new(o.as_dvec3(), d.as_dvec3())
    }

    /// A ray's closest hit so far, exactly.
    #[inline(always)]
    fn settled(&self, ray: usize) -> Hit {
        match self.best.get(ray) {
            NONE => Hit { t: self.rays.0.t_max, id: HitId::NONE },
            EXACT => self.hits[ray],
            entry => {
                let (block, lane) = self.triangles.locate(entry);
                let met = self.line(ray).and_then(|line| line.intersect_certain(&block.vertices(lane)));
                met.map_or(Hit::MISS, |met| Hit { t: met.t, id: self.triangles.ids.id(block.ids[lane]) })
            }
        }
    }

    /// Computes where sure hits are.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, packet: &Packet, lines: &Lines) {
        // Some groups at a time: neighbours mostly meet the same few blocks.
        for (q, hits) in self.hits.chunks_mut(FOUR * GROUP).enumerate().take(packet.quads) {
            settle_four::<S>(self.triangles, (packet, lines, q), &self.best.0[q], hits);
        }
    }

    fn question(&self, ray: usize) -> ClosestHit<'a> {
        let (rays, first) = self.rays;
        let (o, d) = self.ray(ray);
        let asked = RayContext { o, d, cutouts: self.cutouts };
        ClosestHit {
            asked,
            cull: rays.cull_back_faces,
            after: rays.after(first + ray),
            best: self.settled(ray),
        }
    }

    /// True where anything changed.
    fn answer(&mut self, packet: &mut Packet, ray: usize, query: &ClosestHit) -> bool {
        let changed = !query.best.is_miss() && (self.best.get(ray) != EXACT || self.hits[ray] != query.best);
        if changed {
            self.best.set(ray, EXACT);
            self.hits[ray] = query.best;
            packet.limit(ray, query.t_max());
        }
        changed
    }
}

/// Computes where sure hits of four groups are.
#[inline(always)]
fn settle_four<S: Simd>(
    triangles: &Blas,
    (packet, lines, q): (&Packet, &Lines, usize),
    best: &[[u32; GROUP]; FOUR],
    hits: &mut [Hit],
) {
    let mut left = [0; FOUR];
    for (left, (hits, best)) in left.iter_mut().zip(hits.chunks(GROUP).zip(best)) {
        *left = S::F32x16::lt_u32(best, EXACT) & ((1 << hits.len()) - 1) as u32;
    }
    if left == [0; FOUR] {
        return;
    }
    let blocks: &[Triangle4] = &triangles.blocks;
    let mut places = Places::new(lines);
    let mut numbers = [[0; GROUP]; FOUR];
    let mut from = 0;
    while from < FOUR {
        let (mut held, mut its) = (0, [0; FOUR]);
        while from < FOUR && held < BLOCKS {
            if left[from] == 0 {
                from += 1;
                continue;
            }
            let entry = best[from][left[from].trailing_zeros() as usize & (GROUP - 1)];
            let block = entry as usize / TRIANGLE_LANES;
            places.put(held, &blocks[block], &triangles.ids);
            let four = ((block * TRIANGLE_LANES) as u32, (held * TRIANGLE_LANES) as u32);
            for g in from..FOUR {
                let here = S::F32x16::renumber_quad(&best[g], four.0, four.1, &mut numbers[g]) & left[g];
                left[g] &= !here;
                its[g] |= here;
            }
            held += 1;
        }
        for (g, hits) in hits.chunks_mut(GROUP).enumerate().take(FOUR) {
            if its[g] != 0 {
                put_hits::<S>(its[g], &places.of::<S>(packet, q * FOUR + g, &numbers[g]), hits);
            }
        }
    }
}

/// Writes the hits of the lines in `mask`.
#[inline(always)]
fn put_hits<S: Simd>(mask: u32, (t, ids): &GroupHits, hits: &mut [Hit]) {
    let along = S::F32x16::load(t);
    let mut mask = mask & S::F32x16::splat(0.0).lt(along) & along.lt(S::F32x16::splat(f32::INFINITY));
    if mask == (1 << GROUP) - 1
        && let Some(hits) = hits.first_chunk_mut::<GROUP>()
    {
        S::interleave3([bytemuck::cast_ref(t), &ids[0], &ids[1]], bytemuck::cast_mut(hits));
        return;
    }
    while mask != 0 {
        let i = mask.trailing_zeros() as usize & (GROUP - 1);
        if let Some(to) = hits.get_mut(i) {
            *to = Hit { t: t[i], id: HitId { instance: ids[0][i], triangle: ids[1][i] } };
        }
        mask &= mask - 1;
    }
}

impl<S: Simd> Verdict<S> for Nearest<'_, '_> {
    #[inline(always)]
    fn plain(&self, block: &Triangle4) -> u8 {
        block.unfiltered_mask()
    }

    #[inline(always)]
    fn ignores(&self, _: &Triangle4, _: usize, _: usize) -> u32 {
        0
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        self.rays.0.cull_back_faces
    }

    #[inline(always)]
    fn take(&mut self, packet: &mut Packet, g: usize, mask: u32, entry: u32, hit: Sure<S::F32x16>) {
        let over = hit.det.rcp();
        let wider = |x: S::F32x16, by: f32| x * over * S::F32x16::splat(by);
        let lower = wider(hit.depth - hit.slack, 1.0 - 8.0 * EPSILON);
        let upper = wider(hit.depth + hit.slack, 1.0 + 8.0 * EPSILON);
        lower.select(mask, S::F32x16::load(packet.lower.group(g))).store(packet.lower.group_mut(g));
        upper.select(mask, S::F32x16::load(packet.upper.group(g))).store(packet.upper.group_mut(g));
        S::F32x16::masked_fill(mask, self.best.group_mut(g), entry);
    }

    fn judge(&mut self, packet: &mut Packet, ray: usize, entry: u32, sure: bool) {
        let (block, lane) = self.triangles.locate(entry);
        let Some(met) = self.line(ray).and_then(|line| line.intersect(&block.vertices(lane), sure)) else {
            return;
        };
        let mut query = self.question(ray);
        self.triangles.report_hit(block, lane, met, None, &mut query);
        self.answer(packet, ray, &query);
    }

    #[inline(always)]
    fn go_alone(&mut self, packet: &mut Packet, ray: usize, child: u32) -> bool {
        let Some(line) = self.line(ray) else { return false };
        let mut query = self.question(ray);
        self.triangles.traverse::<S, _>(child, &line, None, &mut query, self.stack);
        self.answer(packet, ray, &query)
    }
}
