//! Reads a mesh primitive of points or lines.

use ::gltf::json::mesh::{Mode, Semantic};

use super::accessor::Elements;
use super::attributes::{Attributes, normalize, open_positions};
use super::document::Document;
use super::morph_targets;
use super::primitive::{PrimitiveId, mode, read_order};
use super::topology;
use super::topology::VertexOrder;
use crate::compact::compact;
use crate::error::{LoadError, Warnings};
use blinn_scene::{Mesh, Rounds};

/// Reads a primitive of points or lines; `None`, with a warning, if it has nothing to draw.
pub(super) fn read(
    doc: &Document<'_>,
    id: PrimitiveId,
    warnings: &mut Warnings,
) -> Result<Option<Mesh>, LoadError> {
    let Some(json) = id.json(doc) else { return Ok(None) };
    let location = id.location();
    let Some(positions) = open_positions(doc, json, None, &location, warnings)? else { return Ok(None) };
    let order = read_order(doc, json, &location, positions.count, warnings)?;
    let path = || format!("{location}.indices");
    let (used, rounds) = match mode(json) {
        Mode::Points => match order {
            VertexOrder::Sequential(_) => (None, Rounds::Points),
            VertexOrder::Indexed { .. } => {
                (Some(topology::points(&order, positions.count as u32, &path)?), Rounds::Points)
            }
        },
        mode => {
            if mode == Mode::Lines && order.len() % 2 != 0 {
                let message = format!("ignored the last of {} vertices, which forms no line", order.len());
                warnings.add(&location, message);
            }
            let mut lines = topology::lines(mode, &order, positions.count as u32, &path)?;
            (Some(compact(&mut lines)), Rounds::Lines(lines))
        }
    };
    let elements = used.as_ref().map_or(Elements::First(positions.count), |used| Elements::At(used));
    if elements.len() == 0 {
        warnings.add(&location, "ignored primitive without points or lines");
        return Ok(None);
    }
    let vertices = positions.count;
    let attributes = Attributes { doc, json, decoded: None, location: &location, vertices, elements };
    let mut mesh = Mesh {
        name: doc.root().meshes[id.mesh].name.clone().unwrap_or_default(),
        positions: positions.floats(elements),
        rounds,
        normals: attributes.vec3(Semantic::Normals, warnings)?,
        uvs: attributes.uvs(warnings)?,
        colors: attributes.colors(warnings)?,
        influences: attributes.influences(warnings)?,
        ..Mesh::default()
    };
    mesh.normals.iter_mut().for_each(|n| *n = normalize(*n));
    morph_targets::read(&attributes, [id.mesh, id.primitive], &mut mesh, warnings)?;
    Ok(Some(mesh))
}
