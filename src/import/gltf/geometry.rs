//! A primitive to a mesh.

use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use ::gltf::json::{self as gltf, Index};
use glam::{Vec2, Vec3, Vec4};

use super::accessor::{Accessor, Pick};
use super::color;
use super::document::Document;
use super::draco;
use super::draco::Packed;
use super::topology;
use super::topology::Order;
use crate::import::error::{LoadError, Warnings};
use crate::scene::{Influences, Mesh, MorphTarget};

/// Sets of texture coordinates that are read; no file known has more than a handful.
const UV_SETS: u32 = 32;
/// Sets of four joints that are read.
const JOINT_SETS: u32 = 16;

/// Four joints and their weights for each vertex.
type JointSet = (Vec<[u32; 4]>, Vec<[f32; 4]>);

/// A primitive of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct PrimitiveId {
    pub mesh: usize,
    pub primitive: usize,
}

impl PrimitiveId {
    /// What the file says of it.
    pub fn json<'d>(&self, doc: &'d Document<'_>) -> Option<&'d Primitive> {
        doc.root().meshes.get(self.mesh)?.primitives.get(self.primitive)
    }

    fn place(&self) -> String {
        format!("meshes[{}].primitives[{}]", self.mesh, self.primitive)
    }
}

/// Whether a primitive has vertex colours that are not shown.
pub(super) fn has_more_colors(primitive: &Primitive) -> bool {
    primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(1)))
}

/// What a primitive is drawn as; unknown modes count as triangles.
pub(super) fn mode(primitive: &Primitive) -> Mode {
    match primitive.mode {
        Checked::Valid(mode) => mode,
        Checked::Invalid => Mode::Triangles,
    }
}

/// How many vertices and triangles a primitive asks for, before anything of it is read.
pub(super) fn size(doc: &Document<'_>, primitive: &Primitive) -> (u64, u64) {
    let count = |i: usize| doc.root().accessors.get(i).map_or(0, |a| a.count.0);
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let positions = positions.map_or(0, |i| count(i.value()));
    let drawn = primitive.indices.map_or(positions, |i| count(i.value()));
    let copies = 1 + primitive.targets.as_ref().map_or(0, Vec::len) as u64;
    let triangles = topology::most_triangles(mode(primitive), drawn);
    if draco::is_packed(primitive) {
        return (draco::most(positions).saturating_mul(copies), draco::most(triangles));
    }
    (positions.min(drawn).saturating_mul(copies), triangles)
}

/// Reads a primitive of triangles; `None` where there is nothing to draw.
pub(super) fn read(
    doc: &Document<'_>,
    id: PrimitiveId,
    warnings: &mut Warnings,
) -> Result<Option<Mesh>, LoadError> {
    let Some(json) = id.json(doc) else { return Ok(None) };
    let place = id.place();
    let mut packed = unpack(doc, json, &place, warnings)?;
    let unpacked = packed.as_mut().map(|p| std::mem::take(&mut p.triangles));
    let packed = packed.as_ref();
    let Some(positions) = accessor(doc, json, packed, Semantic::Positions, warnings)? else {
        warnings.add(&place, "has no POSITION, and is not drawn");
        return Ok(None);
    };
    if positions.width != 3 {
        let rule = format!("has {} numbers an element, where 3 are needed", positions.width);
        return Err(LoadError::invalid(format_args!("{place}.attributes.POSITION"), rule));
    }
    if json.mode == Checked::Invalid {
        warnings.add(format_args!("{place}.mode"), "is unknown; drawn as triangles");
    }
    let mut triangles = match unpacked {
        Some(triangles) => triangles,
        None => triangles(doc, json, &place, positions.count, warnings)?,
    };
    if triangles.is_empty() {
        warnings.add(&place, "has no triangles");
        return Ok(None);
    }
    // Many primitives may each use a small part of one large set of vertices.
    let used = (json.indices.is_some() || packed.is_some())
        .then(|| compact(&mut triangles, positions.count))
        .flatten();
    let pick = used.as_ref().map_or(Pick::First(positions.count), |used| Pick::These(used));
    let attributes = Attributes { doc, json, packed, place: &place, vertices: positions.count, pick };

    let normals: Vec<Vec3> = attributes.vec3(Semantic::Normals, warnings)?;
    let normals: Vec<Vec3> = normals.into_iter().map(unit).collect();
    let mut mesh = Mesh {
        name: doc.root().meshes[id.mesh].name.clone().unwrap_or_default(),
        positions: positions.floats(pick),
        triangles,
        tangents: if normals.is_empty() { Vec::new() } else { attributes.tangents(warnings)? },
        normals,
        uvs: attributes.uvs(warnings)?,
        colors: attributes.colors(warnings)?,
        influences: attributes.influences(warnings)?,
        ..Mesh::default()
    };
    attributes.morph_targets(id, &mut mesh, warnings)?;
    Ok(Some(mesh))
}

