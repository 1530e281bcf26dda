//! Animations: channels, samplers and their targets, including KHR_animation_pointer.

use std::collections::HashMap;

use ::gltf::json::Node;
use ::gltf::json::animation::{Channel as JsonChannel, Interpolation as JsonInterpolation, Property};
use ::gltf::json::validation::Checked;

use super::accessor::Accessor;
use super::document::Document;
use super::keys;
use super::keys::KeyShape;
use super::pointer;
use super::pointer::PointerTarget;
use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use blinn_scene::{Animation, Channel, ChannelTarget, Interpolation, Keyframes};

/// Limit on the numbers in all channels together, counted for each target.
const MAX_KEY_NUMBERS: u64 = 1 << 28;

/// The scene's objects for each index of the file. Objects outside the scene are missing.
pub(super) struct SceneIds<'a> {
    pub nodes: &'a [Option<u32>],
    pub materials: &'a HashMap<usize, u32>,
    /// One light for each node with it.
    pub lights: &'a HashMap<usize, Vec<u32>>,
    pub area_lights: &'a HashMap<usize, Vec<u32>>,
    pub photometric_lights: &'a HashMap<usize, u32>,
    /// One camera for each node with it.
    pub cameras: &'a HashMap<usize, Vec<u32>>,
    /// The image-based light of the scene.
    pub environment: Option<u64>,
}

