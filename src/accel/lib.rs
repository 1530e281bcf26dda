//! Ray tracing: BVHs over the triangles of a posed scene, traversed by batches of rays.
//!
//! # The BVHs
//!
//! A scene has two BVHs over world-space triangles, one of static and one of dynamic instances. Instanced meshes
//! have a BVH each in local space (BLAS), and one more lies over their instances (TLAS). All are eight wide
//! (`bvh/bvh8.rs`), with blocks of four triangles in their leaves (`bvh/triangle4.rs`). `build/` makes them by the
//! surface area heuristic (SAH; `build/builder.rs`, `build/bvh2_to_bvh8.rs`), and refits the BVH of dynamic triangles from
//! frame to frame (`build/refit.rs`).
//!
//! # From a ray to a triangle
//!
//! 1. [`Accel::intersect`] runs the `IntersectKernel` (`intersect.rs`) at a SIMD level. A `PacketSplitter` splits the
//!    batch into ranges of up to 256 rays.
//! 2. Rays of a range that share an origin or a direction traverse the world BVHs as a ray packet (`packet/`), unless many
//!    triangles lie between them (`ray_spread.rs`). Other rays, and all rays in the TLAS, are traced as ray streams of up
//!    to 1024 rays (`stream/`); fewer than eight of them one by one, by `SingleRayTracer::trace`.
//! 3. A single ray enters a BVH by `Blas::traverse`, or by `Tlas::traverse`, which transforms it into the frames of the
//!    instances that it reaches and continues in their BLASes.
//! 4. `Bvh8::traverse_closest` visits nodes front to back (`traverse/bvh8_traversal.rs`). A `SimdNodeTest` tests the
//!    boxes of a node's eight children at once (`traverse/box_test.rs`).
//! 5. In a leaf, a conservative f32 test takes the four triangles of a `Triangle4` at once
//!    (`traverse/conservative_triangle_test.rs`); the exact f64 test decides about the few that are left
//!    (`traverse/exact_triangle_test.rs`).
//! 6. Hits go to a ray query (`traverse/query.rs`): the closest-hit query keeps the first one in the order of (t, id).
//!
//! [`Accel::occluded`] and [`Accel::transmittance`] (`occlusion.rs`) take the same way with an any-hit query, which ends
//! at the first occluder, and visit children by their probability of occlusion (`bvh/occlusion_order.rs`).
//!
//! # Glossary
//!
//! - *node*: a `Bvh8Node`, with up to eight children in its *slots*. Construction says *wide node* to tell it from a node of
//!   obvhs's binary BVHs (BVH2).
//! - *leaf*: one or more *blocks* in a row. A block is a `Triangle4`, with a triangle in each of its four *lanes*.
//! - *triangle slot*: a place in the blocks of a BLAS, 4 · block + lane.
//! - *entry*: what a leaf is filled with during construction, a triangle or a set of coincident ones.
//! - *world BVH*: one of the two BVHs over world-space triangles.
//! - *local frame*: the space of a BVH's triangles: the world, or that of an instanced mesh.
//! - *shadow ray*: a ray whose answer is not the closest hit but if, or how much, light passes. Rays of ambient occlusion
//!   are shadow rays.
//! - *ray packet*: up to 256 rays with a common origin or direction, in 16 *groups* of 16 rays; a *quad* is four groups.
//! - *ray stream*: up to 1024 rays of any kind. They visit each node together, as the *list* of rays that reach it.
//!
//! # Determinism
//!
//! Only the hit test decides which triangle is hit, and at which t; BVHs merely skip triangles that cannot be hit. So no
//! answer depends on the BVH, its preset, the SIMD level, the order of rays in a batch, or threads.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod build;
mod bvh;
mod frustum;
mod intersect;
mod occlusion;
mod packet;
mod packet_splitter;
mod ray_batch;
mod ray_spread;
mod report;
mod rounds;
mod scratch;
mod settings;
mod single_ray_tracer;
mod stream;
mod traverse;

