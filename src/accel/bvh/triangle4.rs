//! Four triangles side by side, as leaves hold them.

use glam::Vec3;

use crate::accel::build::canonical_triangle::padded_bounds;
use crate::accel::build::input_triangles::{SurfaceFlags, TriangleRef};
use crate::accel::bvh::aabb::Aabb;
use crate::scene::SurfaceClass;
use crate::simd::Lanes;
use crate::simd::vec3::{Vec3Lanes, per_axis};

/// Triangles in a block.
pub(crate) const TRIANGLE_LANES: usize = 4;

/// Up to four triangles. Lanes that are not used repeat the last one that is.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Triangle4 {
    /// By corner, axis, triangle.
    pub vertex: [[[f32; TRIANGLE_LANES]; 3]; 3],
    /// What stands where: an index of a triangle, or [`COINCIDENT`] and that of a group.
    pub ids: [u32; TRIANGLE_LANES],
    /// At least the length of every edge at a first corner.
    pub max_edge: f32,
    /// Four bits for each triangle.
    looks: u16,
    /// Triangles that are alone in their place and there wherever they are met; and, four bits higher, those
    /// of them that light does not pass.
    simple: u8,
    /// Number of triangles; with [`LAST`] where the leaf ends here.
    count: u8,
}

// A tree is mostly blocks, and rays wait for memory.
const _: () = assert!(size_of::<Triangle4>() == 168);

/// Marks the index of a group of triangles in one place.
pub(crate) const COINCIDENT: u32 = 1 << 31;
const LAST: u8 = 1 << 7;

impl Triangle4 {
    /// A block of 1 to 4 triangles. `last` ends a leaf.
    pub fn new(triangles: &[TriangleRef], last: bool) -> Triangle4 {
        let mut block = Triangle4 {
            vertex: [[[0.0; TRIANGLE_LANES]; 3]; 3],
            ids: [0; TRIANGLE_LANES],
            max_edge: 0.0,
            looks: 0,
            simple: 0,
            count: triangles.len() as u8 | if last { LAST } else { 0 },
        };
        for lane in 0..TRIANGLE_LANES {
            let TriangleRef { corners, id, look } = triangles[lane.min(triangles.len() - 1)];
            for (v, corner) in block.vertex.iter_mut().zip(corners.v()) {
                for axis in 0..3 {
                    v[axis][lane] = corner[axis];
                }
            }
            block.ids[lane] = id;
            block.max_edge = block.max_edge.max(corners.edge());
            // Triangles in one place may be wound either way: which of them are seen from a side each says.
            let single_sided = look.single_sided && id & COINCIDENT == 0;
            block.looks |= (look.class as u16 | u16::from(single_sided) << 2 | u16::from(look.reversed) << 3)
                << (4 * lane);
            let plain = id & COINCIDENT == 0 && look.class != SurfaceClass::Cutout;
            let opaque = plain && look.class == SurfaceClass::Opaque;
            block.simple |= (u8::from(plain) | u8::from(opaque) << TRIANGLE_LANES) << lane;
        }
        block
    }

    /// Number of triangles.
    #[inline(always)]
    pub fn count(&self) -> usize {
        usize::from(self.count & !LAST)
    }

    /// A bit for each triangle.
    #[inline(always)]
    pub fn lane_mask(&self) -> u32 {
        (1 << self.count()) - 1
    }

    /// A bit for each triangle that is alone in its place and there wherever it is met.
    #[inline(always)]
    pub fn unfiltered_mask(&self) -> u8 {
        self.simple & ((1 << TRIANGLE_LANES) - 1)
    }

    /// A bit for each of those that light does not pass.
    #[inline(always)]
    pub fn opaque_mask(&self) -> u8 {
        self.simple >> TRIANGLE_LANES
    }

    /// True where the leaf ends here.
    #[inline(always)]
    pub fn is_last_in_leaf(&self) -> bool {
        self.count & LAST != 0
    }

    /// The corners of a triangle.
    #[inline(always)]
    pub fn vertices(&self, lane: usize) -> [Vec3; 3] {
        let corner =
            |k: usize| Vec3::new(self.vertex[k][0][lane], self.vertex[k][1][lane], self.vertex[k][2][lane]);
        [corner(0), corner(1), corner(2)]
    }

    /// Loads the vertices of all four triangles.
    #[inline(always)]
    pub fn load_vertices<L: Lanes<TRIANGLE_LANES>>(&self) -> [Vec3Lanes<L>; 3] {
        per_axis(|vertex| per_axis(|axis| L::load(&self.vertex[vertex][axis])))
    }

    /// The box of all, as trees have it.
    pub fn bounds(&self) -> Aabb {
        Aabb::union_of((0..self.count()).map(|lane| padded_bounds(&self.vertices(lane))))
    }

    /// How a triangle looks; a group of them as one that is seen from both sides.
    #[inline(always)]
    pub fn flags(&self, lane: usize) -> SurfaceFlags {
        let bits = self.looks >> (4 * lane);
        let class = match bits & 3 {
            0 => SurfaceClass::Opaque,
            1 => SurfaceClass::Cutout,
            _ => SurfaceClass::Translucent,
        };
        SurfaceFlags { class, single_sided: bits & 4 != 0, reversed: bits & 8 != 0 }
    }
}
