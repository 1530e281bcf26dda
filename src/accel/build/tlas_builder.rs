//! Builds the TLAS over the instances of an instancing plan.

use std::collections::BTreeMap;

use glam::{DAffine3, Vec3};
use obvhs::Boundable;
use obvhs::aabb::Aabb as ObvhsAabb;
use rayon::prelude::*;

use crate::build::builder::{self, Cluster, ClusterLeaves};
use crate::build::instancing_plan::InstancingPlan;
use crate::build::leaf_packing::LeafCapacity;
use crate::build::morton_clusters::MortonKey;
use crate::bvh::aabb::Aabb;
use crate::bvh::blas::Blas;
use crate::bvh::canonical_triangle::{MAX_COORDINATE, MIN_PADDING};
use crate::bvh::instance::{BlasInstance, InstanceTransform, condition_number};
use crate::bvh::occlusion_order::OcclusionCost;
use crate::bvh::tlas::Tlas;
use crate::settings::Preset;
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_scene::PosedScene;

/// An instance in the build. There may be millions: transforms are computed once these are freed.
#[derive(Clone, Copy)]
struct InstanceBounds {
    instance: u32,
    blas: u32,
    bounds: Aabb,
}

/// Instances with equal bounds: they share a leaf, so that a thousand instances in one place do not make a tree as
/// deep.
#[derive(Clone, Copy)]
struct EqualBounds<'a>(&'a [InstanceBounds]);

impl Boundable for EqualBounds<'_> {
    fn aabb(&self) -> ObvhsAabb {
        self.0[0].bounds.into()
    }
}

/// A cluster of the TLAS.
struct InstanceCluster<'a> {
    boxes: Vec<ObvhsAabb>,
    instances: Vec<EqualBounds<'a>>,
    /// Occlusion cost of each BLAS.
    blas_costs: &'a [OcclusionCost],
}

/// The instances in the leaves of a cluster.
#[derive(Default)]
struct LeafInstances {
    instances: Vec<InstanceRef>,
    /// End of each leaf's range in `instances`.
    leaf_ends: Vec<u32>,
}

#[derive(Clone, Copy)]
struct InstanceRef {
    instance: u32,
    blas: u32,
}

impl Cluster for InstanceCluster<'_> {
    type Leaves = LeafInstances;

    fn boxes(&self) -> &[ObvhsAabb] {
        &self.boxes
    }

    fn entry_count(&self, i: u32) -> u32 {
        self.instances[i as usize].0.len() as u32
    }

    fn into_leaves<'a>(self, leaves: impl Iterator<Item = &'a [u32]>) -> ClusterLeaves<LeafInstances> {
        let mut contents = LeafInstances::default();
        let mut occlusion_costs = Vec::new();
        for leaf in leaves {
            let first = contents.instances.len();
            let instances = leaf.iter().flat_map(|&i| self.instances[i as usize].0);
            let without_bounds =
                |bounds: &InstanceBounds| InstanceRef { instance: bounds.instance, blas: bounds.blas };
            contents.instances.extend(instances.map(without_bounds));
            contents.leaf_ends.push(contents.instances.len() as u32);
            // A mesh fills its instance's bounds about as it fills its own.
            let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
            let costs = contents.instances[first..]
                .iter()
                .map(|instance| (unit, self.blas_costs[instance.blas as usize]));
            occlusion_costs.push(OcclusionCost::of_node(unit, costs));
        }
        let end = contents.leaf_ends.len() as u32;
        ClusterLeaves { contents, numbers: (0..end).collect(), end, occlusion_costs }
    }
}

/// Builds the TLAS over the instances of `plan`. `meshes` are the BLASes of its instanced meshes.
pub(crate) fn build_tlas(
    posed: &PosedScene,
    plan: &InstancingPlan,
    meshes: &BTreeMap<u32, Blas>,
    preset: Preset,
    cancel: &CancelToken,
) -> Result<Tlas, Cancelled> {
    let (mut bounds, padding) = collect_instances(posed, plan, meshes);
    bounds.par_sort_by_key(|instance| instance.bounds.to_bits());
    let same_bounds = |a: &InstanceBounds, b: &InstanceBounds| a.bounds.to_bits() == b.bounds.to_bits();
    let equal_bounds: Vec<EqualBounds> = bounds.chunk_by(same_bounds).map(EqualBounds).collect();
    let blas_costs: Vec<OcclusionCost> = meshes.values().map(|blas| blas.bvh.occlusion_cost).collect();
    let make_cluster = |keys: &[MortonKey]| {
        let instances: Vec<EqualBounds> = keys.iter().map(|key| equal_bounds[key.index()]).collect();
        let boxes = instances.iter().map(EqualBounds::aabb).collect();
        InstanceCluster { boxes, instances, blas_costs: &blas_costs }
    };
    let keys = (0..equal_bounds.len()).map(MortonKey::new).collect();
    let bounds_of = |i: usize| equal_bounds[i].aabb();
    let (bvh, leaves) = builder::build(keys, bounds_of, make_cluster, LeafCapacity::ONE, preset, cancel)?;
    drop(equal_bounds);
    drop(bounds);
    let PaddingBounds { condition, largest_coordinate } = padding;
    let padding_per_distance = 8.0 * f64::EPSILON * condition;
    let mut tlas = Tlas {
        bvh,
        padding: (padding_per_distance * largest_coordinate) as f32,
        padding_per_distance: padding_per_distance as f32,
        ..Tlas::default()
    };
    let leaves = leaves.into_iter().map(|leaves| leaves.contents);
    fill_leaves(&mut tlas, posed, leaves.collect());
    Ok(tlas)
}

