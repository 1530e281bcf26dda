//! Vertex attributes of a primitive.

use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{Vec2, Vec3, Vec4};

use super::accessor::{Accessor, Elements};
use super::color;
use super::document::Document;
use super::draco::DecodedPrimitive;
use super::target_attributes::UV_SETS;
use crate::error::{LoadError, Warnings};
use crate::finite_uvs::replace_nonfinite;
use blinn_scene::Influences;

/// Supported sets of four joints (JOINTS_n).
const JOINT_SETS: u32 = 16;

/// Four joints and their weights per vertex.
struct JointSet {
    joints: Vec<[u32; 4]>,
    weights: Vec<[f32; 4]>,
}

/// Opens an attribute, from the Draco stream if it has the attribute.
pub(super) fn attribute<'d>(
    doc: &'d Document<'_>,
    json: &Primitive,
    decoded: Option<&'d DecodedPrimitive>,
    name: Semantic,
    warnings: &mut Warnings,
) -> Result<Option<Accessor<'d>>, LoadError> {
    if let Some(accessor) = decoded.and_then(|p| p.accessor(&name.to_string())) {
        return Ok(Some(accessor));
    }
    let index = json.attributes.get(&Checked::Valid(name));
    index.map(|i| Accessor::open(doc, i.value(), warnings)).transpose()
}

/// Opens the positions of a primitive; `None`, with a warning, if it has none.
///
/// # Errors
/// They are not vectors of three numbers, or cannot be read.
pub(super) fn open_positions<'d>(
    doc: &'d Document<'_>,
    json: &Primitive,
    decoded: Option<&'d DecodedPrimitive>,
    location: &str,
    warnings: &mut Warnings,
) -> Result<Option<Accessor<'d>>, LoadError> {
    let Some(positions) = attribute(doc, json, decoded, Semantic::Positions, warnings)? else {
        warnings.add(location, "ignored primitive without POSITION");
        return Ok(None);
    };
    if positions.components != 3 {
        let message = format!("has {} components per element; expected 3", positions.components);
        return Err(LoadError::invalid(format_args!("{location}.attributes.POSITION"), message));
    }
    Ok(Some(positions))
}

/// Normalizes a vector unless its length is 0 or not finite.
pub(super) fn normalize(v: Vec3) -> Vec3 {
    v.try_normalize().unwrap_or(v)
}

/// Reads the vertex attributes of one primitive.
pub(super) struct Attributes<'a, 'd> {
    pub doc: &'d Document<'a>,
    pub json: &'d Primitive,
    /// The decoded Draco stream.
    pub decoded: Option<&'d DecodedPrimitive>,
    /// JSON path of the primitive.
    pub location: &'d str,
    /// Number of positions in the file.
    pub vertices: usize,
    /// The vertices that the primitive uses.
    pub elements: Elements<'d>,
}

