//! Selects parts of a scene by name: shows only some objects, or hides some.

use std::collections::BTreeSet;

use blinn_core::closest_name::did_you_mean;

use glob::{MatchOptions, Pattern};
use serde::{Serialize, Serializer};

use super::{ChannelTarget, Scene};

/// The visible parts of a scene.
///
/// Patterns have `*`, `?`, `[…]` and, in paths, `**`. They match the names of nodes and objects. A pattern
/// with a `/` also matches paths of node names from the root, where `*` stays within one name. A match
/// includes everything below the node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Selection {
    /// Objects to show, without all others. Empty shows all.
    pub only: Vec<Glob>,
    /// Objects and lights to hide.
    pub hide: Vec<Glob>,
}

/// A glob pattern for names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Glob(Pattern);

impl Glob {
    /// Parses a pattern.
    ///
    /// # Errors
    /// The pattern's syntax error.
    pub fn new(text: &str) -> Result<Glob, String> {
        Pattern::new(text).map(Glob).map_err(|e| e.to_string())
    }

    /// Returns true if the pattern matches a name.
    pub fn matches_name(&self, name: &str) -> bool {
        // Names that contain brackets or stars match themselves.
        name == self.0.as_str() || self.0.matches(name)
    }

    /// The text of the pattern.
    pub fn as_str(&self) -> &str {
        self.0.as_str()
    }

    /// Returns true if the pattern matches only one text: itself.
    fn is_literal(&self) -> bool {
        !self.0.as_str().contains(['*', '?', '['])
    }

    /// Returns true if the pattern has a slash and matches a path, whose parts are separated by slashes.
    pub fn matches_path(&self, path: &str) -> bool {
        let options = MatchOptions { require_literal_separator: true, ..MatchOptions::new() };
        let pattern = self.0.as_str();
        pattern.contains('/')
            && (pattern.trim_start_matches('/') == path
                || self.0.matches_with(path, options)
                || (pattern.starts_with('/') && self.0.matches_with(&format!("/{path}"), options)))
    }
}

/// Serialises the text of the pattern.
impl Serialize for Glob {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

/// A pattern without a match.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no node or object matches '{pattern}'; the file has: {names}")]
pub struct NoMatch {
    /// The pattern.
    pub pattern: String,
    /// The names in the file, or the first of them, and the one that was probably meant.
    pub names: String,
}

impl Scene {
    /// Removes the instances and lights that are not shown. Nodes, materials and object numbers stay.
    ///
    /// # Errors
    /// A pattern without a match.
    pub fn select(&mut self, selection: &Selection) -> Result<(), NoMatch> {
        if *selection == Selection::default() {
            return Ok(());
        }
        let paths = self.node_paths();
        let mut only = Matches::default();
        for glob in &selection.only {
            only.extend(self.find(glob, &paths)?);
        }
        let mut hide = Matches::default();
        for glob in &selection.hide {
            hide.extend(self.find(glob, &paths)?);
        }
        let is_shown = |node: u32, object: u32| {
            (selection.only.is_empty() || only.contains(node, object)) && !hide.contains(node, object)
        };
        self.instances.retain(|i| is_shown(i.node, i.object));
        self.retain_lights(|node| !hide.contains(node, 0));
        Ok(())
    }

    /// Returns the numbers of the drawn objects that a pattern matches, as [`Selection`] matches them.
    ///
    /// # Errors
    /// A pattern without a match.
    pub fn matching_objects(&self, glob: &Glob) -> Result<BTreeSet<u32>, NoMatch> {
        let matches = self.find(glob, &self.node_paths())?;
        let matching = self.instances.iter().filter(|i| matches.contains(i.node, i.object));
        Ok(matching.map(|instance| instance.object).collect())
    }

