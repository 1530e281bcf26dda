//! Reads a mesh primitive: its triangles and vertex attributes become a [`Mesh`].

use std::collections::HashMap;

use ::gltf::json::accessor::Type;
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use ::gltf::json::{self as gltf, Index};
use glam::{Vec3, Vec4};

use super::accessor::{Accessor, Elements};
use super::attributes::{Attributes, normalize, open_positions};
use super::color;
use super::document::Document;
use super::draco;
use super::draco::DecodedPrimitive;
use super::edge_visibility;
use super::morph_targets;
use super::topology;
use super::topology::{MeshSize, VertexOrder};
use crate::compact::compact;
use crate::error::{LoadError, Warnings};
use crate::smooth::split_vertices;
use blinn_scene::Mesh;

/// Least bytes of a vertex of a Draco stream.
const MIN_CONVERTED_VERTEX: u64 = 64;

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

    pub(super) fn location(&self) -> String {
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
    // Points that are used twice are two vertices.
    let used = if mode(primitive) == Mode::Points { drawn } else { positions.min(drawn) };
    MeshSize { vertices: used.saturating_mul(copies), triangles }
}

/// Peak bytes of a vertex: its attributes in the scene, and what they are converted from.
pub(super) fn vertex_bytes(doc: &Document<'_>, primitive: &Primitive) -> u64 {
    let bytes = |(semantic, accessor): (&Checked<Semantic>, &Index<gltf::Accessor>)| match semantic {
        Checked::Valid(Semantic::Positions | Semantic::Normals) => 12,
        Checked::Valid(Semantic::Tangents) => 16,
        Checked::Valid(Semantic::TexCoords(_)) => 8,
        Checked::Valid(Semantic::Colors(0)) => {
            let accessor = doc.root().accessors.get(accessor.value());
            // Other colours are read with three components first, or twice.
            let is_read_once =
                accessor.is_some_and(|a| a.type_ == Checked::Valid(Type::Vec4) && !color::may_be_unmarked(a));
            if is_read_once { 16 } else { 32 }
        }
        Checked::Valid(Semantic::Joints(_) | Semantic::Weights(_)) => 32,
        _ => 0,
    };
    let attributes: u64 = primitive.attributes.iter().map(bytes).sum();
    // Decoded streams are in memory beside the mesh.
    if draco::is_compressed(primitive) {
        attributes.saturating_mul(2).max(MIN_CONVERTED_VERTEX)
    } else {
        attributes
    }
}

/// Bytes of the lists of the vertices that points and lines use, beside indices and lines.
pub(super) fn round_list_bytes(doc: &Document<'_>, primitive: &Primitive) -> u64 {
    let lines = max_size(doc, primitive).triangles;
    match mode(primitive) {
        Mode::Points => index_count(doc, primitive).saturating_mul(4),
        // Both ends of each line.
        Mode::Lines | Mode::LineLoop | Mode::LineStrip => lines.saturating_mul(8),
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => 0,
    }
}