pub use blinn_core::simd::{SimdLevel, SimdLevelError};
pub use build::input_triangles::MAX_STORED_TRIANGLES;
pub use ray_batch::{AcceptAll, Coherence, HitBatch, HitFilter, RayBatch, ShadowRayBatch};
pub use report::{AccelStats, BuildReport};
pub use rounds::{RoundSize, RoundSizes};
pub use settings::{AccelSettings, FlattenBudget, Preset};
pub use traverse::traversal_stats::TraversalStats;

use std::collections::btree_map::Entry;

use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::geometry::{Hit, Ray, Rgb};
use blinn_scene::PosedScene;
use build::instancing_plan::InstancingPlan;
use build::mesh_flags::MeshFlagsCache;
use build::scene_triangles::{build_mesh_blas, build_world_blas, world_triangles};
use build::tlas_builder::build_tlas;
use bvh::scene_bvh::SceneBvh;
use frustum::FrustumKernel;
use intersect::IntersectKernel;
use occlusion::ShadowRayKernel;
use rounds::Rounds;

/// The acceleration structure: a posed scene's triangles in BVHs. It owns all that it needs.
#[derive(Debug)]
pub struct Accel {
    settings: AccelSettings,
    bvh: SceneBvh,
    /// The plan that `bvh` was built by.
    plan: InstancingPlan,
    flags_cache: MeshFlagsCache,
    has_translucent: bool,
    /// Points and lines; `None` in most scenes.
    rounds: Option<Rounds>,
    /// Their sizes for shadow rays and secondary rays.
    solid_rounds: RoundSizes,
}

impl Accel {
    /// Builds the BVHs of `posed`, and reports the triangles that it rejected.
    pub fn build(posed: &PosedScene, settings: &AccelSettings) -> (Accel, BuildReport) {
        never_cancelled(Accel::build_cancellable(posed, settings, &CancelToken::default()))
    }

    /// Builds the BVHs as [`Accel::build`] does, unless it is cancelled.
    ///
    /// # Errors
    /// `cancel` was cancelled.
    pub fn build_cancellable(
        posed: &PosedScene,
        settings: &AccelSettings,
        cancel: &CancelToken,
    ) -> Result<(Accel, BuildReport), Cancelled> {
        let mut accel = Accel {
            settings: *settings,
            bvh: SceneBvh::default(),
            plan: InstancingPlan::default(),
            flags_cache: MeshFlagsCache::default(),
            has_translucent: false,
            rounds: None,
            solid_rounds: RoundSizes::NONE,
        };
        let report = accel.update_cancellable(posed, cancel)?;
        Ok((accel, report))
    }

    /// Updates the BVHs to another pose of the same scene: keeps those of static triangles and of instanced
    /// meshes, rebuilds the TLAS, and refits the BVH of dynamic triangles, or rebuilds it where that is better.
    pub fn update(&mut self, posed: &PosedScene) -> BuildReport {
        never_cancelled(self.update_cancellable(posed, &CancelToken::default()))
    }

    /// Updates the BVHs as [`Accel::update`] does, unless it is cancelled. They are of no use then.
    ///
    /// # Errors
    /// `cancel` was cancelled.
    pub fn update_cancellable(
        &mut self,
        posed: &PosedScene,
        cancel: &CancelToken,
    ) -> Result<BuildReport, Cancelled> {
        let AccelSettings { preset, flatten, .. } = self.settings;
        let plan = InstancingPlan::new(posed, flatten, |mesh| self.flags_cache.get(posed, mesh));
        if self.plan.static_world != plan.static_world {
            self.bvh.static_world = build_world_blas(posed, &plan.static_world, preset, cancel)?;
        }
        if self.plan.dynamic_world != plan.dynamic_world || plan.may_deform(posed) {
            self.update_dynamic_world(posed, &plan, cancel)?;
        }
        self.bvh.mesh_blases.retain(|&mesh, _| plan.mesh_flags(mesh) == self.plan.mesh_flags(mesh));
        for (&mesh, instanced) in &plan.instanced {
            if let Entry::Vacant(slot) = self.bvh.mesh_blases.entry(mesh) {
                slot.insert(build_mesh_blas(posed, mesh, &instanced.flags, preset, cancel)?);
            }
        }
        self.bvh.tlas = build_tlas(posed, &plan, &self.bvh.mesh_blases, preset, cancel)?;
        self.has_translucent = plan.has_translucent();
        // Rebuilt for each pose: that is quick.
        self.rounds = None;
        self.rounds = Rounds::build(posed, cancel)?;
        self.set_solid_rounds(self.solid_rounds);
        self.plan = plan;
        Ok(self.report())
    }