/// Reads all animations. A channel without valid keyframes is ignored with a warning.
pub(super) fn read(
    doc: &Document<'_>,
    ids: &SceneIds<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<Animation>, LoadError> {
    let mut numbers = 0u64;
    let mut out = Vec::with_capacity(doc.root().animations.len());
    for (i, json) in doc.root().animations.iter().enumerate() {
        let mut animation = Animation { name: json.name.clone().unwrap_or_default(), channels: Vec::new() };
        for (j, channel) in json.channels.iter().enumerate() {
            let pointer = doc.json.pointers.get(&(i, j));
            let location = format!("animations[{i}].channels[{j}]");
            let reader = ChannelReader { doc, animation: json, channel, pointer, location };
            match reader.read(ids, warnings) {
                Ok(Some(read)) => {
                    let size = (read.keyframes.times.len() + read.keyframes.values.len()) as u64;
                    numbers = numbers.saturating_add(size.saturating_mul(read.targets.len() as u64));
                    LoadError::check_limit("numbers of animation keyframes", numbers, MAX_KEY_NUMBERS)?;
                    let channel = |target| Channel { target, keyframes: read.keyframes.clone() };
                    animation.channels.extend(read.targets.into_iter().map(channel));
                }
                Ok(None) => {}
                Err(ChannelError::File(error @ LoadError::Limit { .. })) => return Err(error),
                Err(ChannelError::File(error)) => warn(&reader.location, &error, warnings),
                Err(ChannelError::Channel(why)) => warn(&reader.location, &why, warnings),
            }
        }
        out.push(animation);
    }
    Ok(out)
}

fn warn(location: &str, why: &dyn std::fmt::Display, warnings: &mut Warnings) {
    warnings.add(location, format_args!("ignored channel: {why}"));
}

/// A channel's keyframes for all its targets in the scene.
struct ReadChannel {
    targets: Vec<ChannelTarget>,
    keyframes: Keyframes,
}

/// The reason why a channel is ignored.
enum ChannelError {
    /// An error of its accessors.
    File(LoadError),
    /// A defect of the channel itself.
    Channel(String),
}

impl From<LoadError> for ChannelError {
    fn from(error: LoadError) -> ChannelError {
        ChannelError::File(error)
    }
}

/// The animated property of a channel, by the indices of the file.
#[derive(Clone, Copy, Debug)]
enum FileTarget {
    Node(usize, Property),
    Pointer(PointerTarget),
}

/// Reads one channel.
struct ChannelReader<'r, 'd> {
    doc: &'r Document<'d>,
    animation: &'r ::gltf::json::Animation,
    channel: &'r JsonChannel,
    /// The JSON pointer of KHR_animation_pointer.
    pointer: Option<&'r String>,
    /// JSON path of the channel.
    location: String,
}

impl ChannelReader<'_, '_> {
    /// Reads the channel; `None` if it has no target in the scene.
    fn read(&self, ids: &SceneIds<'_>, warnings: &mut Warnings) -> Result<Option<ReadChannel>, ChannelError> {
        let Some(target) = self.target().map_err(ChannelError::Channel)? else { return Ok(None) };
        let targets = target.in_scene(self.doc, ids);
        if targets.is_empty() {
            return Ok(None);
        }
        let keyframes = self.keyframes(&target, warnings)?;
        Ok(Some(ReadChannel { targets, keyframes }))
    }

    /// The channel's target; `None` for a channel without a node, which the specification ignores.
    fn target(&self) -> Result<Option<FileTarget>, String> {
        if let Some(pointer) = self.pointer {
            let target = pointer::parse(pointer);
            let target = target.ok_or_else(|| format!("'{}' cannot be animated", printable(pointer)))?;
            return Ok(Some(FileTarget::Pointer(target)));
        }
        let node = self.channel.target.node.value();
        match self.channel.target.path {
            _ if node == u32::MAX as usize => Ok(None),
            Checked::Valid(property) => Ok(Some(FileTarget::Node(node, property))),
            Checked::Invalid => Err("unknown target path".into()),
        }
    }

    /// Reads and checks the keyframes of the channel's sampler.
    fn keyframes(&self, target: &FileTarget, warnings: &mut Warnings) -> Result<Keyframes, ChannelError> {
        let invalid = |why: String| Err(ChannelError::Channel(why));
        let Some(sampler) = self.animation.samplers.get(self.channel.sampler.value()) else {
            return invalid(format!("sampler {} does not exist", self.channel.sampler.value()));
        };
        let input = Accessor::open(self.doc, sampler.input.value(), warnings)?;
        let output = Accessor::open(self.doc, sampler.output.value(), warnings)?;
        if input.components != 1 || input.count == 0 {
            return invalid("keyframe times are not scalars".into());
        }
        let mut times: Vec<f32> = input.flat_floats();
        let interpolation = match sampler.interpolation {
            Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
            Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::CubicSpline,
            Checked::Valid(JsonInterpolation::Linear) | Checked::Invalid => Interpolation::Linear,
        };
        // Cubic splines have an in-tangent, a value and an out-tangent per keyframe.
        let elements = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let width = target.width().unwrap_or_else(|| {
            let weights = target.morph_targets(self.doc);
            weights_per_value(output.count, times.len() * elements, weights)
        });
        if output.components != target.width().unwrap_or(1) || width == 0 {
            return invalid(format!(
                "{} values of {} components do not match {} keyframes",
                output.count,
                output.components,
                times.len()
            ));
        }
        let mut values = output.flat_floats();
        for message in keys::repair(&mut times, &mut values, KeyShape { elements, width }) {
            warnings.add(&self.location, message);
        }
        if times.is_empty() {
            return invalid("it has no valid keyframes".into());
        }
        Ok(Keyframes { times, values, width, interpolation })
    }
}

/// Numbers per value of a channel of morph weights: what the number of values implies if that is possible,
/// else the number of morph targets.
fn weights_per_value(values: usize, values_per_weight: usize, morph_targets: usize) -> usize {
    if values.is_multiple_of(values_per_weight) { values / values_per_weight } else { morph_targets }
}

impl FileTarget {
    /// The animated properties in the scene.
    fn in_scene(&self, doc: &Document<'_>, ids: &SceneIds<'_>) -> Vec<ChannelTarget> {
        let node = |i: usize| ids.nodes.get(i).copied().flatten();
        let all = |map: &HashMap<usize, Vec<u32>>, i: usize| map.get(&i).cloned().unwrap_or_default();
        match *self {
            FileTarget::Node(index, property) => {
                let target = match property {
                    Property::Translation => ChannelTarget::Translation,
                    Property::Rotation => ChannelTarget::Rotation,
                    Property::Scale => ChannelTarget::Scale,
                    Property::MorphTargetWeights => ChannelTarget::Weights,
                };
                node(index).map(target).into_iter().collect()
            }
            FileTarget::Pointer(target) => match target {
                PointerTarget::Visibility(i) => node(i).map(ChannelTarget::Visibility).into_iter().collect(),
                PointerTarget::Weight(i, k) => {
                    node(i).map(|n| ChannelTarget::Weight(n, k)).into_iter().collect()
                }
                PointerTarget::MeshWeights(mesh) => nodes_with_default_weights(doc, mesh)
                    .filter_map(node)
                    .map(ChannelTarget::Weights)
                    .collect(),
                PointerTarget::MeshWeight(mesh, k) => {
                    let nodes = nodes_with_default_weights(doc, mesh).filter_map(node);
                    nodes.map(|n| ChannelTarget::Weight(n, k)).collect()
                }
                PointerTarget::Material(i, field) => {
                    ids.materials.get(&i).map(|&m| ChannelTarget::Material(m, field)).into_iter().collect()
                }
                PointerTarget::Light(i, field) => {
                    all(ids.lights, i).into_iter().map(|l| ChannelTarget::Light(l, field)).collect()
                }
                PointerTarget::PhotometricLight(node, field) => {
                    let light = ids.photometric_lights.get(&node);
                    light.map(|&l| ChannelTarget::Light(l, field)).into_iter().collect()
                }
                PointerTarget::AreaLight(i, field) => {
                    let lights = all(ids.area_lights, i);
                    lights.into_iter().map(|l| ChannelTarget::AreaLight(l, field)).collect()
                }
                PointerTarget::Camera(i, field) => {
                    all(ids.cameras, i).into_iter().map(|c| ChannelTarget::Camera(c, field)).collect()
                }
                PointerTarget::Environment(i, field) => {
                    let is_lit = ids.environment == Some(i as u64);
                    is_lit.then_some(ChannelTarget::Environment(field)).into_iter().collect()
                }
            },
        }
    }

    /// Number of morph targets that a channel of weights animates; 0 for other channels.
    fn morph_targets(&self, doc: &Document<'_>) -> usize {
        let meshes = &doc.root().meshes;
        let mesh = match *self {
            FileTarget::Node(node, _) => doc
                .root()
                .nodes
                .get(node)
                .and_then(|node| node.mesh)
                .and_then(|mesh| meshes.get(mesh.value())),
            FileTarget::Pointer(PointerTarget::MeshWeights(mesh)) => meshes.get(mesh),
            FileTarget::Pointer(_) => None,
        };
        let primitives = mesh.into_iter().flat_map(|mesh| &mesh.primitives);
        primitives.map(|primitive| primitive.targets.as_ref().map_or(0, Vec::len)).max().unwrap_or(0)
    }

    /// Numbers per value; `None` for morph weights, whose number follows from the sampler's output.
    fn width(&self) -> Option<usize> {
        match self {
            FileTarget::Node(_, Property::Translation | Property::Scale) => Some(3),
            FileTarget::Node(_, Property::Rotation) => Some(4),
            FileTarget::Node(_, Property::MorphTargetWeights) => None,
            FileTarget::Pointer(target) => match target {
                PointerTarget::MeshWeights(_) => None,
                PointerTarget::Weight(..) | PointerTarget::MeshWeight(..) => Some(1),
                PointerTarget::Visibility(_) | PointerTarget::Camera(..) => Some(1),
                PointerTarget::Material(_, field) => Some(field.width()),
                PointerTarget::Light(_, field)
                | PointerTarget::AreaLight(_, field)
                | PointerTarget::PhotometricLight(_, field) => Some(field.width()),
                PointerTarget::Environment(_, field) => Some(field.width()),
            },
        }
    }
}

/// The nodes with a mesh that use its default weights: weights of the node override the mesh's.
fn nodes_with_default_weights(doc: &Document<'_>, mesh: usize) -> impl Iterator<Item = usize> {
    let uses_default = move |n: &Node| {
        n.mesh.is_some_and(|m| m.value() == mesh) && n.weights.as_ref().is_none_or(Vec::is_empty)
    };
    doc.root().nodes.iter().enumerate().filter(move |(_, n)| uses_default(n)).map(|(i, _)| i)
}
