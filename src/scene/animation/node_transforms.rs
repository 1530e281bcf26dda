//! Evaluates the scene graph at one time: node transforms, visibility and morph weights.

use std::collections::BTreeMap;

use glam::{DAffine3, DQuat, DVec3};

use crate::animation::deform::MeshDeformer;
use crate::{Animation, ChannelTarget, Instance, LocalTransform, Scene};

/// The nodes of a scene at one time.
pub(super) struct NodeTransforms<'s> {
    scene: &'s Scene,
    /// Node to world.
    pub node_to_world: Vec<DAffine3>,
    /// True if the node and all its ancestors are visible.
    pub visible: Vec<bool>,
    /// Morph weights of the nodes that animations drive.
    weights: BTreeMap<u32, Vec<f32>>,
}

/// An instance at one time.
pub(super) struct InstancePose<'a> {
    /// Transforms the vertices, after deformation, to world space.
    pub to_world: DAffine3,
    /// Determines the winding order.
    pub winding: DAffine3,
    /// `None` if the mesh is not deformed.
    pub deformer: Option<MeshDeformer<'a>>,
}

/// The driven translation, rotation and scale of a node.
struct Trs<'a> {
    translation: &'a mut DVec3,
    rotation: &'a mut DQuat,
    scale: &'a mut DVec3,
}

impl<'s> NodeTransforms<'s> {
    /// Evaluates the `active` animations at `time`, in seconds.
    pub fn at(scene: &'s Scene, active: &[&Animation], time: f64) -> NodeTransforms<'s> {
        // Only of driven nodes, which are few.
        let mut locals: BTreeMap<u32, LocalTransform> = BTreeMap::new();
        let mut weights: BTreeMap<u32, Vec<f32>> = BTreeMap::new();
        let mut visible: Vec<bool> = scene.nodes.iter().map(|n| n.visible).collect();
        for channel in active.iter().flat_map(|a| &a.channels) {
            let keyframes = &channel.keyframes;
            match channel.target {
                ChannelTarget::Translation(n) => {
                    *driven_trs(scene, &mut locals, n).translation = keyframes.sample_vec3(time);
                }
                ChannelTarget::Rotation(n) => {
                    *driven_trs(scene, &mut locals, n).rotation = keyframes.sample_rotation(time);
                }
                ChannelTarget::Scale(n) => {
                    *driven_trs(scene, &mut locals, n).scale = keyframes.sample_vec3(time);
                }
                ChannelTarget::Weights(n) => {
                    weights.insert(n, keyframes.sample(time).iter().map(|&w| w as f32).collect());
                }
                ChannelTarget::Weight(n, k) => {
                    let own = weights.entry(n).or_insert_with(|| scene.nodes[n as usize].weights.clone());
                    if own.is_empty() {
                        *own = scene.default_weights(n);
                    }
                    if let Some(w) = own.get_mut(k as usize) {
                        *w = keyframes.sample(time)[0] as f32;
                    }
                }
                ChannelTarget::Visibility(n) => visible[n as usize] = keyframes.sample(time)[0] > 0.5,
                ChannelTarget::Material(..)
                | ChannelTarget::Light(..)
                | ChannelTarget::AreaLight(..)
                | ChannelTarget::Camera(..)
                | ChannelTarget::Environment(..) => {}
            }
        }
        // Parents come before their children, so one pass suffices.
        let mut node_to_world: Vec<DAffine3> = Vec::with_capacity(scene.nodes.len());
        for (i, node) in scene.nodes.iter().enumerate() {
            let local = locals.get(&(i as u32)).unwrap_or(&node.local);
            let parent = node.parent.map_or(DAffine3::IDENTITY, |p| node_to_world[p as usize]);
            node_to_world.push(parent * local.affine());
            visible[i] &= node.parent.is_none_or(|p| visible[p as usize]);
        }
        NodeTransforms { scene, node_to_world, visible, weights }
    }

    /// Returns the transform and the deformation of an instance.
    pub fn pose_instance(&self, instance: &Instance) -> InstancePose<'_> {
        let mesh = &self.scene.meshes[instance.mesh as usize];
        let node = instance.node as usize;
        let mut to_world = self.node_to_world[node];
        if let Some(trs) = instance.trs {
            to_world *= trs.affine();
        }
        // In glTF, the node determines the winding order even where joints place the vertices.
        let winding = to_world;
        let own = self.weights.get(&instance.node).unwrap_or(&self.scene.nodes[node].weights);
        let weights: &[f32] = if own.is_empty() { &mesh.morph_weights } else { own };
        let skin = instance.skin.filter(|_| mesh.influences.per_vertex > 0);
        let skin = skin.map(|skin| &self.scene.skins[skin as usize]);
        let deformer = MeshDeformer::new(mesh, weights, skin, &self.node_to_world);
        if let Some(deformer) = deformer.as_ref().filter(|_| skin.is_some()) {
            // The joints alone place the vertices.
            to_world = DAffine3::from_translation(deformer.origin);
        }
        InstancePose { to_world, winding, deformer }
    }
}

impl Scene {
    /// Returns the morph weights of the meshes at a node that has none of its own.
    fn default_weights(&self, node: u32) -> Vec<f32> {
        let instance = self.instances.iter().find(|i| i.node == node);
        instance.map_or_else(Vec::new, |i| self.meshes[i.mesh as usize].morph_weights.clone())
    }
}

/// Returns the driven translation, rotation and scale of a node. Decomposes its matrix, if it has one.
fn driven_trs<'l>(scene: &Scene, locals: &'l mut BTreeMap<u32, LocalTransform>, node: u32) -> Trs<'l> {
    let local = locals.entry(node).or_insert_with(|| scene.nodes[node as usize].local);
    if let LocalTransform::Matrix(m) = *local {
        let (scale, rotation, translation) = m.to_scale_rotation_translation();
        *local = LocalTransform::Trs { translation, rotation, scale };
    }
    match local {
        LocalTransform::Trs { translation, rotation, scale } => Trs { translation, rotation, scale },
        LocalTransform::Matrix(_) => unreachable!("just decomposed"),
    }
}
