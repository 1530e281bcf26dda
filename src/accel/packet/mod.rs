//! Sixty-four rays that share an origin or a direction, through a tree together.
//!
//! Four planes around all of them cull a node's eight children at once; a child that is left is
//! tested against each ray in groups of sixteen; what depends on the shared part and a triangle
//! alone is computed once for all. Where few rays of a packet remain, they go on alone.
//!
//! f32 decides only what its error bounds prove. Every ray carries an interval that the t of its
//! closest hit so far lies in; hits that are neither surely inside nor surely outside of a
//! triangle, or of that interval, go to the same judgement in f64 as a single ray's, and t is
//! computed there for whatever won. So packets answer as single rays do, to the bit.

mod beam;
mod closest;
mod frustum;
mod lines;
mod places;
mod shadow;

use glam::{DVec3, Vec3};

use super::block::{Block, CAPACITY};
use super::bounds::W_SCALE;
use super::lanes::by_axis;
use super::simd::{Lanes, Part, Simd, prefetch, prefetch_whole};
use super::triangles::Triangles;
use super::wide::{FIRST_SLOTS, GROW, LAST_SLOTS, LEAF, Node, Octant, WIDTH};
use crate::geometry::EPSILON;
use beam::{Beam, Faces};
use frustum::{Cone, Frustum};

pub(super) use closest::intersect;
pub(super) use shadow::{Answers, occluded};

/// Rays in a group.
pub(super) const GROUP: usize = 16;
/// Groups in a packet.
pub(super) const GROUPS: usize = 4;
/// Rays in a packet.
pub(super) const RAYS: usize = GROUP * GROUPS;

/// With so many rays left or fewer, they go on alone.
const FEW: u32 = 3;

/// The rays of a group.
#[inline(always)]
fn group_of(rays: u64, g: usize) -> u32 {
    (rays >> (g * GROUP)) as u32 & ((1 << GROUP) - 1)
}

/// Has the vectors of the packet that comes next fetched, if there is one.
#[inline(always)]
fn fetch(next: Option<&[Vec3]>) {
    let next = next.unwrap_or_default();
    // A processor fetches 64 bytes at once.
    next[..next.len().min(RAYS)].chunks(64 / size_of::<Vec3>()).for_each(prefetch);
}

/// Trees of so many bytes are in a processor's cache for the most part, and fetching them ahead only takes time.
const NEAR_BY: usize = 8 << 20;

/// Has a child of a node fetched.
#[inline(always)]
fn fetch_child(child: u32, nodes: &[Node], blocks: &[Block]) {
    if child & LEAF == 0 {
        nodes.get(child as usize).into_iter().for_each(prefetch_whole);
    } else {
        blocks.get((child & !LEAF) as usize).into_iter().for_each(prefetch_whole);
    }
}

/// What a packet's rays have, the last one's repeated where there are fewer.
#[inline(always)]
fn whole<'a, T: Copy>(of: &'a [T], room: &'a mut Option<[T; RAYS]>) -> Option<&'a [T; RAYS]> {
    if let Some(whole) = of.first_chunk() {
        return Some(whole);
    }
    let room = room.insert([*of.last()?; RAYS]);
    room[..of.len()].copy_from_slice(of);
    Some(room)
}

impl Default for Packet {
    fn default() -> Self {
        let zero = PerRay::splat(0.0);
        Packet {
            own: [zero.clone(), zero.clone(), zero.clone()],
            reciprocal: [zero.clone(), zero.clone(), zero.clone()],
            start: zero.clone(),
            lower: zero.clone(),
            upper: zero,
            live: [0; GROUPS],
            sure_start: 0.0,
            cone: Cone::default(),
            size: 1.0,
        }
    }
}

/// A number for each ray.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(super) struct PerRay<T>([[T; GROUP]; GROUPS]);

impl<T: Copy> PerRay<T> {
    #[inline(always)]
    fn splat(x: T) -> Self {
        PerRay([[x; GROUP]; GROUPS])
    }

    #[inline(always)]
    fn set(&mut self, ray: usize, x: T) {
        self.0[ray / GROUP][ray % GROUP] = x;
    }

    #[inline(always)]
    fn get(&self, ray: usize) -> T {
        self.0[ray / GROUP][ray % GROUP]
    }
}

