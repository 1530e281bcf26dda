//! Per-triangle terms of the edge functions that all rays of a packet share.

use crate::bvh::triangle4::TRIANGLE_LANES;
use blinn_core::simd::vec3::per_axis;
use blinn_core::simd::{Lanes, Simd};

/// The triangles of a block, prepared for rays with a shared origin or direction.
#[repr(C, align(64))]
pub(super) struct PreparedTriangles {
    /// Four vectors of each triangle, by vector, axis and triangle. Their meaning depends on the packet kind.
    pub vectors: [[[f32; TRIANGLE_LANES]; 3]; 4],
    /// The depth (shared origin) or the determinant (shared direction).
    pub shared_term: [f32; TRIANGLE_LANES],
    /// The constants of the edge functions on the projection plane (shared direction).
    pub constants: [[f32; TRIANGLE_LANES]; 3],
}

/// The edge functions of one triangle for the rays of a group. A hit has u, v and det − u − v of one sign, at
/// t = depth/det.
#[derive(Clone, Copy)]
pub(super) struct EdgeFunctions<L> {
    pub u: L,
    pub v: L,
    pub det: L,
    pub depth: L,
}

impl PreparedTriangles {
    #[inline(always)]
    pub fn new<S: Simd>(
        vectors: [[S::F32x4; 3]; 4],
        shared_term: S::F32x4,
        constants: [S::F32x4; 3],
    ) -> PreparedTriangles {
        let zero = [0.0; TRIANGLE_LANES];
        let mut prepared =
            PreparedTriangles { vectors: [[zero; 3]; 4], shared_term: zero, constants: [zero; 3] };
        for (to, from) in prepared.vectors.iter_mut().zip(&vectors) {
            from[0].store(&mut to[0]);
            from[1].store(&mut to[1]);
            from[2].store(&mut to[2]);
        }
        shared_term.store(&mut prepared.shared_term);
        constants.into_iter().zip(&mut prepared.constants).for_each(|(from, to)| from.store(to));
        prepared
    }

    /// Returns vector `i` of triangle `lane` in all lanes.
    #[inline(always)]
    pub fn splat_vector<S: Simd>(&self, i: usize, lane: usize) -> [S::F32x16; 3] {
        per_axis(|axis| S::F32x16::splat(self.vectors[i][axis][lane]))
    }
}
