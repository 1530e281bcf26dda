//! EXT_mesh_primitive_edge_visibility: the edges of triangles that are drawn, and their colours.

use std::collections::HashMap;

use ::gltf::json::accessor::ComponentType;
use ::gltf::json::mesh::Primitive;
use glam::{Vec2, Vec3, Vec4};
use serde_json::Value;

use super::accessor::{Accessor, Elements};
use super::document::Document;
use super::material;
use crate::error::{LoadError, Warnings};
use blinn_scene::{AlphaMode, EdgeMarks, Mesh};

const NAME: &str = "EXT_mesh_primitive_edge_visibility";
/// A side of a triangle that is never drawn, in two bits.
const HIDDEN: u8 = 0;
/// A side of a triangle that is drawn as a silhouette, in two bits.
const SILHOUETTE: u8 = 1;
/// A side of a triangle that is always drawn, in two bits.
const HARD: u8 = 2;
/// The most indices of line strings for each triangle: two for each of its edges, which are there once, and a restart.
const MAX_INDICES_PER_TRIANGLE: usize = 9;

/// Reads the marks of a mesh's edges, if the primitive has any. `kept` are the old numbers of its vertices, if some were
/// removed.
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
    let mut reader = Reader { doc, location, palette: HashMap::new(), marks: EdgeMarks::default() };
    let color = reader.color(extension, "", warnings);
    let mut sides = vec![0u8; mesh.triangles.len()];
    let has_visibility = reader.visibility(extension, &mut sides, warnings)?;
    reader.marks.sides = sides.clone();
    if has_visibility {
        reader.color_marked_sides(color);
    }
    let has_strings = reader.line_strings(extension, color, kept, mesh, warnings)?;
    if has_visibility {
        reader.silhouette_normals(extension, &sides, warnings)?;
    }
    if has_visibility || has_strings {
        mesh.edge_marks = reader.marks;
    }
    Ok(())
}

/// Reads the members of one primitive's extension.
struct Reader<'a, 'd> {
    doc: &'a Document<'d>,
    location: String,
    /// The numbers of colours, from 1 on, by their bits.
    palette: HashMap<[u32; 4], u16>,
    marks: EdgeMarks,
}

impl Reader<'_, '_> {
    /// Reads two bits for each side of each triangle. Returns true if the file has them.
    fn visibility(
        &self,
        extension: &Value,
        sides: &mut [u8],
        warnings: &mut Warnings,
    ) -> Result<bool, LoadError> {
        let Some(index) = extension.get("visibility") else { return Ok(false) };
        let accessor = list(self.doc, index, warnings)?.filter(|a| a.count == (6 * sides.len()).div_ceil(8));
        let Some(accessor) = accessor else {
            warnings.add(
                format_args!("{}.visibility", self.location),
                format_args!(
                    "ignored: expected a byte for every 4 of {} edges of triangles",
                    3 * sides.len()
                ),
            );
            return Ok(false);
        };
        let bytes: Vec<[u32; 1]> = accessor.integers(Elements::First(accessor.count));
        for (triangle, mark) in sides.iter_mut().enumerate() {
            let bits = |side: usize| {
                let bit = 2 * (3 * triangle + side);
                (bytes[bit / 8][0] >> (bit % 8) & 3) as u8
            };
            *mark = bits(0) | bits(1) << 2 | bits(2) << 4;
        }
        Ok(true)
    }

