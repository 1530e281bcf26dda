//! Where rays meet triangles: obvhs trees, traversed in batches, with one watertight hit test.
//!
//! Two levels: a tree for each mesh that is drawn more than once, one world tree for all other
//! triangles, and a tree over those. A hit is (instance, triangle), whatever tree found it.
//!
//! Which triangle is hit, and at which t, is the hit test's to say (`hit.rs`); trees only spare it
//! the triangles that are not there. So no answer depends on the tree, its preset, the order of
//! the rays in a batch, or threads.

mod batch;
mod clean;
mod hit;
mod query;
mod tree;
mod triangles;
mod two_level;

pub use batch::{Cutout, HitBatch, RayBatch, SegmentBatch, Shared};

use std::collections::BTreeMap;

use glam::Vec3;

use crate::geometry::{Hit, HitId, Rgb};
use crate::scene::{PosedScene, SurfaceClass};
use clean::{Look, Raw};
use query::{Asked, Blocking, Closest, Query, passes};
use tree::Stack;
use triangles::{FrameRay, Triangles};
use two_level::{Plan, Top};

/// How trees are built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildSettings {
    /// How much time a tree is worth. The picture never depends on it.
    pub preset: Preset,
}

/// obvhs's presets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// No tree: every ray asks every triangle. What trees are compared with.
    Flat,
    /// Built soonest.
    Fast,
    /// The usual.
    #[default]
    Medium,
    /// Traversed soonest.
    Slow,
}

/// What a build left out of the trees, each triangle counted as often as it is drawn. Ids never
/// move: what is left out is just never hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CleanReport {
    /// Triangles with a vertex that is not a finite number, or beyond ±1e18.
    pub non_finite: u64,
    /// Triangles without area.
    pub zero_area: u64,
    /// Triangles in exactly the same place as one of a lower id, however wound: they share an
    /// entry of the tree, and all can be hit.
    pub coincident: u64,
}

impl CleanReport {
    fn add(&mut self, other: CleanReport, times: u64) {
        self.non_finite += other.non_finite * times;
        self.zero_area += other.zero_area * times;
        self.coincident += other.coincident * times;
    }
}

/// What trees are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelStats {
    /// Trees over triangles: the world's and one for each shared mesh.
    pub trees: usize,
    /// Inner nodes of all trees.
    pub nodes: usize,
    /// Triangles in all trees; shared ones and coincident ones count once.
    pub entries: usize,
    /// Bytes of memory.
    pub bytes: usize,
}

/// The accelerator: a posed scene's triangles, ready for rays. It owns all that it needs.
#[derive(Debug)]
pub struct Accel {
    settings: BuildSettings,
    plan: Plan,
    world: Triangles,
    /// Shared trees, by mesh.
    meshes: BTreeMap<u32, Triangles>,
    top: Top,
    translucent: bool,
}

impl Accel {
    /// Builds the trees of `posed`.
    pub fn build(posed: &PosedScene, settings: &BuildSettings) -> (Accel, CleanReport) {
        let mut accel = Accel {
            settings: *settings,
            plan: Plan::default(),
            world: Triangles::default(),
            meshes: BTreeMap::new(),
            top: Top::default(),
            translucent: false,
        };
        let report = accel.update(posed);
        (accel, report)
    }

    /// Follows the scene it was built of to another pose. Where nothing but instances of shared
    /// meshes moved, the upper level alone is built again.
    pub fn update(&mut self, posed: &PosedScene) -> CleanReport {
        let preset = self.settings.preset;
        let plan = Plan::new(posed);
        let bent = plan.world.iter().any(|&(i, _)| posed.instances[i as usize].deformed.is_some());
        // An instance that has stopped bending has the same transform and another shape.
        if bent || self.plan.world != plan.world || self.bent(posed) {
            self.world = world_triangles(posed, &plan, preset);
        }
        self.meshes.retain(|mesh, _| plan.shared.contains_key(mesh));
        for &mesh in plan.shared.keys() {
            self.meshes.entry(mesh).or_insert_with(|| mesh_triangles(posed, mesh, preset));
        }
        self.top = Top::build(&self.world, &plan, &self.meshes, preset);
        self.translucent = posed.instances.iter().enumerate().any(|(i, instance)| {
            instance.visible && look(posed, i as u32).class == SurfaceClass::Translucent
        });
        let mut report = self.world.report;
        for (mesh, triangles) in &self.meshes {
            report.add(triangles.report, plan.shared[mesh].len() as u64);
        }
        self.plan = plan;
        report
    }

    /// The closest hit of every ray after its `after`. `hits` becomes as long as `rays`.
    pub fn intersect(&self, rays: &RayBatch, cutouts: &dyn Cutout, hits: &mut HitBatch) {
        hits.clear();
        let mut lane = Lane::new(self);
        for i in 0..rays.len() {
            let (o, d) = (rays.origins[i], rays.directions[i]);
            let best = Hit { t: rays.t_max[i], id: HitId::NONE };
            let asked = Asked { o, d, cutouts };
            let mut query = Closest { asked, cull: rays.cull, after: rays.after[i], best };
            lane.trace(o, d, &mut query);
            hits.push(if query.best.is_miss() { Hit::MISS } else { query.best });
        }
    }