/// Rays, in the parameter of directions that were divided by `size`. One for each batch, filled again
/// and again.
#[derive(Debug)]
pub(super) struct Packet {
    /// By axis what rays do not share: their directions, or their origins.
    own: [PerRay<f32>; 3],
    /// 1 over the directions, where those are not shared.
    reciprocal: [PerRay<f32>; 3],
    /// What comes surely before this has no effect.
    start: PerRay<f32>,
    /// The t that nothing beyond matters lies between these; −1 where a ray is done.
    lower: PerRay<f32>,
    upper: PerRay<f32>,
    /// The rays that are not done, by group.
    live: [u32; GROUPS],
    /// What comes before this may have no effect.
    sure_start: f32,
    /// Around the directions, where those are not shared.
    cone: Cone,
    /// This many times a caller's parameter: a parameter of the packet. A power of two, and 1 for
    /// directions of ordinary lengths.
    size: f64,
}

/// Children that a packet has yet to visit.
#[derive(Clone, Debug)]
pub(super) struct PacketStack {
    pending: Vec<Pending>,
    /// Entries in use.
    top: usize,
}

/// The children of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Pending {
    node: u32,
    /// A bit for each group that may enter them.
    groups: u32,
    /// The slots of those that are left, the next one last.
    slots: [u32; WIDTH],
    /// No ray enters them before this.
    near: [f32; WIDTH],
    left: u32,
    /// Their boxes, by slot.
    faces: Faces,
}

impl Default for PacketStack {
    fn default() -> Self {
        PacketStack { pending: vec![Pending::default(); 16], top: 0 }
    }
}

impl PacketStack {
    /// Room for the children of one more node.
    #[inline(always)]
    fn room(&mut self) -> &mut Pending {
        if self.top >= self.pending.len() {
            self.grow();
        }
        &mut self.pending[self.top]
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self) {
        self.pending.resize(2 * (self.top + 1), Pending::default());
    }
}

/// What becomes of hits.
trait Verdict<S: Simd> {
    /// Triangles of a block whose sure hits need no further thought.
    fn plain(&self, block: &Block) -> u8;

    /// Rays of group `g` that triangle `lane` of a block means nothing to.
    fn ignores(&self, block: &Block, lane: usize, g: usize) -> u32;

    /// True where back faces of single-sided triangles are not seen.
    fn culls(&self) -> bool;

    /// True where children go by their odds, and not by what is nearest.
    fn by_odds(&self) -> bool {
        false
    }

    /// Rays `mask` of group `g` surely meet a plain triangle in front of all that they met before,
    /// at depth/det give or take slack/det.
    fn take(&mut self, packet: &mut Packet, g: usize, mask: u32, entry: u32, hit: Sure<S::F16>);

    /// A ray may meet a triangle, or is `sure` to go through it and to face it: it has to be judged.
    fn judge(&mut self, packet: &mut Packet, ray: usize, entry: u32, sure: bool);

    /// A ray goes on alone under `child`.
    fn go_alone(&mut self, packet: &mut Packet, ray: usize, child: u32);
}

/// Where a sure hit is.
#[derive(Clone, Copy)]
struct Sure<L> {
    depth: L,
    det: L,
    slack: L,
}

impl Packet {
    /// Takes the first `count` rays, which begin at `start` and of which nothing matters beyond `end`,
    /// in a caller's parameter.
    #[inline(always)]
    fn begin<S: Simd>(&mut self, count: usize, start: f32, end: f32) {
        let by = self.size as f32;
        let all = if count < RAYS { (1 << count) - 1 } else { u64::MAX };
        let (start, end) = (S::F16::splat(start * by), S::F16::splat(end * by));
        let none = S::F16::splat(-1.0);
        for g in 0..GROUPS {
            self.live[g] = (all >> (g * GROUP)) as u32 & ((1 << GROUP) - 1);
            start.store(&mut self.start.0[g]);
            let end = end.or_else(self.live[g], none);
            end.store(&mut self.lower.0[g]);
            end.store(&mut self.upper.0[g]);
        }
        self.sure_start = 0.0;
    }

