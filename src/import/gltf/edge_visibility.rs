//! EXT_mesh_primitive_edge_visibility: the edges of triangles that are drawn.

use std::collections::HashSet;

use ::gltf::json::accessor::ComponentType;
use ::gltf::json::mesh::Primitive;
use serde_json::Value;

use super::accessor::{Accessor, Elements};
use super::document::Document;
use crate::error::{LoadError, Warnings};
use blinn_scene::Mesh;

const NAME: &str = "EXT_mesh_primitive_edge_visibility";
/// A side of a triangle that is always drawn, in two bits.
const HARD: u8 = 2;

/// Reads the marks of a mesh's edges, if the primitive has any. `kept` are the old numbers of its vertices, if some were
/// removed. The normals of silhouettes follow from the triangles.
pub(super) fn read(
    doc: &Document<'_>,
    json: &Primitive,
    location: &str,
    kept: Option<&[u32]>,
    mesh: &mut Mesh,
    warnings: &mut Warnings,
) -> Result<(), LoadError> {
    let Some(extension) = json.extensions.as_ref().and_then(|e| e.others.get(NAME)) else { return Ok(()) };
    let location = format!("{location}.extensions.{NAME}");
    let mut marks = vec![0u8; mesh.triangles.len()];
    let mut has_marks = false;
    if let Some(index) = extension.get("visibility") {
        match accessor(doc, index, warnings)?.filter(|a| a.count == (6 * marks.len()).div_ceil(8)) {
            Some(accessor) => {
                let bytes: Vec<[u32; 1]> = accessor.integers(Elements::First(accessor.count));
                has_marks = true;
                for (triangle, mark) in marks.iter_mut().enumerate() {
                    let bits = |side: usize| {
                        let bit = 2 * (3 * triangle + side);
                        (bytes[bit / 8][0] >> (bit % 8) & 3) as u8
                    };
                    *mark = bits(0) | bits(1) << 2 | bits(2) << 4;
                }
            }
            None => warnings.add(
                format_args!("{location}.visibility"),
                format_args!(
                    "ignored: expected a byte for every 4 of {} edges of triangles",
                    3 * marks.len()
                ),
            ),
        }
    }
    let strings = extension.get("lineStrings").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let mut pairs = HashSet::new();
    for (i, string) in strings.iter().enumerate() {
        let Some(index) = string.get("indices") else { continue };
        let Some(accessor) = accessor(doc, index, warnings)? else {
            warnings.add(
                format_args!("{location}.lineStrings[{i}].indices"),
                "ignored: expected an accessor of indices",
            );
            continue;
        };
        let restart = accessor.restart_index();
        let indices: Vec<[u32; 1]> = accessor.integers(Elements::First(accessor.count));
        for run in indices.as_flattened().split(|&index| index == restart) {
            pairs.extend(run.windows(2).map(|ends| [ends[0].min(ends[1]), ends[0].max(ends[1])]));
        }
        has_marks = true;
    }
    if !pairs.is_empty() {
        let in_file = |vertex: u32| kept.map_or(vertex, |kept| kept[vertex as usize]);
        for (triangle, mark) in mesh.triangles.iter().zip(&mut marks) {
            let [a, b, c] = triangle.map(in_file);
            for (side, [a, b]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                if pairs.contains(&[a.min(b), a.max(b)]) {
                    *mark |= HARD << (2 * side);
                }
            }
        }
    }
    if has_marks {
        mesh.edge_marks = marks;
    }
    Ok(())
}

/// Opens an accessor of whole numbers; `None` if it is none.
fn accessor<'d>(
    doc: &'d Document<'_>,
    index: &Value,
    warnings: &mut Warnings,
) -> Result<Option<Accessor<'d>>, LoadError> {
    let index = index.as_u64().and_then(|index| usize::try_from(index).ok());
    let Some(index) = index.filter(|&index| index < doc.root().accessors.len()) else { return Ok(None) };
    let accessor = Accessor::open(doc, index, warnings)?;
    let is_list = accessor.components == 1 && accessor.component_type != ComponentType::F32;
    Ok(is_list.then_some(accessor))
}
