//! Ray streams: up to 1024 rays traverse a BVH together, whether or not they share an origin or a direction.
//!
//! Traversal goes through the tree once for all rays of a stream, and keeps the list of rays that reach it with every node
//! on the stack. The rays of a list do not depend on each other, so that none waits for memory, for a comparison or for a
//! mispredicted branch of another, which a single ray spends most of its time on.
//!
//! 1. [`prepared_rays`] prepares 16 rays at a time in f32: a cache line for box tests and one for triangle tests of each ray.
//! 2. [`traversal`] tests the rays of a list one after the other against the eight boxes of a node, and then makes the list
//!    of each child. Closest hits are found by a stream for each octant of directions, so that one order of children is
//!    front to back for all rays. Any hits are found by one stream, by occlusion priority.
//! 3. At a leaf, the inputs of a block of triangles are computed once, then each ray takes the conservative f32 test. The
//!    exact test decides about the few that are left, and queries record hits, as for single rays ([`leaf`], [`query`]).
//! 4. Rays of short lists wait until there are enough of them, then continue eight at a time by turns ([`short_lists`]).
//! 5. In the TLAS, a list that reaches an instance continues as a stream in the instance's frame ([`instances`]).
//!
//! The exact test alone decides about hits, as for ray packets, so that streams and single rays give the same hits, to
//! the bit.
//!
//! Compare Barringer and Akenine-Möller, "Dynamic ray stream traversal" (2014).

mod instances;
mod leaf;
mod list_visitor;
mod lists;
mod node_test;
mod prepared_rays;
mod query;
mod short_lists;
mod streams;
mod tracer;
mod traversal;

pub(crate) use prepared_rays::STREAM_RAYS;
pub(crate) use query::{AnyHitStream, ClosestHitStream};
pub(crate) use streams::Streams;
pub(crate) use tracer::StreamScratch;
