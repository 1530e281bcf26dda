//! Vertices, faces, triangle strips and edges of a PLY file.

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::header::{Element, Encoding, Kind, Property, Type};
use super::values::{Stop, Values};
use crate::polygons::meshes_bytes::{COLOR, NORMAL, POSITION, UV};
use crate::polygons::polygon_mesh::PolygonMesh;
use blinn_core::cancellation::CancelToken;

/// Number of rows between two looks at the cancellation.
const CANCEL_INTERVAL: u64 = 1 << 16;

/// Names of the columns of vertices, in the order of [`VertexColumn`].
const VERTEX_COLUMNS: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
    &["alpha", "a", "diffuse_alpha"],
    &["s", "u", "texture_u", "texture_s"],
    &["t", "v", "texture_v", "texture_t"],
];
const FACE_COLORS: [&[&str]; 4] =
    [VERTEX_COLUMNS[6], VERTEX_COLUMNS[7], VERTEX_COLUMNS[8], VERTEX_COLUMNS[9]];
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];
const CORNER_UVS: [&str; 1] = ["texcoord"];
const TEXTURE: [&str; 1] = ["texnumber"];
const EDGE_ENDS: [&str; 2] = ["vertex1", "vertex2"];

/// Bytes of an index in the mesh.
const INDEX: u64 = 4;

/// The reason why the rows of an element end early.
pub(super) enum RowError {
    /// The file ends after this number of rows.
    End(u64),
    /// A row is invalid.
    Invalid {
        row: u64,
        reason: String,
    },
    Cancelled,
}

/// The content of a file as it is read.
#[derive(Default)]
pub(super) struct Content {
    pub mesh: PolygonMesh,
    /// Displayed colours of faces.
    pub face_colors: Vec<Vec4>,
    /// Displayed colours of vertices.
    pub colors: Vec<Vec4>,
    /// Displayed colours of edges.
    pub edge_colors: Vec<Vec4>,
    /// The image of each face.
    pub textures: Vec<u32>,
    /// Number of faces with fewer than three corners.
    pub degenerate: u64,
}

/// Reads all rows of an element. `row` reads one.
fn read_rows(
    element: &Element,
    values: &mut Values,
    cancel: &CancelToken,
    mut row: impl FnMut(&mut Values) -> Result<(), Stop>,
) -> Result<(), RowError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for i in 0..element.rows {
        if i % CANCEL_INTERVAL == 0 {
            cancel.check().map_err(|_| RowError::Cancelled)?;
        }
        match row(values) {
            Ok(()) => values.end_row(),
            Err(Stop::End) => return Err(RowError::End(i)),
            Err(Stop::NoNumber(text)) => {
                return Err(RowError::Invalid { row: i, reason: format!("'{text}' is not a number") });
            }
        }
    }
    Ok(())
}

/// Reads a list. Calls `item` for each of its values.
#[inline]
fn read_list(values: &mut Values, length: Type, kind: Type, mut item: impl FnMut(f64)) -> Result<(), Stop> {
    let count = values.read(length)?;
    // A negative or fractional length is as wrong as a value that is no number.
    if !(count >= 0.0 && count.fract() == 0.0) {
        return Err(Stop::NoNumber(format!("a list of {count} items")));
    }
    // The file ends before a list that is too long does.
    for _ in 0..count as u64 {
        item(values.read(kind)?);
    }
    Ok(())
}

/// Reads a property without use.
fn skip(property: &Property, values: &mut Values) -> Result<(), Stop> {
    match property.kind {
        Kind::Scalar(kind) => values.read(kind).map(drop),
        Kind::List { length, item } => read_list(values, length, item, |_| ()),
    }
}

/// Reads an element without use.
pub(super) fn skip_rows(
    element: &Element,
    values: &mut Values,
    cancel: &CancelToken,
) -> Result<(), RowError> {
    read_rows(element, values, cancel, |values| {
        element.properties.iter().try_for_each(|property| skip(property, values))
    })
}

/// Returns the number of rows to reserve memory for: no more than the file can have.
pub(super) fn expected_rows(element: &Element, encoding: Encoding, remaining: usize) -> u64 {
    element.rows.min((remaining / element.min_row_bytes(encoding)) as u64 + 1)
}