    /// Whether anything stands in the way of every segment: opaque surfaces, and cutouts where
    /// they are kept. Translucent surfaces do not count. `out` becomes as long as `segments`.
    pub fn occluded(&self, segments: &SegmentBatch, cutouts: &dyn Cutout, out: &mut Vec<bool>) {
        out.clear();
        let mut lane = Lane::new(self);
        for i in 0..segments.len() {
            let mut query = blocking(segments, i, cutouts, None);
            lane.trace(query.asked.o, query.asked.d, &mut query);
            out.push(query.blocked);
        }
    }

    /// How much light passes along every segment: none where anything opaque or a kept cutout is
    /// in the way, else the product of what the translucent surfaces on it transmit, taken in the
    /// order of (t, id). `out` becomes as long as `segments`.
    pub fn transmittance(&self, segments: &SegmentBatch, cutouts: &dyn Cutout, out: &mut Vec<Rgb>) {
        out.clear();
        let mut lane = Lane::new(self);
        let mut passing = Vec::new();
        for i in 0..segments.len() {
            passing.clear();
            let mut query = blocking(segments, i, cutouts, Some(&mut passing));
            lane.trace(query.asked.o, query.asked.d, &mut query);
            let (asked, blocked) = (query.asked, query.blocked);
            out.push(if blocked { Rgb::ZERO } else { passes(&mut passing, asked) });
        }
    }

    /// True where something visible lets part of the light through; else [`Accel::occluded`] says
    /// all there is to say about shadows.
    pub fn has_translucent(&self) -> bool {
        self.translucent
    }

    /// Counts for reports.
    pub fn stats(&self) -> AccelStats {
        let trees = || [&self.world].into_iter().chain(self.meshes.values()).filter(|t| !t.is_empty());
        AccelStats {
            trees: trees().count(),
            nodes: trees().map(Triangles::nodes).sum::<usize>() + self.top.nodes(),
            entries: trees().map(Triangles::entries).sum(),
            bytes: trees().map(Triangles::bytes).sum::<usize>() + self.top.bytes(),
        }
    }

    /// True where the world tree may hold an instance that bent and does so no more.
    fn bent(&self, posed: &PosedScene) -> bool {
        let may_bend = |i: u32| {
            let mesh = posed.mesh(i);
            !mesh.morphs.is_empty() || mesh.influences.per_vertex > 0
        };
        self.plan.world.iter().any(|&(i, _)| may_bend(i))
    }
}

/// What tracing one ray after another needs.
struct Lane<'a> {
    accel: &'a Accel,
    meshes: Vec<&'a Triangles>,
    stack: Stack,
}

impl<'a> Lane<'a> {
    fn new(accel: &'a Accel) -> Lane<'a> {
        Lane { accel, meshes: accel.meshes.values().collect(), stack: Stack::default() }
    }

    /// Rays that are not finite or have no direction meet nothing.
    fn trace(&mut self, o: Vec3, d: Vec3, query: &mut impl Query) {
        if let Some(ray) = FrameRay::new(o, d) {
            let Accel { top, world, .. } = self.accel;
            top.visit(&ray, world, &self.meshes, query, &mut self.stack);
        }
    }
}

/// Segment `i` as a question. A segment ends strictly short of its light, at t = 1.
fn blocking<'a, 'p>(
    segments: &SegmentBatch,
    i: usize,
    cutouts: &'a dyn Cutout,
    passing: Option<&'p mut Vec<Hit>>,
) -> Blocking<'a, 'p> {
    let o = segments.from[i];
    let (d, end) = match segments.shared {
        Shared::Direction(d) => (d, f32::INFINITY),
        Shared::Origin(light) => (light - o, 1.0),
        Shared::None => (segments.to[i] - o, 1.0),
    };
    Blocking { asked: Asked { o, d, cutouts }, end, source: segments.source[i], blocked: false, passing }
}

/// How an instance's triangles look in a world tree.
fn look(posed: &PosedScene, instance: u32) -> Look {
    let material = &posed.materials[posed.mesh(instance).material as usize];
    let reversed = posed.instances[instance as usize].transform.flips;
    Look { class: material.class(), single_sided: !material.double_sided, reversed }
}

fn world_triangles(posed: &PosedScene, plan: &Plan, preset: Preset) -> Triangles {
    // Where each instance's triangles begin in the count of all.
    let mut starts = Vec::with_capacity(plan.world.len());
    let mut count = 0;
    for &(instance, _) in &plan.world {
        starts.push(count);
        count += posed.mesh(instance).triangles.len();
    }
    let looks: Vec<Look> = plan.world.iter().map(|&(instance, _)| look(posed, instance)).collect();
    let raw = |i: usize| {
        let which = starts.partition_point(|&start| start <= i) - 1;
        let id = HitId { instance: plan.world[which].0, triangle: (i - starts[which]) as u32 };
        Raw { v: posed.world_triangle(id), id, look: looks[which] }
    };
    Triangles::build(count, raw, preset)
}

fn mesh_triangles(posed: &PosedScene, mesh: u32, preset: Preset) -> Triangles {
    let mesh = &posed.scene.meshes[mesh as usize];
    let material = &posed.materials[mesh.material as usize];
    // Not reversed where the instance mirrors: a mirrored ray sees the side it saw before.
    let look = Look { class: material.class(), single_sided: !material.double_sided, reversed: false };
    let raw = |i: usize| Raw {
        v: mesh.triangles[i].map(|v| mesh.positions[v as usize]),
        id: HitId { instance: 0, triangle: i as u32 },
        look,
    };
    Triangles::build(mesh.triangles.len(), raw, preset)
}
