//! Refit: updates a BVH to moved triangles. The boxes change, the topology stays.
//!
//! The topology suits the positions that the BVH was built for. The SAH cost tells how much the boxes have grown
//! since; beyond a limit, a new build pays.

use rayon::prelude::*;

use crate::build::duplicate_filter::{DuplicateFilter, Inserter};
use crate::build::input_triangles::{InputTriangle, par_indices};
use crate::bvh::aabb::Aabb;
use crate::bvh::blas::Blas;
use crate::bvh::build_triangle::BuildTriangle;
use crate::bvh::bvh8::{Bvh8, LEAF_BIT};
use crate::bvh::canonical_triangle::{CanonicalTriangle, Degeneracy, padded_bounds};
use crate::bvh::coincident::group_by_flags;
use crate::bvh::sah::sah_cost;
use crate::bvh::surface_flags::SurfaceFlags;
use crate::bvh::triangle4::{COINCIDENT, TRIANGLE_LANES, Triangle4};
use crate::report::BuildReport;

/// A BVH is rebuilt where its SAH cost exceeds this multiple of that at its build.
const MAX_COST_GROWTH: f64 = 1.25;

/// Blocks that a thread packs with one [`Inserter`].
const BLOCKS_PER_TASK: usize = 1024;

impl Blas {
    /// Refits the BVH to the triangles `input(0..)`. Returns false if it has to be rebuilt, since other triangles
    /// are degenerate or coincident than before, or since rays would take too long; it must not be used then.
    pub fn refit(&mut self, input: impl Fn(usize) -> InputTriangle + Sync) -> bool {
        let cost = |bvh: &Bvh8| sah_cost(bvh, |_| 1.0);
        let built_cost = *self.built_cost.get_or_insert_with(|| cost(&self.bvh));
        if !self.update_coincident(&input) {
            return false;
        }
        if !self.update_blocks(&input) {
            return false;
        }
        if !self.rejects_same(&input) {
            return false;
        }
        self.bvh.refit(|leaf| leaf_bounds(&self.blocks[leaf as usize..]));
        self.update_bounds();
        cost(&self.bvh) <= MAX_COST_GROWTH * built_cost
    }

    /// Updates the flags of coincident triangles. Returns false if some are not coincident any more.
    fn update_coincident(&mut self, input: &(impl Fn(usize) -> InputTriangle + Sync)) -> bool {
        self.coincident.par_iter_mut().all(|groups| {
            let mut indices: Vec<u32> = groups.iter().flat_map(|group| &group.indices).copied().collect();
            indices.sort_unstable();
            let canonical = |&index: &u32| input(index as usize).canonical().ok();
            let triangles =
                indices.iter().map(canonical).collect::<Option<Vec<(CanonicalTriangle, SurfaceFlags)>>>();
            let Some(triangles) = triangles else { return false };
            *groups = group_by_flags(indices.into_iter().zip(triangles.iter().map(|(_, flags)| *flags)));
            triangles.windows(2).all(|pair| pair[0].0.to_bits() == pair[1].0.to_bits())
        })
    }

    /// Packs all blocks again. Returns false if a triangle has become degenerate, or coincident with another.
    fn update_blocks(&mut self, input: &(impl Fn(usize) -> InputTriangle + Sync)) -> bool {
        let coincident = &self.coincident;
        let filter = DuplicateFilter::new(self.triangle_count);
        let update_block = |inserter: &mut Inserter, block: &mut Triangle4| {
            let mut triangles = [BuildTriangle::REJECTED; TRIANGLE_LANES];
            let count = block.count();
            for (to, &index) in triangles.iter_mut().zip(&block.indices[..count]) {
                let input_index = match index & COINCIDENT {
                    0 => index,
                    _ => coincident[(index & !COINCIDENT) as usize][0].indices[0],
                };
                let Ok((triangle, flags)) = input(input_index as usize).canonical() else { return false };
                inserter.insert(&triangle.bounds());
                *to = BuildTriangle { triangle, flags, index };
            }
            *block = Triangle4::new(&triangles[..count], block.is_last_in_leaf());
            true
        };
        let update = |blocks: &mut [Triangle4]| {
            let mut inserter = filter.inserter();
            let valid = blocks.iter_mut().all(|block| update_block(&mut inserter, block));
            inserter.finish();
            valid
        };
        self.blocks.par_chunks_mut(BLOCKS_PER_TASK).all(update) && !self.has_duplicates(&filter)
    }

    /// Returns true if two triangles of the blocks are coincident.
    fn has_duplicates(&self, filter: &DuplicateFilter) -> bool {
        let suspects = |block: &Triangle4| {
            let triangles = (0..block.count()).map(|lane| block.vertices(lane));
            let bits = |vertices: [glam::Vec3; 3]| vertices.map(|p| p.to_array().map(f32::to_bits));
            let suspects = triangles.filter(|vertices| filter.maybe_duplicate(&padded_bounds(vertices)));
            suspects.map(bits).collect::<Vec<_>>()
        };
        let blocks = self.blocks.par_iter().with_min_len(256);
        let mut suspects: Vec<_> = blocks.flat_map_iter(suspects).collect();
        suspects.par_sort_unstable();
        suspects.windows(2).any(|pair| pair[0] == pair[1])
    }

    /// Returns false if a rejected triangle has become valid.
    fn rejects_same(&self, input: &(impl Fn(usize) -> InputTriangle + Sync)) -> bool {
        let BuildReport { non_finite, zero_area, .. } = self.report;
        if non_finite + zero_area == 0 {
            return true;
        }
        // Valid triangles are still valid: equal counts mean the same triangles.
        let rejected = |i: usize| match input(i).canonical() {
            Ok(_) => [0, 0],
            Err(Degeneracy::NonFinite) => [1, 0],
            Err(Degeneracy::ZeroArea) => [0, 1],
        };
        let counts = par_indices(self.input_count).map(rejected);
        counts.reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]]) == [non_finite, zero_area]
    }
}

/// Returns the bounds of the leaf that begins with the first of `blocks`.
fn leaf_bounds(blocks: &[Triangle4]) -> Aabb {
    let end = blocks.iter().position(Triangle4::is_last_in_leaf).map_or(blocks.len(), |last| last + 1);
    Aabb::union_of(blocks[..end].iter().map(Triangle4::bounds))
}

impl Bvh8 {
    /// Updates all boxes bottom up, from those of the leaves.
    fn refit(&mut self, leaf_bounds: impl Fn(u32) -> Aabb + Sync) {
        self.nodes.par_iter_mut().with_min_len(256).for_each(|node| {
            for slot in 0..node.count() {
                if node.child[slot] & LEAF_BIT != 0 {
                    node.set_bounds(slot, leaf_bounds(node.child[slot] & !LEAF_BIT));
                }
            }
        });
        // Children come after their parents.
        for i in (0..self.nodes.len()).rev() {
            for slot in 0..self.nodes[i].count() {
                let child = self.nodes[i].child[slot];
                if child & LEAF_BIT == 0 {
                    let bounds = self.nodes[child as usize].union_of_children();
                    self.nodes[i].set_bounds(slot, bounds);
                }
            }
        }
        self.nodes.par_iter_mut().with_min_len(256).for_each(|node| node.update_order(node.count()));
        if let Some(root) = self.root {
            self.bounds = match root & LEAF_BIT {
                0 => self.nodes[root as usize].union_of_children(),
                _ => leaf_bounds(root & !LEAF_BIT),
            };
        }
    }
}

#[cfg(test)]
mod tests;
