//! The rays of a batch that do not make packets, collected for streams.

use std::ops::Range;

use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::accel::single_ray_tracer::SingleRayTracer;
use crate::accel::stream::query::StreamQuery;
use crate::accel::stream::ray_lines::{MIN_STREAM_RAYS, STREAM_RAYS};
use crate::accel::stream::scratch::StreamScratch;
use crate::accel::stream::tracer::{StreamTracer, trace_single};
use crate::simd::Simd;

/// The indices of rays that wait to be traced as a stream, and memory for it.
#[derive(Default)]
pub(crate) struct Streams {
    pending: Vec<u32>,
    /// Taken from the thread for the first stream.
    scratch: Option<Box<StreamScratch>>,
}

impl Streams {
    /// Adds rays of the batch to those that wait. Returns those that waited before if all together are more than a stream.
    #[inline(always)]
    #[must_use]
    pub fn push(&mut self, rays: Range<usize>) -> Option<Vec<u32>> {
        let full = self.pending.len() + rays.len() > STREAM_RAYS;
        let pending = full.then(|| std::mem::take(&mut self.pending));
        self.pending.extend(rays.map(|ray| ray as u32));
        pending
    }

    /// Returns the rays that wait.
    pub fn take_pending(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.pending)
    }

    /// Traces the rays of a query, no more than a stream: through all BVHs, or through the TLAS alone where packets have
    /// traced them before (`worlds_traced`).
    #[inline(always)]
    pub fn trace<'b, S: Simd, Q: StreamQuery>(
        &mut self,
        bvh: &'b SceneBvh,
        query: &mut Q,
        worlds_traced: bool,
        single: &mut SingleRayTracer<'b>,
    ) {
        if query.len() >= MIN_STREAM_RAYS {
            let scratch = self.scratch.get_or_insert_with(StreamScratch::take);
            S::call_outlined(StreamTracer { bvh, worlds_traced, query, scratch, single });
            return;
        }
        for ray in 0..query.len() {
            trace_single::<S, Q>(query, ray, single, worlds_traced);
        }
    }
}

impl Drop for Streams {
    fn drop(&mut self) {
        if let Some(scratch) = self.scratch.take() {
            scratch.give_back();
        }
    }
}
