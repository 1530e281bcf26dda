//! Closest hits by the packet.

use glam::Vec3;

use super::super::batch::{Cutout, RayBatch, Shared};
use super::super::block::{Block, CAPACITY};
use super::super::hit::{Bounds, FrameRay, power_of_two};
use super::super::query::{Asked, Closest, Query};
use super::super::simd::{Lanes, Simd};
use super::super::triangles::Triangles;
use super::super::wide::{Stack, reciprocal};
use super::beam::{Direction, Origin};
use super::frustum::Frustum;
use super::{GROUP, GROUPS, Packet, PacketStack, PerRay, RAYS, Sure, Verdict};
use crate::geometry::{EPSILON, Hit, HitId};

/// No triangle yet.
const NONE: u32 = u32::MAX;
/// The hit is known exactly.
const EXACT: u32 = u32::MAX - 1;

/// Finds the closest hits of rays `first..first + count` (at most a packet of them), if they go
/// together well enough; else nothing is done and false comes back.
#[inline(always)]
pub fn intersect<S: Simd>(
    triangles: &Triangles,
    (rays, first, count): (&RayBatch, usize, usize),
    cutouts: &dyn Cutout,
    out: &mut Vec<Hit>,
    (packets, stack): (&mut PacketStack, &mut Stack),
) -> bool {
    let range = first..first + count;
    let directions = &rays.directions[range.clone()];
    let origins = &rays.origins[range.clone()];
    let (after, t_max) = (&rays.after[range.clone()], &rays.t_max[range]);
    let longest = directions.iter().fold(Vec3::ZERO, |most, d| most.max(d.abs())).max_element();
    let farthest = origins.iter().fold(Vec3::ZERO, |most, o| most.max(o.abs())).max_element();
    let fits = |d: &Vec3| d.is_finite() && *d != Vec3::ZERO;
    if !(longest > 1e-30 && longest < 1e30 && farthest < 1e30 && directions.iter().all(fits)) {
        return false;
    }
    if !origins.iter().all(|o| o.is_finite()) || t_max.iter().any(|t| t.is_nan()) {
        return false;
    }
    let power = power_of_two(f64::from(longest));
    let shrink = (1.0 / power) as f32;
    let mut packet = Packet::new(1.0 / power);
    for ray in 0..RAYS {
        let of = ray.min(count - 1);
        let own = match rays.shared {
            Shared::Direction(_) => origins[of],
            _ => directions[of] * shrink,
        };
        (0..3).for_each(|axis| packet.own[axis].set(ray, own[axis]));
        let parameter = |t: f32| (f64::from(t) * power) as f32;
        packet.start.set(ray, parameter(after[of].t));
        let limit = parameter(t_max[of]);
        if ray < count && limit > 0.0 {
            packet.lower.set(ray, limit);
            packet.upper.set(ray, limit);
            packet.live[ray / GROUP] |= 1 << (ray % GROUP);
        }
    }
    let mut verdict = Nearest {
        triangles,
        rays: (rays, first),
        cutouts,
        best: PerRay::splat(NONE),
        hits: [Hit::MISS; RAYS],
        stack,
    };
    let (centre, radius) = (triangles.centre, triangles.radius);
    let size = triangles.size();
    match rays.shared {
        Shared::Origin(o) => {
            let near_end = packet.invert::<S>();
            let Some(frustum) = Frustum::from_origin::<S>(&packet, o, size) else { return false };
            let length = f64::from(longest * shrink) * 3f64.sqrt();
            let far = o.as_dvec3().distance(centre) + radius;
            let beam = Origin { o, pad: Vec3::ZERO, bounds: Bounds::new(length, far, 0.0), near_end };
            packet.trace::<S, _, _>(triangles, &beam, &frustum, &mut verdict, packets);
        }
        Shared::Direction(_) => {
            let d = directions[0] * shrink;
            let Some(frustum) = Frustum::along::<S>(&packet, d, size, radius as f32) else { return false };
            let far = origins.iter().fold(0f64, |far, o| far.max(o.as_dvec3().distance(centre))) + radius;
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
    for ray in 0..count {
        let hit = verdict.settled(ray);
        out.push(if hit.is_miss() { Hit::MISS } else { hit });
    }
    true
}

impl Packet {
    /// Fills in the reciprocals of the rays' own directions. Which end of boxes comes first on
    /// each axis, where they agree on it.
    #[inline(always)]
    pub(super) fn invert<S: Simd>(&mut self) -> Option<[usize; 3]> {
        let (mut ends, mut agree) = ([0; 3], true);
        let least = S::F16::splat(super::super::wide::LEAST);
        for (axis, end) in ends.iter_mut().enumerate() {
            let (mut some, mut all) = (0, u32::MAX);
            for g in 0..GROUPS {
                let d = S::F16::load(&self.own[axis].0[g]);
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

/// The closest hits of a packet, as far as it has got.
struct Nearest<'a, 's> {
    triangles: &'a Triangles,
    rays: (&'a RayBatch, usize),
    cutouts: &'a dyn Cutout,
    /// What each ray hit: [`NONE`], [`EXACT`] or the place of a plain triangle in the blocks.
    best: PerRay<u32>,
    /// The hits of those that are [`EXACT`].
    hits: [Hit; RAYS],
    stack: &'s mut Stack,
}

impl<'a> Nearest<'a, '_> {
    fn line(&self, ray: usize) -> Option<FrameRay> {
        let (rays, first) = self.rays;
        FrameRay::new(rays.origins[first + ray].as_dvec3(), rays.directions[first + ray].as_dvec3())
    }

    /// A ray's closest hit so far, exactly.
    #[inline(always)]
    fn settled(&self, ray: usize) -> Hit {
        match self.best.get(ray) {
            NONE => Hit { t: self.rays.0.t_max[self.rays.1 + ray], id: HitId::NONE },
            EXACT => self.hits[ray],
            entry => {
                let (block, lane) = self.triangles.at(entry);
                let met = self.line(ray).and_then(|line| line.place(&block.corners(lane)));
                met.map_or(Hit::MISS, |met| Hit { t: met.t, id: self.triangles.spans.id(block.ids[lane]) })
            }
        }
    }

    fn question(&self, ray: usize) -> Closest<'a> {
        let (rays, first) = self.rays;
        let i = first + ray;
        let asked = Asked { o: rays.origins[i], d: rays.directions[i], cutouts: self.cutouts };
        Closest { asked, cull: rays.cull, after: rays.after[i], best: self.settled(ray) }
    }

    fn answer(&mut self, packet: &mut Packet, ray: usize, query: &Closest) {
        if !query.best.is_miss() {
            self.best.set(ray, EXACT);
            self.hits[ray] = query.best;
            packet.limit(ray, query.limit());
        }
    }
}

impl<S: Simd> Verdict<S> for Nearest<'_, '_> {
    #[inline(always)]
    fn plain(&self, block: &Block) -> u8 {
        block.plain
    }

    #[inline(always)]
    fn ignores(&self, _: &Block, _: usize, _: usize) -> u32 {
        0
    }

    #[inline(always)]
    fn culls(&self) -> bool {
        self.rays.0.cull
    }

    #[inline(always)]
    fn take(&mut self, packet: &mut Packet, g: usize, mask: u32, entry: u32, hit: Sure<S::F16>) {
        let wider = |x: S::F16, by: f32| x.div(hit.det) * S::F16::splat(by);
        let lower = wider(hit.depth - hit.slack, 1.0 - 4.0 * EPSILON);
        let upper = wider(hit.depth + hit.slack, 1.0 + 4.0 * EPSILON);
        lower.or_else(mask, S::F16::load(&packet.lower.0[g])).store(&mut packet.lower.0[g]);
        upper.or_else(mask, S::F16::load(&packet.upper.0[g])).store(&mut packet.upper.0[g]);
        S::F16::put(mask, &mut self.best.0[g], entry);
    }

    fn judge(&mut self, packet: &mut Packet, ray: usize, entry: u32) {
        let (block, lane) = self.triangles.at(entry);
        let Some(met) = self.line(ray).and_then(|line| line.judge(&block.corners(lane))) else { return };
        let mut query = self.question(ray);
        self.triangles.tell(block, lane, met, None, &mut query);
        self.answer(packet, ray, &query);
    }

    #[inline(always)]
    fn go_alone(&mut self, packet: &mut Packet, ray: usize, child: u32) {
        let Some(line) = self.line(ray) else { return };
        let mut query = self.question(ray);
        self.triangles.visit::<S, _>(child, &line, None, &mut query, self.stack);
        self.answer(packet, ray, &query);
    }
}

const _: () = assert!(CAPACITY == 4);