    /// Keeps the lights at some nodes, with the animation channels that drive them.
    fn retain_lights(&mut self, keep: impl Fn(u32) -> bool) {
        let lights = kept_indices(self.lights.iter().map(|light| light.node), &keep);
        let area_lights = kept_indices(self.area_lights.iter().map(|light| light.node), &keep);
        self.lights.retain(|light| keep(light.node));
        self.area_lights.retain(|light| keep(light.node));
        for animation in &mut self.animations {
            animation.channels.retain_mut(|c| {
                let (i, new_indices) = match &mut c.target {
                    ChannelTarget::Light(i, _) => (i, &lights),
                    ChannelTarget::AreaLight(i, _) => (i, &area_lights),
                    _ => return true,
                };
                let new = new_indices.get(*i as usize).copied().flatten();
                *i = new.unwrap_or_default();
                new.is_some()
            });
        }
    }

    /// Returns the path of every node: the names from the root, separated by `/`.
    pub fn node_paths(&self) -> Vec<String> {
        let mut paths: Vec<String> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let above = node.parent.map_or("", |p| &paths[p as usize]);
            let slash = if above.is_empty() { "" } else { "/" };
            paths.push(format!("{above}{slash}{}", node.name));
        }
        paths
    }

    fn find(&self, glob: &Glob, paths: &[String]) -> Result<Matches, NoMatch> {
        let mut matches = Matches { nodes: vec![false; self.nodes.len()], objects: BTreeSet::new() };
        let mut any = false;
        // Lists of many plain names are compared, not matched.
        let literal = glob.is_literal().then_some(glob.as_str());
        let literal_path = literal.filter(|text| text.contains('/')).map(|text| text.trim_start_matches('/'));
        for (i, node) in self.nodes.iter().enumerate() {
            let own = match literal {
                Some(text) => node.name == text || literal_path.is_some_and(|path| paths[i] == path),
                None => glob.matches_name(&node.name) || glob.matches_path(&paths[i]),
            };
            any |= own && !(node.name.is_empty() && self.nodes.len() == 1);
            matches.nodes[i] = own || node.parent.is_some_and(|p| matches.nodes[p as usize]);
        }
        let is_named = |name: &str| literal.map_or_else(|| glob.matches_name(name), |text| name == text);
        for (i, _) in self.objects.iter().enumerate().filter(|(_, name)| is_named(name)) {
            matches.objects.insert(i as u32 + 1);
            any = true;
        }
        if any { Ok(matches) } else { Err(self.no_match(glob)) }
    }

    fn no_match(&self, glob: &Glob) -> NoMatch {
        const MAX_NAMES: usize = 20;
        let all = self.objects.iter().chain(self.nodes.iter().map(|n| &n.name));
        let names: BTreeSet<&String> = all.filter(|n| !n.is_empty()).collect();
        let mut list: Vec<String> = names.iter().take(MAX_NAMES).map(|n| format!("'{n}'")).collect();
        if names.len() > MAX_NAMES {
            list.push(format!("and {} more", names.len() - MAX_NAMES));
        }
        let all_names: Vec<&String> = names.into_iter().collect();
        let names = if list.is_empty() { "no names".into() } else { list.join(", ") };
        let pattern: String = glob.0.as_str().into();
        let hint = did_you_mean(&pattern, all_names);
        NoMatch { names: names + &hint, pattern }
    }
}

/// Returns the new index of each light, by its node; `None` for those that are removed.
fn kept_indices(nodes: impl Iterator<Item = u32>, keep: impl Fn(u32) -> bool) -> Vec<Option<u32>> {
    let mut count = 0;
    let new_index = |node: u32| {
        let new = keep(node).then_some(count);
        count += u32::from(new.is_some());
        new
    };
    nodes.map(new_index).collect()
}

/// The matches of patterns.
#[derive(Default)]
struct Matches {
    /// One flag for each node.
    nodes: Vec<bool>,
    objects: BTreeSet<u32>,
}

impl Matches {
    fn contains(&self, node: u32, object: u32) -> bool {
        self.nodes.get(node as usize).is_some_and(|&n| n) || self.objects.contains(&object)
    }

