//! The nodes whose animation moves or shows lights.

use super::keyframes::ChannelTarget;
use super::playback::active_animations;
use super::posed_scene::PosedScene;
use crate::Scene;

impl Scene {
    /// Returns for each node whether a light or an area light is at or below it.
    pub fn nodes_with_lights(&self) -> Vec<bool> {
        let lights = self.lights.iter().map(|light| light.node);
        self.nodes_at_or_above(lights.chain(self.area_lights.iter().map(|light| light.node)))
    }

    /// Returns for each node whether one of `nodes` is at or below it.
    pub fn nodes_at_or_above(&self, nodes: impl IntoIterator<Item = u32>) -> Vec<bool> {
        let mut is_marked = vec![false; self.nodes.len()];
        nodes.into_iter().for_each(|node| is_marked[node as usize] = true);
        // Parents precede their children.
        for (i, node) in self.nodes.iter().enumerate().rev() {
            if let Some(parent) = node.parent.filter(|_| is_marked[i]) {
                is_marked[parent as usize] = true;
            }
        }
        is_marked
    }
}

impl PosedScene<'_> {
    /// Returns true if the animations that play show or hide lights of the file: it lights the scene also while all its
    /// lights are hidden.
    pub fn switches_lights(&self) -> bool {
        let scene = self.scene;
        if scene.lights.is_empty() && scene.area_lights.is_empty() {
            return false;
        }
        let has_light = scene.nodes_with_lights();
        let is_switch = |target: &ChannelTarget| match *target {
            ChannelTarget::Visibility(node) => has_light[node as usize],
            _ => false,
        };
        let active = active_animations(scene, self.animation()).unwrap_or_default();
        active.iter().flat_map(|animation| &animation.channels).any(|channel| is_switch(&channel.target))
    }
}
