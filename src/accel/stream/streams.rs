//! The rays of a batch that do not make packets, collected for streams.

use std::ops::Range;

use crate::bvh::scene_bvh::SceneBvh;
use crate::single_ray_tracer::SingleRayTracer;
use crate::stream::prepared_rays::{MIN_STREAM_RAYS, STREAM_RAYS};
use crate::stream::query::StreamQuery;
use crate::stream::tracer::{StreamScratch, StreamTracer, trace_single};
use blinn_core::simd::Simd;

/// Indices of rays that are pending until there are enough for a stream, and memory to trace it.
pub(crate) struct Streams<'s> {
    pending: Vec<u32>,
    scratch: &'s mut Option<Box<StreamScratch>>,
}

impl<'s> Streams<'s> {
    /// No rays. `scratch` is allocated for the first stream.
    pub fn new(scratch: &'s mut Option<Box<StreamScratch>>) -> Streams<'s> {
        Streams { pending: Vec::new(), scratch }
    }

    /// Adds rays of the batch to the pending ones. Returns those that were pending before if all are more than a stream.
    #[inline(always)]
    #[must_use]
    pub fn push(&mut self, rays: Range<usize>) -> Option<Vec<u32>> {
        let full = self.pending.len() + rays.len() > STREAM_RAYS;
        let pending = full.then(|| std::mem::take(&mut self.pending));
        self.pending.extend(rays.map(|ray| ray as u32));
        pending
    }

    /// Removes and returns the pending rays.
    pub fn take_pending(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.pending)
    }

    /// Traces the rays of a query, at most a stream, through all BVHs, or through the TLAS alone if packets have traced them
    /// in the world BVHs (`worlds_traced`).
    #[inline(always)]
    pub fn trace<'b, S: Simd, Q: StreamQuery>(
        &mut self,
        bvh: &'b SceneBvh,
        query: &mut Q,
        worlds_traced: bool,
        single: &mut SingleRayTracer<'b>,
    ) {
        if query.len() >= MIN_STREAM_RAYS {
            let scratch = self.scratch.get_or_insert_default();
            S::call_outlined(StreamTracer { bvh, worlds_traced, query, scratch, single });
            return;
        }
        for ray in 0..query.len() {
            trace_single::<S, Q>(query, ray, single, worlds_traced);
        }
    }
}
