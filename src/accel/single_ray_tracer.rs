//! Traces single rays through all BVHs of a scene.

use crate::bvh::blas::Blas;
use crate::bvh::scene_bvh::SceneBvh;
use crate::ray_batch::{Coherence, HitFilter, ShadowRayBatch};
use crate::traverse::bvh8_traversal::TraversalStack;
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::{AnyHit, FilteredRay, RayQuery};
use crate::traverse::translucent_hits::Transmittance;
use blinn_core::simd::Simd;

/// The BVHs of a scene with the memory that traversal needs, ray after ray.
pub(crate) struct SingleRayTracer<'a> {
    bvh: &'a SceneBvh,
    /// The BLASes of the TLAS, by their number there.
    pub blases: Vec<&'a Blas>,
    pub stack: TraversalStack,
}

impl<'a> SingleRayTracer<'a> {
    pub fn new(bvh: &'a SceneBvh) -> SingleRayTracer<'a> {
        SingleRayTracer { bvh, blases: bvh.mesh_blases.values().collect(), stack: TraversalStack::default() }
    }

    /// Reports the triangles that `ray` hits to `query`: those of the world BVHs, unless packets have traced them
    /// (`worlds_traced`), then those of instances.
    #[inline(always)]
    pub fn trace<S: Simd>(&mut self, ray: &LocalRay, worlds_traced: bool, query: &mut impl RayQuery) {
        for world in self.bvh.worlds().iter().filter(|_| !worlds_traced) {
            if let Some(root) = world.bvh.root
                && !world.traverse::<S, _>(root, ray, None, query, &mut self.stack)
            {
                return;
            }
        }
        self.bvh.tlas.traverse::<S, _>(ray, &self.blases, query, &mut self.stack);
    }
}

/// Returns the any-hit query of shadow ray `i` and the ray to trace it with; no ray if the shadow ray is not finite or
/// has no length, which nothing occludes. If `transmittance` is given, the query collects what translucent surfaces
/// transmit.
///
/// A shadow ray ends before its light, which is at t = 1. Those to a point are traced from there, as packets do,
/// so that both trace the same line to the bit.
#[inline(always)]
pub(crate) fn shadow_ray_query<'a, 'p>(
    rays: &ShadowRayBatch,
    i: usize,
    filter: &'a dyn HitFilter,
    transmittance: Option<&'p mut Transmittance>,
) -> (Option<LocalRay>, AnyHit<'a, 'p>) {
    let from = rays.from[i];
    let (o, d, t_max, local) = match rays.coherence {
        Coherence::Direction(d) => (from, d, f32::INFINITY, LocalRay::new(from.as_dvec3(), d.as_dvec3())),
        Coherence::Origin(light) => (light, from - light, 1.0, LocalRay::from_light_to_point(light, from)),
        Coherence::None => {
            (rays.to[i], from - rays.to[i], 1.0, LocalRay::from_light_to_point(rays.to[i], from))
        }
    };
    let ray = FilteredRay { o, d, filter };
    // A shadow ray to a point is traced from there.
    let to_light = if t_max == 1.0 { -d } else { d };
    let query = AnyHit { ray, to_light, t_max, source: rays.source[i], occluded: false, transmittance };
    (local, query)
}
