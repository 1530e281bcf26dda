//! Reads a mesh primitive: its triangles and vertex attributes become a [`Mesh`].

use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use ::gltf::json::{self as gltf, Index};
use glam::Vec3;

use super::accessor::{Accessor, Elements};
use super::attributes::{Attributes, attribute, normalize};
use super::document::Document;
use super::draco;
use super::draco::DecodedPrimitive;
use super::topology;
use super::topology::{MeshSize, VertexOrder};
use crate::error::{LoadError, Warnings};
use blinn_scene::Mesh;

/// A primitive of the file, by its indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct PrimitiveId {
    pub mesh: usize,
    pub primitive: usize,
}

impl PrimitiveId {
    pub fn json<'d>(&self, doc: &'d Document<'_>) -> Option<&'d Primitive> {
        doc.root().meshes.get(self.mesh)?.primitives.get(self.primitive)
    }

    fn location(&self) -> String {
        format!("meshes[{}].primitives[{}]", self.mesh, self.primitive)
    }
}

/// Returns true if a primitive has more than one set of vertex colours, of which only the first is supported.
pub(super) fn has_more_colors(primitive: &Primitive) -> bool {
    primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(1)))
}

/// The topology of a primitive; an unknown mode counts as triangles.
pub(super) fn mode(primitive: &Primitive) -> Mode {
    match primitive.mode {
        Checked::Valid(mode) => mode,
        Checked::Invalid => Mode::Triangles,
    }
}

/// Upper bound of a primitive's vertices (including those of morph targets) and triangles, from the JSON
/// alone.
pub(super) fn max_size(doc: &Document<'_>, primitive: &Primitive) -> MeshSize {
    let count = |i: usize| doc.root().accessors.get(i).map_or(0, |a| a.count.0);
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let positions = positions.map_or(0, |i| count(i.value()));
    let drawn = primitive.indices.map_or(positions, |i| count(i.value()));
    let copies = 1 + primitive.targets.as_ref().map_or(0, Vec::len) as u64;
    let triangles = topology::max_triangles(mode(primitive), drawn);
    if draco::is_compressed(primitive) {
        let vertices = draco::max_count(positions).saturating_mul(copies);
        return MeshSize { vertices, triangles: draco::max_count(triangles) };
    }
    MeshSize { vertices: positions.min(drawn).saturating_mul(copies), triangles }
}

/// Reads a primitive of triangles; `None`, with a warning, if it has nothing to draw.
pub(super) fn read(
    doc: &Document<'_>,
    id: PrimitiveId,
    warnings: &mut Warnings,
) -> Result<Option<Mesh>, LoadError> {
    let Some(json) = id.json(doc) else { return Ok(None) };
    let location = id.location();
    let mut decoded = decode_draco(doc, json, &location, warnings)?;
    let decoded_triangles = decoded.as_mut().map(|p| std::mem::take(&mut p.triangles));
    let decoded = decoded.as_ref();
    let Some(positions) = attribute(doc, json, decoded, Semantic::Positions, warnings)? else {
        warnings.add(&location, "ignored primitive without POSITION");
        return Ok(None);
    };
    if positions.components != 3 {
        let message = format!("has {} components per element; expected 3", positions.components);
        return Err(LoadError::invalid(format_args!("{location}.attributes.POSITION"), message));
    }
    if json.mode == Checked::Invalid {
        warnings.add(format_args!("{location}.mode"), "unknown mode; used TRIANGLES");
    }
    let mut triangles = match decoded_triangles {
        Some(triangles) => triangles,
        None => read_triangles(doc, json, &location, positions.count, warnings)?,
    };
    if triangles.is_empty() {
        warnings.add(&location, "ignored primitive without triangles");
        return Ok(None);
    }
    // Many primitives may each use a small part of one large vertex buffer.
    let used = (json.indices.is_some() || decoded.is_some())
        .then(|| compact(&mut triangles, positions.count))
        .flatten();
    let elements = used.as_ref().map_or(Elements::First(positions.count), |used| Elements::At(used));
    let attributes =
        Attributes { doc, json, decoded, location: &location, vertices: positions.count, elements };

    let normals: Vec<Vec3> = attributes.vec3(Semantic::Normals, warnings)?;
    let normals: Vec<Vec3> = normals.into_iter().map(normalize).collect();
    let mut mesh = Mesh {
        name: doc.root().meshes[id.mesh].name.clone().unwrap_or_default(),
        positions: positions.floats(elements),
        triangles,
        tangents: if normals.is_empty() { Vec::new() } else { attributes.tangents(warnings)? },
        normals,
        uvs: attributes.uvs(warnings)?,
        colors: attributes.colors(warnings)?,
        influences: attributes.influences(warnings)?,
        ..Mesh::default()
    };
    attributes.morph_targets(id.mesh, &mut mesh, warnings)?;
    Ok(Some(mesh))
}