    /// Sets the sizes of points and lines for shadow rays, and for rays without sizes of their own, such as secondary rays. Sizes
    /// in pixels make no sense there. None by default: such rays pass.
    pub fn set_solid_rounds(&mut self, sizes: RoundSizes) {
        self.solid_rounds = sizes;
        if let Some(rounds) = &mut self.rounds {
            rounds.set_solid(sizes);
        }
    }

    fn update_dynamic_world(
        &mut self,
        posed: &PosedScene,
        plan: &InstancingPlan,
        cancel: &CancelToken,
    ) -> Result<(), Cancelled> {
        let world = &mut self.bvh.dynamic_world;
        let before = self.plan.dynamic_world.iter().map(|flattened| flattened.instance);
        let same_instances = before.eq(plan.dynamic_world.iter().map(|flattened| flattened.instance));
        let ids = world.ids.clone();
        if !(same_instances && world.refit(world_triangles(posed, &plan.dynamic_world, &ids))) {
            *world = build_world_blas(posed, &plan.dynamic_world, self.settings.preset, cancel)?;
        }
        Ok(())
    }

    /// Adds the reports of all BLASes.
    fn report(&self) -> BuildReport {
        let mut report = BuildReport::default();
        self.bvh.worlds().iter().for_each(|world| report.add(world.report, 1));
        for (mesh, blas) in &self.bvh.mesh_blases {
            report.add(blas.report, self.plan.instanced[mesh].instances.len() as u64);
        }
        report.non_finite_rounds = self.rounds.as_ref().map_or(0, Rounds::non_finite);
        report
    }

    /// Finds each ray's closest hit, behind [`after`](RayBatch#structfield.after) if that is set. `hits` becomes as long as `rays`.
    pub fn intersect(&self, rays: &RayBatch, filter: &dyn HitFilter, hits: &mut HitBatch) {
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        self.settings.simd.run(IntersectKernel { bvh: &self.bvh, rays, filter, hits });
        if let Some(rounds) = &self.rounds {
            rounds.intersect(self.settings.simd, rays, filter, hits);
        }
    }

    /// Finds for each ray if it hits a point or a line, as if there were no triangles.
    pub fn hit_any_round(&self, rays: &RayBatch, filter: &dyn HitFilter) -> Vec<bool> {
        match &self.rounds {
            Some(rounds) => rounds.hit_any(self.settings.simd, rays, filter),
            None => vec![false; rays.len()],
        }
    }

    /// Finds out if anything occludes each shadow ray: opaque surfaces, and alpha-tested ones where the filter accepts
    /// the hit. Translucent surfaces do not occlude. `out` becomes as long as `rays`.
    pub fn occluded(&self, rays: &ShadowRayBatch, filter: &dyn HitFilter, out: &mut Vec<bool>) {
        out.clear();
        self.settings.simd.run(ShadowRayKernel { bvh: &self.bvh, rays, filter, out });
        if let Some(rounds) = &self.rounds {
            rounds.occlude(self.settings.simd, rays, filter, |i| out[i] = true);
        }
    }

    /// Finds the transmittance of each shadow ray in linear RGB: 0 if it is occluded, otherwise the product of the
    /// transmittances of the translucent surfaces on it, in the order of (t, id), and 0 where that is less
    /// than 2⁻¹⁷. `out` becomes as long as `rays`.
    pub fn transmittance(&self, rays: &ShadowRayBatch, filter: &dyn HitFilter, out: &mut Vec<Rgb>) {
        out.clear();
        self.settings.simd.run(ShadowRayKernel { bvh: &self.bvh, rays, filter, out });
        if let Some(rounds) = &self.rounds {
            rounds.occlude(self.settings.simd, rays, filter, |i| out[i] = Rgb::ZERO);
        }
    }

