//! Ray packets: up to 256 rays that share an origin or a direction traverse a BVH together.
//!
//! A packet consists of ray groups of 16 rays. On a plane across the rays, each group covers a rectangle, and so does
//! each box ([`group_bounds`]). Culling gets finer on the way down:
//!
//! 1. The eight children of a node are tested against the bounds of the whole packet.
//! 2. Each child is tested against the bounds of all groups at once.
//! 3. The four triangles of a block are tested against the bounds of four groups at once.
//! 4. Single rays are tested only at leaves, and at boxes that are smaller than the rectangle of a group.
//!
//! Where few rays are left, they continue as single rays. Whatever depends on the shared origin or direction and on a
//! triangle alone is computed once for all rays.
//!
//! f32 only decides what its error bounds prove. Each ray has an interval around the t of its closest hit so far.
//! Hits that are not certainly inside or outside of a triangle, or of that interval, take the same exact test in f64
//! as those of single rays ([`exact_triangle_test`]), and the t of the closest hit is computed there. So packets and single
//! rays give the same hits, to the bit.
//!
//! Compare Wald et al., "Ray tracing deformable scenes using dynamic bounding volume hierarchies" (2007), for packets
//! in a BVH, and Reshetov et al., "Multi-level ray tracing algorithm" (2005), for culling by the frustum of a packet.
//!
//! [`exact_triangle_test`]: crate::traverse::exact_triangle_test

mod any_hit;
mod closest_hit;
mod exact_hits;
mod group_bounds;
mod leaf;
mod packet_frustum;
mod packet_kind;
mod packet_query;
mod packet_traversal;
mod per_ray;
mod prepared_triangles;
mod ray_packet;
mod shared_direction;
mod shared_origin;
mod shared_vector;

pub(crate) use any_hit::{PacketOcclusion, occluded};
pub(crate) use closest_hit::intersect;
pub(crate) use packet_traversal::PacketScratch;
pub(crate) use per_ray::{PACKET_SIZE, RAYS_PER_GROUP};
