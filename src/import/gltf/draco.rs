//! KHR_draco_mesh_compression: decodes a primitive's triangles and vertices from a Draco stream.

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
use super::topology::MeshSize;
use crate::error::LoadError;

const NAME: &str = "KHR_draco_mesh_compression";
/// A stream may have more vertices than its accessors, since encoders split vertices at seams: up to twice as
/// many and this number.
const SLACK: u64 = 1024;

/// A decoded Draco stream.
#[derive(Debug)]
pub(super) struct DecodedPrimitive {
    /// Triangles whose indices are below `vertices`.
    pub triangles: Vec<[u32; 3]>,
    pub vertices: usize,
    attributes: HashMap<String, DecodedAttribute>,
}

/// A decoded attribute: one element per vertex, tightly packed.
#[derive(Debug)]
struct DecodedAttribute {
    component_type: ComponentType,
    components: usize,
    normalized: bool,
    bytes: Vec<u8>,
}

fn extension(json: &Primitive) -> Option<&Value> {
    json.extensions.as_ref()?.others.get(NAME)
}

/// Returns true for a primitive with a Draco stream.
pub(super) fn is_compressed(json: &Primitive) -> bool {
    extension(json).is_some()
}

/// Largest number of vertices or triangles of a stream whose accessors have `count`.
pub(super) fn max_count(count: u64) -> u64 {
    count.saturating_mul(2).saturating_add(SLACK)
}

/// Decodes the primitive's stream within the limits `max`.
///
/// # Errors
/// The stream is missing, damaged or exceeds the limits.
pub(super) fn decode(
    doc: &Document<'_>,
    json: &Primitive,
    location: &str,
    max: MeshSize,
) -> Result<DecodedPrimitive, LoadError> {
    let invalid = |message: String| LoadError::invalid(format_args!("{location}.extensions.{NAME}"), message);
    let extension = extension(json).unwrap_or(&Value::Null);
    let view = extension.get("bufferView").and_then(Value::as_u64);
    let view = view.ok_or_else(|| invalid("bufferView is missing".into()))?;
    let ids = extension.get("attributes").and_then(Value::as_object).filter(|ids| !ids.is_empty());
    // Encoders write such streams with indices truncated to eight bits.
    let ids =
        ids.ok_or_else(|| invalid("attributes are missing; save the file without Draco compression".into()))?;
    let bytes = doc.buffer_view(view as usize)?.bytes;
    // 256 bytes per vertex hold sixteen attributes of four floats.
    let limits = DecodeLimits::default()
        .with_max_points(max.vertices)
        .with_max_faces(max.triangles)
        .with_max_decoded_bytes(max.vertices.saturating_mul(256));
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    let decoded = MeshDecoder::new().decode(&mut buffer, &mut mesh);
    decoded.map_err(|e| invalid(format!("the Draco stream cannot be decoded: {e}")))?;

    let count = mesh.num_points();
    if count as u64 > max.vertices {
        let message = format!("the Draco stream has {count} vertices; at most {} are allowed", max.vertices);
        return Err(invalid(message));
    }
    let triangles: Vec<[u32; 3]> = mesh.faces().iter().map(|f| f.map(|p| p.0)).collect();
    if triangles.as_flattened().iter().any(|&v| v as usize >= count) {
        return Err(invalid(format!("the Draco stream has an index beyond its {count} vertices")));
    }
    let mut attributes = HashMap::new();
    for (name, id) in ids {
        let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
        let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
        let attribute = attribute.ok_or_else(|| invalid(format!("the Draco stream has no {name}")))?;
        attributes.insert(name.clone(), decode_attribute(attribute, count, is_normalized(doc, json, name)));
    }
    Ok(DecodedPrimitive { triangles, vertices: count, attributes })
}

/// The `normalized` property of the attribute's accessor, if there is one.
fn is_normalized(doc: &Document<'_>, json: &Primitive, name: &str) -> Option<bool> {
    let mut attributes = json.attributes.iter();
    let (_, index) = attributes.find(|(semantic, _)| match semantic {
        ::gltf::json::validation::Checked::Valid(s) => s.to_string() == name,
        ::gltf::json::validation::Checked::Invalid => false,
    })?;
    doc.root().accessors.get(index.value()).map(|a| a.normalized)
}

/// Reads the attribute's value of each vertex; zero where the stream has none.
fn decode_attribute(attribute: &PointAttribute, count: usize, normalized: Option<bool>) -> DecodedAttribute {
    let components = usize::from(attribute.num_components());
    let component_type = match attribute.data_type() {
        DataType::Int8 => Some(ComponentType::I8),
        DataType::Uint8 => Some(ComponentType::U8),
        DataType::Int16 => Some(ComponentType::I16),
        DataType::Uint16 => Some(ComponentType::U16),
        DataType::Uint32 => Some(ComponentType::U32),
        DataType::Float32 => Some(ComponentType::F32),
        _ => None,
    };
    let Some(component_type) = component_type else {
        // A type that glTF lacks is converted to floats.
        let floats = attribute.read_f32s(count, components);
        let bytes = floats.into_iter().flat_map(f32::to_le_bytes).collect();
        return DecodedAttribute { component_type: ComponentType::F32, components, normalized: false, bytes };
    };
    let size = components * component_type.size();
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
    DecodedAttribute { component_type, components, normalized, bytes }
}

impl DecodedPrimitive {
    /// An accessor of the named attribute, if the stream has it.
    pub fn accessor(&self, name: &str) -> Option<Accessor<'_>> {
        let DecodedAttribute { component_type, components, normalized, bytes } = self.attributes.get(name)?;
        Some(Accessor::tightly_packed(self.vertices, *components, *component_type, *normalized, bytes))
    }
}
