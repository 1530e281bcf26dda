//! Where rays meet triangles: obvhs trees, traversed in batches, with one watertight hit test.
//!
//! Two trees in the world, one for what stands still and one for what moves; for large meshes that
//! are drawn more than once or move as they are, trees of their own and a tree over those. A hit is
//! (instance, triangle), whatever tree found it.
//!
//! Which triangle is hit, and at which t, is the hit test's to say (`hit.rs`); trees only spare it
//! the triangles that are not there. So no answer depends on the tree, its preset, the order of
//! the rays in a batch, or threads.

mod build;
mod bvh;
mod packet;
mod ray_batch;
mod traverse;

pub use crate::simd::SimdLevel;
pub use build::instancing_plan::FlattenBudget;
pub use ray_batch::{AnyHitFilter, Coherence, HitBatch, RayBatch, SegmentBatch};
pub use traverse::traversal_stats::TraversalStats;

use std::collections::BTreeMap;

use crate::geometry::{Hit, HitId, Rgb};
use crate::scene::PosedScene;
use crate::simd::{AutovecKernel, Simd, SimdKernel};
use build::instancing_plan::{Member, Plan};
use build::scene_triangles::{mesh_triangles, world_raw, world_triangles};
use build::surface_flags::SurfaceFlagsCache;
use bvh::blas::Blas;
use bvh::bvh8::TraversalStack;
use bvh::tlas::Tlas;
use packet::{Answers, GROUP, GROUPS, Packet, PacketStack, RAYS};
use traverse::hit::LocalRay;
use traverse::query::{AnyHit, ClosestHit, RayContext, RayQuery};
use traverse::transmittance::Transmittance;

/// How trees are built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildSettings {
    /// How much time a tree is worth. The picture never depends on it.
    pub preset: Preset,
    /// SIMD instructions that rays are traced with; by default the widest that this processor supports. The picture
    /// does not depend on it.
    pub simd: SimdLevel,
    /// Which shared meshes go into a world's tree. The picture depends on it by the rounding of t.
    pub flatten: FlattenBudget,
}

/// obvhs's presets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// No tree: every ray asks every triangle. What trees are compared with.
    BruteForce,
    /// Built soonest.
    Fast,
    /// The usual.
    #[default]
    Medium,
    /// Traversed soonest.
    Slow,
}

/// What a build left out of the trees, each triangle counted as often as it is drawn. CoincidentIds never
/// move: what is left out is just never hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildReport {
    /// Triangles with a vertex that is not a finite number, or beyond ±1e18.
    pub non_finite: u64,
    /// Triangles without area.
    pub zero_area: u64,
    /// Triangles in exactly the same place as one of a lower id, however wound: they share an
    /// entry of the tree, and all can be hit.
    pub coincident: u64,
}

impl BuildReport {
    fn add(&mut self, other: BuildReport, times: u64) {
        self.non_finite += other.non_finite * times;
        self.zero_area += other.zero_area * times;
        self.coincident += other.coincident * times;
    }
}

/// What trees are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelStats {
    /// Trees over triangles: the world's two and one for each mesh that has its own.
    pub bvhs: usize,
    /// Inner nodes of all trees.
    pub nodes: usize,
    /// Triangles in all trees; shared ones and coincident ones count once.
    pub triangles: usize,
    /// Bytes of memory.
    pub bytes: usize,
}

/// The accelerator: a posed scene's triangles, ready for rays. It owns all that it needs.
#[derive(Debug)]
pub struct Accel {
    settings: BuildSettings,
    looks: SurfaceFlagsCache,
    plan: Plan,
    /// What stands still, and what moves.
    worlds: [Blas; 2],
    /// Trees of their own, by mesh.
    meshes: BTreeMap<u32, Blas>,
    top: Tlas,
    translucent: bool,
}

impl Accel {
    /// Builds the trees of `posed`.
    pub fn build(posed: &PosedScene, settings: &BuildSettings) -> (Accel, BuildReport) {
        let mut accel = Accel {
            settings: *settings,
            looks: SurfaceFlagsCache::default(),
            plan: Plan::default(),
            worlds: Default::default(),
            meshes: BTreeMap::new(),
            top: Tlas::default(),
            translucent: false,
        };
        let report = accel.update(posed);
        (accel, report)
    }