/// Decodes a primitive's Draco stream. One that is broken costs nothing where the file holds the
/// same uncompressed.
fn unpack(
    doc: &Document<'_>,
    json: &Primitive,
    place: &str,
    warnings: &mut Warnings,
) -> Result<Option<Packed>, LoadError> {
    if !draco::is_packed(json) {
        return Ok(None);
    }
    match draco::decode(doc, json, place, size(doc, json)) {
        Ok(packed) => Ok(Some(packed)),
        Err(error) => {
            let stored = |index: &Index<gltf::Accessor>| {
                let accessor = doc.root().accessors.get(index.value());
                accessor.is_some_and(|a| a.buffer_view.is_some() || a.sparse.is_some())
            };
            let positions = json.attributes.get(&Checked::Valid(Semantic::Positions));
            if !positions.is_some_and(stored) || !json.indices.as_ref().is_none_or(stored) {
                return Err(error);
            }
            warnings.add(place, format_args!("{error}; the uncompressed data is used"));
            Ok(None)
        }
    }
}

/// Opens an attribute, from the Draco stream where that has it.
fn accessor<'d>(
    doc: &'d Document<'_>,
    json: &Primitive,
    packed: Option<&'d Packed>,
    name: Semantic,
    warnings: &mut Warnings,
) -> Result<Option<Accessor<'d>>, LoadError> {
    if let Some(found) = packed.and_then(|p| p.accessor(&name.to_string())) {
        return Ok(Some(found));
    }
    let index = json.attributes.get(&Checked::Valid(name));
    index.map(|i| Accessor::open(doc, i.value(), warnings)).transpose()
}

fn triangles(
    doc: &Document<'_>,
    json: &Primitive,
    place: &str,
    vertices: usize,
    warnings: &mut Warnings,
) -> Result<Vec<[u32; 3]>, LoadError> {
    let path = || format!("{place}.indices");
    let order = match json.indices {
        None => Order::Counting(vertices as u32),
        Some(index) => {
            let accessor = Accessor::open(doc, index.value(), warnings)?;
            if accessor.width != 1 {
                return Err(LoadError::invalid(path(), "are not SCALAR"));
            }
            let indices: Vec<[u32; 1]> = accessor.integers(Pick::First(accessor.count));
            Order::Listed { indices: indices.into_flattened(), restart: accessor.largest() }
        }
    };
    let count = match &order {
        Order::Counting(n) => *n as usize,
        Order::Listed { indices, .. } => indices.len(),
    };
    let mode = mode(json);
    if mode == Mode::Triangles && count % 3 != 0 {
        let what = format!("{count} vertices make no whole triangles; the last {} are left out", count % 3);
        warnings.add(place, what);
    }
    topology::triangles(mode, &order, vertices as u32, &path)
}

/// Numbers the vertices that triangles use afresh where those are few; gives their old numbers.
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

/// Unit length where there is a length.
fn unit(v: Vec3) -> Vec3 {
    v.try_normalize().unwrap_or(v)
}

/// Reads a primitive's vertex attributes.
struct Attributes<'a, 'd> {
    doc: &'d Document<'a>,
    json: &'d Primitive,
    packed: Option<&'d Packed>,
    place: &'d str,
    vertices: usize,
    pick: Pick<'d>,
}

