//! All shading points of a batch, in blocks of [`LANES`].

use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, ZERO3_F32};
use blinn_core::simd::{AutovecKernel, SimdLevel};

/// Shading points in blocks, which are full but for the last one. Clearing it keeps the memory.
#[derive(Default)]
pub(crate) struct PointsSoa {
    blocks: Vec<PointBlock>,
    count: usize,
}

impl PointsSoa {
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// The blocks, each with its number of points.
    pub fn blocks_mut(&mut self) -> impl Iterator<Item = (&mut PointBlock, usize)> {
        let count = self.count;
        let counts = (0..count).step_by(LANES).map(move |first| LANES.min(count - first));
        self.blocks.iter_mut().zip(counts)
    }

    /// The layered points.
    pub fn layered_points(&self) -> impl Iterator<Item = usize> {
        let blocks = self.blocks.iter().zip((0..self.count).step_by(LANES));
        let count = self.count;
        blocks.flat_map(move |(block, first)| {
            block.layered.lanes().map(move |lane| first + lane).filter(move |&i| i < count)
        })
    }

    /// The block and the lane of point `i`.
    #[inline(always)]
    pub fn lane(&self, i: usize) -> (&PointBlock, usize) {
        (&self.blocks[i / LANES], i % LANES)
    }

    /// The block and the lane of point `i`, to change it.
    #[inline(always)]
    pub fn lane_mut(&mut self, i: usize) -> (&mut PointBlock, usize) {
        (&mut self.blocks[i / LANES], i % LANES)
    }

    /// Free lanes in the block of the next point.
    #[inline(always)]
    pub fn free_lanes(&self) -> usize {
        LANES - self.count % LANES
    }

    /// Appends `count` points, at most [`PointsSoa::free_lanes`], and returns their block and first lane.
    #[inline(always)]
    pub fn append(&mut self, count: usize) -> (&mut PointBlock, usize) {
        let first = self.count;
        if first / LANES == self.blocks.len() {
            self.blocks.push(PointBlock::ZERO);
        }
        self.count += count;
        let (block, lane) = self.lane_mut(first);
        if lane == 0 {
            block.has_specular = false;
            block.reflecting = 0;
            block.highlights.clear();
            block.layered.clear();
            block.noisy_diffuse = ZERO3_F32;
            block.noisy_specular = ZERO3_F32;
        }
        (block, lane)
    }

    /// Computes v and the normals of specular lobes in blocks with highlights or reflections:
    /// [`PointBlock::compute_view_dirs`].
    pub fn compute_view_dirs(&mut self, simd: SimdLevel, turns_normals: bool) {
        simd.run(ViewDirs { points: self, turns_normals });
    }

    /// Adds the current light of all points to their noisy light.
    pub fn accumulate_noisy(&mut self) {
        self.blocks_mut().for_each(|(block, _)| block.accumulate_noisy());
    }

    /// Adds the current light to the radiance of all points.
    pub fn accumulate(&mut self, simd: SimdLevel) {
        simd.run(Accumulate(self));
    }
}

/// [`PointsSoa::compute_view_dirs`].
struct ViewDirs<'a> {
    points: &'a mut PointsSoa,
    turns_normals: bool,
}

impl AutovecKernel for ViewDirs<'_> {
    #[inline(always)]
    fn run(self) {
        for (block, _) in self.points.blocks_mut() {
            if block.has_specular || block.reflecting != 0 || block.layered.mask() != 0 {
                block.compute_view_dirs(self.turns_normals);
            }
        }
    }
}

/// [`PointsSoa::accumulate`].
struct Accumulate<'a>(&'a mut PointsSoa);

impl AutovecKernel for Accumulate<'_> {
    #[inline(always)]
    fn run(self) {
        for (block, _) in self.0.blocks_mut() {
            block.accumulate();
        }
    }
}