    /// Follows the scene it was built of to another pose. What stands still is not built again; of
    /// large meshes that move as they are, the upper level alone is; the tree of what else moves or
    /// bends is fitted to its new places, unless a new one is better.
    pub fn update(&mut self, posed: &PosedScene) -> BuildReport {
        let BuildSettings { preset, flatten, .. } = self.settings;
        let plan = Plan::new(posed, flatten, |mesh| self.looks.of(posed, mesh));
        let [still, moving] = &mut self.worlds;
        if self.plan.still != plan.still {
            *still = world_triangles(posed, &plan.still, preset);
        }
        if self.plan.moving != plan.moving || plan.bends(posed) {
            let instance = |member: &Member| member.instance;
            let same = self.plan.moving.iter().map(instance).eq(plan.moving.iter().map(instance));
            let spans = moving.ids.clone();
            if !(same && moving.refit(world_raw(posed, &plan.moving, &spans))) {
                *moving = world_triangles(posed, &plan.moving, preset);
            }
        }
        self.meshes.retain(|&mesh, _| plan.look(mesh) == self.plan.look(mesh));
        for (&mesh, placed) in &plan.placed {
            let build = || mesh_triangles(posed, mesh, &placed.look, preset);
            self.meshes.entry(mesh).or_insert_with(build);
        }
        self.top = Tlas::build(posed, &plan, &self.meshes, preset);
        self.translucent = plan.is_translucent();
        let mut report = BuildReport::default();
        self.worlds.iter().for_each(|world| report.add(world.report, 1));
        for (mesh, triangles) in &self.meshes {
            report.add(triangles.report, plan.placed[mesh].instances.len() as u64);
        }
        self.plan = plan;
        report
    }

    /// The closest hit of every ray after its `after`. `hits` becomes as long as `rays`.
    pub fn intersect(&self, rays: &RayBatch, cutouts: &dyn AnyHitFilter, hits: &mut HitBatch) {
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        self.settings.simd.run(Intersect { accel: self, rays, cutouts, hits });
    }

    /// Whether anything stands in the way of every segment: opaque surfaces, and cutouts where
    /// they are kept. Translucent surfaces do not count. `out` becomes as long as `segments`.
    pub fn occluded(&self, segments: &SegmentBatch, cutouts: &dyn AnyHitFilter, out: &mut Vec<bool>) {
        out.clear();
        self.settings.simd.run(Occluded { accel: self, segments, cutouts, out });
    }

    /// How much light passes along every segment: none where anything opaque or a kept cutout is
    /// in the way, else the product of what the translucent surfaces on it transmit, taken in the
    /// order of (t, id), and none where that is less than 2⁻¹⁷. `out` becomes as long as `segments`.
    pub fn transmittance(&self, segments: &SegmentBatch, cutouts: &dyn AnyHitFilter, out: &mut Vec<Rgb>) {
        out.clear();
        self.settings.simd.run(TransmittanceKernel { accel: self, segments, cutouts, out });
    }

    /// Runs what has nothing to do with trees with the instructions that they are traversed with.
    pub(crate) fn run_autovec(&self, job: impl AutovecKernel) {
        self.settings.simd.run(job);
    }

    /// True where something visible lets part of the light through; else [`Accel::occluded`] says
    /// all there is to say about shadows.
    pub fn has_translucent(&self) -> bool {
        self.translucent
    }

    /// Counts for reports.
    pub fn stats(&self) -> AccelStats {
        let trees = || self.worlds.iter().chain(self.meshes.values()).filter(|t| !t.is_empty());
        AccelStats {
            bvhs: trees().count(),
            nodes: trees().map(Blas::nodes).sum::<usize>() + self.top.nodes(),
            triangles: trees().map(Blas::entries).sum(),
            bytes: trees().map(Blas::bytes).sum::<usize>() + self.top.bytes(),
        }
    }

    /// True where rays of a batch can go together first of all.
    fn together(&self, shared: Coherence, count: usize) -> bool {
        count > FEW && shared != Coherence::None && self.worlds.iter().any(|world| !world.is_empty())
    }
}

/// [`Accel::intersect`].
struct Intersect<'a> {
    accel: &'a Accel,
    rays: &'a RayBatch,
    cutouts: &'a dyn AnyHitFilter,
    hits: &'a mut HitBatch,
}