impl<'d> Attributes<'_, 'd> {
    /// Opens an attribute; one that does not fit its mesh is left out with a warning.
    fn open(
        &self,
        name: Semantic,
        widths: &[usize],
        warnings: &mut Warnings,
    ) -> Result<Option<Accessor<'d>>, LoadError> {
        let place = format!("{}.attributes.{}", self.place, name.to_string());
        let accessor = accessor(self.doc, self.json, self.packed, name, warnings)?;
        Ok(accessor.filter(|a| self.fits(a, &place, widths, warnings)))
    }

    /// False, with a warning, for numbers that do not fit the mesh.
    fn fits(&self, accessor: &Accessor<'_>, place: &str, widths: &[usize], warnings: &mut Warnings) -> bool {
        if !widths.contains(&accessor.width) {
            warnings.add(place, format_args!("has {} numbers an element; left out", accessor.width));
            return false;
        }
        if accessor.count < self.vertices {
            let (has, needs) = (accessor.count, self.vertices);
            warnings.add(place, format_args!("has {has} elements for {needs} vertices; left out"));
            return false;
        }
        true
    }

    fn vec3(&self, name: Semantic, warnings: &mut Warnings) -> Result<Vec<Vec3>, LoadError> {
        Ok(self.open(name, &[3], warnings)?.map_or_else(Vec::new, |a| a.floats(self.pick)))
    }

    fn tangents(&self, warnings: &mut Warnings) -> Result<Vec<Vec4>, LoadError> {
        let Some(accessor) = self.open(Semantic::Tangents, &[4], warnings)? else { return Ok(Vec::new()) };
        let tangents: Vec<Vec4> = accessor.floats(self.pick);
        let clean = |t: Vec4| unit(t.truncate()).extend(if t.w < 0.0 { -1.0 } else { 1.0 });
        Ok(tangents.into_iter().map(clean).collect())
    }

    fn uvs(&self, warnings: &mut Warnings) -> Result<Vec<Vec<Vec2>>, LoadError> {
        let mut sets: Vec<Vec<Vec2>> = Vec::new();
        for name in self.json.attributes.keys() {
            let Checked::Valid(Semantic::TexCoords(set)) = *name else { continue };
            if set >= UV_SETS {
                let place = format!("{}.attributes.TEXCOORD_{set}", self.place);
                warnings.add(place, format_args!("sets from {UV_SETS} on are left out"));
                continue;
            }
            if let Some(accessor) = self.open(Semantic::TexCoords(set), &[2], warnings)? {
                let set = set as usize;
                sets.resize_with(sets.len().max(set + 1), Vec::new);
                sets[set] = accessor.floats(self.pick);
            }
        }
        Ok(sets)
    }

    fn colors(&self, warnings: &mut Warnings) -> Result<Vec<Vec4>, LoadError> {
        let Some(accessor) = self.open(Semantic::Colors(0), color::WIDTHS, warnings)? else {
            return Ok(Vec::new());
        };
        let place = format!("{}.attributes.COLOR_0", self.place);
        Ok(color::read(accessor, self.pick, &place, warnings))
    }

    fn influences(&self, warnings: &mut Warnings) -> Result<Influences, LoadError> {
        let mut sets: Vec<JointSet> = Vec::new();
        for set in 0..JOINT_SETS {
            let has = |name| self.json.attributes.contains_key(&Checked::Valid(name));
            let alone = match (has(Semantic::Joints(set)), has(Semantic::Weights(set))) {
                (true, false) => Some(("JOINTS", "WEIGHTS")),
                (false, true) => Some(("WEIGHTS", "JOINTS")),
                _ => None,
            };
            if let Some((one, other)) = alone {
                let place = format!("{}.attributes.{one}_{set}", self.place);
                warnings.add(place, format_args!("there is no {other}_{set} with it; left out"));
            }
            let joints = self.open(Semantic::Joints(set), &[4], warnings)?;
            let weights = self.open(Semantic::Weights(set), &[4], warnings)?;
            let (Some(joints), Some(weights)) = (joints, weights) else { break };
            sets.push((joints.integers(self.pick), weights.floats(self.pick)));
        }
        let per_vertex = 4 * sets.len();
        let mut out = Influences { per_vertex, ..Influences::default() };
        for vertex in 0..if sets.is_empty() { 0 } else { self.pick.len() } {
            let first = out.weights.len();
            for (joints, weights) in &sets {
                out.joints.extend(joints[vertex].map(|j| j.min(u32::from(u16::MAX)) as u16));
                out.weights.extend(weights[vertex].map(|w| if w.is_finite() { w.max(0.0) } else { 0.0 }));
            }
            // Weights that say nothing leave the vertex to its first joint.
            let own = &mut out.weights[first..];
            let sum: f32 = own.iter().sum();
            if sum > 0.0 && sum.is_finite() {
                own.iter_mut().for_each(|w| *w /= sum);
            } else {
                own.fill(0.0);
                own[0] = 1.0;
            }
        }
        Ok(out)
    }

    fn morph_targets(
        &self,
        id: PrimitiveId,
        mesh: &mut Mesh,
        warnings: &mut Warnings,
    ) -> Result<(), LoadError> {
        let json = &self.doc.root().meshes[id.mesh];
        let names = json.extras.as_ref().map_or_else(Vec::new, |e| target_names(e.get()));
        for (i, target) in self.json.targets.iter().flatten().enumerate() {
            let mut read = |index: Option<Index<_>>, name: &str, wanted: bool| {
                let Some(index) = index.filter(|_| wanted) else { return Ok(Vec::new()) };
                let place = format!("{}.targets[{i}].{name}", self.place);
                let accessor = Accessor::open(self.doc, index.value(), warnings)?;
                let fits = self.fits(&accessor, &place, &[3], warnings);
                Ok::<Vec<Vec3>, LoadError>(if fits { accessor.floats(self.pick) } else { Vec::new() })
            };
            mesh.morph_targets.push(MorphTarget {
                name: names.get(i).cloned().unwrap_or_default(),
                positions: read(target.positions, "POSITION", true)?,
                normals: read(target.normals, "NORMAL", !mesh.normals.is_empty())?,
                tangents: read(target.tangents, "TANGENT", !mesh.tangents.is_empty())?,
            });
        }
        mesh.morph_weights = json.weights.clone().unwrap_or_default();
        mesh.morph_weights.resize(mesh.morph_targets.len(), 0.0);
        Ok(())
    }
}

/// The names of morph targets, which exporters keep in the mesh's extras.
fn target_names(extras: &str) -> Vec<String> {
    let names = serde_json::from_str::<serde_json::Value>(extras).ok();
    let names = names.as_ref().and_then(|v| v.get("targetNames")).and_then(|v| v.as_array());
    names.into_iter().flatten().map(|n| n.as_str().unwrap_or_default().to_string()).collect()
}
