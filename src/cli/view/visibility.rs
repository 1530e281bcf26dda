//! Patterns of `--hide` for single objects.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use glob::Pattern;

use blinn_scene::Scene;

/// Objects and nodes by their names, to find the pattern that hides an object and the fewest others.
#[derive(Default)]
pub struct HidePatterns {
    /// Name and a node of each object that is drawn.
    objects: Vec<Option<(String, u32)>>,
    /// Paths of all nodes.
    paths: Vec<String>,
    nodes_by_name: HashMap<String, Vec<u32>>,
    nodes_by_path: HashMap<String, Vec<u32>>,
    objects_by_name: HashMap<String, Vec<u32>>,
    /// Each node with all nodes below it.
    subtrees: Vec<Range<u32>>,
    /// The objects that are drawn at each node.
    objects_at: HashMap<u32, Vec<u32>>,
}

impl HidePatterns {
    pub fn new(scene: &Scene) -> HidePatterns {
        let mut all = HidePatterns {
            objects: vec![None; scene.objects.len()],
            paths: scene.node_paths(),
            ..HidePatterns::default()
        };
        for instance in &scene.instances {
            let Some(object) = instance.object.checked_sub(1) else { continue };
            if let (Some(slot), Some(name)) =
                (all.objects.get_mut(object as usize), scene.objects.get(object as usize))
                && slot.is_none()
            {
                *slot = Some((name.clone(), instance.node));
                all.objects_by_name.entry(name.clone()).or_default().push(object);
            }
            all.objects_at.entry(instance.node).or_default().push(object);
        }
        let count = scene.nodes.len() as u32;
        all.subtrees = (0..count).map(|i| i..i + 1).collect();
        // Parents stand before their children.
        for (i, node) in scene.nodes.iter().enumerate().rev() {
            if let Some(parent) = node.parent {
                let end = all.subtrees[i].end;
                let above = &mut all.subtrees[parent as usize].end;
                *above = end.max(*above);
            }
        }
        for (i, node) in scene.nodes.iter().enumerate() {
            all.nodes_by_name.entry(node.name.clone()).or_default().push(i as u32);
            all.nodes_by_path.entry(all.paths[i].clone()).or_default().push(i as u32);
        }
        all
    }

    /// The patterns for objects by their indices, from 0. Objects that are not drawn, and those that others hide, have
    /// none.
    pub fn patterns(&self, hidden: &[u32]) -> Vec<String> {
        let mut done = BTreeSet::new();
        let mut patterns = Vec::new();
        for object in hidden {
            if done.contains(object) {
                continue;
            }
            if let Some((pattern, matching)) = self.best_pattern(*object) {
                done.extend(matching);
                patterns.push(pattern);
            }
        }
        patterns
    }

    /// The objects that are hidden together with `hidden`: those below them, and those of the same name.
    pub fn all_hidden(&self, hidden: &[u32]) -> Vec<u32> {
        let mut all = BTreeSet::new();
        for object in hidden {
            if !all.contains(object)
                && let Some((_, matching)) = self.best_pattern(*object)
            {
                all.extend(matching);
            }
        }
        all.into_iter().collect()
    }

    /// The pattern that matches an object and the fewest others, with all that it matches.
    fn best_pattern(&self, object: u32) -> Option<(String, BTreeSet<u32>)> {
        let (name, node) = self.objects.get(object as usize)?.as_ref()?;
        let path = self.paths.get(*node as usize)?;
        let nodes =
            |known: &HashMap<String, Vec<u32>>, text: &str| known.get(text).cloned().unwrap_or_default();
        let mut candidates = Vec::new();
        if !name.is_empty() {
            let mut matching = self.objects_below(&nodes(&self.nodes_by_name, name));
            matching.extend(self.objects_by_name.get(name).into_iter().flatten());
            candidates.push((Pattern::escape(name), matching));
        }
        if !path.trim_matches('/').is_empty() {
            let rooted = if path.contains('/') { path.clone() } else { format!("/{path}") };
            candidates
                .push((Pattern::escape(&rooted), self.objects_below(&nodes(&self.nodes_by_path, path))));
        }
        let candidates = candidates.into_iter().filter(|(_, matching)| matching.contains(&object));
        candidates.min_by_key(|(_, matching)| matching.len())
    }

    /// The objects at nodes and below them.
    fn objects_below(&self, nodes: &[u32]) -> BTreeSet<u32> {
        let below = nodes.iter().filter_map(|node| self.subtrees.get(*node as usize).cloned()).flatten();
        below.filter_map(|node| self.objects_at.get(&node)).flatten().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_scene::{Glob, Instance, Node};

    /// car ─┬─ wheel, └─ wheel; wheel; and a [1]: five objects, the first of the car itself.
    fn scene() -> Scene {
        let mut scene = Scene::default();
        for (name, parent) in
            [("car", None), ("wheel", Some(0)), ("wheel", Some(0)), ("wheel", None), ("a [1]", None)]
        {
            scene.nodes.push(Node { name: name.into(), parent, visible: true, ..Node::default() });
            scene.objects.push(name.into());
            let object = scene.objects.len() as u32;
            scene.instances.push(Instance { node: object - 1, object, ..Instance::default() });
        }
        scene
    }

    /// The patterns match the objects that `--hide` hides.
    #[test]
    fn patterns_hide_as_few_objects_as_possible() {
        let scene = scene();
        let patterns = HidePatterns::new(&scene);
        for (hidden, expected, all) in [
            (vec![0], vec!["car"], vec![0, 1, 2]),
            (vec![1], vec!["car/wheel"], vec![1, 2]),
            (vec![3], vec!["/wheel"], vec![3]),
            (vec![4], vec!["a [[]1[]]"], vec![4]),
            (vec![1, 2, 4], vec!["car/wheel", "a [[]1[]]"], vec![1, 2, 4]),
            (vec![9], vec![], vec![]),
        ] {
            let found = patterns.patterns(&hidden);
            assert_eq!(found, expected);
            assert_eq!(patterns.all_hidden(&hidden), all);
            let matching: BTreeSet<u32> = found
                .iter()
                .flat_map(|pattern| scene.matching_objects(&Glob::new(pattern).unwrap()).unwrap())
                .map(|id| id - 1)
                .collect();
            assert_eq!(matching.into_iter().collect::<Vec<_>>(), all, "{found:?}");
        }
    }
}
