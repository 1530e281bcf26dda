//! KHR_draco_mesh_compression: a primitive's triangles and vertices in one Draco stream.

use std::collections::HashMap;

use ::gltf::json::accessor::ComponentType;
use ::gltf::json::mesh::Primitive;
use draco_core::draco_types::DataType;
use draco_core::geometry_attribute::PointAttribute;
use draco_core::geometry_indices::PointIndex;
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use serde_json::Value;

use super::accessor::Accessor;
use super::document::Document;
use crate::import::error::LoadError;

const NAME: &str = "KHR_draco_mesh_compression";
/// Decoders split vertices at seams, so a stream may hold more than its accessors promise; more
/// than twice as many and some is not what exporters write.
const SLACK: u64 = 1024;

/// A decoded stream.
#[derive(Debug)]
pub(super) struct Packed {
    /// All of whose indices are below `vertices`.
    pub triangles: Vec<[u32; 3]>,
    pub vertices: usize,
    attributes: HashMap<String, Values>,
}

/// One attribute, an element for each vertex, tightly packed.
#[derive(Debug)]
struct Values {
    component: ComponentType,
    width: usize,
    normalized: bool,
    bytes: Vec<u8>,
}

fn extension(json: &Primitive) -> Option<&Value> {
    json.extensions.as_ref()?.others.get(NAME)
}

/// True for a primitive with a Draco stream.
pub(super) fn is_packed(json: &Primitive) -> bool {
    extension(json).is_some()
}

/// The most that a stream may hold where its accessors promise `count`.
pub(super) fn most(count: u64) -> u64 {
    count.saturating_mul(2).saturating_add(SLACK)
}

/// Decodes the primitive's stream, of at most so many vertices and triangles.
///
/// # Errors
/// What is wrong with the stream, with its place.
pub(super) fn decode(
    doc: &Document<'_>,
    json: &Primitive,
    place: &str,
    (vertices, triangles): (u64, u64),
) -> Result<Packed, LoadError> {
    let wrong = |what: String| LoadError::invalid(format_args!("{place}.extensions.{NAME}"), what);
    let extension = extension(json).unwrap_or(&Value::Null);
    let view = extension.get("bufferView").and_then(Value::as_u64);
    let view = view.ok_or_else(|| wrong("names no bufferView".into()))?;
    let ids = extension.get("attributes").and_then(Value::as_object).filter(|ids| !ids.is_empty());
    // Without any, encoders know of no vertices, and cut indices to eight bits.
    let ids =
        ids.ok_or_else(|| wrong("names no attributes: save the file without Draco compression".into()))?;
    let bytes = doc.view(view as usize)?.bytes;
    // Room for a dozen attributes of four floats each.
    let limits = DecodeLimits::default()
        .with_max_points(vertices)
        .with_max_faces(triangles)
        .with_max_decoded_bytes(vertices.saturating_mul(256));
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    let decoded = MeshDecoder::new().decode(&mut buffer, &mut mesh);
    decoded.map_err(|e| wrong(format!("the Draco stream cannot be decoded: {e}")))?;

    let count = mesh.num_points();
    if count as u64 > vertices {
        return Err(wrong(format!("the Draco stream has {count} vertices, where up to {vertices} are due")));
    }
    let triangles: Vec<[u32; 3]> = mesh.faces().iter().map(|f| f.map(|p| p.0)).collect();
    if triangles.as_flattened().iter().any(|&v| v as usize >= count) {
        return Err(wrong(format!("the Draco stream names a vertex past its {count}")));
    }
    let mut attributes = HashMap::new();
    for (name, id) in ids {
        let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
        let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
        let attribute = attribute.ok_or_else(|| wrong(format!("the Draco stream has no {name}")))?;
        attributes.insert(name.clone(), values(attribute, count, promised(doc, json, name)));
    }
    Ok(Packed { triangles, vertices: count, attributes })
}

/// What the accessor of that attribute says of `normalized`, where there is one.
fn promised(doc: &Document<'_>, json: &Primitive, name: &str) -> Option<bool> {
    let mut attributes = json.attributes.iter();
    let (_, index) = attributes.find(|(semantic, _)| match semantic {
        ::gltf::json::validation::Checked::Valid(s) => s.to_string() == name,
        ::gltf::json::validation::Checked::Invalid => false,
    })?;
    doc.root().accessors.get(index.value()).map(|a| a.normalized)
}

/// The attribute's value for each vertex; zero where the stream has none.
fn values(attribute: &PointAttribute, count: usize, normalized: Option<bool>) -> Values {
    let width = usize::from(attribute.num_components());
    let component = match attribute.data_type() {
        DataType::Int8 => Some(ComponentType::I8),
        DataType::Uint8 => Some(ComponentType::U8),
        DataType::Int16 => Some(ComponentType::I16),
        DataType::Uint16 => Some(ComponentType::U16),
        DataType::Uint32 => Some(ComponentType::U32),
        DataType::Float32 => Some(ComponentType::F32),
        _ => None,
    };
    let Some(component) = component else {
        // glTF has no such numbers; floats hold any that make sense.
        let floats = attribute.read_f32s(count, width);
        let bytes = floats.into_iter().flat_map(f32::to_le_bytes).collect();
        return Values { component: ComponentType::F32, width, normalized: false, bytes };
    };
    let size = width * component.size();
    let stride = usize::try_from(attribute.byte_stride()).unwrap_or(size);
    let data = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(count * size);
    for vertex in 0..count as u32 {
        let index = attribute.mapped_index(PointIndex(vertex)).0 as usize;
        let at = index.checked_mul(stride).filter(|_| index < attribute.size());
        match at.and_then(|at| data.get(at..at.checked_add(size)?)) {
            Some(element) => bytes.extend_from_slice(element),
            None => bytes.resize(bytes.len() + size, 0),
        }
    }
    let normalized = normalized.unwrap_or(attribute.normalized());
    Values { component, width, normalized, bytes }
}

impl Packed {
    /// The attribute of that name as an accessor, where the stream has it.
    pub fn accessor(&self, name: &str) -> Option<Accessor<'_>> {
        let values = self.attributes.get(name)?;
        Some(Accessor::packed(
            self.vertices,
            values.width,
            values.component,
            values.normalized,
            &values.bytes,
        ))
    }
}