    /// Returns false if no ray inside a frustum can hit a triangle, by the bounds of the BVHs; true if one may, or if there
    /// are points or lines.
    /// `corner_rays` are the frustum's four edges in order around it; they share an origin or a direction.
    pub fn may_intersect(&self, corner_rays: &[Ray; 4]) -> bool {
        self.rounds.is_some() || self.settings.simd.run(FrustumKernel { bvh: &self.bvh, corner_rays })
    }

    /// Returns the SIMD level of traversal, which shading uses as well.
    pub fn simd(&self) -> SimdLevel {
        self.settings.simd
    }

    /// Returns true if a visible surface transmits part of the light. Without one, [`Accel::occluded`] is all that
    /// shadows need.
    pub fn has_translucent(&self) -> bool {
        self.has_translucent
    }

    /// Returns the typical distance of neighbouring points in metres; `None` without a cloud of points.
    pub fn point_spacing(&self) -> Option<f32> {
        self.rounds.as_ref()?.point_spacing()
    }

    /// Returns the numbers of points and of lines over all visible instances.
    pub fn round_counts(&self) -> [usize; 2] {
        self.rounds.as_ref().map_or([0; 2], Rounds::counts)
    }

    /// Returns the size of all BVHs.
    pub fn stats(&self) -> AccelStats {
        let SceneBvh { tlas, .. } = &self.bvh;
        let blases = || self.bvh.blases();
        AccelStats {
            bvhs: blases().count(),
            nodes: blases().map(|blas| blas.bvh.nodes.len()).sum::<usize>() + tlas.bvh.nodes.len(),
            triangles: blases().map(|blas| blas.triangle_count).sum(),
            bytes: blases().map(|blas| blas.bytes()).sum::<usize>()
                + tlas.bytes()
                + self.rounds.as_ref().map_or(0, Rounds::bytes),
        }
    }

    /// Finds the closest hits as [`Accel::intersect`] does, with the number of nodes, blocks and triangles that each ray
    /// visits when it is traced alone. Slow: for heat maps of traversal cost.
    pub fn intersect_with_stats(
        &self,
        rays: &RayBatch,
        filter: &dyn HitFilter,
    ) -> Vec<(Hit, TraversalStats)> {
        let traced = traverse::traversal_stats::intersect_with_stats(&self.bvh, rays, filter);
        let Some(rounds) = &self.rounds else { return traced };
        let (mut hits, mut stats): (Vec<Hit>, Vec<TraversalStats>) = traced.into_iter().unzip();
        rounds.intersect_with_stats(self.settings.simd, rays, filter, &mut hits, &mut stats);
        hits.into_iter().zip(stats).collect()
    }

    /// Finds occlusion as [`Accel::occluded`] does, with the number of nodes, blocks and triangles that each shadow ray
    /// visits when it is traced alone. Slow: for statistics of traversal cost. Points and lines do not count.
    pub fn occluded_with_stats(
        &self,
        rays: &ShadowRayBatch,
        filter: &dyn HitFilter,
    ) -> Vec<(bool, TraversalStats)> {
        traverse::traversal_stats::occluded_with_stats(&self.bvh, rays, filter)
    }

    /// Returns the cost of the BVHs by the surface area heuristic (SAH): the expected number of nodes and of blocks of
    /// four triangles that a random line through the scene's bounds visits if nothing ends it. 0 for an empty
    /// scene.
    pub fn sah_cost(&self) -> f64 {
        self.bvh.sah_cost()
    }
}

/// The result of work whose token nobody cancels.
fn never_cancelled<T>(result: Result<T, Cancelled>) -> T {
    result.unwrap_or_else(|Cancelled| unreachable!("the default token is never cancelled"))
}
