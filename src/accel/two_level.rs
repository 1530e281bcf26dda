//! The upper level: trees in frames of their own, placed in the world, and the tree over them.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use obvhs::Boundable;
use obvhs::aabb::Aabb;

use super::Preset;
use super::collapse::{self, Filled, Region};
use super::corners::HUGE;
use super::hit::{FrameRay, power_of_two};
use super::odds::Odds;
use super::plan::Plan;
use super::query::Query;
use super::regions::Key;
use super::simd::Simd;
use super::triangles::{Triangles, limit};
use super::wide::{Box3, BoxRay, LEAF, Leaves, Stack, Wide, aabb, bits};

/// A frame that rays can be taken into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub to_world: DAffine3,
    to_local: DMat3,
    /// How many times larger than its parts a sum of products with `to_local` and then its
    /// inverse may become: 1 for plain scaling, up to 3 for rotations, more for shears.
    condition: f64,
}

impl Frame {
    /// `None` for transforms that flatten, that shear or stretch so much that f32 would suffer,
    /// or whose numbers are out of all proportion: what they place goes into a world tree.
    pub fn new(to_world: DAffine3) -> Option<Frame> {
        let m = to_world.matrix3;
        let to_local = m.inverse();
        let rows = |m: DMat3| [m.row(0).abs(), m.row(1).abs(), m.row(2).abs()];
        let (out, back) = (rows(m), rows(to_local));
        let back_sums = DVec3::from(back.map(|row| row.element_sum()));
        let condition = out.into_iter().map(|row| row.dot(back_sums)).fold(0.0, f64::max);
        let largest = |rows: [DVec3; 3]| rows.into_iter().map(DVec3::max_element).fold(0.0, f64::max);
        let fits = condition < 1e4
            && largest(out) < 1e12
            && largest(back) < 1e12
            && to_world.translation.abs().max_element() < f64::from(HUGE);
        // Written so that NaN does not fit.
        fits.then_some(Frame { to_world, to_local, condition })
    }

    /// A ray in this frame. That one line meets the whole mesh, so no crack can open.
    pub fn ray(&self, ray: &FrameRay) -> FrameRay {
        let o = self.to_local * (ray.o - self.to_world.translation);
        let d = self.to_local * ray.d;
        let power = power_of_two(d.abs().max_element().max(f64::MIN_POSITIVE));
        FrameRay { o, d: d / power, size: ray.size * power, unit: ray.unit / power, ..*ray }
    }

    /// The world box of a local box.
    fn world_box(&self, (lo, hi): Box3) -> Box3 {
        let mut bounds = crate::geometry::Aabb::EMPTY;
        for corner in 0..8u32 {
            let at = |k: usize| if corner >> k & 1 == 0 { lo[k] } else { hi[k] };
            bounds.add(self.to_world.transform_point3(Vec3::new(at(0), at(1), at(2)).as_dvec3()));
        }
        let down = |x: f64| (x as f32).next_down();
        let up = |x: f64| (x as f32).next_up();
        let (min, max) = (bounds.min, bounds.max);
        let lowest = Vec3::new(down(min.x), down(min.y), down(min.z));
        let highest = Vec3::new(up(max.x), up(max.y), up(max.z));
        // Nothing is seen beyond the magnitude that triangles are refused at.
        let huge = Vec3::splat(HUGE);
        (lowest.clamp(-huge, huge), highest.clamp(-huge, huge))
    }
}

/// An instance of a shared mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub instance: u32,
    /// The index of the mesh's tree.
    pub tree: usize,
    pub frame: Frame,
}

/// Instances whose boxes are equal.
#[derive(Clone, Copy)]
struct Slot<'a>(&'a [(Placed, Box3)]);

impl Boundable for Slot<'_> {
    fn aabb(&self) -> Aabb {
        aabb(self.0[0].1)
    }
}

/// Slots of a region.
struct Slots<'a> {
    boxes: Vec<Aabb>,
    slots: Vec<Slot<'a>>,
    /// Of each mesh's tree.
    odds: &'a [Odds],
}

impl Region for Slots<'_> {
    /// What each leaf holds.
    type Leaves = Vec<Vec<Placed>>;

    fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    fn entries(&self, i: u32) -> u32 {
        self.slots[i as usize].0.len() as u32
    }

    fn leaves<'a>(self, members: impl Iterator<Item = &'a [u32]>) -> Filled<Self::Leaves> {
        let placed = |&i: &u32| self.slots[i as usize].0.iter().map(|(part, _)| *part);
        let leaves: Vec<Vec<Placed>> = members.map(|leaf| leaf.iter().flat_map(placed).collect()).collect();
        // A mesh fills the box of its instance about as it fills its own.
        let own = |leaf: &Vec<Placed>| {
            let everywhere = (Vec3::ZERO, Vec3::ONE);
            Odds::of_all(everywhere, leaf.iter().map(|part| (everywhere, self.odds[part.tree])))
        };
        let odds = leaves.iter().map(own).collect();
        let places = leaves.len() as u32;
        Filled { leaves, firsts: (0..places).collect(), places, odds }
    }
}

