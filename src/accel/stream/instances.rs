//! Streams in the TLAS, and in the frames of the instances that they reach.

use std::array::from_fn;
use std::marker::PhantomData;

use glam::Vec3;

use crate::bvh::blas::Blas;
use crate::bvh::bvh8::LEAF_BIT;
use crate::bvh::instance::BlasInstance;
use crate::bvh::tlas::Tlas;
use crate::packet::RAYS_PER_GROUP;
use crate::stream::leaf::TriangleVisitor;
use crate::stream::list_visitor::ListVisitor;
use crate::stream::prepared_rays::{BoxPadding, MIN_STREAM_RAYS, NO_OCTANT, PreparedRays, RayGroup};
use crate::stream::query::{SingleRayTask, StreamQuery};
use crate::stream::traversal::{TraversalScratch, TraverseKernel};
use crate::traverse::bvh8_traversal::TraversalStack;
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::RayQuery;
use blinn_core::simd::{Lanes, OutlinedKernel, Simd};

/// Scales of t that f32 represents with room to spare.
const T_SCALES: [f64; 2] = [1e-30, 1e30];

/// Continues lists in the BLASes of instances.
pub(super) struct InstanceVisitor<'a, 'b, Q> {
    pub tlas: &'a Tlas,
    pub blases: &'a [&'b Blas],
    pub query: &'a mut Q,
    pub scratch: &'a mut TraversalScratch,
    /// The rays of the world's stream in the current instance's frame.
    pub rays: &'a mut Vec<u32>,
    pub stack: &'a mut TraversalStack,
}

impl<S: Simd, Q: StreamQuery> ListVisitor<S> for InstanceVisitor<'_, '_, Q> {
    const ANY_HIT: bool = Q::ANY_HIT;

    #[inline(always)]
    fn visit_leaf(&mut self, leaf: u32, rays: &[u32], prepared_rays: &mut PreparedRays) {
        let tlas = self.tlas;
        for instance in tlas.instances(leaf) {
            self.rays.clear();
            self.rays.extend(rays.iter().filter(|&&ray| !prepared_rays.has_ended(ray as usize)));
            if self.rays.len() < MIN_STREAM_RAYS {
                for i in 0..self.rays.len() {
                    self.trace_single::<S>(instance, i);
                }
            } else {
                S::call_outlined(InstanceKernel { visitor: &mut *self, instance });
            }
            for &ray in &*self.rays {
                prepared_rays.set_t_max(ray as usize, self.query.t_max(ray as usize));
            }
        }
    }

    #[inline(always)]
    fn prefetch(&self, _: u32) {}
}

impl<Q: StreamQuery> InstanceVisitor<'_, '_, Q> {
    /// Traces ray `i` of those in an instance's frame as a single ray.
    #[inline(always)]
    fn trace_single<S: Simd>(&mut self, instance: &BlasInstance, i: usize) {
        let ray = self.rays[i] as usize;
        let blas = self.blases[instance.blas as usize];
        let root = blas.bvh.root.unwrap_or(LEAF_BIT);
        let Some(local_ray) = self.query.local_ray(ray) else { return };
        let local_ray = instance.transform.ray(&local_ray);
        let instance = instance.instance;
        let stack = &mut *self.stack;
        self.query
            .update(ray, TraverseInstance { blas, root, local_ray, instance, stack, simd: PhantomData::<S> });
    }
}

/// The traversal of an instance's BLAS by a single ray.
struct TraverseInstance<'a, S> {
    blas: &'a Blas,
    root: u32,
    local_ray: LocalRay,
    instance: u32,
    stack: &'a mut TraversalStack,
    simd: PhantomData<S>,
}

impl<S: Simd> SingleRayTask for TraverseInstance<'_, S> {
    #[inline(always)]
    fn run(self, query: &mut impl RayQuery) {
        self.blas.traverse::<S, _>(self.root, &self.local_ray, Some(self.instance), query, self.stack);
    }
}

/// Traces the rays of a visitor as a stream in an instance's frame.
struct InstanceKernel<'v, 'a, 'b, Q> {
    visitor: &'v mut InstanceVisitor<'a, 'b, Q>,
    instance: &'v BlasInstance,
}

impl<S: Simd, Q: StreamQuery> OutlinedKernel<S> for InstanceKernel<'_, '_, '_, Q> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let InstanceKernel { visitor, instance } = self;
        let blas = visitor.blases[instance.blas as usize];
        let Some(root) = blas.bvh.root else { return };
        let count = visitor.rays.len();
        visitor.scratch.prepared_rays.clear();
        for first in (0..count).step_by(RAYS_PER_GROUP) {
            let rays = &visitor.rays[first..count.min(first + RAYS_PER_GROUP)];
            let local_rays: [Option<LocalRay>; RAYS_PER_GROUP] = from_fn(|i| {
                let local_ray = visitor.query.local_ray(*rays.get(i)? as usize)?;
                let local_ray = instance.transform.ray(&local_ray);
                let [min, max] = T_SCALES;
                (min < local_ray.t_scale && local_ray.t_scale < max).then_some(local_ray)
            });
            store_group::<S, Q>(visitor.scratch, first / RAYS_PER_GROUP, visitor.query, rays, &local_rays);
            for (i, &ray) in rays.iter().enumerate() {
                let source = visitor.query.source(ray as usize);
                visitor.scratch.prepared_rays.triangles[first + i].source =
                    blas.source_index(source, Some(instance.instance));
            }
        }
        S::call_outlined(TraverseKernel {
            bvh: &blas.bvh,
            root,
            count,
            visitor: &mut TriangleVisitor {
                blas,
                instance: Some(instance),
                query_rays: Some(visitor.rays),
                bounds: visitor.scratch.prepared_rays.error_bounds(blas.centre, blas.radius, true),
                query: &mut *visitor.query,
            },
            scratch: &mut *visitor.scratch,
        });
        for i in 0..count {
            if visitor.scratch.prepared_rays.octants[i] == NO_OCTANT {
                visitor.trace_single::<S>(instance, i);
            }
        }
    }
}

/// Stores group `g` of the rays in an instance's frame. Those without a local ray take no part in the stream.
#[inline(always)]
fn store_group<S: Simd, Q: StreamQuery>(
    scratch: &mut TraversalScratch,
    g: usize,
    query: &Q,
    rays: &[u32],
    local_rays: &[Option<LocalRay>; RAYS_PER_GROUP],
) {
    let mut o = [Vec3::ZERO; RAYS_PER_GROUP];
    let mut d = [Vec3::X; RAYS_PER_GROUP];
    let mut t_min = [0.0; RAYS_PER_GROUP];
    let mut t_max = [0.0; RAYS_PER_GROUP];
    let mut t_scale = [1.0; RAYS_PER_GROUP];
    let mut valid = 0;
    for (i, (&ray, local_ray)) in rays.iter().zip(local_rays).enumerate() {
        let ray = ray as usize;
        if let Some(local_ray) = local_ray {
            o[i] = local_ray.o.as_vec3();
            d[i] = local_ray.d.as_vec3();
            t_min[i] = query.t_min(ray);
            t_max[i] = query.t_max(ray);
            t_scale[i] = local_ray.t_scale as f32;
            valid |= 1 << i;
        }
    }
    let group = RayGroup {
        o: S::deinterleave3(&o),
        d: S::deinterleave3(&d),
        t_min: S::F32x16::load(&t_min),
        t_max: S::F32x16::load(&t_max),
        t_scale: S::F32x16::load(&t_scale),
        is_from_light: query.is_from_light(),
    };
    scratch.prepared_rays.store_group::<S>(g, &group, valid, BoxPadding::default());
}