    /// Reads the normals of the faces beside silhouettes, for the sides in `visibility`. Line strings may have changed some.
    fn silhouette_normals(
        &mut self,
        extension: &Value,
        visibility: &[u8],
        warnings: &mut Warnings,
    ) -> Result<(), LoadError> {
        let Some(index) = extension.get("silhouetteNormals") else { return Ok(()) };
        let is_silhouette = |sides: u8, side: usize| sides >> (2 * side) & 3 == SILHOUETTE;
        let all = || visibility.iter().zip(&self.marks.sides).flat_map(|pair| (0..3).map(move |s| (pair, s)));
        let silhouettes = || all().filter(|&((&before, _), side)| is_silhouette(before, side));
        let count = silhouettes().count();
        let accessor = open(self.doc, index, warnings)?.filter(|a| a.count == 2 * count);
        let elements = Elements::First(2 * count);
        let normals: Vec<Vec3> = match accessor {
            Some(a) if a.components == 3 => a.floats(elements),
            // Drafts of the extension have octahedral normals in the two bytes of a number.
            Some(a) if a.components == 1 && a.component_type == ComponentType::U16 => {
                let packed: Vec<[u32; 1]> = a.integers(elements);
                packed.iter().map(|&[packed]| octahedral(packed)).collect()
            }
            _ => {
                warnings.add(
                    format_args!("{}.silhouetteNormals", self.location),
                    format_args!(
                        "ignored: expected 2 normals for each of {count} silhouettes; the triangles decide"
                    ),
                );
                return Ok(());
            }
        };
        let pairs = normals.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
        let is_left = |((_, &now), side): ((&u8, &u8), usize)| is_silhouette(now, side);
        let left: Vec<[Vec3; 2]> =
            pairs.zip(silhouettes()).filter(|(_, at)| is_left(*at)).map(|(pair, _)| pair).collect();
        self.marks.silhouette_normals = left;
        Ok(())
    }

    /// Marks the edges of line strings, each list of which may have a colour of its own. Returns true if the file has some.
    fn line_strings(
        &mut self,
        extension: &Value,
        color: u16,
        kept: Option<&[u32]>,
        mesh: &Mesh,
        warnings: &mut Warnings,
    ) -> Result<bool, LoadError> {
        let strings = extension.get("lineStrings").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        if strings.is_empty() {
            return Ok(false);
        }
        let edges = StringEdges::new(mesh, kept);
        let mut left = MAX_INDICES_PER_TRIANGLE.saturating_mul(mesh.triangles.len());
        let mut has_some = false;
        let mut unknown = 0usize;
        for (i, string) in strings.iter().enumerate() {
            let Some(index) = string.get("indices") else { continue };
            let place = format!(".lineStrings[{i}]");
            let accessor = list(self.doc, index, warnings)?;
            let Some(accessor) = accessor.filter(|accessor| accessor.count <= left) else {
                warnings.add(
                    format_args!("{}{place}.indices", self.location),
                    "ignored: expected an accessor of indices, three for each edge at most",
                );
                continue;
            };
            left -= accessor.count;
            has_some = true;
            let color = match self.color(string, &place, warnings) {
                0 => color,
                own => own,
            };
            let restart = accessor.restart_index();
            let indices: Vec<[u32; 1]> = accessor.integers(Elements::First(accessor.count));
            for run in indices.as_flattened().split(|&index| index == restart) {
                for ends in run.windows(2).filter(|ends| ends[0] != ends[1]) {
                    let sides = edges.beside([ends[0], ends[1]]);
                    unknown += usize::from(sides.is_empty());
                    sides.iter().for_each(|&(triangle, side)| self.mark_hard(triangle, side, color));
                }
            }
        }
        if unknown > 0 {
            warnings.add(
                format_args!("{}.lineStrings", self.location),
                format_args!("ignored {unknown} lines that are no edges of triangles"),
            );
        }
        Ok(has_some)
    }

    fn mark_hard(&mut self, triangle: u32, side: u8, color: u16) {
        let (triangle, side) = (triangle as usize, usize::from(side));
        self.marks.sides[triangle] |= HARD << (2 * side);
        self.set_color(triangle, side, color);
    }

    fn set_color(&mut self, triangle: usize, side: usize, color: u16) {
        if color > 0 && self.marks.side_colors.is_empty() {
            self.marks.side_colors = vec![[0; 3]; self.marks.sides.len()];
        }
        if let Some(colors) = self.marks.side_colors.get_mut(triangle) {
            colors[side] = color;
        }
    }

    fn color_marked_sides(&mut self, color: u16) {
        if color == 0 {
            return;
        }
        for triangle in 0..self.marks.sides.len() {
            for side in 0..3 {
                if self.marks.side(triangle, side) != HIDDEN {
                    self.set_color(triangle, side, color);
                }
            }
        }
    }