impl SimdKernel for Intersect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let Intersect { accel, rays, cutouts, hits } = self;
        let mut lane = Lane::new(accel);
        let (mut packet, mut packets) = (Packet::default(), PacketStack::default());
        let mut bundles = Bundles::of(rays.len());
        while let Some((first, count)) = bundles.pop() {
            let mut together = accel.together(rays.coherence, count);
            if together {
                let scratch = (&mut packet, &mut packets, &mut lane.stack);
                let out = &mut hits[first..first + count];
                together = packet::intersect::<S>(&accel.worlds, (rays, first, count), cutouts, out, scratch);
                if !together && bundles.split(first, count) {
                    continue;
                }
            }
            if together && accel.top.is_empty() {
                continue;
            }
            for (i, hit) in hits.iter_mut().enumerate().skip(first).take(count) {
                let (o, d) = (rays.origins[i], rays.directions[i]);
                let best = if hit.is_miss() { Hit { t: rays.t_max, id: HitId::NONE } } else { *hit };
                let asked = RayContext { o, d, cutouts };
                let mut query = ClosestHit { asked, cull: rays.cull_back_faces, after: rays.after(i), best };
                if let Some(ray) = LocalRay::new(o.as_dvec3(), d.as_dvec3()) {
                    lane.trace::<S>(&ray, !together, &mut query);
                }
                if !query.best.is_miss() {
                    *hit = query.best;
                }
            }
        }
    }
}

/// [`Accel::occluded`].
struct Occluded<'a> {
    accel: &'a Accel,
    segments: &'a SegmentBatch,
    cutouts: &'a dyn AnyHitFilter,
    out: &'a mut Vec<bool>,
}

impl SimdKernel for Occluded<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let Occluded { accel, segments, cutouts, out } = self;
        let mut lane = Lane::new(accel);
        let (mut packet, mut packets) = (Packet::default(), PacketStack::default());
        let mut bundles = Bundles::of(segments.len());
        while let Some((first, count)) = bundles.pop() {
            let mut answers = Answers { blocked: [0; GROUPS], passing: None };
            let mut together = accel.together(segments.coherence, count);
            if together {
                let (some, scratch) =
                    ((segments, first, count), (&mut packet, &mut packets, &mut lane.stack));
                together = packet::occluded::<S>(&accel.worlds, some, cutouts, &mut answers, scratch);
                if !together && bundles.split(first, count) {
                    continue;
                }
            }
            let rest = !together || !accel.top.is_empty();
            if !rest {
                out.extend((0..count).map(|i| answers.blocked(i)));
                continue;
            }
            for i in 0..count {
                let mut blocked = answers.blocked(i);
                if !blocked {
                    let (ray, mut query) = blocking(segments, first + i, cutouts, None);
                    if let Some(ray) = ray {
                        lane.trace::<S>(&ray, !together, &mut query);
                    }
                    blocked = query.blocked;
                }
                out.push(blocked);
            }
        }
    }
}

/// [`Accel::transmittance`].
struct TransmittanceKernel<'a> {
    accel: &'a Accel,
    segments: &'a SegmentBatch,
    cutouts: &'a dyn AnyHitFilter,
    out: &'a mut Vec<Rgb>,
}

impl SimdKernel for TransmittanceKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let TransmittanceKernel { accel, segments, cutouts, out } = self;
        let mut lane = Lane::new(accel);
        let (mut packet, mut packets) = (Packet::default(), PacketStack::default());
        let mut passing: Box<[Transmittance]> = (0..RAYS).map(|_| Transmittance::default()).collect();
        let mut bundles = Bundles::of(segments.len());
        while let Some((first, count)) = bundles.pop() {
            passing.iter_mut().for_each(Transmittance::clear);
            let mut blocked = [0; GROUPS];
            let mut together = accel.together(segments.coherence, count);
            if together {
                let mut answers = Answers { blocked, passing: Some(&mut passing) };
                let (some, scratch) =
                    ((segments, first, count), (&mut packet, &mut packets, &mut lane.stack));
                together = packet::occluded::<S>(&accel.worlds, some, cutouts, &mut answers, scratch);
                blocked = answers.blocked;
                if !together {
                    if bundles.split(first, count) {
                        continue;
                    }
                    // All trees are asked once more.
                    passing.iter_mut().for_each(Transmittance::clear);
                }
            }
            let rest = !together || !accel.top.is_empty();
            for (i, passing) in passing.iter_mut().enumerate().take(count) {
                let mut blocked = blocked[i / GROUP] >> (i % GROUP) & 1 == 1;
                if rest && !blocked {
                    let (ray, mut query) = blocking(segments, first + i, cutouts, Some(&mut *passing));
                    if let Some(ray) = ray {
                        lane.trace::<S>(&ray, !together, &mut query);
                    }
                    blocked = query.blocked;
                }
                out.push(if blocked { Rgb::ZERO } else { passing.light() });
            }
        }
    }
}

