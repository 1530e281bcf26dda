//! The queries of a stream: closest hit or any hit of each ray.

use glam::Vec3;

use crate::ray_batch::{Coherence, HitBatch, HitFilter, RayBatch, ShadowRayBatch};
use crate::single_ray_tracer::shadow_ray_query;
use crate::stream::prepared_rays::STREAM_RAYS;
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::{ClosestHit, FilteredRay, RayQuery};
use crate::traverse::translucent_hits::Transmittance;
use blinn_core::geometry::{Hit, HitId};

/// A test or a traversal of a single ray, which reports hits to the ray's query.
pub(crate) trait SingleRayTask {
    fn run(self, query: &mut impl RayQuery);
}

/// The queries of up to [`STREAM_RAYS`] rays, by their number in the stream.
pub(crate) trait StreamQuery {
    /// True for any-hit queries.
    const ANY_HIT: bool;

    /// The number of rays.
    fn len(&self) -> usize;

    /// The ray's origin, and its direction rounded to f32.
    fn origin_and_direction(&self, ray: usize) -> (Vec3, Vec3);

    /// The ray in world space; `None` if it is not finite or has no direction.
    fn local_ray(&self, ray: usize) -> Option<LocalRay>;

    /// True if shadow rays are traced from the light.
    fn is_from_light(&self) -> bool;

    /// Hits before this t have no effect.
    fn t_min(&self, ray: usize) -> f32;

    /// Hits beyond this t have no effect; −∞ once the query has ended.
    fn t_max(&self, ray: usize) -> f32;

    /// The triangle that the ray starts on, or [`HitId::NONE`].
    fn source(&self, ray: usize) -> HitId;

    /// Continues the ray's query by `task`, unless it has ended. Returns the new [`StreamQuery::t_max`].
    fn update(&mut self, ray: usize, task: impl SingleRayTask) -> f32;

    /// Ends an any-hit query: the ray is occluded.
    fn end(&mut self, ray: usize);
}

/// Closest-hit queries.
pub(crate) struct ClosestHitStream<'a> {
    pub rays: &'a RayBatch,
    /// The index of each ray in the batch.
    pub indices: &'a [u32],
    pub filter: &'a dyn HitFilter,
    /// The hits of the whole batch.
    pub hits: &'a mut HitBatch,
}

impl ClosestHitStream<'_> {
    #[inline(always)]
    fn index(&self, ray: usize) -> usize {
        self.indices[ray] as usize
    }

    fn best(&self, index: usize) -> Hit {
        let hit = self.hits[index];
        if hit.is_miss() { Hit { t: self.rays.t_max, id: HitId::NONE } } else { hit }
    }
}

impl StreamQuery for ClosestHitStream<'_> {
    const ANY_HIT: bool = false;

    #[inline(always)]
    fn len(&self) -> usize {
        self.indices.len()
    }

    #[inline(always)]
    fn origin_and_direction(&self, ray: usize) -> (Vec3, Vec3) {
        let index = self.index(ray);
        (self.rays.origins[index], self.rays.directions[index])
    }

    #[inline(always)]
    fn local_ray(&self, ray: usize) -> Option<LocalRay> {
        let (o, d) = self.origin_and_direction(ray);
        LocalRay::new(o.as_dvec3(), d.as_dvec3())
    }

    #[inline(always)]
    fn is_from_light(&self) -> bool {
        false
    }

    #[inline(always)]
    fn t_min(&self, ray: usize) -> f32 {
        self.rays.after(self.index(ray)).t
    }

    #[inline(always)]
    fn t_max(&self, ray: usize) -> f32 {
        self.best(self.index(ray)).t
    }

    #[inline(always)]
    fn source(&self, ray: usize) -> HitId {
        self.rays.source(self.index(ray))
    }

    #[inline(always)]
    fn update(&mut self, ray: usize, task: impl SingleRayTask) -> f32 {
        let index = self.index(ray);
        let (o, d) = self.origin_and_direction(ray);
        let mut query = ClosestHit {
            ray: FilteredRay { o, d, filter: self.filter },
            cull_back_faces: self.rays.cull_back_faces,
            source: self.rays.source(index),
            after: self.rays.after(index),
            best: self.best(index),
        };
        task.run(&mut query);
        if !query.best.is_miss() {
            self.hits[index] = query.best;
        }
        query.best.t
    }

    fn end(&mut self, _: usize) {}
}

/// Any-hit queries of shadow rays.
pub(crate) struct AnyHitStream<'a> {
    pub rays: &'a ShadowRayBatch,
    /// The index of each ray in the batch.
    pub indices: &'a [u32],
    pub filter: &'a dyn HitFilter,
    /// True for the rays of the stream that are occluded.
    pub occluded: &'a mut [bool; STREAM_RAYS],
    /// Collects the translucent surfaces on each ray of the stream; without it, they are ignored.
    pub transmittance: Option<&'a mut [Transmittance]>,
}

impl AnyHitStream<'_> {
    #[inline(always)]
    fn index(&self, ray: usize) -> usize {
        self.indices[ray] as usize
    }
}

impl StreamQuery for AnyHitStream<'_> {
    const ANY_HIT: bool = true;

    #[inline(always)]
    fn len(&self) -> usize {
        self.indices.len()
    }

    #[inline(always)]
    fn origin_and_direction(&self, ray: usize) -> (Vec3, Vec3) {
        let index = self.index(ray);
        let from = self.rays.from[index];
        match self.rays.coherence {
            Coherence::Direction(d) => (from, d),
            Coherence::Origin(light) => (light, from - light),
            Coherence::None => (self.rays.to[index], from - self.rays.to[index]),
        }
    }

    #[inline(always)]
    fn local_ray(&self, ray: usize) -> Option<LocalRay> {
        shadow_ray_query(self.rays, self.index(ray), self.filter, None).0
    }

    #[inline(always)]
    fn is_from_light(&self) -> bool {
        !matches!(self.rays.coherence, Coherence::Direction(_))
    }

    #[inline(always)]
    fn t_min(&self, _: usize) -> f32 {
        0.0
    }

    #[inline(always)]
    fn t_max(&self, ray: usize) -> f32 {
        match (self.occluded[ray & (STREAM_RAYS - 1)], self.is_from_light()) {
            (true, _) => f32::NEG_INFINITY,
            (false, true) => 1.0,
            (false, false) => f32::INFINITY,
        }
    }

    #[inline(always)]
    fn source(&self, ray: usize) -> HitId {
        self.rays.source[self.index(ray)]
    }

    #[inline(always)]
    fn update(&mut self, ray: usize, task: impl SingleRayTask) -> f32 {
        let index = self.index(ray);
        if !self.occluded[ray & (STREAM_RAYS - 1)] {
            let transmittance = self.transmittance.as_mut().map(|all| &mut all[ray]);
            let (_, mut query) = shadow_ray_query(self.rays, index, self.filter, transmittance);
            task.run(&mut query);
            self.occluded[ray & (STREAM_RAYS - 1)] = query.occluded;
        }
        self.t_max(ray)
    }

    #[inline(always)]
    fn end(&mut self, ray: usize) {
        self.occluded[ray & (STREAM_RAYS - 1)] = true;
    }
}
