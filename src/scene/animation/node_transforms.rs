//! How the nodes of a scene stand at one moment, and what follows for what is drawn at them. A pose is
//! made of it.

use std::collections::BTreeMap;

use glam::DAffine3;

use crate::scene::animation::deform::MeshDeformer;
use crate::scene::{Animation, ChannelTarget, Instance, LocalTransform, Scene};

/// The nodes of a scene at one moment.
pub(crate) struct NodeTransforms<'s> {
    scene: &'s Scene,
    /// Node to world.
    pub node_to_world: Vec<DAffine3>,
    /// Whether a node, and all above it, is shown.
    pub visible: Vec<bool>,
    /// Of the nodes that are driven to others than their own.
    weights: BTreeMap<u32, Vec<f32>>,
}

/// An instance at that moment.
pub(crate) struct InstancePose<'a> {
    /// Its vertices, as bent, to the world.
    pub to_world: DAffine3,
    /// Says which side is the front.
    pub winding: DAffine3,
    /// `None`: its mesh is what the file says.
    pub bend: Option<MeshDeformer<'a>>,
}

impl<'s> NodeTransforms<'s> {
    /// Where `playing` has put the nodes at `time`, in seconds.
    pub fn of(scene: &'s Scene, playing: &[&Animation], time: f64) -> NodeTransforms<'s> {
        // Of the nodes that are driven: they are few.
        let mut locals: BTreeMap<u32, LocalTransform> = BTreeMap::new();
        let mut weights: BTreeMap<u32, Vec<f32>> = BTreeMap::new();
        let local = |n: u32| scene.nodes[n as usize].local;
        let mut visible: Vec<bool> = scene.nodes.iter().map(|n| n.visible).collect();
        for channel in playing.iter().flat_map(|a| &a.channels) {
            let keys = &channel.keyframes;
            match channel.target {
                ChannelTarget::Translation(n) => {
                    *trs(locals.entry(n).or_insert_with(|| local(n))).0 = keys.sample_vec3(time);
                }
                ChannelTarget::Rotation(n) => {
                    *trs(locals.entry(n).or_insert_with(|| local(n))).1 = keys.sample_rotation(time);
                }
                ChannelTarget::Scale(n) => {
                    *trs(locals.entry(n).or_insert_with(|| local(n))).2 = keys.sample_vec3(time);
                }
                ChannelTarget::Weights(n) => {
                    weights.insert(n, keys.sample(time).iter().map(|&w| w as f32).collect());
                }
                ChannelTarget::Weight(n, k) => {
                    let own = weights.entry(n).or_insert_with(|| scene.nodes[n as usize].weights.clone());
                    if own.is_empty() {
                        *own = scene.default_weights(n);
                    }
                    if let Some(w) = own.get_mut(k as usize) {
                        *w = keys.sample(time)[0] as f32;
                    }
                }
                ChannelTarget::Visibility(n) => visible[n as usize] = keys.sample(time)[0] > 0.5,
                ChannelTarget::Material(..) | ChannelTarget::Light(..) | ChannelTarget::Camera(..) => {}
            }
        }
        // Parents stand before their children, so one pass does it however deep the graph is.
        let mut node_to_world: Vec<DAffine3> = Vec::with_capacity(scene.nodes.len());
        for (i, node) in scene.nodes.iter().enumerate() {
            let local = locals.get(&(i as u32)).unwrap_or(&node.local);
            let above = node.parent.map_or(DAffine3::IDENTITY, |p| node_to_world[p as usize]);
            node_to_world.push(above * local.affine());
            visible[i] &= node.parent.is_none_or(|p| visible[p as usize]);
        }
        NodeTransforms { scene, node_to_world, visible, weights }
    }

    /// Where `instance` is, and how its mesh is bent.
    pub fn place(&self, instance: &Instance) -> InstancePose<'_> {
        let mesh = &self.scene.meshes[instance.mesh as usize];
        let node = instance.node as usize;
        let mut to_world = self.node_to_world[node];
        if let Some(placement) = instance.trs {
            to_world *= placement.affine();
        }
        // glTF has it say which side is the front even where joints place the vertices.
        let winding = to_world;
        let own = self.weights.get(&instance.node).unwrap_or(&self.scene.nodes[node].weights);
        let shape: &[f32] = if own.is_empty() { &mesh.morph_weights } else { own };
        let skin = instance.skin.filter(|_| mesh.influences.per_vertex > 0);
        let skin = skin.map(|skin| &self.scene.skins[skin as usize]);
        let bend = MeshDeformer::new(mesh, shape, skin, &self.node_to_world);
        if let Some(bend) = bend.as_ref().filter(|_| skin.is_some()) {
            // Joints alone place the vertices.
            to_world = DAffine3::from_translation(bend.origin);
        }
        InstancePose { to_world, winding, bend }
    }
}

impl Scene {
    /// The weights that the meshes at a node have where the node gives none.
    fn default_weights(&self, node: u32) -> Vec<f32> {
        let drawn = self.instances.iter().find(|i| i.node == node);
        drawn.map_or_else(Vec::new, |i| self.meshes[i.mesh as usize].morph_weights.clone())
    }
}

/// The scale-rotation-translation of a local transform about to be animated.
fn trs(local: &mut LocalTransform) -> (&mut glam::DVec3, &mut glam::DQuat, &mut glam::DVec3) {
    if let LocalTransform::Matrix(m) = *local {
        let (scale, rotation, translation) = m.to_scale_rotation_translation();
        *local = LocalTransform::Trs { translation, rotation, scale };
    }
    match local {
        LocalTransform::Trs { translation, rotation, scale } => (translation, rotation, scale),
        LocalTransform::Matrix(_) => unreachable!("just decomposed"),
    }
}
