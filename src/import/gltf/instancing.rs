//! EXT_mesh_gpu_instancing: many copies of one node's mesh.

use ::gltf::json::Node;
use glam::Vec3;

use super::accessor::{Accessor, Pick};
use super::color;
use super::document::Document;
use crate::import::error::{LoadError, Warnings};
use crate::scene::PackedTrs;

const NAME: &str = "EXT_mesh_gpu_instancing";

fn attribute(node: &Node, name: &str) -> Option<usize> {
    let extension = node.extensions.as_ref()?.others.get(NAME)?;
    extension.get("attributes")?.get(name)?.as_u64().map(|i| i as usize)
}

/// What places a copy, and how many numbers it has.
const PLACES: [(&str, &[usize]); 3] = [("TRANSLATION", &[3]), ("ROTATION", &[4]), ("SCALE", &[3])];
/// Its colour, as three.js writes and reads it.
const COLOR: (&str, &[usize]) = ("_COLOR_0", color::WIDTHS);

/// What a node's mesh is drawn as, once.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drawn {
    pub trs: Option<PackedTrs>,
    pub color: Option<Vec3>,
}

/// How many copies the node asks for; `None` for a node that is drawn once.
pub(super) fn count(doc: &Document<'_>, node: &Node) -> Option<u64> {
    let counts = PLACES.iter().filter_map(|(name, _)| attribute(node, name));
    counts.filter_map(|i| doc.root().accessors.get(i)).map(|a| a.count.0).min()
}

/// The copies below a node.
pub(super) fn copies(
    doc: &Document<'_>,
    index: usize,
    warnings: &mut Warnings,
) -> Result<Vec<Drawn>, LoadError> {
    let node = &doc.root().nodes[index];
    let place = |name: &str| format!("nodes[{index}].extensions.{NAME}.attributes.{name}");
    let mut open = |(name, widths): (&str, &[usize])| {
        let Some(accessor) = attribute(node, name) else { return Ok(None) };
        let accessor = Accessor::open(doc, accessor, warnings)?;
        if !widths.contains(&accessor.width) {
            let what = format!("has {} numbers an element; left out", accessor.width);
            warnings.add(place(name), what);
            return Ok(None);
        }
        Ok::<_, LoadError>(Some(accessor))
    };
    let [translation, rotation, scale] = PLACES;
    let (translation, rotation, scale) = (open(translation)?, open(rotation)?, open(scale)?);
    let color = open(COLOR)?;
    let given = [&translation, &rotation, &scale, &color];
    let counts: Vec<usize> = given.into_iter().flatten().map(|a| a.count).collect();
    let n = counts.iter().copied().min().unwrap_or(0);
    if counts.iter().any(|&c| c != n) {
        let place = format!("nodes[{index}].extensions.{NAME}");
        warnings.add(place, format_args!("its attributes differ in length; {n} copies are drawn"));
    }
    let pick = Pick::First(n);
    let translation = translation.map(|a| a.floats::<3, Vec3>(pick));
    let rotation = rotation.map(|a| a.floats::<4, [f32; 4]>(pick));
    let scale = scale.map(|a| a.floats::<3, Vec3>(pick));
    let color = color.map(|a| color::read(a, pick, &place("_COLOR_0"), warnings));
    let copy = |i: usize| {
        let vec = |list: &Option<Vec<Vec3>>, or| list.as_ref().map_or(or, |l: &Vec<Vec3>| l[i]);
        let trs = PackedTrs {
            translation: vec(&translation, Vec3::ZERO),
            rotation: rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i]),
            scale: vec(&scale, Vec3::ONE),
        };
        Drawn { trs: Some(trs), color: color.as_ref().map(|c| c[i].truncate()) }
    };
    Ok((0..n).map(copy).collect())
}