/// The tree over all placed trees.
///
/// A ray taken into a frame is rounded there, in f64. Seen from the world it then passes where it
/// should to within ε/2·condition·(2|o| + 3|T| + |p|), with T the frame's translation and p the
/// place. So the boxes here are padded, for each ray, by a generous multiple of that.
#[derive(Debug, Default)]
pub(super) struct Top {
    pub tree: Wide,
    parts: Vec<Placed>,
    /// Leaf n of the tree holds the parts before ends[n] that leaf n − 1 does not.
    ends: Vec<u32>,
    /// The padding for a ray from the centre of the world.
    pad: f32,
    /// Added to it for each unit of distance.
    pad_per_distance: f32,
}

impl Top {
    /// A tree over the instances that `plan` places.
    pub fn build(plan: &Plan, meshes: &BTreeMap<u32, Triangles>, preset: Preset) -> Top {
        let mut parts: Vec<(Placed, Box3)> = Vec::new();
        for (tree, (mesh, local)) in meshes.iter().enumerate() {
            let Some(bounds) = local.bounds else { continue };
            for &(instance, frame) in plan.placed.get(mesh).into_iter().flat_map(|placed| &placed.frames) {
                parts.push((Placed { instance, tree, frame }, frame.world_box(bounds)));
            }
        }
        // Equal boxes share a slot here too: a thousand instances in one place are not a chain.
        parts.sort_by_key(|(_, b)| bits(*b));
        let slots: Vec<Slot> = parts.chunk_by(|a, b| bits(a.1) == bits(b.1)).map(Slot).collect();
        let odds: Vec<Odds> = meshes.values().map(|mesh| mesh.tree.odds).collect();
        let open = |keys: &[Key]| {
            let slots: Vec<Slot> = keys.iter().map(|key| slots[key.index()]).collect();
            Slots { boxes: slots.iter().map(Slot::aabb).collect(), slots, odds: &odds }
        };
        let (tree, leaves) = collapse::build(&slots, open, 1, preset);
        let mut reach = 0f64;
        let mut condition = 0f64;
        for (Placed { frame, .. }, (lo, hi)) in &parts {
            let place = f64::from(lo.abs().max(hi.abs()).max_element());
            reach = reach.max(place + frame.to_world.translation.abs().max_element());
            condition = condition.max(frame.condition);
        }
        let per = 8.0 * f64::EPSILON * condition;
        let mut top = Top { tree, pad: (per * reach) as f32, pad_per_distance: per as f32, ..Top::default() };
        for leaf in leaves.into_iter().flat_map(|filled| filled.leaves) {
            top.parts.extend(leaf);
            top.ends.push(top.parts.len() as u32);
        }
        top
    }

    /// What a leaf of the tree holds.
    #[inline(always)]
    pub fn parts(&self, leaf: u32) -> &[Placed] {
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
        self.tree.root.is_none()
    }

    /// Tells `query` of the triangles that `ray` meets, in any order. False once it has stopped.
    #[inline(always)]
    pub fn visit<S: Simd, Q: Query>(
        &self,
        ray: &FrameRay,
        meshes: &[&Triangles],
        query: &mut Q,
        stack: &mut Stack,
    ) -> bool {
        let Some(root) = self.tree.root else { return true };
        let boxes = BoxRay::new(ray.o, ray.d, self.pad(ray.o), ray.parameter(query.start()));
        let limit = limit(ray, query);
        let mut leaves = Entering { top: self, ray, meshes, query };
        match Q::ANY {
            true => self.tree.walk_any::<S>(root, &boxes, stack, limit, &mut leaves),
            false => self.tree.walk::<S>(root, &boxes, stack, limit, &mut leaves),
        }
    }

    /// Inner nodes of its tree.
    pub fn nodes(&self) -> usize {
        self.tree.nodes.len()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
            + self.parts.capacity() * size_of::<Placed>()
            + self.ends.capacity() * size_of::<u32>()
    }
}

/// A ray at the leaves of the upper tree.
struct Entering<'a, Q> {
    top: &'a Top,
    ray: &'a FrameRay,
    meshes: &'a [&'a Triangles],
    query: &'a mut Q,
}

impl<S: Simd, Q: Query> Leaves<S> for Entering<'_, Q> {
    #[inline(always)]
    fn enter(&mut self, leaf: u32, stack: &mut Stack) -> Option<f32> {
        for Placed { instance, tree, frame } in self.top.parts(leaf) {
            let triangles = self.meshes[*tree];
            let root = triangles.tree.root.unwrap_or(LEAF);
            if !triangles.visit::<S, Q>(root, &frame.ray(self.ray), Some(*instance), self.query, stack) {
                return None;
            }
        }
        Some(limit(self.ray, self.query))
    }
}
