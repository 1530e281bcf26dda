//! Parts of a scene, by name: what is hidden, and what alone is shown.

use std::collections::BTreeSet;

use glob::{MatchOptions, Pattern};

use super::{ChannelTarget, Light, Scene};

/// What of a scene is shown. Patterns have `*`, `?`, `[…]` and, in paths, `**`.
///
/// A pattern is held against the names of nodes and objects; one with a `/` against a node's path
/// from the root too, where `*` stays within one name. What a pattern finds it finds with all that
/// is below it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Objects that are shown, with nothing but them; all where empty.
    pub only: Vec<Glob>,
    /// Objects and lights that are not shown.
    pub hide: Vec<Glob>,
}

/// A pattern for names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Glob(Pattern);

impl Glob {
    /// Reads a pattern.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn new(text: &str) -> Result<Glob, String> {
        Pattern::new(text).map(Glob).map_err(|e| e.to_string())
    }

    fn finds(&self, name: &str) -> bool {
        // A name that has brackets or stars of its own is found by itself.
        name == self.0.as_str() || self.0.matches(name)
    }

    fn finds_path(&self, path: &str) -> bool {
        let options = MatchOptions { require_literal_separator: true, ..MatchOptions::new() };
        let given = self.0.as_str();
        given.contains('/')
            && (given.trim_start_matches('/') == path
                || self.0.matches_with(path, options)
                || (given.starts_with('/') && self.0.matches_with(&format!("/{path}"), options)))
    }
}

/// A pattern that finds nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("nothing is called '{pattern}'; the file has: {names}")]
pub struct NoMatch {
    /// The pattern.
    pub pattern: String,
    /// Names that exist.
    pub names: String,
}

impl Scene {
    /// Takes out of the scene what is not to be shown: instances, and lights that are hidden.
    /// Nodes, materials and the numbers of objects stay what they are.
    ///
    /// # Errors
    /// A pattern that finds nothing.
    pub fn select(&mut self, selection: &Selection) -> Result<(), NoMatch> {
        if *selection == Selection::default() {
            return Ok(());
        }
        let paths = self.paths();
        let mut only = Found::default();
        for glob in &selection.only {
            only.join(self.find(glob, &paths)?);
        }
        let mut hide = Found::default();
        for glob in &selection.hide {
            hide.join(self.find(glob, &paths)?);
        }
        let shown = |node: u32, object: u32| {
            (selection.only.is_empty() || only.holds(node, object)) && !hide.holds(node, object)
        };
        self.instances.retain(|i| shown(i.node, i.object));
        self.keep_lights(|l| !hide.holds(l.node, 0));
        Ok(())
    }

    /// Keeps some of the lights, and what animates them.
    fn keep_lights(&mut self, keep: impl Fn(&Light) -> bool) {
        let mut kept = 0;
        let number = |l: &Light| {
            let new = keep(l).then_some(kept);
            kept += u32::from(new.is_some());
            new
        };
        let numbers: Vec<Option<u32>> = self.lights.iter().map(number).collect();
        self.lights.retain(keep);
        for animation in &mut self.animations {
            animation.channels.retain_mut(|c| match &mut c.target {
                ChannelTarget::Light(i, _) => {
                    let new = numbers.get(*i as usize).copied().flatten();
                    *i = new.unwrap_or_default();
                    new.is_some()
                }
                _ => true,
            });
        }
    }

    /// Every node's names from the root, with `/` between them.
    fn paths(&self) -> Vec<String> {
        let mut paths: Vec<String> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let above = node.parent.map_or("", |p| &paths[p as usize]);
            let slash = if above.is_empty() { "" } else { "/" };
            paths.push(format!("{above}{slash}{}", node.name));
        }
        paths
    }

    fn find(&self, glob: &Glob, paths: &[String]) -> Result<Found, NoMatch> {
        let mut found = Found { nodes: vec![false; self.nodes.len()], objects: BTreeSet::new() };
        let mut any = false;
        for (i, node) in self.nodes.iter().enumerate() {
            let own = glob.finds(&node.name) || glob.finds_path(&paths[i]);
            any |= own && !(node.name.is_empty() && self.nodes.len() == 1);
            found.nodes[i] = own || node.parent.is_some_and(|p| found.nodes[p as usize]);
        }
        for (i, _) in self.objects.iter().enumerate().filter(|(_, name)| glob.finds(name)) {
            found.objects.insert(i as u32 + 1);
            any = true;
        }
        if any { Ok(found) } else { Err(self.nothing(glob)) }
    }

    fn nothing(&self, glob: &Glob) -> NoMatch {
        const SHOWN: usize = 20;
        let all = self.objects.iter().chain(self.nodes.iter().map(|n| &n.name));
        let names: BTreeSet<&String> = all.filter(|n| !n.is_empty()).collect();
        let mut list: Vec<String> = names.iter().take(SHOWN).map(|n| format!("'{n}'")).collect();
        if names.len() > SHOWN {
            list.push(format!("and {} more", names.len() - SHOWN));
        }
        let names = if list.is_empty() { "no names".into() } else { list.join(", ") };
        NoMatch { pattern: glob.0.as_str().into(), names }
    }
}