    /// Returns the number of the colour of an object's `material`: its base colour without textures, as edges have no
    /// texture coordinates. 0 if it has none.
    fn color(&mut self, json: &Value, place: &str, warnings: &mut Warnings) -> u16 {
        let Some(index) = json.get("material") else { return 0 };
        let materials = &self.doc.root().materials;
        let index = index.as_u64().and_then(|index| usize::try_from(index).ok());
        let Some(json) = index.and_then(|index| materials.get(index)) else {
            warnings
                .add(format_args!("{}{place}.material", self.location), "ignored: there is no such material");
            return 0;
        };
        let material = material::read(json, &mut |_| None);
        let alpha = if material.alpha_mode == AlphaMode::Blend { material.alpha.factor } else { 1.0 };
        let color: Vec4 = material.base_color.factor.extend(alpha.clamp(0.0, 1.0));
        let next = u16::try_from(self.marks.colors.len() + 1);
        let bits = color.to_array().map(f32::to_bits);
        match (self.palette.get(&bits), next) {
            (Some(&number), _) => number,
            (None, Ok(number)) => {
                self.marks.colors.push(color);
                self.palette.insert(bits, number);
                number
            }
            (None, Err(_)) => {
                warnings.add(
                    format_args!("{}{place}.material", self.location),
                    format_args!("ignored: more than {} colours of edges", u16::MAX),
                );
                0
            }
        }
    }
}

/// The sides of a mesh's triangles by the vertices in the file at their ends. Vertices with the same position are one, as
/// normals split them.
struct StringEdges<'a> {
    kept: Option<&'a [u32]>,
    /// For each vertex the first one with the same position.
    welded: Vec<u32>,
    sides: HashMap<[u32; 2], Vec<(u32, u8)>>,
}

impl<'a> StringEdges<'a> {
    fn new(mesh: &Mesh, kept: Option<&'a [u32]>) -> StringEdges<'a> {
        let mut firsts = HashMap::new();
        let weld = |(vertex, p): (u32, &Vec3)| {
            *firsts.entry((*p + 0.0).to_array().map(f32::to_bits)).or_insert(vertex)
        };
        let welded: Vec<u32> = (0..).zip(&mesh.positions).map(weld).collect();
        let mut sides: HashMap<[u32; 2], Vec<(u32, u8)>> = HashMap::new();
        for (triangle, corners) in (0..).zip(&mesh.triangles) {
            let [a, b, c] = corners.map(|corner| welded[corner as usize]);
            for (side, [a, b]) in (0..).zip([[a, b], [b, c], [c, a]]) {
                sides.entry([a.min(b), a.max(b)]).or_default().push((triangle, side));
            }
        }
        StringEdges { kept, welded, sides }
    }

    /// Returns the triangles, with the number of the side, that have an edge between two vertices of the file.
    fn beside(&self, ends: [u32; 2]) -> &[(u32, u8)] {
        let vertex = |in_file: u32| {
            let vertex = match self.kept {
                Some(kept) => kept.binary_search(&in_file).ok()?,
                None => in_file as usize,
            };
            self.welded.get(vertex).copied()
        };
        let [Some(a), Some(b)] = ends.map(vertex) else { return &[] };
        self.sides.get(&[a.min(b), a.max(b)]).map_or(&[], Vec::as_slice)
    }
}

/// Unpacks a unit vector from two bytes: a point of an octahedron that is folded into a square.
fn octahedral(packed: u32) -> Vec3 {
    let byte = |shift: u32| (packed >> shift & 0xff) as f32 / 127.5 - 1.0;
    let point = Vec2::new(byte(0), byte(8));
    let z = 1.0 - point.x.abs() - point.y.abs();
    let fold = (-z).max(0.0);
    let unfolded = point - Vec2::new(fold.copysign(point.x), fold.copysign(point.y));
    unfolded.extend(z).normalize_or_zero()
}

/// Opens an accessor; `None` if there is no such accessor.
fn open<'d>(
    doc: &'d Document<'_>,
    index: &Value,
    warnings: &mut Warnings,
) -> Result<Option<Accessor<'d>>, LoadError> {
    let index = index.as_u64().and_then(|index| usize::try_from(index).ok());
    let Some(index) = index.filter(|&index| index < doc.root().accessors.len()) else { return Ok(None) };
    Accessor::open(doc, index, warnings).map(Some)
}

/// Opens an accessor of whole numbers; `None` if it is none.
fn list<'d>(
    doc: &'d Document<'_>,
    index: &Value,
    warnings: &mut Warnings,
) -> Result<Option<Accessor<'d>>, LoadError> {
    let is_list = |a: &Accessor| a.components == 1 && a.component_type != ComponentType::F32;
    Ok(open(doc, index, warnings)?.filter(is_list))
}