/// Number of indices that are in memory as long as triangles are assembled.
pub(super) fn index_count(doc: &Document<'_>, primitive: &Primitive) -> u64 {
    let accessor = primitive.indices.and_then(|i| doc.root().accessors.get(i.value()));
    accessor.map_or(0, |indices| indices.count.0)
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
    let Some(positions) = open_positions(doc, json, decoded, &location, warnings)? else { return Ok(None) };
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
    let is_sparse = triangles.len().saturating_mul(3) < positions.count;
    let used = (is_sparse && (json.indices.is_some() || decoded.is_some())).then(|| compact(&mut triangles));
    let elements = used.as_ref().map_or(Elements::First(positions.count), |used| Elements::At(used));
    let attributes =
        Attributes { doc, json, decoded, location: &location, vertices: positions.count, elements };

    let is_list = mode(json) == Mode::Triangles;
    let triangle_colors = match is_list {
        true => attributes.triangle_colors(triangles.len(), warnings)?,
        false => None,
    };
    let normals: Vec<Vec3> = attributes.vec3(Semantic::Normals, warnings)?;
    let normals: Vec<Vec3> = normals.into_iter().map(normalize).collect();
    let mut mesh = Mesh {
        name: doc.root().meshes[id.mesh].name.clone().unwrap_or_default(),
        positions: positions.floats(elements),
        triangles,
        tangents: if normals.is_empty() { Vec::new() } else { attributes.tangents(warnings)? },
        normals,
        uvs: attributes.uvs(warnings)?,
        colors: if triangle_colors.is_some() { Vec::new() } else { attributes.colors(warnings)? },
        influences: attributes.influences(warnings)?,
        ..Mesh::default()
    };
    morph_targets::read(&attributes, [id.mesh, id.primitive], &mut mesh, warnings)?;
    edge_visibility::read(doc, json, &location, used.as_deref(), &mut mesh, warnings)?;
    if let Some(colors) = triangle_colors {
        let corners = 3 * colors.len() as u64;
        LoadError::check_limit("vertices", corners, doc.limits.vertices)?;
        doc.budget.charge_meshes(corners.saturating_mul(1 + mesh.morph_targets.len() as u64), 0)?;
        color_triangles(&mut mesh, &colors);
    }
    Ok(Some(mesh))
}

/// Gives the triangles of a mesh colours of their own. A vertex is duplicated where the colours of its triangles differ.
fn color_triangles(mesh: &mut Mesh, colors: &[Vec4]) {
    let mut ids: HashMap<[u32; 4], u32> = HashMap::new();
    let corner_ids = colors.iter().flat_map(|color| {
        let next = ids.len() as u32;
        [*ids.entry(color.to_array().map(f32::to_bits)).or_insert(next); 3]
    });
    let corner_ids: Vec<u32> = corner_ids.collect();
    split_vertices(mesh, &corner_ids);
    mesh.colors = vec![Vec4::ONE; mesh.positions.len()];
    for (triangle, &color) in mesh.triangles.iter().zip(colors) {
        triangle.iter().for_each(|&v| mesh.colors[v as usize] = color);
    }
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

/// Reads the order in which a primitive uses its vertices. The incomplete triangles and other parts of a truncated file
/// are left out.
pub(super) fn read_order(
    doc: &Document<'_>,
    json: &Primitive,
    location: &str,
    vertices: usize,
    warnings: &mut Warnings,
) -> Result<VertexOrder, LoadError> {
    let Some(index) = json.indices else { return Ok(VertexOrder::Sequential(vertices as u32)) };
    let accessor = Accessor::open(doc, index.value(), warnings)?;
    if accessor.components != 1 {
        return Err(LoadError::invalid(format_args!("{location}.indices"), "indices are not SCALAR"));
    }
    let indices: Vec<[u32; 1]> = accessor.integers(Elements::First(accessor.count));
    let mut indices = indices.into_flattened();
    if doc.is_truncated() {
        let is_complete = |part: &&[u32]| part.iter().all(|&v| (v as usize) < vertices);
        let size = match mode(json) {
            Mode::Triangles => 3,
            Mode::Lines => 2,
            Mode::Points => 1,
            Mode::TriangleStrip | Mode::TriangleFan | Mode::LineStrip | Mode::LineLoop => 0,
        };
        if size > 0 {
            indices = indices.chunks_exact(size).filter(is_complete).flatten().copied().collect();
        }
    }
    Ok(VertexOrder::Indexed { indices, restart: accessor.restart_index() })
}

fn read_triangles(
    doc: &Document<'_>,
    json: &Primitive,
    location: &str,
    vertices: usize,
    warnings: &mut Warnings,
) -> Result<Vec<[u32; 3]>, LoadError> {
    let order = read_order(doc, json, location, vertices, warnings)?;
    let (mode, count) = (mode(json), order.len());
    if mode == Mode::Triangles && count % 3 != 0 {
        let message = format!("ignored the last {} of {count} vertices, which form no triangle", count % 3);
        warnings.add(location, message);
    }
    topology::triangles(mode, &order, vertices as u32, &|| format!("{location}.indices"))
}