/// Decodes a primitive's Draco stream. If that fails, the uncompressed data is used where the file has it.
fn decode_draco(
    doc: &Document<'_>,
    json: &Primitive,
    location: &str,
    warnings: &mut Warnings,
) -> Result<Option<DecodedPrimitive>, LoadError> {
    if !draco::is_compressed(json) {
        return Ok(None);
    }
    match draco::decode(doc, json, location, max_size(doc, json)) {
        Ok(decoded) => Ok(Some(decoded)),
        Err(error) => {
            let has_data = |index: &Index<gltf::Accessor>| {
                let accessor = doc.root().accessors.get(index.value());
                accessor.is_some_and(|a| a.buffer_view.is_some() || a.sparse.is_some())
            };
            let positions = json.attributes.get(&Checked::Valid(Semantic::Positions));
            if !positions.is_some_and(has_data) || !json.indices.as_ref().is_none_or(has_data) {
                return Err(error);
            }
            warnings.add(location, format_args!("{error}; used the uncompressed data"));
            Ok(None)
        }
    }
}

fn read_triangles(
    doc: &Document<'_>,
    json: &Primitive,
    location: &str,
    vertices: usize,
    warnings: &mut Warnings,
) -> Result<Vec<[u32; 3]>, LoadError> {
    let path = || format!("{location}.indices");
    let order = match json.indices {
        None => VertexOrder::Sequential(vertices as u32),
        Some(index) => {
            let accessor = Accessor::open(doc, index.value(), warnings)?;
            if accessor.components != 1 {
                return Err(LoadError::invalid(path(), "indices are not SCALAR"));
            }
            let indices: Vec<[u32; 1]> = accessor.integers(Elements::First(accessor.count));
            let mut indices = indices.into_flattened();
            if doc.is_truncated() && mode(json) == Mode::Triangles {
                let triangles =
                    indices.chunks_exact(3).filter(|t| t.iter().all(|&v| (v as usize) < vertices));
                indices = triangles.flatten().copied().collect();
            }
            VertexOrder::Indexed { indices, restart: accessor.restart_index() }
        }
    };
    let count = match &order {
        VertexOrder::Sequential(n) => *n as usize,
        VertexOrder::Indexed { indices, .. } => indices.len(),
    };
    let mode = mode(json);
    if mode == Mode::Triangles && count % 3 != 0 {
        let message = format!("ignored the last {} of {count} vertices, which form no triangle", count % 3);
        warnings.add(location, message);
    }
    topology::triangles(mode, &order, vertices as u32, &path)
}

/// Renumbers the vertices if the triangles use only a few of them. Returns the old numbers of the used
/// vertices.
fn compact(triangles: &mut [[u32; 3]], vertices: usize) -> Option<Vec<u32>> {
    if triangles.len().saturating_mul(3) >= vertices {
        return None;
    }
    let mut used: Vec<u32> = triangles.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    for corner in triangles.as_flattened_mut() {
        *corner = used.partition_point(|u| u < corner) as u32;
    }
    Some(used)
}
