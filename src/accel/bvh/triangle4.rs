//! Leaf block of the BVH: four triangles in structure-of-arrays form, tested against a ray at once.

use glam::Vec3;

use crate::bvh::aabb::Aabb;
use crate::bvh::build_triangle::BuildTriangle;
use crate::bvh::canonical_triangle::padded_bounds;
use crate::bvh::surface_flags::SurfaceFlags;
use blinn_core::simd::Lanes;
use blinn_core::simd::vec3::{Vec3Lanes, per_axis};
use blinn_scene::SurfaceClass;

/// Triangles in a [`Triangle4`].
pub(crate) const TRIANGLE_LANES: usize = 4;

/// Marks a triangle index as the index of a set of coincident triangles ([`Blas::coincident`]).
///
/// [`Blas::coincident`]: crate::bvh::blas::Blas::coincident
pub(crate) const COINCIDENT: u32 = 1 << 31;

/// Marks the last block of a leaf in the triangle count.
const LAST_IN_LEAF: u8 = 1 << 7;

/// Up to four triangles. Unused lanes repeat the last triangle.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Triangle4 {
    /// Coordinates by vertex, axis and lane.
    pub vertex: [[[f32; TRIANGLE_LANES]; 3]; 3],
    /// Index of a triangle of the BLAS, or [`COINCIDENT`] and the index of a set of coincident triangles.
    pub indices: [u32; TRIANGLE_LANES],
    /// Upper bound on the lengths of the edges at first vertices.
    pub max_edge: f32,
    /// Four bits for each lane, see [`Triangle4::flags`].
    flags: u16,
    /// [`Triangle4::unfiltered_mask`] in the low four bits, [`Triangle4::opaque_mask`] in the high ones.
    masks: u8,
    /// Number of triangles, with [`LAST_IN_LEAF`] in the last block of a leaf.
    count: u8,
}

// Blocks are most of a BVH's memory, and rays wait for memory.
const _: () = assert!(size_of::<Triangle4>() == 168);

impl Triangle4 {
    /// Packs 1 to 4 triangles. `last_in_leaf` ends a leaf.
    pub fn new(triangles: &[BuildTriangle], last_in_leaf: bool) -> Triangle4 {
        let mut block = Triangle4 {
            vertex: [[[0.0; TRIANGLE_LANES]; 3]; 3],
            indices: [0; TRIANGLE_LANES],
            max_edge: 0.0,
            flags: 0,
            masks: 0,
            count: triangles.len() as u8 | if last_in_leaf { LAST_IN_LEAF } else { 0 },
        };
        for lane in 0..TRIANGLE_LANES {
            block.set(lane, &triangles[lane.min(triangles.len() - 1)]);
        }
        block
    }

    fn set(&mut self, lane: usize, &BuildTriangle { triangle, index, flags }: &BuildTriangle) {
        for (to, vertex) in self.vertex.iter_mut().zip(triangle.vertices()) {
            for axis in 0..3 {
                to[axis][lane] = vertex[axis];
            }
        }
        self.indices[lane] = index;
        self.max_edge = self.max_edge.max(triangle.max_edge());
        let coincident = index & COINCIDENT != 0;
        // Coincident triangles may have either winding: back faces are culled one by one.
        let single_sided = flags.single_sided && !coincident;
        let bits = flags.class as u16 | u16::from(single_sided) << 2 | u16::from(flags.reversed) << 3;
        self.flags |= bits << (4 * lane);
        let unfiltered = !coincident && flags.class != SurfaceClass::Cutout;
        let opaque = unfiltered && flags.class == SurfaceClass::Opaque;
        self.masks |= (u8::from(unfiltered) | u8::from(opaque) << TRIANGLE_LANES) << lane;
    }

    /// Number of triangles.
    #[inline(always)]
    pub fn count(&self) -> usize {
        usize::from(self.count & !LAST_IN_LEAF)
    }

    /// A bit for each triangle.
    #[inline(always)]
    pub fn lane_mask(&self) -> u32 {
        (1 << self.count()) - 1
    }

    /// A bit for each triangle that is neither coincident with others nor alpha tested: a ray that intersects
    /// it hits it, without asking the hit filter.
    #[inline(always)]
    pub fn unfiltered_mask(&self) -> u8 {
        self.masks & ((1 << TRIANGLE_LANES) - 1)
    }

    /// A bit for each triangle of [`Triangle4::unfiltered_mask`] that is opaque.
    #[inline(always)]
    pub fn opaque_mask(&self) -> u8 {
        self.masks >> TRIANGLE_LANES
    }

    /// Returns true for the last block of a leaf.
    #[inline(always)]
    pub fn is_last_in_leaf(&self) -> bool {
        self.count & LAST_IN_LEAF != 0
    }

    /// The vertices of a triangle.
    #[inline(always)]
    pub fn vertices(&self, lane: usize) -> [Vec3; 3] {
        let position = |i: usize| {
            let [x, y, z] = &self.vertex[i];
            Vec3::new(x[lane], y[lane], z[lane])
        };
        [position(0), position(1), position(2)]
    }

    /// Loads the vertices of all four triangles.
    #[inline(always)]
    pub fn load_vertices<L: Lanes<TRIANGLE_LANES>>(&self) -> [Vec3Lanes<L>; 3] {
        per_axis(|vertex| per_axis(|axis| L::load(&self.vertex[vertex][axis])))
    }

    /// The bounds of all triangles, padded as in the BVH.
    pub fn bounds(&self) -> Aabb {
        Aabb::union_of((0..self.count()).map(|lane| padded_bounds(&self.vertices(lane))))
    }

    /// The surface flags of a triangle; coincident triangles count as double sided.
    #[inline(always)]
    pub fn flags(&self, lane: usize) -> SurfaceFlags {
        let bits = self.flags >> (4 * lane);
        let class = match bits & 3 {
            0 => SurfaceClass::Opaque,
            1 => SurfaceClass::Cutout,
            _ => SurfaceClass::Translucent,
        };
        SurfaceFlags { class, single_sided: bits & 4 != 0, reversed: bits & 8 != 0 }
    }
}
