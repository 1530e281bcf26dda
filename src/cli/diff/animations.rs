//! Compares the animations of two scenes at all times.

use std::collections::HashMap;
use std::fmt::Debug;

use glam::DVec4;
use serde_json::{Value, json};

use blinn_output::compare::JsonDifference;
use blinn_scene::{Animation, ChannelTarget, Keyframes, Scene};

/// Differences of values below this share of the larger one (of 1 for small ones) are rounding errors of exporters.
const TOLERANCE: f64 = 1e-5;

/// Returns where curves of animations with equal names first differ: for each animated property the time, and both
/// values. Curves are compared as functions of time, so that other keyframes of the same curve are equal. Animations
/// that one file alone has are left to the comparison of properties.
pub(super) fn curve_differences(old: &Scene, new: &Scene) -> Vec<JsonDifference> {
    let mut differences = Vec::new();
    let of_new = named(&new.animations);
    for (key, animation) in named(&old.animations) {
        let Some(other) = of_new.iter().find(|(k, _)| *k == key).map(|(_, other)| *other) else { continue };
        let mut channels: HashMap<String, &Keyframes> = HashMap::new();
        for channel in &other.channels {
            channels.insert(target_name(new, channel.target), &channel.keyframes);
        }
        for channel in &animation.channels {
            let target = target_name(old, channel.target);
            let path = |at: &str| format!("animations[{}].{target}{at}", key.0);
            match channels.remove(&target) {
                Some(keyframes) => {
                    let Some(time) = first_difference(channel.target, &channel.keyframes, keyframes) else {
                        continue;
                    };
                    let value = |keyframes: &Keyframes| Some(json!(keyframes.sample(time)));
                    differences.push(JsonDifference {
                        path: path(&format!(" at {time:.3} s")),
                        old: value(&channel.keyframes),
                        new: value(keyframes),
                    });
                }
                None => differences.push(JsonDifference {
                    path: path(""),
                    old: Some(keyframe_count(&channel.keyframes)),
                    new: None,
                }),
            }
        }
        // In the order of the file.
        for channel in &other.channels {
            let target = target_name(new, channel.target);
            if channels.remove(&target).is_some() {
                differences.push(JsonDifference {
                    path: format!("animations[{}].{target}", key.0),
                    old: None,
                    new: Some(keyframe_count(&channel.keyframes)),
                });
            }
        }
    }
    differences
}

/// Animations with their name and the number of earlier ones of the same name.
fn named<'a>(animations: &'a [Animation]) -> Vec<((&'a str, usize), &'a Animation)> {
    let mut earlier: HashMap<&str, usize> = HashMap::new();
    let key = |animation: &'a Animation| {
        let count = earlier.entry(&animation.name).or_default();
        *count += 1;
        ((animation.name.as_str(), *count), animation)
    };
    animations.iter().map(key).collect()
}

fn keyframe_count(keyframes: &Keyframes) -> Value {
    json!({"keyframes": keyframes.times.len()})
}

/// Returns the first of the keyframes of both, and the times halfway between them, at which the values differ.
fn first_difference(target: ChannelTarget, old: &Keyframes, new: &Keyframes) -> Option<f64> {
    let is_same = old.times == new.times
        && old.values == new.values
        && (old.width, old.interpolation) == (new.width, new.interpolation);
    if is_same {
        return None;
    }
    let mut keys: Vec<f32> = old.times.iter().chain(&new.times).copied().filter(|t| t.is_finite()).collect();
    keys.sort_by(f32::total_cmp);
    keys.dedup();
    let next = keys.iter().skip(1).map(Some).chain([None]);
    let times = keys.iter().zip(next).flat_map(|(&key, next)| {
        let key = f64::from(key);
        [Some(key), next.map(|&next| (key + f64::from(next)) / 2.0)]
    });
    times.flatten().find(|time| values_differ(target, old, new, *time))
}

fn values_differ(target: ChannelTarget, old: &Keyframes, new: &Keyframes, time: f64) -> bool {
    if matches!(target, ChannelTarget::Rotation(_)) {
        // Both signs of a quaternion are the same rotation.
        let [a, b] = [old, new].map(|keyframes| DVec4::from(keyframes.sample_rotation(time)));
        return (a - b).length().min((a + b).length()) > TOLERANCE;
    }
    let (a, b) = (old.sample(time), new.sample(time));
    let differ = |(a, b): (&f64, &f64)| (a - b).abs() > TOLERANCE * a.abs().max(b.abs()).max(1.0);
    a.len() != b.len() || a.iter().zip(&b).any(differ)
}

