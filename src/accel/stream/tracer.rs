//! Traces streams through all BVHs of a scene.

use std::marker::PhantomData;

use glam::Vec3;

use crate::bvh::blas::Blas;
use crate::bvh::scene_bvh::SceneBvh;
use crate::packet::RAYS_PER_GROUP;
use crate::single_ray_tracer::SingleRayTracer;
use crate::stream::instances::InstanceVisitor;
use crate::stream::leaf::TriangleVisitor;
use crate::stream::prepared_rays::{BoxPadding, NO_OCTANT, PreparedRays, RayGroup};
use crate::stream::query::{SingleRayTask, StreamQuery};
use crate::stream::traversal::{TraversalScratch, TraverseKernel};
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::RayQuery;
use blinn_core::simd::{Lanes, OutlinedKernel, Simd};

/// Memory for one stream at a time.
#[derive(Debug, Default)]
pub(crate) struct StreamScratch {
    /// For the world BVHs and the TLAS.
    world: TraversalScratch,
    /// For the local frames of instances; allocated for the first.
    instance: Option<Box<TraversalScratch>>,
    /// The rays of the stream that are in the local frame of an instance.
    instance_rays: Vec<u32>,
}

/// Traces a stream: the rays of `query`, no more than [`STREAM_RAYS`].
///
/// [`STREAM_RAYS`]: crate::stream::STREAM_RAYS
pub(crate) struct StreamTracer<'a, 'b, Q> {
    pub bvh: &'b SceneBvh,
    /// True if the world BVHs have been traversed already.
    pub worlds_traced: bool,
    pub query: &'a mut Q,
    pub scratch: &'a mut StreamScratch,
    pub single: &'a mut SingleRayTracer<'b>,
}

impl<S: Simd, Q: StreamQuery> OutlinedKernel<S> for StreamTracer<'_, '_, Q> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let StreamTracer { bvh, worlds_traced, query, scratch, single } = self;
        let StreamScratch { world: scratch, instance: instance_scratch, instance_rays } = scratch;
        let count = query.len();
        for blas in bvh.worlds().into_iter().filter(|_| !worlds_traced) {
            let Some(root) = blas.bvh.root else { continue };
            load_rays::<S, Q>(&mut scratch.prepared_rays, query, BoxPadding::default());
            load_sources(&mut scratch.prepared_rays, query, blas);
            let mut visitor = TriangleVisitor {
                blas,
                instance: None,
                query_rays: None,
                bounds: scratch.prepared_rays.error_bounds(blas.centre, blas.radius, false),
                query: &mut *query,
            };
            S::call_outlined(TraverseKernel { bvh: &blas.bvh, root, count, scratch, visitor: &mut visitor });
        }
        if let Some(root) = bvh.tlas.bvh.root {
            let padding =
                BoxPadding { constant: bvh.tlas.padding, per_distance: bvh.tlas.padding_per_distance };
            load_rays::<S, Q>(&mut scratch.prepared_rays, query, padding);
            let mut visitor = InstanceVisitor {
                tlas: &bvh.tlas,
                blases: &single.blases,
                query: &mut *query,
                scratch: instance_scratch.get_or_insert_default(),
                rays: instance_rays,
                stack: &mut single.stack,
            };
            let bvh = &bvh.tlas.bvh;
            S::call_outlined(TraverseKernel { bvh, root, count, scratch, visitor: &mut visitor });
        }
        for ray in 0..count {
            if scratch.prepared_rays.octants[ray] == NO_OCTANT && query.t_max(ray) != f32::NEG_INFINITY {
                // Too long, too short or too far away for the stream, if it is finite at all.
                trace_single::<S, Q>(query, ray, single, worlds_traced);
            }
        }
    }
}

/// Traces a ray of a query as a single ray through all BVHs; through the TLAS alone if the world BVHs have been traversed.
#[inline(always)]
pub(crate) fn trace_single<S: Simd, Q: StreamQuery>(
    query: &mut Q,
    ray: usize,
    tracer: &mut SingleRayTracer,
    worlds_traced: bool,
) {
    if let Some(local_ray) = query.local_ray(ray) {
        query.update(ray, TraceScene { tracer, local_ray, worlds_traced, simd: PhantomData::<S> });
    }
}

/// The traversal of all BVHs by a single ray.
struct TraceScene<'a, 'b, S> {
    tracer: &'a mut SingleRayTracer<'b>,
    local_ray: LocalRay,
    worlds_traced: bool,
    simd: PhantomData<S>,
}

impl<S: Simd> SingleRayTask for TraceScene<'_, '_, S> {
    #[inline(always)]
    fn run(self, query: &mut impl RayQuery) {
        self.tracer.trace::<S>(&self.local_ray, self.worlds_traced, query);
    }
}

/// Loads the rays of a query whose queries have not ended.
#[inline(always)]
fn load_rays<S: Simd, Q: StreamQuery>(prepared_rays: &mut PreparedRays, query: &Q, padding: BoxPadding) {
    prepared_rays.clear();
    let count = query.len();
    for g in 0..count.div_ceil(RAYS_PER_GROUP) {
        let mut o = [Vec3::ZERO; RAYS_PER_GROUP];
        let mut d = [Vec3::ZERO; RAYS_PER_GROUP];
        let mut t_min = [0.0; RAYS_PER_GROUP];
        let mut t_max = [0.0; RAYS_PER_GROUP];
        for i in 0..RAYS_PER_GROUP {
            let ray = (RAYS_PER_GROUP * g + i).min(count - 1);
            (o[i], d[i]) = query.origin_and_direction(ray);
            t_min[i] = query.t_min(ray);
            t_max[i] = query.t_max(ray);
        }
        let t_max = S::F32x16::load(&t_max);
        let live = S::F32x16::splat(0.0).lt(t_max);
        let mut group = RayGroup {
            o: S::deinterleave3(&o),
            d: S::deinterleave3(&d),
            t_min: S::F32x16::load(&t_min),
            t_max,
            t_scale: t_max,
            is_from_light: query.is_from_light(),
        };
        let left = count - RAYS_PER_GROUP * g;
        let used = if left >= RAYS_PER_GROUP { (1 << RAYS_PER_GROUP) - 1 } else { (1 << left) - 1 };
        let valid = used & live & group.normalize();
        prepared_rays.store_group::<S>(g, &group, valid, padding);
    }
}

/// Loads the indices of the triangles that rays start on.
#[inline(always)]
fn load_sources<Q: StreamQuery>(prepared_rays: &mut PreparedRays, query: &Q, blas: &Blas) {
    for (ray, test_data) in prepared_rays.triangles.iter_mut().enumerate().take(query.len()) {
        test_data.source = blas.source_index(query.source(ray), None);
    }
}
