//! The upper level: which triangles share a tree in their own frame, which go into the world's,
//! and the tree over those trees.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::Preset;
use super::hit::HUGE;
use super::query::Query;
use super::tree::{Box3, BoxRay, Stack, Tree};
use super::triangles::{FrameRay, Triangles};
use crate::geometry::EPSILON;
use crate::scene::PosedScene;

/// Which instances share trees, and which triangles go into the world tree.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Plan {
    /// Instances in the world tree, with where they are.
    pub world: Vec<(u32, DAffine3)>,
    /// The instances of every shared mesh, by mesh.
    pub shared: BTreeMap<u32, Vec<(u32, Frame)>>,
}

/// A frame that rays can be taken into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    to_world: DAffine3,
    to_local: DMat3,
    /// How many times larger than its parts a sum of products with `to_local` and then its
    /// inverse may become: 1 for plain scaling, up to 3 for rotations, more for shears.
    condition: f64,
}

impl Plan {
    /// Meshes that several visible instances draw as they are get a shared tree.
    pub fn new(posed: &PosedScene) -> Plan {
        let mut plan = Plan::default();
        for (i, instance) in posed.instances.iter().enumerate().filter(|(_, i)| i.visible) {
            let mesh = posed.scene.instances[i].mesh;
            let to_world = instance.transform.affine;
            match Frame::new(to_world).filter(|_| instance.deformed.is_none()) {
                Some(frame) => plan.shared.entry(mesh).or_default().push((i as u32, frame)),
                None => plan.world.push((i as u32, to_world)),
            }
        }
        plan.shared.retain(|_, drawn| {
            let shared = drawn.len() > 1;
            if !shared {
                plan.world.extend(drawn.iter().map(|(i, frame)| (*i, frame.to_world)));
            }
            shared
        });
        plan.world.sort_unstable_by_key(|&(i, _)| i);
        plan
    }
}

impl Frame {
    /// `None` for transforms that flatten, that shear or stretch so much that f32 would suffer,
    /// or whose numbers are out of all proportion: what they place goes into the world tree.
    fn new(to_world: DAffine3) -> Option<Frame> {
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

    /// A ray in this frame, with the same parameter: its direction keeps the frame's scale. Both
    /// are rounded to f32 once, and that one ray meets the whole mesh, so no crack can open.
    fn ray(&self, ray: &FrameRay) -> FrameRay {
        let o = self.to_local * (ray.o.as_dvec3() - self.to_world.translation);
        let d = self.to_local * ray.d.as_dvec3();
        FrameRay { o: o.as_vec3(), d: d.as_vec3(), unit: ray.unit }
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

/// Something that the upper tree holds.
#[derive(Clone, Copy, Debug)]
enum Part {
    World,
    /// An instance of a shared mesh; the index is that of the mesh's tree.
    Placed {
        instance: u32,
        tree: usize,
        frame: Frame,
    },
}

/// The tree over the world tree and all placed trees.
///
/// A ray taken into a frame is rounded there, by half an ulp of each component of o and d. Seen
/// from the world it then passes where it should to within ε/2·condition·(2|o| + 3|T| + |p|), with
/// T the frame's translation and p the place. So the boxes here are padded, for each ray, by a
/// generous multiple of that.
#[derive(Clone, Debug, Default)]
pub(super) struct Top {
    tree: Tree,
    parts: Vec<Part>,
    /// The padding for a ray from the centre of the world.
    pad: f32,
    /// Added to it for each unit of distance.
    pad_per_distance: f32,
}

impl Top {
    /// A tree over `world` and the instances that `plan` places.
    pub fn build(world: &Triangles, plan: &Plan, meshes: &BTreeMap<u32, Triangles>, preset: Preset) -> Top {
        let mut parts: Vec<(Part, Box3)> = world.bounds.map(|b| (Part::World, b)).into_iter().collect();
        for (tree, (mesh, local)) in meshes.iter().enumerate() {
            let Some(bounds) = local.bounds else { continue };
            for &(instance, frame) in plan.shared.get(mesh).into_iter().flatten() {
                parts.push((Part::Placed { instance, tree, frame }, frame.world_box(bounds)));
            }
        }
        // Equal boxes share a slot here too: a thousand instances in one place are not a chain.
        let bits = |b: &Box3| [b.0.to_array(), b.1.to_array()].map(|p| p.map(f32::to_bits));
        parts.sort_by_key(|(_, b)| bits(b));
        let slots: Vec<&[(Part, Box3)]> = parts.chunk_by(|a, b| bits(&a.1) == bits(&b.1)).collect();
        let boxes: Vec<Box3> = slots.iter().map(|slot| slot[0].1).collect();
        let (mut tree, order) = Tree::build(&boxes, preset);
        tree.widen(&order.iter().map(|&slot| slots[slot as usize].len() as u32).collect::<Vec<_>>());
        let mut reach = 0f64;
        let mut condition = 0f64;
        for (part, (lo, hi)) in &parts {
            if let Part::Placed { frame, .. } = part {
                let place = f64::from(lo.abs().max(hi.abs()).max_element());
                reach = reach.max(place + frame.to_world.translation.abs().max_element());
                condition = condition.max(frame.condition);
            }
        }
        let per = 8.0 * f64::from(EPSILON) * condition;
        let parts = order.iter().flat_map(|&slot| slots[slot as usize].iter().map(|(p, _)| *p)).collect();
        Top { tree, parts, pad: (per * reach) as f32, pad_per_distance: per as f32 }
    }

    /// Tells `query` of the triangles that `ray` meets, in any order.
    pub fn visit<Q: Query>(
        &self,
        ray: &FrameRay,
        world: &Triangles,
        meshes: &[&Triangles],
        query: &mut Q,
        stack: &mut Stack,
    ) {
        if let [Part::World] = self.parts[..] {
            world.visit(ray, None, query, stack);
            return;
        }
        let pad = self.pad + self.pad_per_distance * ray.o.abs().max_element();
        let boxes = BoxRay::new(ray.o, ray.d, pad, ray.parameter(query.start()));
        self.tree.walk(&boxes, stack, ray.limit(query), |parts, stack| {
            for part in &self.parts[parts] {
                let goes_on = match part {
                    Part::World => world.visit(ray, None, query, stack),
                    Part::Placed { instance, tree, frame } => {
                        meshes[*tree].visit(&frame.ray(ray), Some(*instance), query, stack)
                    }
                };
                if !goes_on {
                    return None;
                }
            }
            Some(ray.limit(query))
        });
    }

    /// Inner nodes of its tree.
    pub fn nodes(&self) -> usize {
        self.tree.nodes()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + self.parts.capacity() * size_of::<Part>()
    }
}