    /// At least how far from `centre` what rays do not share is.
    #[inline(always)]
    fn reach<S: Simd>(&self, centre: DVec3) -> f64 {
        let middle = centre.as_vec3();
        let mut most = S::F16::splat(0.0);
        for axis in 0..3 {
            for g in 0..GROUPS {
                most = (S::F16::load(&self.own[axis].0[g]) - S::F16::splat(middle[axis])).abs().max(most);
            }
        }
        let rounding = 4.0 * f64::from(EPSILON) * (f64::from(most.greatest()) + centre.length());
        f64::from(most.greatest()) * 3f64.sqrt() + rounding
    }

    /// A ray is done.
    fn finish(&mut self, ray: usize) {
        self.live[ray / GROUP] &= !(1 << (ray % GROUP));
        self.lower.set(ray, -1.0);
        self.upper.set(ray, -1.0);
    }

    /// A ray's closest hit so far is at a caller's t.
    fn limit(&mut self, ray: usize, t: f32) {
        let t = (f64::from(t) * self.size) as f32;
        self.lower.set(ray, t);
        self.upper.set(ray, t);
    }

    /// Nothing beyond this matters to any ray.
    #[inline(always)]
    fn farthest<S: Simd>(&self) -> f32 {
        let upper = |g: usize| S::F16::load(&self.upper.0[g]);
        upper(0).max(upper(1)).max(upper(2).max(upper(3))).greatest() * GROW
    }

    /// Leads the rays through a tree.
    #[inline(always)]
    fn trace<S: Simd, B: Beam<S>, V: Verdict<S>>(
        &mut self,
        triangles: &Triangles,
        beam: &B,
        frustum: &Frustum,
        verdict: &mut V,
        stack: &mut PacketStack,
    ) {
        S::call(Trace { packet: self, triangles, beam, frustum, verdict, stack });
    }

    /// The rays in `entering` at a leaf. True where anything changed.
    #[inline(always)]
    fn meet_leaf<S: Simd, B: Beam<S>>(
        &mut self,
        blocks: &[Block],
        beam: &B,
        first: u32,
        entering: u64,
        verdict: &mut impl Verdict<S>,
    ) -> bool {
        let mut changed = false;
        for (index, block) in blocks.iter().enumerate().skip(first as usize) {
            let prepared = beam.prepare(block);
            let slack = beam.slack(block);
            let (side, minus) = (S::F16::splat(slack.side), S::F16::splat(-slack.side));
            let (unsure, facing) = (S::F16::splat(slack.depth), S::F16::splat(slack.facing));
            for g in 0..GROUPS {
                let mask = group_of(entering, g);
                if mask == 0 {
                    continue;
                }
                for lane in 0..block.count() {
                    let sides = beam.sides(self, g, &prepared, lane);
                    let (u, v) = (sides.u, sides.v);
                    let w = (sides.det - u - v) * S::F16::splat(W_SCALE);
                    let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
                    // Written so that NaN stays possible.
                    let outside = least.lt(minus) & side.lt(greatest);
                    let mut possible = mask & self.live[g] & !outside;
                    if possible == 0 {
                        continue;
                    }
                    let det = sides.det.abs();
                    let depth = sides.depth.flipped_by(sides.det);
                    let certain = facing.lt(det);
                    if verdict.culls() {
                        let look = block.look(lane);
                        if look.single_sided {
                            let against = sides.det.lt(S::F16::splat(0.0));
                            let back = if look.reversed { against } else { !against };
                            possible &= !(back & certain);
                        }
                    }
                    possible &= !verdict.ignores(block, lane, g);
                    let start = S::F16::load(&self.start.0[g]);
                    let inside = certain & (side.lt(least) | greatest.lt(minus));
                    let (before, behind) = (depth - unsure, depth + unsure);
                    let nearer = behind.lt(S::F16::load(&self.lower.0[g]) * det)
                        & (start.max(S::F16::splat(self.sure_start)) * det).lt(before);
                    let plain = u32::from(verdict.plain(block) >> lane & 1).wrapping_neg();
                    let sure = possible & inside & nearer & plain;
                    let mut doubtful = possible & !sure;
                    if doubtful != 0 {
                        let upper = S::F16::load(&self.upper.0[g]);
                        let beyond = (upper * det).lt(before) | behind.lt(start * det);
                        doubtful &= !(beyond & certain);
                    }
                    if sure | doubtful == 0 {
                        continue;
                    }
                    changed = true;
                    let entry = (index * CAPACITY + lane) as u32;
                    if sure != 0 {
                        verdict.take(self, g, sure, entry, Sure { depth, det, slack: unsure });
                    }
                    while doubtful != 0 {
                        let ray = doubtful.trailing_zeros() as usize;
                        verdict.judge(self, g * GROUP + ray, entry, inside >> ray & 1 == 1);
                        doubtful &= doubtful - 1;
                    }
                }
            }
            if block.last() {
                break;
            }
        }
        changed
    }
}

