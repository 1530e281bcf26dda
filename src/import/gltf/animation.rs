//! Animations and skins: what refers to nodes of the walk.

use std::collections::HashMap;

use ::gltf::json::animation::{Channel as JsonChannel, Interpolation as JsonInterpolation, Property};
use ::gltf::json::validation::Checked;
use glam::{DAffine3, DMat4, Mat4};

use super::accessor::{Accessor, Pick};
use super::document::Document;
use super::pointer;
use super::pointer::Pointed;
use crate::import::error::{LoadError, Warnings};
use crate::import::files::escape::printable;
use crate::scene::{Animation, Channel, ChannelTarget, Interpolation, Keyframes, Skin};

/// Numbers in all channels together; each copy of a shared node has its own.
const KEY_NUMBERS: u64 = 1 << 28;

/// The scene's nodes for each node of the file.
pub(super) type Copies = [Vec<u32>];

/// What became of the file's parts in the scene. What is in none of them is not in the scene.
pub(super) struct Places<'a> {
    pub nodes: &'a Copies,
    pub materials: &'a HashMap<usize, u32>,
    /// Lights and cameras by the file's index: once for each node that carries them.
    pub lights: &'a HashMap<usize, Vec<u32>>,
    pub cameras: &'a HashMap<usize, Vec<u32>>,
}