impl<'d> Attributes<'_, 'd> {
    /// Opens an attribute. One that does not match the mesh is ignored with a warning.
    fn open(
        &self,
        name: Semantic,
        components: &[usize],
        warnings: &mut Warnings,
    ) -> Result<Option<Accessor<'d>>, LoadError> {
        let location = format!("{}.attributes.{}", self.location, name.to_string());
        let accessor = attribute(self.doc, self.json, self.decoded, name, warnings)?;
        Ok(accessor.filter(|a| self.matches(a, &location, components, warnings)))
    }

    /// Returns false, with a warning, if an accessor has the wrong number of components or too few elements.
    pub fn matches(
        &self,
        accessor: &Accessor<'_>,
        location: &str,
        components: &[usize],
        warnings: &mut Warnings,
    ) -> bool {
        if !components.contains(&accessor.components) {
            let message = format!("ignored attribute with {} components per element", accessor.components);
            warnings.add(location, message);
            return false;
        }
        if accessor.count < self.vertices {
            let message =
                format!("ignored attribute with {} elements for {} vertices", accessor.count, self.vertices);
            warnings.add(location, message);
            return false;
        }
        true
    }

    pub fn vec3(&self, name: Semantic, warnings: &mut Warnings) -> Result<Vec<Vec3>, LoadError> {
        Ok(self.open(name, &[3], warnings)?.map_or_else(Vec::new, |a| a.floats(self.elements)))
    }

    pub fn tangents(&self, warnings: &mut Warnings) -> Result<Vec<Vec4>, LoadError> {
        let Some(accessor) = self.open(Semantic::Tangents, &[4], warnings)? else { return Ok(Vec::new()) };
        let tangents: Vec<Vec4> = accessor.floats(self.elements);
        let clean = |t: Vec4| normalize(t.truncate()).extend(if t.w < 0.0 { -1.0 } else { 1.0 });
        Ok(tangents.into_iter().map(clean).collect())
    }

    /// Reads all sets of texture coordinates; sets that the file lacks are empty.
    pub fn uvs(&self, warnings: &mut Warnings) -> Result<Vec<Vec<Vec2>>, LoadError> {
        let mut sets: Vec<Vec<Vec2>> = Vec::new();
        for name in self.json.attributes.keys() {
            let Checked::Valid(Semantic::TexCoords(set)) = *name else { continue };
            if set >= UV_SETS {
                let location = format!("{}.attributes.TEXCOORD_{set}", self.location);
                warnings
                    .add(location, format_args!("ignored texture coordinates beyond set {}", UV_SETS - 1));
                continue;
            }
            if let Some(accessor) = self.open(Semantic::TexCoords(set), &[2], warnings)? {
                let mut uvs: Vec<Vec2> = accessor.floats(self.elements);
                let replaced = replace_nonfinite(&mut uvs);
                if replaced > 0 {
                    let location = format!("{}.attributes.TEXCOORD_{set}", self.location);
                    let message = format!("{replaced} texture coordinates are not finite; used 0");
                    warnings.add(location, message);
                }
                let set = set as usize;
                sets.resize_with(sets.len().max(set + 1), Vec::new);
                sets[set] = uvs;
            }
        }
        Ok(sets)
    }

    pub fn colors(&self, warnings: &mut Warnings) -> Result<Vec<Vec4>, LoadError> {
        let Some(accessor) = self.open(Semantic::Colors(0), color::COMPONENTS, warnings)? else {
            return Ok(Vec::new());
        };
        let location = format!("{}.attributes.COLOR_0", self.location);
        Ok(color::read(accessor, self.elements, &location, warnings))
    }

    /// Reads COLOR_0 as colours of triangles, if it has one for each of the `triangles` and not for each vertex: VTK
    /// writes the colours of cells so.
    pub fn triangle_colors(
        &self,
        triangles: usize,
        warnings: &mut Warnings,
    ) -> Result<Option<Vec<Vec4>>, LoadError> {
        let accessor = attribute(self.doc, self.json, self.decoded, Semantic::Colors(0), warnings)?;
        let is_per_triangle = |a: &Accessor<'_>| {
            a.count == triangles && a.count != self.vertices && color::COMPONENTS.contains(&a.components)
        };
        let Some(accessor) = accessor.filter(is_per_triangle) else { return Ok(None) };
        let location = format!("{}.attributes.COLOR_0", self.location);
        let message = format!("has a colour for each of the {triangles} triangles, not for each vertex");
        warnings.add(&location, message);
        Ok(Some(color::read(accessor, Elements::First(triangles), &location, warnings)))
    }

    /// Reads joints and weights for skinning. The weights of a vertex are normalized to a sum of 1.
    pub fn influences(&self, warnings: &mut Warnings) -> Result<Influences, LoadError> {
        let mut sets: Vec<JointSet> = Vec::new();
        for set in 0..JOINT_SETS {
            self.warn_unpaired(set, warnings);
            let joints = self.open(Semantic::Joints(set), &[4], warnings)?;
            let weights = self.open(Semantic::Weights(set), &[4], warnings)?;
            let (Some(joints), Some(weights)) = (joints, weights) else { break };
            sets.push(JointSet {
                joints: joints.integers(self.elements),
                weights: weights.floats(self.elements),
            });
        }
        let per_vertex = 4 * sets.len();
        let mut out = Influences { per_vertex, ..Influences::default() };
        for vertex in 0..if sets.is_empty() { 0 } else { self.elements.len() } {
            let first = out.weights.len();
            for JointSet { joints, weights } in &sets {
                out.joints.extend(joints[vertex].map(|j| j.min(u32::from(u16::MAX)) as u16));
                out.weights.extend(weights[vertex].map(|w| if w.is_finite() { w.max(0.0) } else { 0.0 }));
            }
            normalize_weights(&mut out.weights[first..]);
        }
        Ok(out)
    }

    /// Warns of JOINTS_n without WEIGHTS_n and the other way round.
    fn warn_unpaired(&self, set: u32, warnings: &mut Warnings) {
        let has = |name| self.json.attributes.contains_key(&Checked::Valid(name));
        let (present, missing) = match (has(Semantic::Joints(set)), has(Semantic::Weights(set))) {
            (true, false) => ("JOINTS", "WEIGHTS"),
            (false, true) => ("WEIGHTS", "JOINTS"),
            _ => return,
        };
        let location = format!("{}.attributes.{present}_{set}", self.location);
        warnings.add(location, format_args!("ignored attribute without {missing}_{set}"));
    }
}

/// Scales the weights of a vertex to a sum of 1. Weights without a positive finite sum bind the vertex to its
/// first joint.
fn normalize_weights(weights: &mut [f32]) {
    let sum: f32 = weights.iter().sum();
    if sum > 0.0 && sum.is_finite() {
        weights.iter_mut().for_each(|w| *w /= sum);
    } else {
        weights.fill(0.0);
        weights[0] = 1.0;
    }
}