/// The name of an animated property, such as `node 'Cube' translation`.
fn target_name(scene: &Scene, target: ChannelTarget) -> String {
    let node = |index: u32| owner("node", scene.nodes.get(index as usize).map(|node| &*node.name), index);
    match target {
        ChannelTarget::Translation(i) => format!("{} translation", node(i)),
        ChannelTarget::Rotation(i) => format!("{} rotation", node(i)),
        ChannelTarget::Scale(i) => format!("{} scale", node(i)),
        ChannelTarget::Weights(i) => format!("{} morph weights", node(i)),
        ChannelTarget::Weight(i, weight) => format!("{} morph weight {weight}", node(i)),
        ChannelTarget::Visibility(i) => format!("{} visibility", node(i)),
        ChannelTarget::Material(i, property) => {
            let name = scene.materials.get(i as usize).map(|material| &*material.name);
            format!("{} {}", owner("material", name, i), words(property))
        }
        ChannelTarget::Light(i, property) => {
            let name = scene.lights.get(i as usize).map(|light| &*light.name);
            format!("{} {}", owner("light", name, i), words(property))
        }
        ChannelTarget::AreaLight(i, property) => {
            let name = scene.area_lights.get(i as usize).map(|light| &*light.name);
            format!("{} {}", owner("area light", name, i), words(property))
        }
        ChannelTarget::Camera(i, property) => {
            let name = scene.cameras.get(i as usize).map(|camera| &*camera.name);
            format!("{} {}", owner("camera", name, i), words(property))
        }
        ChannelTarget::Environment(property) => format!("environment {}", words(property)),
    }
}

/// The name of what has the property, or its index if it has none.
fn owner(kind: &str, name: Option<&str>, index: u32) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} '{name}'"),
        _ => format!("{kind} {index}"),
    }
}

/// The words of a property such as `AlphaCutoff` or `Offset(Base)`: `alpha cutoff`, `offset (base)`.
fn words(property: impl Debug) -> String {
    let mut out = String::new();
    for c in format!("{property:?}").chars() {
        if (c.is_uppercase() || c == '(') && !out.is_empty() && !out.ends_with('(') {
            out.push(' ');
        }
        out.extend(c.to_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_scene::{Channel, Interpolation, MaterialProperty, Node, TextureSlot};

    fn scene(target: ChannelTarget, width: usize, times: &[f32], values: &[f32]) -> Scene {
        let keyframes = Keyframes {
            times: times.to_vec(),
            values: values.to_vec(),
            width,
            interpolation: Interpolation::Linear,
        };
        let animation = Animation { name: "Move".into(), channels: vec![Channel { target, keyframes }] };
        Scene {
            nodes: vec![Node { name: "Cube".into(), ..Node::default() }],
            animations: vec![animation],
            ..Scene::default()
        }
    }

    #[test]
    fn other_keyframes_of_the_same_curve_are_equal() {
        let target = ChannelTarget::Weight(0, 0);
        let two = scene(target, 1, &[0.0, 2.0], &[0.0, 1.0]);
        let three = scene(target, 1, &[0.0, 0.5, 2.0], &[0.0, 0.25, 1.0]);
        assert_eq!(curve_differences(&two, &three), []);
        let rotation = ChannelTarget::Rotation(0);
        let turned = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let negated = turned.map(|v: f32| -v);
        let [a, b] = [turned, negated].map(|values| scene(rotation, 4, &[0.0, 1.0], &values));
        assert_eq!(curve_differences(&a, &b), []);
    }

    #[test]
    fn the_first_time_of_a_difference_is_named() {
        let target = ChannelTarget::Translation(0);
        let old = scene(target, 3, &[0.0, 1.0, 2.0], &[0.0; 9]);
        let mut values = [0.0; 9];
        values[7] = 0.5;
        let new = scene(target, 3, &[0.0, 1.0, 2.0], &values);
        let path = "animations[Move].node 'Cube' translation at 1.500 s";
        let (a, b) = (Some(json!([0.0, 0.0, 0.0])), Some(json!([0.0, 0.25, 0.0])));
        assert_eq!(curve_differences(&old, &new), [JsonDifference { path: path.into(), old: a, new: b }]);
        assert_eq!(curve_differences(&old, &old), []);
    }

    #[test]
    fn properties_that_one_file_animates_are_named() {
        let old = scene(ChannelTarget::Visibility(0), 1, &[0.0], &[1.0]);
        let offset = MaterialProperty::Offset(TextureSlot::MetallicRoughness);
        let new = scene(ChannelTarget::Material(0, offset), 2, &[0.0], &[1.0, 0.0]);
        let paths: Vec<String> = curve_differences(&old, &new).into_iter().map(|d| d.path).collect();
        assert_eq!(
            paths,
            [
                "animations[Move].node 'Cube' visibility",
                "animations[Move].material 0 offset (metallic roughness)"
            ]
        );
    }

    #[test]
    fn animations_of_one_name_are_compared_in_order() {
        let still = scene(ChannelTarget::Weight(0, 0), 1, &[0.0], &[1.0]).animations.remove(0);
        let mut moved = still.clone();
        moved.channels[0].keyframes.values[0] = 2.0;
        let of = |animations: &[&Animation]| Scene {
            animations: animations.iter().map(|animation| (*animation).clone()).collect(),
            ..Scene::default()
        };
        let differing = curve_differences(&of(&[&still, &still]), &of(&[&still, &moved]));
        assert_eq!(differing.len(), 1);
        assert_eq!(curve_differences(&of(&[&still, &moved]), &of(&[&still, &moved])), []);
    }
}