/// Returns the bytes of a row of an element in the mesh. Faces count as triangles.
pub(super) fn row_bytes(element: &Element) -> u64 {
    let has = |names: &[&str], bytes: u64| if element.has(names) { bytes } else { 0 };
    match element.name.as_str() {
        "vertex" => {
            let [normals, colors, uvs] = [VERTEX_COLUMNS[3], VERTEX_COLUMNS[6], VERTEX_COLUMNS[10]];
            POSITION + has(normals, NORMAL) + has(colors, COLOR) + has(uvs, UV)
        }
        "face" => {
            3 * INDEX + has(FACE_COLORS[0], COLOR) + has(&CORNER_UVS, 3 * UV) + has(&TEXTURE, 2 * INDEX)
        }
        "edge" => 2 * INDEX + has(FACE_COLORS[0], COLOR),
        _ => 0,
    }
}

impl Content {
    /// Reads the vertices, relative to `origin`.
    pub fn read_vertices(
        &mut self,
        element: &Element,
        values: &mut Values,
        origin: DVec3,
        cancel: &CancelToken,
    ) -> Result<(), RowError> {
        let column = |property: &Property| {
            let index = VERTEX_COLUMNS.iter().position(|names| names.contains(&property.name.as_str()));
            let is_color = index.is_some_and(|index| (6..10).contains(&index));
            match property.kind {
                Kind::Scalar(kind) => index.map(|i| (i, if is_color { kind.color_scale() } else { 1.0 })),
                Kind::List { .. } => None,
            }
        };
        let columns: Vec<Option<(usize, f64)>> = element.properties.iter().map(column).collect();
        let has = |range: std::ops::Range<usize>| {
            range.into_iter().all(|index| columns.iter().flatten().any(|(column, _)| *column == index))
        };
        let (has_normals, has_colors, has_uvs) = (has(3..6), has(6..9), has(10..12));
        let expected = self.mesh.positions.capacity();
        self.mesh.normals.reserve_exact(if has_normals { expected } else { 0 });
        self.colors.reserve_exact(if has_colors { expected } else { 0 });
        read_rows(element, values, cancel, |values| {
            let mut row = [0.0; 12];
            row[9] = 1.0;
            for (property, column) in element.properties.iter().zip(&columns) {
                match (property.kind, column) {
                    (Kind::Scalar(kind), Some((index, scale))) => row[*index] = values.read(kind)? / scale,
                    _ => skip(property, values)?,
                }
            }
            let [x, y, z, nx, ny, nz, r, g, b, a, s, t] = row;
            self.mesh.positions.push((DVec3::new(x, y, z) - origin).as_vec3());
            if has_normals {
                self.mesh.normals.push(Vec3::new(nx as f32, ny as f32, nz as f32));
            }
            if has_colors {
                self.colors.push(Vec4::new(r as f32, g as f32, b as f32, a as f32));
            }
            if has_uvs {
                self.mesh.uvs.push(Vec2::new(s as f32, (1.0 - t) as f32));
            }
            Ok(())
        })
    }

    /// Reads the faces.
    pub fn read_faces(
        &mut self,
        element: &Element,
        values: &mut Values,
        cancel: &CancelToken,
    ) -> Result<(), RowError> {
        let (columns, has_colors) = color_columns(element);
        let (has_uvs, has_textures) = (element.has(&CORNER_UVS), element.has(&TEXTURE));
        let mut uvs: Vec<f64> = Vec::new();
        read_rows(element, values, cancel, |values| {
            let first = self.mesh.corners.len();
            let (mut color, mut texture) = ([0.0, 0.0, 0.0, 1.0], 0.0);
            uvs.clear();
            for (property, column) in element.properties.iter().zip(&columns) {
                let name = property.name.as_str();
                match (property.kind, column) {
                    (Kind::List { length, item }, _) if INDICES.contains(&name) => {
                        read_list(values, length, item, |index| self.mesh.corners.push(vertex_index(index)))?;
                    }
                    (Kind::List { length, item }, _) if CORNER_UVS.contains(&name) => {
                        read_list(values, length, item, |value| uvs.push(value))?;
                    }
                    (Kind::Scalar(kind), _) if TEXTURE.contains(&name) => texture = values.read(kind)?,
                    (Kind::Scalar(kind), Some((index, scale))) => color[*index] = values.read(kind)? / scale,
                    _ => skip(property, values)?,
                }
            }
            let arity = self.mesh.corners.len() - first;
            if !self.mesh.push_face(first) {
                self.degenerate += 1;
                return Ok(());
            }
            if has_colors {
                self.face_colors.push(Vec4::from_array(color.map(|channel| channel as f32)));
            }
            if has_uvs {
                let corner = |i: usize| match uvs.get(2 * i..2 * i + 2) {
                    Some(&[s, t]) if uvs.len() == 2 * arity => Vec2::new(s as f32, (1.0 - t) as f32),
                    _ => Vec2::ZERO,
                };
                self.mesh.corner_uvs.extend((0..arity).map(corner));
            }
            if has_textures {
                self.textures.push(if texture >= 0.0 { texture as u32 } else { 0 });
            }
            Ok(())
        })
    }

