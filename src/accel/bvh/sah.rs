//! Surface area heuristic (SAH): measures the expected cost of a random line through a BVH. `build/builder.rs`,
//! `build/bvh2_to_bvh8.rs` and `build/leaf_packing.rs` construct BVHs by it.
//!
//! A line that hits a convex body hits a box inside it with the ratio of the boxes' surface areas (Goldsmith
//! and Salmon, Automatic Creation of Object Hierarchies for Ray Tracing, 1987).

use crate::bvh::aabb::Aabb;
use crate::bvh::blas::Blas;
use crate::bvh::bvh8::{Bvh8, LEAF_BIT};
use crate::bvh::scene_bvh::SceneBvh;

/// Returns the expected number of nodes that a line through the tree's bounds visits, plus `leaf_cost` of each
/// leaf that it visits. Nothing ends the line.
pub(crate) fn sah_cost(bvh: &Bvh8, leaf_cost: impl Fn(u32) -> f64) -> f64 {
    let Some(root) = bvh.root else { return 0.0 };
    if root & LEAF_BIT != 0 {
        return leaf_cost(root & !LEAF_BIT);
    }
    let total_area = bvh.bounds.half_area();
    // Bounds without area: count every child as hit.
    let hit_probability =
        |bounds: Aabb| if total_area > 0.0 { (bounds.half_area() / total_area).min(1.0) } else { 1.0 };
    let mut cost = 1.0;
    for node in bvh.nodes.iter() {
        for slot in 0..node.count() {
            let child = node.child[slot];
            let child_cost = if child & LEAF_BIT == 0 { 1.0 } else { leaf_cost(child & !LEAF_BIT) };
            cost += hit_probability(node.bounds(slot)) * child_cost;
        }
    }
    cost
}

/// SAH cost of a BLAS in nodes and blocks of four triangles.
fn blas_cost(blas: &Blas) -> f64 {
    sah_cost(&blas.bvh, |leaf| {
        let blocks = &blas.blocks[leaf as usize..];
        (1 + blocks.iter().take_while(|block| !block.is_last_in_leaf()).count()) as f64
    })
}

impl SceneBvh {
    /// SAH cost of all BVHs: the expected number of nodes and blocks of four triangles that a line through the
    /// scene's bounds visits. 0 for an empty scene.
    pub fn sah_cost(&self) -> f64 {
        let mesh_costs: Vec<f64> = self.mesh_blases.values().map(blas_cost).collect();
        let instanced_cost = sah_cost(&self.tlas.bvh, |leaf| {
            self.tlas.instances(leaf).iter().map(|instance| mesh_costs[instance.blas as usize]).sum()
        });
        let mut costs: Vec<(Aabb, f64)> =
            self.worlds().iter().map(|world| (world.bvh.bounds, blas_cost(world))).collect();
        costs.push((self.tlas.bvh.bounds, instanced_cost));
        costs.retain(|&(_, cost)| cost > 0.0);
        let total_area = Aabb::union_of(costs.iter().map(|cost| cost.0)).half_area();
        let hit_probability =
            |bounds: Aabb| if total_area > 0.0 { bounds.half_area() / total_area } else { 1.0 };
        costs.iter().map(|&(bounds, cost)| cost * hit_probability(bounds)).sum()
    }
}