/// So few rays are traced one by one.
const FEW: usize = 8;

/// Rays of a batch that are tried together, by their first and their number: as many as a packet
/// holds, and where those are too far apart, a quarter of that, and then a group's worth.
struct Bundles {
    next: usize,
    len: usize,
    /// Parts of those before, the next one last.
    parts: [(usize, usize); 2 * PARTS],
    left: usize,
}

/// Parts that rays come again in.
const PARTS: usize = 4;

impl Bundles {
    fn of(len: usize) -> Bundles {
        Bundles { next: 0, len, parts: Default::default(), left: 0 }
    }

    fn pop(&mut self) -> Option<(usize, usize)> {
        if self.left > 0 {
            self.left -= 1;
            return Some(self.parts[self.left]);
        }
        let first = self.next;
        self.next += RAYS.min(self.len - first);
        (first < self.next).then(|| (first, self.next - first))
    }

    /// Has those just popped come again in parts, unless they are too few.
    fn split(&mut self, first: usize, count: usize) -> bool {
        if count <= GROUP {
            return false;
        }
        let size = if count > RAYS / PARTS { RAYS / PARTS } else { GROUP };
        let parts = count.div_ceil(size);
        for (part, i) in self.parts[self.left..].iter_mut().zip((0..parts).rev()) {
            *part = (first + i * size, size.min(count - i * size));
        }
        self.left += parts;
        true
    }
}

/// What tracing one ray after another needs.
struct Lane<'a> {
    accel: &'a Accel,
    meshes: Vec<&'a Blas>,
    stack: TraversalStack,
}

impl<'a> Lane<'a> {
    fn new(accel: &'a Accel) -> Lane<'a> {
        Lane { accel, meshes: accel.meshes.values().collect(), stack: TraversalStack::default() }
    }

    /// Tells `query` of what `ray` meets in placed trees and, unless that has been asked, in the
    /// world's.
    #[inline(always)]
    fn trace<S: Simd>(&mut self, ray: &LocalRay, worlds: bool, query: &mut impl RayQuery) {
        let Accel { top, worlds: trees, .. } = self.accel;
        for world in trees.iter().filter(|_| worlds) {
            if let Some(root) = world.bvh.root
                && !world.traverse::<S, _>(root, ray, None, query, &mut self.stack)
            {
                return;
            }
        }
        top.traverse::<S, _>(ray, &self.meshes, query, &mut self.stack);
    }
}

/// Segment `i` as a question, and the line that it is on; none for segments that are nowhere or go
/// nowhere, which nothing blocks. A segment ends strictly short of its light, at t = 1. Those to a
/// point are traced from there, as packets are, so that both are the same line to the bit.
#[inline(always)]
fn blocking<'a, 'p>(
    segments: &SegmentBatch,
    i: usize,
    cutouts: &'a dyn AnyHitFilter,
    passing: Option<&'p mut Transmittance>,
) -> (Option<LocalRay>, AnyHit<'a, 'p>) {
    let from = segments.from[i];
    let (o, d, end, ray) = match segments.coherence {
        Coherence::Direction(d) => (from, d, f32::INFINITY, LocalRay::new(from.as_dvec3(), d.as_dvec3())),
        Coherence::Origin(light) => (light, from - light, 1.0, LocalRay::shadow(from, light)),
        Coherence::None => {
            (segments.to[i], from - segments.to[i], 1.0, LocalRay::shadow(from, segments.to[i]))
        }
    };
    let asked = RayContext { o, d, cutouts };
    (ray, AnyHit { asked, end, source: segments.source[i], blocked: false, passing })
}