    /// Reads edges: pairs of vertices with an optional colour.
    pub fn read_edges(
        &mut self,
        element: &Element,
        values: &mut Values,
        cancel: &CancelToken,
    ) -> Result<(), RowError> {
        if !EDGE_ENDS.iter().all(|end| element.has(&[end])) {
            return skip_rows(element, values, cancel);
        }
        let (columns, has_colors) = color_columns(element);
        read_rows(element, values, cancel, |values| {
            let (mut color, mut ends) = ([0.0, 0.0, 0.0, 1.0], [0; 2]);
            for (property, column) in element.properties.iter().zip(&columns) {
                let end = EDGE_ENDS.iter().position(|end| *end == property.name);
                match (property.kind, end, column) {
                    (Kind::Scalar(kind), Some(end), _) => ends[end] = vertex_index(values.read(kind)?),
                    (Kind::Scalar(kind), _, Some((index, scale))) => {
                        color[*index] = values.read(kind)? / scale;
                    }
                    _ => skip(property, values)?,
                }
            }
            self.mesh.edges.push(ends);
            if has_colors {
                self.edge_colors.push(Vec4::from_array(color.map(|channel| channel as f32)));
            }
            Ok(())
        })
    }

    /// Reads triangle strips: lists of vertices in which a negative number begins a new strip.
    pub fn read_strips(
        &mut self,
        element: &Element,
        values: &mut Values,
        cancel: &CancelToken,
    ) -> Result<(), RowError> {
        read_rows(element, values, cancel, |values| {
            for property in &element.properties {
                let Kind::List { length, item } = property.kind else {
                    skip(property, values)?;
                    continue;
                };
                let mut last: Option<(u32, u32)> = None;
                let mut before: Option<u32> = None;
                let mut flip = false;
                read_list(values, length, item, |index| {
                    if index < 0.0 {
                        (last, before, flip) = (None, None, false);
                        return;
                    }
                    let c = vertex_index(index);
                    if let Some((a, b)) = last {
                        let first = self.mesh.corners.len();
                        self.mesh.corners.extend(if flip { [b, a, c] } else { [a, b, c] });
                        self.mesh.push_face(first);
                        flip = !flip;
                        last = Some((b, c));
                    } else if let Some(a) = before {
                        last = Some((a, c));
                    } else {
                        before = Some(c);
                    }
                })?;
            }
            Ok(())
        })
    }
}

/// Returns the channel and the scale of each property of faces or edges that is part of their colour, and true if they
/// have red, green and blue.
fn color_columns(element: &Element) -> (Vec<Option<(usize, f64)>>, bool) {
    let color_column = |property: &Property| match property.kind {
        Kind::Scalar(kind) => {
            let index = FACE_COLORS.iter().position(|names| names.contains(&property.name.as_str()));
            index.map(|index| (index, kind.color_scale()))
        }
        Kind::List { .. } => None,
    };
    let columns: Vec<Option<(usize, f64)>> = element.properties.iter().map(color_column).collect();
    let has_colors = (0..3).all(|index| columns.iter().flatten().any(|(column, _)| *column == index));
    (columns, has_colors)
}

/// Returns an index of a vertex; one that no vertex has for a number that is none.
fn vertex_index(value: f64) -> u32 {
    if value >= 0.0 && value < f64::from(u32::MAX) && value.fract() == 0.0 { value as u32 } else { u32::MAX }
}
