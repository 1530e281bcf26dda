//! Up to 256 rays that share an origin or a direction, through a tree together.
//!
//! They go by groups of sixteen. On a plane across the rays each group is a rectangle and so is each
//! box: a node's eight children are asked about for all rays, each child for all groups, and the
//! triangles of a block for four groups at once. At leaves, and at boxes smaller than a group's
//! rectangle, each of its rays is asked; where few rays are left, they go on alone. What depends on
//! the shared part and a triangle alone is computed once for all.
//!
//! f32 decides only what its error bounds prove. Every ray carries an interval that the t of its
//! closest hit so far lies in; hits that are neither surely inside nor surely outside of a
//! triangle, or of that interval, go to the same judgement in f64 as a single ray's, and t is
//! computed there for whatever won. So packets answer as single rays do, to the bit.

mod any_hit;
mod closest;
mod exact_hits;
pub(crate) mod frustum;
mod group_bounds;
mod leaf;
mod packet_kind;
mod shared_ray;
mod traverse;

use glam::{DVec3, Vec3};

use crate::accel::bvh::triangle4::Triangle4;
use crate::geometry::EPSILON;
use crate::simd::{Lanes, Simd, prefetch};
use group_bounds::Cone;

pub(crate) use any_hit::{Answers, occluded};
pub(crate) use closest::intersect;
pub(crate) use traverse::PacketStack;

/// Rays in a group.
pub(crate) const GROUP: usize = 16;
/// Groups of which each fills as many lanes as a block has triangles, and how often there are so many.
const FOUR: usize = 4;
const QUADS: usize = 4;
/// Groups in a packet.
pub(crate) const GROUPS: usize = QUADS * FOUR;
/// Rays in a packet.
pub(crate) const RAYS: usize = GROUP * GROUPS;

/// A bit for each ray of a packet, by group.
pub(crate) type Rays = [u32; GROUPS];

/// Has the first vectors of the packet that comes next fetched, if there is one: the processor goes on by
/// itself.
#[inline(always)]
fn fetch(next: Option<&[Vec3]>) {
    let next = next.unwrap_or_default();
    // A processor fetches 64 bytes at once.
    next[..next.len().min(FOUR * GROUP)].chunks(64 / size_of::<Vec3>()).for_each(prefetch);
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
            quads: 0,
            sure_start: 0.0,
            greatest: 0.0,
            cone: Cone::default(),
            size: 1.0,
        }
    }
}

/// A number for each ray.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct PerRay<T>([[[T; GROUP]; FOUR]; QUADS]);

impl<T: Copy> PerRay<T> {
    #[inline(always)]
    fn splat(x: T) -> Self {
        PerRay([[[x; GROUP]; FOUR]; QUADS])
    }

    #[inline(always)]
    fn set(&mut self, ray: usize, x: T) {
        self.group_mut(ray / GROUP)[ray % GROUP] = x;
    }

    #[inline(always)]
    fn get(&self, ray: usize) -> T {
        self.group(ray / GROUP)[ray % GROUP]
    }

    #[inline(always)]
    fn group(&self, g: usize) -> &[T; GROUP] {
        &self.0[g / FOUR % QUADS][g % FOUR]
    }

    #[inline(always)]
    fn group_mut(&mut self, g: usize) -> &mut [T; GROUP] {
        &mut self.0[g / FOUR % QUADS][g % FOUR]
    }
}

impl PerRay<f32> {
    /// Those of four groups.
    #[inline(always)]
    fn four<L: Lanes<GROUP>>(&self, q: usize) -> [L; FOUR] {
        let of = &self.0[q];
        [L::load(&of[0]), L::load(&of[1]), L::load(&of[2]), L::load(&of[3])]
    }
}

/// Rays, in the parameter of directions that were divided by `size`. One for each batch, filled again
/// and again.
#[derive(Debug)]
pub(crate) struct Packet {
    /// By axis what rays do not share: their directions, or their origins.
    own: [PerRay<f32>; 3],
    /// 1 over the directions, where those are not shared.
    reciprocal: [PerRay<f32>; 3],
    /// What comes surely before this has no effect.
    start: PerRay<f32>,
    /// The t that nothing beyond matters lies between these; −1 where a ray is done.
    lower: PerRay<f32>,
    upper: PerRay<f32>,
    /// The rays that are not done.
    live: Rays,
    /// So many times four groups are there.
    quads: usize,
    /// What comes before this may have no effect.
    sure_start: f32,
    /// At least the coordinates of origins, where those are not shared.
    greatest: f32,
    /// Around the directions, where those are not shared.
    cone: Cone,
    /// This many times a caller's parameter: a parameter of the packet. A power of two, and 1 for
    /// directions of ordinary lengths.
    size: f64,
}

/// What becomes of hits.
pub(crate) trait Verdict<S: Simd> {
    /// Triangles of a block whose sure hits need no further thought.
    fn plain(&self, block: &Triangle4) -> u8;

    /// Rays of group `g` that triangle `lane` of a block means nothing to.
    fn ignores(&self, block: &Triangle4, lane: usize, g: usize) -> u32;

    /// True where back faces of single-sided triangles are not seen.
    fn culls(&self) -> bool;

    /// True where children go by their odds, and not by what is nearest.
    fn by_odds(&self) -> bool {
        false
    }

    /// Rays `mask` of group `g` surely meet a plain triangle in front of all that they met before,
    /// at depth/det give or take slack/det.
    fn take(&mut self, packet: &mut Packet, g: usize, mask: u32, entry: u32, hit: Sure<S::F32x16>);

    /// A ray may meet a triangle, or is `sure` to go through it and to face it: it has to be judged.
    fn judge(&mut self, packet: &mut Packet, ray: usize, entry: u32, sure: bool);

    /// A ray goes on alone under `child`. True where that changed anything.
    fn go_alone(&mut self, packet: &mut Packet, ray: usize, child: u32) -> bool;
}

/// Where a sure hit is.
#[derive(Clone, Copy)]
pub(crate) struct Sure<L> {
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
        let (start, end) = (S::F32x16::splat(start * by), S::F32x16::splat(end * by));
        let none = S::F32x16::splat(-1.0);
        self.live = [0; GROUPS];
        for g in 0..self.quads * FOUR {
            let left = count.saturating_sub(g * GROUP).min(GROUP);
            self.live[g] = (1 << left) - 1;
            start.store(self.start.group_mut(g));
            let end = end.select(self.live[g], none);
            end.store(self.lower.group_mut(g));
            end.store(self.upper.group_mut(g));
        }
        self.sure_start = 0.0;
    }

    /// At least how far from `centre` what rays do not share is.
    #[inline(always)]
    fn reach<S: Simd>(&self, centre: DVec3) -> f64 {
        let middle = centre.as_vec3();
        let mut most = S::F32x16::splat(0.0);
        for axis in 0..3 {
            for g in 0..self.quads * FOUR {
                let own = S::F32x16::load(self.own[axis].group(g));
                most = (own - S::F32x16::splat(middle[axis])).abs().max(most);
            }
        }
        let rounding = 4.0 * f64::from(EPSILON) * (f64::from(most.reduce_max()) + centre.length());
        f64::from(most.reduce_max()) * 3f64.sqrt() + rounding
    }

    /// The least start.
    #[inline(always)]
    fn first<S: Simd>(&self) -> f32 {
        let mut first = S::F32x16::load(self.start.group(0));
        for g in 1..self.quads * FOUR {
            first = first.min(S::F32x16::load(self.start.group(g)));
        }
        first.reduce_min()
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
}