    fn extend(&mut self, other: Matches) {
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
    use crate::pose;
    use crate::{
        Animation, AreaLight, AreaLightShape, Channel, Instance, Interpolation, Keyframes, Light, LightKind,
        LightProperty, LightUnits, Mesh, Node, PoseSettings,
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
            color: blinn_core::geometry::Rgb::ONE,
            intensity: 1.0,
            range: f32::INFINITY,
            radius: 0.0,
        };
        scene.lights = vec![light(5), light(1)];
        let area_light = |node: u32| AreaLight {
            name: String::new(),
            node,
            shape: AreaLightShape::Rect,
            size: [1.0; 2],
            color: blinn_core::geometry::Rgb::ONE,
            intensity: 1.0,
        };
        scene.area_lights = vec![area_light(5), area_light(1)];
        let keys =
            Keyframes { times: vec![0.0], values: vec![7.0], width: 1, interpolation: Interpolation::Step };
        let channel = |i: u32| Channel {
            target: ChannelTarget::Light(i, LightProperty::Intensity),
            keyframes: keys.clone(),
        };
        let area_channel = |i: u32| Channel {
            target: ChannelTarget::AreaLight(i, LightProperty::Intensity),
            keyframes: keys.clone(),
        };
        let channels = vec![channel(0), channel(1), area_channel(0), area_channel(1)];
        scene.animations.push(Animation { name: String::new(), channels });
        scene
    }

    #[test]
    fn remaining_lights_keep_their_animation() {
        let mut scene = scene();
        scene.select(&Selection { hide: globs(&["lamp*"]), ..Default::default() }).unwrap();
        assert_eq!((scene.lights.len(), scene.lights[0].node), (1, 1));
        let targets: Vec<ChannelTarget> = scene.animations[0].channels.iter().map(|c| c.target).collect();
        let intensity = LightProperty::Intensity;
        assert_eq!(targets, [ChannelTarget::Light(0, intensity), ChannelTarget::AreaLight(0, intensity)]);
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        assert_eq!(posed.lights(LightUnits::Raw, 1.0).len(), 1);
        let [light] = &posed.area_lights(LightUnits::Raw, 1.0)[..] else { panic!() };
        assert_eq!((scene.area_lights[0].node, light.radiance.x), (1, 7.0));
    }

    fn globs(list: &[&str]) -> Vec<Glob> {
        list.iter().map(|g| Glob::new(g).unwrap()).collect()
    }

    fn remaining(only: &[&str], hide: &[&str]) -> (Vec<u32>, usize) {
        let mut scene = scene();
        scene.select(&Selection { only: globs(only), hide: globs(hide) }).unwrap();
        (scene.instances.iter().map(|i| i.object).collect(), scene.lights.len())
    }

    #[test]
    fn names_and_paths_match_nodes_with_their_descendants() {
        assert_eq!(remaining(&[], &[]), (vec![1, 2, 3, 4], 2));
        assert_eq!(remaining(&[], &["wheel.?"]), (vec![1, 4], 2));
        assert_eq!(remaining(&[], &["wheels"]), (vec![1, 4], 2));
        assert_eq!(remaining(&["car"], &[]), (vec![1, 2, 3], 2));
        assert_eq!(remaining(&["wheel*"], &["*.L"]), (vec![3], 2));
        assert_eq!(remaining(&["car/*/wheel.R"], &[]), (vec![3], 2));
        assert_eq!(remaining(&["/car/**/wheel.*", "body"], &[]), (vec![1, 2, 3], 2));
        assert_eq!(remaining(&[], &["lamp [1]"]), (vec![1, 2, 3], 1));
        assert_eq!(remaining(&["body"], &["body"]), (vec![], 1));
    }

    #[test]
    fn a_pattern_without_a_match_is_an_error_that_lists_the_names() {
        for wrong in ["Wheel*", "wheels/*.R", "*/wheel.R", "car/wheel.R", "/wheels"] {
            let selection = Selection { hide: globs(&[wrong]), ..Default::default() };
            let error = scene().select(&selection).unwrap_err().to_string();
            assert!(error.contains(wrong) && error.contains("'body', 'car', 'lamp [1]'"), "{error}");
        }
        assert!(Glob::new("[a").is_err() && Glob::new("a**b").is_err());
    }
}
