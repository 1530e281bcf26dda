//! Four triangles side by side, as leaves hold them.

use glam::Vec3;

use crate::accel::build::canonical_triangle::padded;
use crate::accel::build::input_triangles::{Fit, Look};
use crate::accel::bvh::bvh8::{Box3, union};
use crate::scene::SurfaceClass;

/// Triangles in a block.
pub(crate) const CAPACITY: usize = 4;

/// Up to four triangles. Lanes that are not used repeat the last one that is.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Block {
    /// By corner, axis, triangle.
    pub v: [[[f32; CAPACITY]; 3]; 3],
    /// What stands where: an index of a triangle, or [`GROUP`] and that of a group.
    pub ids: [u32; CAPACITY],
    /// At least the length of every edge at a first corner.
    pub edge: f32,
    /// Four bits for each triangle.
    looks: u16,
    /// Triangles that are alone in their place and there wherever they are met; and, four bits higher, those
    /// of them that light does not pass.
    simple: u8,
    /// Number of triangles; with [`LAST`] where the leaf ends here.
    count: u8,
}

// A tree is mostly blocks, and rays wait for memory.
const _: () = assert!(size_of::<Block>() == 168);

/// Marks the index of a group of triangles in one place.
pub(crate) const GROUP: u32 = 1 << 31;
const LAST: u8 = 1 << 7;

impl Block {
    /// A block of 1 to 4 triangles. `last` ends a leaf.
    pub fn new(triangles: &[Fit], last: bool) -> Block {
        let mut block = Block {
            v: [[[0.0; CAPACITY]; 3]; 3],
            ids: [0; CAPACITY],
            edge: 0.0,
            looks: 0,
            simple: 0,
            count: triangles.len() as u8 | if last { LAST } else { 0 },
        };
        for lane in 0..CAPACITY {
            let Fit { corners, id, look } = triangles[lane.min(triangles.len() - 1)];
            for (v, corner) in block.v.iter_mut().zip(corners.v()) {
                for axis in 0..3 {
                    v[axis][lane] = corner[axis];
                }
            }
            block.ids[lane] = id;
            block.edge = block.edge.max(corners.edge());
            // Triangles in one place may be wound either way: which of them are seen from a side each says.
            let single_sided = look.single_sided && id & GROUP == 0;
            block.looks |= (look.class as u16 | u16::from(single_sided) << 2 | u16::from(look.reversed) << 3)
                << (4 * lane);
            let plain = id & GROUP == 0 && look.class != SurfaceClass::Cutout;
            let opaque = plain && look.class == SurfaceClass::Opaque;
            block.simple |= (u8::from(plain) | u8::from(opaque) << CAPACITY) << lane;
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
    pub fn used(&self) -> u32 {
        (1 << self.count()) - 1
    }

    /// A bit for each triangle that is alone in its place and there wherever it is met.
    #[inline(always)]
    pub fn plain(&self) -> u8 {
        self.simple & ((1 << CAPACITY) - 1)
    }

    /// A bit for each of those that light does not pass.
    #[inline(always)]
    pub fn opaque(&self) -> u8 {
        self.simple >> CAPACITY
    }

    /// True where the leaf ends here.
    #[inline(always)]
    pub fn last(&self) -> bool {
        self.count & LAST != 0
    }

    /// The corners of a triangle.
    #[inline(always)]
    pub fn corners(&self, lane: usize) -> [Vec3; 3] {
        let corner = |k: usize| Vec3::new(self.v[k][0][lane], self.v[k][1][lane], self.v[k][2][lane]);
        [corner(0), corner(1), corner(2)]
    }

    /// The box of all, as trees have it.
    pub fn bounds(&self) -> Box3 {
        union((0..self.count()).map(|lane| padded(&self.corners(lane))))
    }

    /// How a triangle looks; a group of them as one that is seen from both sides.
    #[inline(always)]
    pub fn look(&self, lane: usize) -> Look {
        let bits = self.looks >> (4 * lane);
        let class = match bits & 3 {
            0 => SurfaceClass::Opaque,
            1 => SurfaceClass::Cutout,
            _ => SurfaceClass::Translucent,
        };
        Look { class, single_sided: bits & 4 != 0, reversed: bits & 8 != 0 }
    }
}
