//! The upper level: trees in frames of their own, placed in the world, and the tree over them.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use obvhs::Boundable;
use obvhs::aabb::Aabb as ObvhsAabb;
use rayon::prelude::*;

use crate::accel::Preset;
use crate::accel::build::builder;
use crate::accel::build::builder::{Filled, Region};
use crate::accel::build::canonical_triangle::HUGE;
use crate::accel::build::instancing_plan::Plan;
use crate::accel::build::leaf_packing::Capacity;
use crate::accel::build::morton_clusters::MortonKey;
use crate::accel::build::occlusion_order::OcclusionCost;
use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::blas::{Blas, limit};
use crate::accel::bvh::bvh8::{BoxTestRay, Bvh8, LEAF_BIT, Leaves, TraversalStack};
use crate::accel::traverse::hit::{LocalRay, floor_power_of_two};
use crate::accel::traverse::query::RayQuery;
use crate::scene::PosedScene;
use crate::simd::Simd;

/// A frame that rays can be taken into.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceTransform {
    /// Where it begins, in the world.
    origin: DVec3,
    to_local: DMat3,
}

/// The absolute values of a matrix's rows.
fn rows(m: DMat3) -> [DVec3; 3] {
    [m.row(0).abs(), m.row(1).abs(), m.row(2).abs()]
}

/// How many times larger than its parts a sum of products with `to_local` and then `to_world`, its inverse, may
/// become: 1 for plain scaling, up to 3 for rotations, more for shears.
fn condition(to_world: DMat3, to_local: DMat3) -> f64 {
    let back_sums = DVec3::from(rows(to_local).map(|row| row.element_sum()));
    rows(to_world).into_iter().map(|row| row.dot(back_sums)).fold(0.0, f64::max)
}

impl InstanceTransform {
    /// `None` for transforms that flatten, that shear or stretch so much that f32 would suffer,
    /// or whose numbers are out of all proportion: what they place goes into a world tree.
    pub fn new(to_world: DAffine3) -> Option<InstanceTransform> {
        let DAffine3 { matrix3: m, translation: origin } = to_world;
        let to_local = m.inverse();
        let largest = |m: DMat3| rows(m).into_iter().map(DVec3::max_element).fold(0.0, f64::max);
        let fits = condition(m, to_local) < 1e4
            && largest(m) < 1e12
            && largest(to_local) < 1e12
            && origin.abs().max_element() < f64::from(HUGE);
        // Written so that NaN does not fit.
        fits.then_some(InstanceTransform { origin, to_local })
    }

    /// A ray in this frame. That one line meets the whole mesh, so no crack can open.
    pub fn ray(&self, ray: &LocalRay) -> LocalRay {
        let o = self.to_local * (ray.o - self.origin);
        let d = self.to_local * ray.d;
        let power = floor_power_of_two(d.abs().max_element().max(f64::MIN_POSITIVE));
        LocalRay {
            o,
            d: d / power,
            t_scale: ray.t_scale * power,
            inv_t_scale: ray.inv_t_scale / power,
            ..*ray
        }
    }
}

/// The world box of a local box.
fn world_box(to_world: &DAffine3, local: Aabb) -> Aabb {
    let mut bounds = crate::geometry::Aabb::EMPTY;
    for corner in 0..8u32 {
        let at = |k: usize| if corner >> k & 1 == 0 { local.min[k] } else { local.max[k] };
        bounds.extend(to_world.transform_point3(Vec3::new(at(0), at(1), at(2)).as_dvec3()));
    }
    let down = |x: f64| (x as f32).next_down();
    let up = |x: f64| (x as f32).next_up();
    let (min, max) = (bounds.min, bounds.max);
    let lowest = Vec3::new(down(min.x), down(min.y), down(min.z));
    let highest = Vec3::new(up(max.x), up(max.y), up(max.z));
    // Nothing is seen beyond the magnitude that triangles are refused at.
    let huge = Vec3::splat(HUGE);
    Aabb { min: lowest.clamp(-huge, huge), max: highest.clamp(-huge, huge) }
}

/// An instance of a shared mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlasInstance {
    pub instance: u32,
    /// The index of the mesh's tree.
    pub tree: u32,
    pub frame: InstanceTransform,
}