/// Reads every animation. A channel that cannot be followed is left out alone.
pub(super) fn animations(
    doc: &Document<'_>,
    places: &Places<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<Animation>, LoadError> {
    let mut numbers = 0u64;
    let mut out = Vec::with_capacity(doc.root().animations.len());
    for (i, json) in doc.root().animations.iter().enumerate() {
        let mut animation = Animation { name: json.name.clone().unwrap_or_default(), channels: Vec::new() };
        for (j, channel) in json.channels.iter().enumerate() {
            let place = format!("animations[{i}].channels[{j}]");
            let aim = match aim(doc, channel, i, j) {
                Ok(Some(aim)) => aim,
                Ok(None) => continue,
                Err(why) => {
                    warnings.add(place, format_args!("{why}; left out"));
                    continue;
                }
            };
            let targets = aim.targets(doc, places);
            if targets.is_empty() {
                // It moves a part of another scene.
                continue;
            }
            let keys = match keys(doc, json, channel, &aim, warnings) {
                Ok(keys) => keys,
                Err(Wrong::File(error @ LoadError::Limit { .. })) => return Err(error),
                Err(Wrong::File(error)) => {
                    warnings.add(place, format_args!("{error}; left out"));
                    continue;
                }
                Err(Wrong::Keyframes(why)) => {
                    warnings.add(place, format_args!("{why}; left out"));
                    continue;
                }
            };
            let size = (keys.times.len() + keys.values.len()) as u64;
            numbers = numbers.saturating_add(size.saturating_mul(targets.len() as u64));
            LoadError::check_limit("animation keys", numbers, KEY_NUMBERS)?;
            animation
                .channels
                .extend(targets.into_iter().map(|target| Channel { target, keyframes: keys.clone() }));
        }
        out.push(animation);
    }
    Ok(out)
}

/// What a channel drives, by the file's indices.
#[derive(Clone, Copy, Debug)]
enum Aim {
    Node(usize, Property),
    Pointed(Pointed),
}

impl Aim {
    /// Each place in the scene that it drives.
    fn targets(&self, doc: &Document<'_>, places: &Places<'_>) -> Vec<ChannelTarget> {
        let nodes = |i: usize| places.nodes.get(i).map_or(&[][..], Vec::as_slice).iter().copied();
        let all = |map: &HashMap<usize, Vec<u32>>, i: usize| map.get(&i).cloned().unwrap_or_default();
        match *self {
            Aim::Node(node, property) => {
                let target = match property {
                    Property::Translation => ChannelTarget::Translation,
                    Property::Rotation => ChannelTarget::Rotation,
                    Property::Scale => ChannelTarget::Scale,
                    Property::MorphTargetWeights => ChannelTarget::Weights,
                };
                nodes(node).map(target).collect()
            }
            Aim::Pointed(Pointed::Visibility(node)) => nodes(node).map(ChannelTarget::Visibility).collect(),
            Aim::Pointed(Pointed::Weight(node, k)) => {
                nodes(node).map(|n| ChannelTarget::Weight(n, k)).collect()
            }
            Aim::Pointed(Pointed::MeshWeights(mesh)) => {
                shown(doc, mesh).flat_map(nodes).map(ChannelTarget::Weights).collect()
            }
            Aim::Pointed(Pointed::MeshWeight(mesh, k)) => {
                shown(doc, mesh).flat_map(nodes).map(|n| ChannelTarget::Weight(n, k)).collect()
            }
            Aim::Pointed(Pointed::Material(i, field)) => {
                places.materials.get(&i).map(|&m| ChannelTarget::Material(m, field)).into_iter().collect()
            }
            Aim::Pointed(Pointed::Light(i, field)) => {
                all(places.lights, i).into_iter().map(|l| ChannelTarget::Light(l, field)).collect()
            }
            Aim::Pointed(Pointed::Camera(i, field)) => {
                all(places.cameras, i).into_iter().map(|c| ChannelTarget::Camera(c, field)).collect()
            }
        }
    }

    /// Numbers in a value; `None` for as many as there are.
    fn width(&self) -> Option<usize> {
        match self {
            Aim::Node(_, Property::Translation | Property::Scale) => Some(3),
            Aim::Node(_, Property::Rotation) => Some(4),
            Aim::Node(_, Property::MorphTargetWeights) | Aim::Pointed(Pointed::MeshWeights(_)) => None,
            Aim::Pointed(Pointed::Weight(..) | Pointed::MeshWeight(..)) => Some(1),
            Aim::Pointed(Pointed::Visibility(_) | Pointed::Camera(..)) => Some(1),
            Aim::Pointed(Pointed::Material(_, field)) => Some(field.width()),
            Aim::Pointed(Pointed::Light(_, field)) => Some(field.width()),
        }
    }
}

/// The nodes that show a mesh with its default weights: a node's own go before its mesh's.
fn shown(doc: &Document<'_>, mesh: usize) -> impl Iterator<Item = usize> {
    let plain = move |n: &::gltf::json::Node| {
        n.mesh.is_some_and(|m| m.value() == mesh) && n.weights.as_ref().is_none_or(Vec::is_empty)
    };
    doc.root().nodes.iter().enumerate().filter(move |(_, n)| plain(n)).map(|(i, _)| i)
}

/// `None` for a channel that the specification says to ignore.
fn aim(
    doc: &Document<'_>,
    channel: &JsonChannel,
    animation: usize,
    index: usize,
) -> Result<Option<Aim>, String> {
    if let Some(pointer) = doc.json.pointers.get(&(animation, index)) {
        let pointed = pointer::read(pointer);
        let pointed = pointed.ok_or_else(|| format!("'{}' is not animated", printable(pointer)))?;
        return Ok(Some(Aim::Pointed(pointed)));
    }
    let node = channel.target.node.value();
    match channel.target.path {
        _ if node == u32::MAX as usize => Ok(None),
        Checked::Valid(property) => Ok(Some(Aim::Node(node, property))),
        Checked::Invalid => Err("what it drives is not known".into()),
    }
}

enum Wrong {
    File(LoadError),
    Keyframes(String),
}

impl From<LoadError> for Wrong {
    fn from(error: LoadError) -> Wrong {
        Wrong::File(error)
    }
}

fn keys(
    doc: &Document<'_>,
    json: &::gltf::json::Animation,
    channel: &JsonChannel,
    aim: &Aim,
    warnings: &mut Warnings,
) -> Result<Keyframes, Wrong> {
    let wrong = |why: String| Err(Wrong::Keyframes(why));
    let Some(sampler) = json.samplers.get(channel.sampler.value()) else {
        return wrong(format!("there is no sampler {}", channel.sampler.value()));
    };
    let input = Accessor::open(doc, sampler.input.value(), warnings)?;
    let output = Accessor::open(doc, sampler.output.value(), warnings)?;
    if input.width != 1 || input.count == 0 {
        return wrong("its times are no list of numbers".into());
    }
    let times: Vec<f32> = input.flat_floats();
    if !times.iter().all(|t| t.is_finite()) || !times.is_sorted() {
        return wrong("its times do not ascend".into());
    }
    let interpolation = match sampler.interpolation {
        Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
        Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::CubicSpline,
        Checked::Valid(JsonInterpolation::Linear) | Checked::Invalid => Interpolation::Linear,
    };
    let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let per_key = times.len() * parts;
    let (width, numbers) = aim.width().map_or((1, output.count / per_key), |n| (n, n));
    if output.width != width || numbers == 0 || output.count != per_key * (numbers / width) {
        let (count, has, keys) = (output.count, output.width, times.len());
        return wrong(format!("{count} values of {has} numbers do not fit {keys} keys"));
    }
    let values = output.flat_floats();
    if !values.iter().all(|v| v.is_finite()) {
        return wrong("its values are not finite".into());
    }
    Ok(Keyframes { times, values, width: numbers, interpolation })
}

/// Reads a skin, its joints as nodes of the scene. `None`, with a warning, where they are not all
/// in it.
pub(super) fn skin(
    doc: &Document<'_>,
    index: usize,
    copies: &Copies,
    warnings: &mut Warnings,
) -> Result<Option<Skin>, LoadError> {
    let Some(json) = doc.root().skins.get(index) else { return Ok(None) };
    let place = format!("skins[{index}]");
    let node = |j: &::gltf::json::Index<::gltf::json::Node>| copies.get(j.value())?.first().copied();
    let joints: Option<Vec<u32>> = json.joints.iter().map(node).collect();
    let Some(joints) = joints.filter(|j| !j.is_empty()) else {
        warnings.add(place, "has no joints in this scene, and does not bend its meshes");
        return Ok(None);
    };
    let mut inverse_bind = Vec::with_capacity(joints.len());
    if let Some(index) = json.inverse_bind_matrices {
        let accessor = Accessor::open(doc, index.value(), warnings)?;
        if accessor.width == 16 {
            let count = accessor.count.min(joints.len());
            let matrices: Vec<[f32; 16]> = accessor.floats(Pick::First(count));
            inverse_bind.extend(matrices.iter().map(|m| affine(Mat4::from_cols_array(m).as_dmat4())));
        }
        if inverse_bind.len() < joints.len() {
            let has = inverse_bind.len();
            let what = format!("has {has} matrices for {} joints; the others are the identity", joints.len());
            warnings.add(format_args!("{place}.inverseBindMatrices"), what);
        }
    }
    inverse_bind.resize(joints.len(), DAffine3::IDENTITY);
    Ok(Some(Skin { name: json.name.clone().unwrap_or_default(), joints, inverse_bind }))
}

fn affine(m: DMat4) -> DAffine3 {
    DAffine3::from_cols(m.x_axis.truncate(), m.y_axis.truncate(), m.z_axis.truncate(), m.w_axis.truncate())
}
