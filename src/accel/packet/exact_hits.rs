//! The t of certain hits in f64, for the rays of a group at once.

use glam::DVec3;

use crate::bvh::blas::Blas;
use crate::bvh::triangle_ids::TriangleIdMap;
use crate::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::packet::per_ray::RAYS_PER_GROUP;
use crate::packet::ray_packet::RayPacket;
use crate::packet::shared_vector::SharedVector;
use crate::traverse::exact_triangle_test::invert_power_of_two;
use blinn_core::simd::Simd;
use blinn_core::simd::vec3::per_axis;

/// Leaf blocks whose triangles an [`ExactHits`] holds.
pub(super) const BLOCKS_PER_TABLE: usize = RAYS_PER_GROUP / TRIANGLE_LANES;

/// The triangles of a few blocks, for rays that certainly hit one of them at an angle that is not grazing. Their t
/// is that of [`LocalRay::intersect_inside`], to the bit. What depends on a triangle alone is computed once for all
/// rays; each ray looks up the triangle that it hits.
///
/// [`LocalRay::intersect_inside`]: crate::traverse::exact_triangle_test::LocalRay::intersect_inside
#[derive(Clone, Debug)]
pub(super) struct ExactHits {
    shared: SharedVectorF64,
    /// n = e₁×e₂, by axis.
    normal: [[f64; RAYS_PER_GROUP]; 3],
    /// v₀, by axis, where the direction is shared.
    vertex: [[f64; RAYS_PER_GROUP]; 3],
    /// The part of t = n·(v₀ − o) / n·d that all rays share: the numerator with a shared origin, the denominator with a
    /// shared direction.
    shared_term: [f64; RAYS_PER_GROUP],
    instance: [u32; RAYS_PER_GROUP],
    triangle: [u32; RAYS_PER_GROUP],
}

/// A [`SharedVector`] in f64.
#[derive(Clone, Copy, Debug)]
enum SharedVectorF64 {
    Origin(DVec3),
    Direction(DVec3),
}

/// The hits of a ray group.
pub(super) struct GroupHits {
    pub t: [f32; RAYS_PER_GROUP],
    pub instance: [u32; RAYS_PER_GROUP],
    pub triangle: [u32; RAYS_PER_GROUP],
}

impl ExactHits {
    /// Returns a table without triangles.
    #[inline(always)]
    pub fn new(shared: &SharedVector) -> ExactHits {
        let shared = match *shared {
            SharedVector::Origin(o) => SharedVectorF64::Origin(o.as_dvec3()),
            SharedVector::Direction(d) => SharedVectorF64::Direction(d.as_dvec3()),
        };
        ExactHits {
            shared,
            normal: [[0.0; RAYS_PER_GROUP]; 3],
            vertex: [[0.0; RAYS_PER_GROUP]; 3],
            shared_term: [0.0; RAYS_PER_GROUP],
            instance: [0; RAYS_PER_GROUP],
            triangle: [0; RAYS_PER_GROUP],
        }
    }

    /// Sets the four triangles of block number `i` of the table.
    #[inline(always)]
    pub fn set_block(&mut self, i: usize, block: &Triangle4, id_map: &TriangleIdMap) {
        let first = i % BLOCKS_PER_TABLE * TRIANGLE_LANES;
        let v0 = per_axis(|axis| block.vertex[0][axis].map(f64::from));
        let edge = |vertex: usize, axis: usize| {
            let mut edge = block.vertex[vertex][axis].map(f64::from);
            edge.iter_mut().zip(&v0[axis]).for_each(|(x, v0)| *x -= v0);
            edge
        };
        let e1 = per_axis(|axis| edge(1, axis));
        let e2 = per_axis(|axis| edge(2, axis));
        for axis in 0..3 {
            let b = (axis + 1) % 3;
            let c = (axis + 2) % 3;
            for i in 0..TRIANGLE_LANES {
                self.normal[axis][first + i] = e1[b][i] * e2[c][i] - e2[b][i] * e1[c][i];
            }
        }
        let n = |i: usize| DVec3::from(per_axis(|axis| self.normal[axis][first + i]));
        let v0 = |i: usize| DVec3::from(per_axis(|axis| v0[axis][i]));
        match self.shared {
            SharedVectorF64::Origin(o) => {
                for i in 0..TRIANGLE_LANES {
                    self.shared_term[first + i] = n(i).dot(v0(i) - o);
                }
            }
            SharedVectorF64::Direction(d) => {
                for i in 0..TRIANGLE_LANES {
                    self.shared_term[first + i] = n(i).dot(d);
                    for axis in 0..3 {
                        self.vertex[axis][first + i] = v0(i)[axis];
                    }
                }
            }
        }
        for (i, &index) in block.indices.iter().enumerate().take(block.count()) {
            let id = id_map.id(index);
            self.instance[first + i] = id.instance;
            self.triangle[first + i] = id.triangle;
        }
    }