/// What of an instance the tree is built of. There may be millions: frames come when those are gone.
#[derive(Clone, Copy)]
struct Boxed {
    instance: u32,
    tree: u32,
    bounds: Aabb,
}

/// Instances whose boxes are equal.
#[derive(Clone, Copy)]
struct Slot<'a>(&'a [Boxed]);

impl Boundable for Slot<'_> {
    fn aabb(&self) -> ObvhsAabb {
        self.0[0].bounds.into()
    }
}

/// What leaves hold: instances and their trees, one leaf after the other, and where each leaf's end.
#[derive(Default)]
struct Held {
    parts: Vec<(u32, u32)>,
    ends: Vec<u32>,
}

/// Slots of a region.
struct Slots<'a> {
    boxes: Vec<ObvhsAabb>,
    slots: Vec<Slot<'a>>,
    /// Of each mesh's tree.
    odds: &'a [OcclusionCost],
}

impl Region for Slots<'_> {
    type Leaves = Held;

    fn boxes(&self) -> &[ObvhsAabb] {
        &self.boxes
    }

    fn entries(&self, i: u32) -> u32 {
        self.slots[i as usize].0.len() as u32
    }

    fn leaves<'a>(self, members: impl Iterator<Item = &'a [u32]>) -> Filled<Self::Leaves> {
        let (mut held, mut odds) = (Held::default(), Vec::new());
        for leaf in members {
            let first = held.parts.len();
            let boxed = leaf.iter().flat_map(|&i| self.slots[i as usize].0);
            held.parts.extend(boxed.map(|part| (part.instance, part.tree)));
            held.ends.push(held.parts.len() as u32);
            // A mesh fills the box of its instance about as it fills its own.
            let everywhere = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
            let own = held.parts[first..].iter().map(|&(_, tree)| (everywhere, self.odds[tree as usize]));
            odds.push(OcclusionCost::of_all(everywhere, own));
        }
        let places = held.ends.len() as u32;
        Filled { leaves: held, firsts: (0..places).collect(), places, odds }
    }
}

/// The tree over all placed trees.
///
/// A ray taken into a frame is rounded there, in f64. Seen from the world it then passes where it
/// should to within ε/2·condition·(2|o| + 3|T| + |p|), with T the frame's translation and p the
/// place. So the boxes here are padded, for each ray, by a generous multiple of that.
#[derive(Debug, Default)]
pub(crate) struct Tlas {
    pub bvh: Bvh8,
    parts: Vec<BlasInstance>,
    /// Leaf n of the tree holds the parts before ends[n] that leaf n − 1 does not.
    ends: Vec<u32>,
    /// The padding for a ray from the centre of the world.
    pad: f32,
    /// Added to it for each unit of distance.
    pad_per_distance: f32,
}

impl Tlas {
    /// A tree over the instances that `plan` places.
    pub fn build(posed: &PosedScene, plan: &Plan, meshes: &BTreeMap<u32, Blas>, preset: Preset) -> Tlas {
        let to_world = |instance: u32| posed.instances[instance as usize].transform.affine;
        let mut parts: Vec<Boxed> =
            Vec::with_capacity(plan.placed.values().map(|placed| placed.instances.len()).sum());
        let (mut reach, mut most) = (0f64, 0f64);
        for (tree, (mesh, local)) in (0..).zip(meshes) {
            let (Some(bounds), Some(placed)) = (local.bounds, plan.placed.get(mesh)) else { continue };
            for &instance in &placed.instances {
                let to_world = to_world(instance);
                let Some(frame) = InstanceTransform::new(to_world) else { continue };
                let bounds = world_box(&to_world, bounds);
                parts.push(Boxed { instance, tree, bounds });
                let place = f64::from(bounds.max_abs_coordinate());
                reach = reach.max(place + frame.origin.abs().max_element());
                most = most.max(condition(to_world.matrix3, frame.to_local));
            }
        }
        // Equal boxes share a slot here too: a thousand instances in one place are not a chain.
        parts.par_sort_by_key(|part| part.bounds.to_bits());
        let slots: Vec<Slot> =
            parts.chunk_by(|a, b| a.bounds.to_bits() == b.bounds.to_bits()).map(Slot).collect();
        let odds: Vec<OcclusionCost> = meshes.values().map(|mesh| mesh.bvh.odds).collect();
        let open = |keys: &[MortonKey]| {
            let slots: Vec<Slot> = keys.iter().map(|key| slots[key.index()]).collect();
            Slots { boxes: slots.iter().map(Slot::aabb).collect(), slots, odds: &odds }
        };
        let (tree, leaves) = builder::build(&slots, open, Capacity::ONE, preset);
        drop(slots);
        drop(parts);
        let per = 8.0 * f64::EPSILON * most;
        let mut top =
            Tlas { bvh: tree, pad: (per * reach) as f32, pad_per_distance: per as f32, ..Tlas::default() };
        top.parts.reserve_exact(leaves.iter().map(|filled| filled.leaves.parts.len()).sum());
        top.ends.reserve_exact(leaves.iter().map(|filled| filled.leaves.ends.len()).sum());
        for Held { parts, ends } in leaves.into_iter().map(|filled| filled.leaves) {
            let before = top.parts.len() as u32;
            top.ends.extend(ends.into_iter().map(|end| before + end));
            let placed = |(instance, tree)| {
                Some(BlasInstance { instance, tree, frame: InstanceTransform::new(to_world(instance))? })
            };
            top.parts.extend(parts.into_iter().filter_map(placed));
        }
        top
    }