/// What patterns found.
#[derive(Default)]
struct Found {
    /// For each node.
    nodes: Vec<bool>,
    objects: BTreeSet<u32>,
}

impl Found {
    fn holds(&self, node: u32, object: u32) -> bool {
        self.nodes.get(node as usize).is_some_and(|&n| n) || self.objects.contains(&object)
    }

    fn join(&mut self, other: Found) {
        if self.nodes.is_empty() {
            self.nodes = other.nodes;
        } else {
            for (own, other) in self.nodes.iter_mut().zip(other.nodes) {
                *own |= other;
            }
        }
        self.objects.extend(other.objects);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::pose;
    use crate::scene::{
        Animation, Channel, Instance, Interpolation, Keyframes, LightKind, LightProperty, LightUnits, Mesh,
        Node, PoseSettings,
    };

    /// car ─┬─ body, ├─ wheels ─┬─ wheel.L, └─ wheel.R; and a lamp [1] with a light.
    fn scene() -> Scene {
        let mut scene = Scene { meshes: vec![Mesh::default()], ..Scene::default() };
        for (name, parent) in [
            ("car", None),
            ("body", Some(0)),
            ("wheels", Some(0)),
            ("wheel.L", Some(2)),
            ("wheel.R", Some(2)),
            ("lamp [1]", None),
        ] {
            scene.nodes.push(Node { name: name.into(), parent, visible: true, ..Node::default() });
        }
        for node in [1, 3, 4, 5] {
            scene.objects.push(scene.nodes[node as usize].name.clone());
            let object = scene.objects.len() as u32;
            scene.instances.push(Instance { node, mesh: 0, object, ..Instance::default() });
        }
        let light = |node: u32| Light {
            name: String::new(),
            node,
            kind: LightKind::Point,
            color: crate::geometry::Rgb::ONE,
            intensity: 1.0,
            range: f32::INFINITY,
        };
        scene.lights = vec![light(5), light(1)];
        let keys =
            Keyframes { times: vec![0.0], values: vec![7.0], width: 1, interpolation: Interpolation::Step };
        let channel = |i: u32| Channel {
            target: ChannelTarget::Light(i, LightProperty::Intensity),
            keyframes: keys.clone(),
        };
        scene.animations.push(Animation { name: String::new(), channels: vec![channel(0), channel(1)] });
        scene
    }

    #[test]
    fn the_lights_that_stay_keep_their_animation() {
        let mut scene = scene();
        scene.select(&Selection { hide: globs(&["lamp*"]), ..Default::default() }).unwrap();
        assert_eq!((scene.lights.len(), scene.lights[0].node), (1, 1));
        let targets: Vec<ChannelTarget> = scene.animations[0].channels.iter().map(|c| c.target).collect();
        assert_eq!(targets, [ChannelTarget::Light(0, LightProperty::Intensity)]);
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        assert_eq!(posed.lights(LightUnits::Raw, 1.0).len(), 1);
    }

    fn globs(list: &[&str]) -> Vec<Glob> {
        list.iter().map(|g| Glob::new(g).unwrap()).collect()
    }

    fn left(only: &[&str], hide: &[&str]) -> (Vec<u32>, usize) {
        let mut scene = scene();
        scene.select(&Selection { only: globs(only), hide: globs(hide) }).unwrap();
        (scene.instances.iter().map(|i| i.object).collect(), scene.lights.len())
    }

    #[test]
    fn names_and_paths_find_things_with_all_below_them() {
        assert_eq!(left(&[], &[]), (vec![1, 2, 3, 4], 2));
        assert_eq!(left(&[], &["wheel.?"]), (vec![1, 4], 2));
        assert_eq!(left(&[], &["wheels"]), (vec![1, 4], 2));
        assert_eq!(left(&["car"], &[]), (vec![1, 2, 3], 2));
        assert_eq!(left(&["wheel*"], &["*.L"]), (vec![3], 2));
        assert_eq!(left(&["car/*/wheel.R"], &[]), (vec![3], 2));
        assert_eq!(left(&["/car/**/wheel.*", "body"], &[]), (vec![1, 2, 3], 2));
        assert_eq!(left(&[], &["lamp [1]"]), (vec![1, 2, 3], 1));
        assert_eq!(left(&["body"], &["body"]), (vec![], 1));
    }

    #[test]
    fn what_finds_nothing_is_told_with_the_names_there_are() {
        for wrong in ["Wheel*", "wheels/*.R", "*/wheel.R", "car/wheel.R", "/wheels"] {
            let selection = Selection { hide: globs(&[wrong]), ..Default::default() };
            let error = scene().select(&selection).unwrap_err().to_string();
            assert!(error.contains(wrong) && error.contains("'body', 'car', 'lamp [1]'"), "{error}");
        }
        assert!(Glob::new("[a").is_err() && Glob::new("a**b").is_err());
    }
}
