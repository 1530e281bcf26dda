//! EXT_mesh_gpu_instancing: many instances of one node's mesh.

use ::gltf::json::Node;
use glam::Vec3;

use super::accessor::{Accessor, Elements};
use super::color;
use super::document::Document;
use crate::error::{LoadError, Warnings};
use blinn_scene::PackedTrs;

const NAME: &str = "EXT_mesh_gpu_instancing";

/// Attributes that transform an instance, with their numbers of components.
const TRANSFORMS: [(&str, &[usize]); 3] = [("TRANSLATION", &[3]), ("ROTATION", &[4]), ("SCALE", &[3])];
/// An instance's colour, as three.js writes and reads it.
const COLOR: (&str, &[usize]) = ("_COLOR_0", color::COMPONENTS);

/// Per-instance data. The default is a node without the extension.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InstanceAttributes {
    pub trs: Option<PackedTrs>,
    pub color: Option<Vec3>,
}

fn attribute(node: &Node, name: &str) -> Option<usize> {
    let extension = node.extensions.as_ref()?.others.get(NAME)?;
    extension.get("attributes")?.get(name)?.as_u64().map(|i| i as usize)
}

/// Number of instances from the JSON alone; `None` for a node without the extension.
pub(super) fn count(doc: &Document<'_>, node: &Node) -> Option<u64> {
    let counts = TRANSFORMS.iter().filter_map(|(name, _)| attribute(node, name));
    counts.filter_map(|i| doc.root().accessors.get(i)).map(|a| a.count.0).min()
}

/// Reads the instances of a node, by the node's index in the file.
pub(super) fn read(
    doc: &Document<'_>,
    index: usize,
    warnings: &mut Warnings,
) -> Result<Vec<InstanceAttributes>, LoadError> {
    let node = &doc.root().nodes[index];
    let location = |name: &str| format!("nodes[{index}].extensions.{NAME}.attributes.{name}");
    let mut open = |(name, components): (&str, &[usize])| {
        let Some(accessor) = attribute(node, name) else { return Ok(None) };
        let accessor = Accessor::open(doc, accessor, warnings)?;
        if !components.contains(&accessor.components) {
            let message = format!("ignored attribute with {} components per element", accessor.components);
            warnings.add(location(name), message);
            return Ok(None);
        }
        Ok::<_, LoadError>(Some(accessor))
    };
    let translation = open(TRANSFORMS[0])?;
    let rotation = open(TRANSFORMS[1])?;
    let scale = open(TRANSFORMS[2])?;
    let color = open(COLOR)?;
    let present = [&translation, &rotation, &scale, &color];
    let counts: Vec<usize> = present.into_iter().flatten().map(|a| a.count).collect();
    let n = counts.iter().copied().min().unwrap_or(0);
    if counts.iter().any(|&c| c != n) {
        let location = format!("nodes[{index}].extensions.{NAME}");
        warnings.add(location, format_args!("attributes differ in length; used {n} instances"));
    }
    let elements = Elements::First(n);
    let translation = translation.map(|a| a.floats::<3, Vec3>(elements));
    let rotation = rotation.map(|a| a.floats::<4, [f32; 4]>(elements));
    let scale = scale.map(|a| a.floats::<3, Vec3>(elements));
    let color = color.map(|a| color::read(a, elements, &location("_COLOR_0"), warnings));
    let instance = |i: usize| {
        let vec = |list: &Option<Vec<Vec3>>, default| list.as_ref().map_or(default, |l: &Vec<Vec3>| l[i]);
        let trs = PackedTrs {
            translation: vec(&translation, Vec3::ZERO),
            rotation: rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i]),
            scale: vec(&scale, Vec3::ONE),
        };
        InstanceAttributes { trs: Some(trs), color: color.as_ref().map(|c| c[i].truncate()) }
    };
    Ok((0..n).map(instance).collect())
}