    /// Computes the hits of the rays of group `g` with the triangles `slots` of the table.
    #[inline(always)]
    pub fn compute<S: Simd>(&self, packet: &RayPacket, g: usize, slots: &[u32; RAYS_PER_GROUP]) -> GroupHits {
        let inv_t_scale = invert_power_of_two(packet.t_scale);
        let n = lookup_vectors::<S>(&self.normal, slots);
        let n = |i: usize| DVec3::new(n[0][i], n[1][i], n[2][i]);
        let shared_term = S::lookup_f64(&self.shared_term, slots);
        let varying = |i: usize| DVec3::from(per_axis(|axis| f64::from(packet.varying[axis].group(g)[i])));
        let mut t = [0.0; RAYS_PER_GROUP];
        match self.shared {
            SharedVectorF64::Origin(_) => {
                for (i, t) in t.iter_mut().enumerate() {
                    *t = (shared_term[i] / n(i).dot(varying(i)) * inv_t_scale) as f32;
                }
            }
            SharedVectorF64::Direction(_) => {
                let v0 = lookup_vectors::<S>(&self.vertex, slots);
                let v0 = |i: usize| DVec3::new(v0[0][i], v0[1][i], v0[2][i]);
                for (i, t) in t.iter_mut().enumerate() {
                    *t = (n(i).dot(v0(i) - varying(i)) / shared_term[i] * inv_t_scale) as f32;
                }
            }
        }
        let instance = S::lookup_u32(&self.instance, slots);
        let triangle = S::lookup_u32(&self.triangle, slots);
        GroupHits { t, instance, triangle }
    }
}

/// Looks up vectors by axis. Without closures: one of this size is compiled as a function of its own, without the
/// instructions of `S`.
#[inline(always)]
fn lookup_vectors<S: Simd>(
    table: &[[f64; RAYS_PER_GROUP]; 3],
    indices: &[u32; RAYS_PER_GROUP],
) -> [[f64; RAYS_PER_GROUP]; 3] {
    let x = S::lookup_f64(&table[0], indices);
    let y = S::lookup_f64(&table[1], indices);
    let z = S::lookup_f64(&table[2], indices);
    [x, y, z]
}

/// Computes the hits of the rays of group `g` in `mask`, each with the triangle of its slot. Their t is that of
/// [`ExactHits::compute`], to the bit. Faster where hardly two rays hit the same block.
#[inline(always)]
pub(super) fn compute_by_ray(
    shared: &SharedVector,
    packet: &RayPacket,
    g: usize,
    blas: &Blas,
    triangle_slots: &[u32; RAYS_PER_GROUP],
    mask: u32,
) -> GroupHits {
    let zero = [0.0; RAYS_PER_GROUP];
    let mut vertices = [[zero; 3]; 3];
    let mut hits = GroupHits { t: zero, instance: [0; RAYS_PER_GROUP], triangle: [0; RAYS_PER_GROUP] };
    let mut rays = mask;
    while rays != 0 {
        let ray = rays.trailing_zeros() as usize & (RAYS_PER_GROUP - 1);
        rays &= rays - 1;
        let (block, lane) = blas.block_and_lane(triangle_slots[ray]);
        for vertex in 0..3 {
            for axis in 0..3 {
                vertices[vertex][axis][ray] = block.vertex[vertex][axis][lane];
            }
        }
        let id = blas.ids.id(block.indices[lane]);
        hits.instance[ray] = id.instance;
        hits.triangle[ray] = id.triangle;
    }
    let inv_t_scale = invert_power_of_two(packet.t_scale);
    let varying = per_axis(|axis| packet.varying[axis].group(g));
    for (ray, t) in hits.t.iter_mut().enumerate() {
        let varying = DVec3::from(per_axis(|axis| f64::from(varying[axis][ray])));
        let (o, d) = match *shared {
            SharedVector::Origin(o) => (o.as_dvec3(), varying),
            SharedVector::Direction(d) => (varying, d.as_dvec3()),
        };
        let v = per_axis(|vertex| DVec3::from(per_axis(|axis| f64::from(vertices[vertex][axis][ray]))));
        let n = (v[1] - v[0]).cross(v[2] - v[0]);
        *t = (n.dot(v[0] - o) / n.dot(d) * inv_t_scale) as f32;
    }
    hits
}
