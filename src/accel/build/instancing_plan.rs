//! Which triangles go into the world's trees, and which share a tree in their own frame.
//!
//! Rays go through a world's tree together and through placed ones alone, so what is drawn in few
//! triangles goes into the world, however often its mesh is drawn. What keeps its place and what may
//! move are worlds of their own: from pose to pose, the second alone has work.
//!
//! A hit in a frame of its own is rounded there, and its t may differ in the last bit from that in the
//! world. So what goes where depends on the scene and its pose alone, never on what was rendered before:
//! frames have the same bytes however they are shared out.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DVec3};

use crate::accel::build::surface_flags::MeshFlags;
use crate::accel::bvh::tlas::InstanceTransform;
use crate::geometry::Transform;
use crate::scene::{PosedInstance, PosedScene};

/// An instance whose triangles are in a world's tree.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Member {
    pub instance: u32,
    pub to_world: DAffine3,
    pub look: MeshFlags,
}

/// Its members, by rising index.
pub(crate) type World = Vec<Member>;

/// A mesh that has a tree of its own.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlacedMesh {
    /// How it looks in its own frame.
    pub look: MeshFlags,
    /// Its instances, each in a [`InstanceTransform`].
    pub instances: Vec<u32>,
}

/// What goes where.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plan {
    /// What no animation moves.
    pub still: World,
    /// What may move or bend: its tree is refitted, or built again, with every pose.
    pub moving: World,
    /// Meshes with trees of their own.
    pub placed: BTreeMap<u32, PlacedMesh>,
}

/// Instances of one mesh that keep its shape.
struct Drawn {
    mesh: u32,
    moves: bool,
    instances: Vec<u32>,
}

/// Blas, each as often as it is drawn, that a world takes from meshes that could have trees of
/// their own: the smallest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlattenBudget {
    /// Of meshes that are drawn more than once. Every one costs its memory, and its time to build once.
    pub static_triangles: u64,
    /// Of meshes that move. Every one costs its time to build with every frame.
    pub dynamic_triangles: u64,
}

impl Default for FlattenBudget {
    fn default() -> Self {
        FlattenBudget::DEFAULT
    }
}

impl FlattenBudget {
    /// Where packets gain more than copies cost.
    pub const DEFAULT: FlattenBudget =
        FlattenBudget { static_triangles: 1 << 20, dynamic_triangles: 1 << 18 };
    /// Every mesh that can gets a tree of its own.
    pub const ZERO: FlattenBudget = FlattenBudget { static_triangles: 0, dynamic_triangles: 0 };
}

impl Plan {
    /// Decides for all that is visible; `look` says how meshes look.
    pub fn new(posed: &PosedScene, flatten: FlattenBudget, mut look: impl FnMut(u32) -> MeshFlags) -> Plan {
        let mut plan = Plan::default();
        let moving = posed.scene.animated_instances(&posed.scene.animations);
        let mut rigid: BTreeMap<(bool, u32), Drawn> = BTreeMap::new();
        let seen = |i: &PosedInstance| i.visible && !vanishes(&i.transform.affine.matrix3);
        for (i, instance) in posed.instances.iter().enumerate().filter(|(_, i)| seen(i)) {
            let to_world = instance.transform.affine;
            let mesh = posed.scene.instances[i].mesh;
            let moves = moving[i];
            let keeps = instance.deformed.is_none() && !(moves && may_bend(posed, i as u32));
            if keeps && InstanceTransform::new(to_world).is_some() {
                let new = || Drawn { mesh, moves, instances: Vec::new() };
                rigid.entry((moves, mesh)).or_insert_with(new).instances.push(i as u32);
            } else {
                let world = if moves { &mut plan.moving } else { &mut plan.still };
                world.push(member(posed, i as u32, look(mesh)));
            }
        }
        let triangles = |drawn: &Drawn| {
            let one = posed.scene.meshes[drawn.mesh as usize].triangles.len() as u64;
            one * drawn.instances.len() as u64
        };
        let mut rigid: Vec<(u64, Drawn)> = rigid.into_values().map(|d| (triangles(&d), d)).collect();
        rigid.sort_by_key(|(triangles, drawn)| (*triangles, drawn.mesh));
        let mut left = flatten;
        for (triangles, Drawn { mesh, moves, instances }) in rigid {
            let left = if moves { &mut left.dynamic_triangles } else { &mut left.static_triangles };
            // What stands still in one place costs a world no more than a tree of its own would.
            let single = !moves && instances.len() == 1;
            if single || triangles <= *left {
                *left -= if single { 0 } else { triangles };
                let world = if moves { &mut plan.moving } else { &mut plan.still };
                let look = look(mesh);
                world.extend(instances.iter().map(|&i| member(posed, i, look.clone())));
            } else {
                let new = || PlacedMesh { look: look(mesh), instances: Vec::new() };
                plan.placed.entry(mesh).or_insert_with(new).instances.extend(instances);
            }
        }
        plan.still.sort_unstable_by_key(|member| member.instance);
        plan.moving.sort_unstable_by_key(|member| member.instance);
        plan
    }

    /// How a mesh that has a tree of its own looks.
    pub fn look(&self, mesh: u32) -> Option<&MeshFlags> {
        self.placed.get(&mesh).map(|placed| &placed.look)
    }

    /// True where something lets part of the light through, or may.
    pub fn is_translucent(&self) -> bool {
        let worlds = self.still.iter().chain(&self.moving).map(|member| &member.look);
        worlds.chain(self.placed.values().map(|placed| &placed.look)).any(MeshFlags::is_translucent)
    }

    /// True where what moves may have another shape now, though it is where it was.
    pub fn bends(&self, posed: &PosedScene) -> bool {
        self.moving.iter().any(|member| may_bend(posed, member.instance))
    }
}

/// Whether everything becomes a line or a point, as what animations scale to 0 to hide it.
fn vanishes(to_world: &DMat3) -> bool {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *to_world;
    [x.cross(y), y.cross(z), z.cross(x)] == [DVec3::ZERO; 3]
}

fn member(posed: &PosedScene, instance: u32, look: MeshFlags) -> Member {
    let Transform { affine: to_world, flips_winding, .. } = posed.instances[instance as usize].transform;
    Member { instance, to_world, look: look.placed(flips_winding) }
}

/// Whether an instance can be drawn in another shape than its mesh's.
fn may_bend(posed: &PosedScene, instance: u32) -> bool {
    !posed.mesh(instance).morph_targets.is_empty() || posed.scene.instances[instance as usize].skin.is_some()
}