/// [`Packet::trace`].
struct Trace<'a, B, V> {
    packet: &'a mut Packet,
    triangles: &'a Triangles,
    beam: &'a B,
    frustum: &'a Frustum,
    verdict: &'a mut V,
    stack: &'a mut PacketStack,
}

impl<S: Simd, B: Beam<S>, V: Verdict<S>> Part<S> for Trace<'_, B, V> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Trace { packet, triangles, beam, frustum, verdict, stack } = self;
        let Some(root) = triangles.tree.root else { return };
        let blocks: &[Block] = &triangles.blocks;
        stack.top = 0;
        if root & LEAF != 0 {
            let all = (0..GROUPS).fold(0, |all, g| all | u64::from(packet.live[g]) << (g * GROUP));
            packet.meet_leaf::<S, B>(blocks, beam, root & !LEAF, all, verdict);
            return;
        }
        let nodes: &[Node] = &triangles.tree.nodes;
        let octant = Octant::of(frustum.mean());
        let by_odds = verdict.by_odds();
        let far_off = size_of_val(nodes) + size_of_val(blocks) > NEAR_BY;
        let mut farthest = packet.farthest::<S>();
        let mut groups = 0;
        for g in 0..GROUPS {
            groups |= u32::from(packet.live[g] != 0) << g;
        }
        let mut here = root;
        loop {
            let node = &nodes[here as usize];
            let (hit, near) = frustum.meets::<S>(node, farthest);
            if hit != 0 {
                let next = stack.room();
                (next.node, next.groups, next.left) = (here, groups, hit.count_ones());
                let order = if by_odds { LAST_SLOTS } else { node.order(octant) };
                S::arrange(hit, order, (near, &FIRST_SLOTS), (&mut next.near, &mut next.slots));
                beam.faces(node, &mut next.faces);
                stack.top += 1;
            }
            (here, groups) = loop {
                let Some(next) = stack.pending[..stack.top].last_mut() else { return };
                if next.left == 0 {
                    stack.top -= 1;
                    continue;
                }
                next.left -= 1;
                let last = next.left as usize & (WIDTH - 1);
                if !(next.near[last] <= farthest) {
                    continue;
                }
                let node = &nodes[next.node as usize];
                let slot = next.slots[last] as usize & (WIDTH - 1);
                if far_off && next.left > 0 {
                    // What comes after this, unless this descends.
                    let coming = next.slots[(next.left - 1) as usize & (WIDTH - 1)] as usize & (WIDTH - 1);
                    fetch_child(node.child[coming], nodes, blocks);
                }
                let faces = &next.faces;
                let planes = by_axis(|axis| [faces[axis][0][slot], faces[axis][1][slot]]);
                // In a register: what goes through memory by parts is waited for.
                let mut entering = 0u64;
                for g in 0..GROUPS {
                    if next.groups >> g & 1 == 1 {
                        let mask = beam.enters(packet, g, &planes) & packet.live[g];
                        entering |= u64::from(mask) << (g * GROUP);
                    }
                }
                if entering == 0 {
                    continue;
                }
                let child = node.child[slot];
                if child & LEAF != 0 {
                    if packet.meet_leaf::<S, B>(blocks, beam, child & !LEAF, entering, verdict) {
                        farthest = packet.farthest::<S>();
                    }
                } else if entering.count_ones() <= FEW {
                    while entering != 0 {
                        verdict.go_alone(packet, entering.trailing_zeros() as usize, child);
                        entering &= entering - 1;
                    }
                    farthest = packet.farthest::<S>();
                } else {
                    let some = |g: usize| u32::from(group_of(entering, g) != 0) << g;
                    break (child, some(0) | some(1) | some(2) | some(3));
                }
                if farthest < 0.0 {
                    return;
                }
            }
        }
    }
}