/// The inputs of the padding of boxes ([`Tlas`]).
#[derive(Default)]
struct PaddingBounds {
    /// The largest condition number of all transforms.
    condition: f64,
    /// The largest sum of a coordinate of bounds and one of a transform's origin.
    largest_coordinate: f64,
}

fn collect_instances(
    posed: &PosedScene,
    plan: &InstancingPlan,
    meshes: &BTreeMap<u32, Blas>,
) -> (Vec<InstanceBounds>, PaddingBounds) {
    let count = plan.instanced.values().map(|instanced| instanced.instances.len()).sum();
    let mut all: Vec<InstanceBounds> = Vec::with_capacity(count);
    let mut padding = PaddingBounds::default();
    for (blas, (mesh, local)) in (0..).zip(meshes) {
        let (Some(local), Some(instanced)) = (local.bounds, plan.instanced.get(mesh)) else { continue };
        for &instance in &instanced.instances {
            let to_world = to_world(posed, instance);
            let Some(transform) = InstanceTransform::new(to_world) else { continue };
            let bounds = world_bounds(&to_world, local);
            all.push(InstanceBounds { instance, blas, bounds });
            let largest = f64::from(bounds.max_abs_coordinate()) + transform.origin.abs().max_element();
            padding.largest_coordinate = padding.largest_coordinate.max(largest);
            let condition = condition_number(to_world.matrix3, transform.to_local);
            padding.condition = padding.condition.max(condition);
        }
    }
    (all, padding)
}

fn fill_leaves(tlas: &mut Tlas, posed: &PosedScene, clusters: Vec<LeafInstances>) {
    tlas.instances.reserve_exact(clusters.iter().map(|leaves| leaves.instances.len()).sum());
    tlas.leaf_ends.reserve_exact(clusters.iter().map(|leaves| leaves.leaf_ends.len()).sum());
    for LeafInstances { instances, leaf_ends } in clusters {
        let first = tlas.instances.len() as u32;
        tlas.leaf_ends.extend(leaf_ends.into_iter().map(|end| first + end));
        let with_transform = |InstanceRef { instance, blas }| {
            let transform = InstanceTransform::new(to_world(posed, instance))?;
            Some(BlasInstance { instance, blas, transform })
        };
        // Never `None`, which would shift `leaf_ends`: `collect_instances` has skipped instances without a transform.
        tlas.instances.extend(instances.into_iter().filter_map(with_transform));
    }
}

fn to_world(posed: &PosedScene, instance: u32) -> DAffine3 {
    posed.instances[instance as usize].transform.affine
}

/// Returns the bounds in the world of local bounds, rounded outward.
fn world_bounds(to_world: &DAffine3, local: Aabb) -> Aabb {
    let mut bounds = blinn_core::geometry::Aabb::EMPTY;
    for corner in 0..8u32 {
        let at = |axis: usize| if corner >> axis & 1 == 0 { local.min[axis] } else { local.max[axis] };
        bounds.extend(to_world.transform_point3(Vec3::new(at(0), at(1), at(2)).as_dvec3()));
    }
    // By no more than boxes of triangles are padded, and not to subnormal numbers, which are slow on many processors.
    let is_zero = |x: f64| x.abs() < f64::from(MIN_PADDING);
    let down = |x: f64| if is_zero(x) { -MIN_PADDING } else { (x as f32).next_down() };
    let up = |x: f64| if is_zero(x) { MIN_PADDING } else { (x as f32).next_up() };
    let min = Vec3::new(down(bounds.min.x), down(bounds.min.y), down(bounds.min.z));
    let max = Vec3::new(up(bounds.max.x), up(bounds.max.y), up(bounds.max.z));
    // Triangles beyond this are rejected, and nothing there can be hit.
    let largest = Vec3::splat(MAX_COORDINATE);
    Aabb { min: min.clamp(-largest, largest), max: max.clamp(-largest, largest) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene may have millions of instances.
    #[test]
    fn instance_bounds_are_small() {
        assert!(size_of::<InstanceBounds>() <= 32);
    }
}