    /// What a leaf of the tree holds.
    #[inline(always)]
    pub fn parts(&self, leaf: u32) -> &[BlasInstance] {
        let first = if leaf == 0 { 0 } else { self.ends[leaf as usize - 1] };
        &self.parts[first as usize..self.ends[leaf as usize] as usize]
    }

    /// How much wider its boxes are for a ray from `o`.
    #[inline(always)]
    pub fn pad(&self, o: DVec3) -> f32 {
        self.pad + self.pad_per_distance * o.abs().max_element() as f32
    }

    /// True where nothing is placed.
    pub fn is_empty(&self) -> bool {
        self.bvh.root.is_none()
    }

    /// Tells `query` of the triangles that `ray` meets, in any order. False once it has stopped.
    #[inline(always)]
    pub fn traverse<S: Simd, Q: RayQuery>(
        &self,
        ray: &LocalRay,
        meshes: &[&Blas],
        query: &mut Q,
        stack: &mut TraversalStack,
    ) -> bool {
        let Some(root) = self.bvh.root else { return true };
        let boxes = BoxTestRay::new(ray.o, ray.d, self.pad(ray.o), ray.to_local_t(query.t_min()));
        let limit = limit(ray, query);
        let mut leaves = Entering { top: self, ray, meshes, query };
        match Q::ANY_HIT {
            true => self.bvh.walk_any::<S>(root, &boxes, stack, limit, &mut leaves),
            false => self.bvh.walk::<S>(root, &boxes, stack, limit, &mut leaves),
        }
    }

    /// Inner nodes of its tree.
    pub fn nodes(&self) -> usize {
        self.bvh.nodes.len()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.bvh.bytes()
            + self.parts.capacity() * size_of::<BlasInstance>()
            + self.ends.capacity() * size_of::<u32>()
    }
}

/// A ray at the leaves of the upper tree.
struct Entering<'a, Q> {
    top: &'a Tlas,
    ray: &'a LocalRay,
    meshes: &'a [&'a Blas],
    query: &'a mut Q,
}

impl<S: Simd, Q: RayQuery> Leaves<S> for Entering<'_, Q> {
    #[inline(always)]
    fn enter(&mut self, leaf: u32, stack: &mut TraversalStack) -> Option<f32> {
        for BlasInstance { instance, tree, frame } in self.top.parts(leaf) {
            let triangles = self.meshes[*tree as usize];
            let root = triangles.bvh.root.unwrap_or(LEAF_BIT);
            if !triangles.traverse::<S, Q>(root, &frame.ray(self.ray), Some(*instance), self.query, stack) {
                return None;
            }
        }
        Some(limit(self.ray, self.query))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// There may be millions of both.
    #[test]
    fn instances_are_small() {
        assert!(size_of::<BlasInstance>() <= 104 && size_of::<Boxed>() <= 32);
    }
}
