//! Instancing plan: which instances are flattened into world-space BVHs, and which meshes get a BLAS of their own.
//!
//! Ray packets traverse world BVHs, but only single rays traverse the TLAS. So meshes with few triangles are
//! flattened, however often they are instanced. Static and dynamic instances have a world BVH each: from pose to
//! pose, only the dynamic one changes.
//!
//! A hit in a BLAS is rounded in local space, so that its t may differ in the last bit from that in the world.
//! The plan therefore depends on the scene and its pose only, never on earlier frames: the bytes of a frame are the
//! same however frames are distributed over processes.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DVec3};

use crate::build::mesh_flags::MeshFlags;
use crate::bvh::instance::InstanceTransform;
use crate::settings::FlattenBudget;
use blinn_core::geometry::Transform;
use blinn_scene::{PosedInstance, PosedScene};

/// An instance whose triangles are in a world BVH.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FlattenedInstance {
    /// Index of the instance in the scene.
    pub instance: u32,
    pub to_world: DAffine3,
    pub flags: MeshFlags,
}

/// The instances of a world BVH, by ascending index.
pub(crate) type World = Vec<FlattenedInstance>;

/// A mesh with a BLAS of its own.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InstancedMesh {
    /// Flags in local space.
    pub flags: MeshFlags,
    /// Indices of its instances, all of which have an [`InstanceTransform`].
    pub instances: Vec<u32>,
}

/// The BVH that each visible instance goes to.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct InstancingPlan {
    /// Instances that no animation moves.
    pub static_world: World,
    /// Instances that may move or deform: their BVH is refitted or rebuilt for every pose.
    pub dynamic_world: World,
    /// Meshes with a BLAS of their own.
    pub instanced: BTreeMap<u32, InstancedMesh>,
}

/// The rigid instances of a mesh, either all static or all dynamic ones.
struct RigidMesh {
    mesh: u32,
    is_dynamic: bool,
    instances: Vec<u32>,
}

impl RigidMesh {
    /// Number of triangles of all instances.
    fn triangles(&self, posed: &PosedScene) -> u64 {
        posed.scene.meshes[self.mesh as usize].triangles.len() as u64 * self.instances.len() as u64
    }
}

impl InstancingPlan {
    /// Plans all visible instances. `flags` returns those of a mesh.
    pub fn new(
        posed: &PosedScene,
        budget: FlattenBudget,
        mut flags: impl FnMut(u32) -> MeshFlags,
    ) -> InstancingPlan {
        let mut plan = InstancingPlan::default();
        let mut rigid_meshes = plan.split_off_rigid_meshes(posed, &mut flags);
        // The meshes with the fewest triangles first.
        rigid_meshes.sort_by_key(|rigid| (rigid.triangles(posed), rigid.mesh));
        let mut remaining = budget;
        for rigid in rigid_meshes {
            let triangles = rigid.triangles(posed);
            let RigidMesh { mesh, is_dynamic, instances } = rigid;
            let remaining = match is_dynamic {
                true => &mut remaining.dynamic_triangles,
                false => &mut remaining.static_triangles,
            };
            // A single static instance costs a world BVH no more than a BLAS of its own.
            let is_free = !is_dynamic && instances.len() == 1;
            if is_free || triangles <= *remaining {
                *remaining -= if is_free { 0 } else { triangles };
                let flags = flags(mesh);
                let flattened = instances.iter().map(|&i| flattened_instance(posed, i, flags.clone()));
                plan.world_mut(is_dynamic).extend(flattened);
            } else {
                let new = || InstancedMesh { flags: flags(mesh), instances: Vec::new() };
                plan.instanced.entry(mesh).or_insert_with(new).instances.extend(instances);
            }
        }
        plan.static_world.sort_unstable_by_key(|flattened| flattened.instance);
        plan.dynamic_world.sort_unstable_by_key(|flattened| flattened.instance);
        plan
    }

    /// Flattens the instances that cannot have a BLAS of their own, as they deform or have a degenerate transform,
    /// and returns the others by mesh.
    fn split_off_rigid_meshes(
        &mut self,
        posed: &PosedScene,
        mut flags: impl FnMut(u32) -> MeshFlags,
    ) -> Vec<RigidMesh> {
        let animated = posed.scene.animated_instances(&posed.scene.animations);
        let mut rigid: BTreeMap<(bool, u32), RigidMesh> = BTreeMap::new();
        let is_visible = |i: &PosedInstance| i.visible && !is_collapsed(&i.transform.affine.matrix3);
        for (i, instance) in posed.instances.iter().enumerate().filter(|(_, i)| is_visible(i)) {
            let mesh = posed.scene.instances[i].mesh;
            let is_dynamic = animated[i];
            let is_rigid = instance.deformed.is_none() && !(is_dynamic && may_deform(posed, i as u32));
            if is_rigid && InstanceTransform::new(instance.transform.affine).is_some() {
                let new = || RigidMesh { mesh, is_dynamic, instances: Vec::new() };
                rigid.entry((is_dynamic, mesh)).or_insert_with(new).instances.push(i as u32);
            } else {
                self.world_mut(is_dynamic).push(flattened_instance(posed, i as u32, flags(mesh)));
            }
        }
        rigid.into_values().collect()
    }

    fn world_mut(&mut self, is_dynamic: bool) -> &mut World {
        if is_dynamic { &mut self.dynamic_world } else { &mut self.static_world }
    }

    /// Returns the flags of a mesh that has a BLAS of its own.
    pub fn mesh_flags(&self, mesh: u32) -> Option<&MeshFlags> {
        self.instanced.get(&mesh).map(|instanced| &instanced.flags)
    }

    /// Returns true if something may transmit light.
    pub fn has_translucent(&self) -> bool {
        let worlds = self.static_world.iter().chain(&self.dynamic_world).map(|flattened| &flattened.flags);
        let instanced = self.instanced.values().map(|instanced| &instanced.flags);
        worlds.chain(instanced).any(MeshFlags::is_translucent)
    }

    /// Returns true if a dynamic instance may change its shape, even if its transform is the same.
    pub fn may_deform(&self, posed: &PosedScene) -> bool {
        self.dynamic_world.iter().any(|flattened| may_deform(posed, flattened.instance))
    }
}

/// Returns true if a transform collapses everything to a line or a point, such as a scale of 0 by which an
/// animation hides an object.
fn is_collapsed(to_world: &DMat3) -> bool {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *to_world;
    [x.cross(y), y.cross(z), z.cross(x)] == [DVec3::ZERO; 3]
}

fn flattened_instance(posed: &PosedScene, instance: u32, flags: MeshFlags) -> FlattenedInstance {
    let Transform { affine: to_world, flips_winding, .. } = posed.instances[instance as usize].transform;
    FlattenedInstance { instance, to_world, flags: flags.in_world(flips_winding) }
}

/// Returns true if morph targets or a skin may deform an instance.
fn may_deform(posed: &PosedScene, instance: u32) -> bool {
    !posed.mesh(instance).morph_targets.is_empty() || posed.scene.instances[instance as usize].skin.is_some()
}
