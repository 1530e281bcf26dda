//! One parsed chunk of OBJ text: the common output of the fast and the lenient parser.

use glam::{Vec3, Vec4};

pub(super) use crate::polygons::vertex_dedup::NO_INDEX;

/// Colour of a vertex that has none.
pub(super) const NO_COLOR: Vec4 = Vec4::NEG_INFINITY;
/// Set in an index that is relative to the start of its chunk. The lower bits hold the offset plus
/// [`RELATIVE_BIAS`].
const RELATIVE_BIT: u32 = 1 << 31;
const RELATIVE_BIAS: i64 = 1 << 30;

/// A corner of a face: zero-based indices, or [`NO_INDEX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub v: u32,
    pub vt: u32,
    pub vn: u32,
}

/// A statement that applies to all faces after it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Statement {
    /// `o`
    Object(String),
    /// `g`
    Group(String),
    /// `s`; 0 disables smoothing.
    Smoothing(u32),
    /// `usemtl`
    Material(String),
    /// `mtllib`: the rest of the line.
    Library(String),
    /// Derived from the faces, not a statement of the file: the attributes that all following corners have.
    VertexFormat(VertexFormat),
}

/// Attributes that every corner of a face has besides its position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct VertexFormat {
    pub uv: bool,
    pub normal: bool,
}

/// A statement and its position among the faces of the chunk.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StatementAt {
    /// Index of the first face after the statement.
    pub face: usize,
    pub statement: Statement,
}

/// A `p` or `l` of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RoundElement {
    /// Number of the statements of the chunk before it.
    pub statement: u32,
    /// Number of its vertices.
    pub count: u32,
    /// True for `p`.
    pub is_points: bool,
}

/// The content of a chunk of text, in file order.
#[derive(Debug, Default)]
pub(super) struct Chunk {
    pub positions: Vec<Vec3>,
    /// Vertex colours as written, or [`NO_COLOR`]. Shorter than `positions` if the last vertices have none.
    pub colors: Vec<Vec4>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<Vec3>,
    /// The corners of all faces, face by face.
    pub corners: Vec<Corner>,
    /// Number of corners of each face. Empty if all faces are triangles.
    pub arities: Vec<u32>,
    pub faces: usize,
    pub statements: Vec<StatementAt>,
    /// True if any corner has a relative index.
    has_relative: bool,
    /// Highest absolute one-based index of positions, texture coordinates and normals.
    pub max_index: [u32; 3],
    /// Largest distance before the start of this chunk that a relative index refers to, by attribute.
    max_lookback: [i64; 3],
    /// Points and lines.
    pub rounds: Vec<RoundElement>,
    /// The vertices of all points and lines.
    pub round_vertices: Vec<u32>,
    /// Number of faces with fewer than three corners.
    pub degenerate: u64,
    /// Number of curves, surfaces and unknown statements, and of points and lines without vertices.
    pub ignored: u64,
    /// True if all vertices of the file are points: normals belong to them.
    pub is_cloud: bool,
    format: Option<VertexFormat>,
}

impl Chunk {
    /// Adds a statement before the next face.
    pub fn push_statement(&mut self, statement: Statement) {
        self.statements.push(StatementAt { face: self.faces, statement });
    }

    /// Adds a vertex with an optional colour.
    #[inline]
    pub fn push_vertex(&mut self, position: Vec3, color: Option<Vec4>) {
        if let Some(color) = color {
            self.colors.resize(self.positions.len(), NO_COLOR);
            self.colors.push(color);
        }
        self.positions.push(position);
    }

    /// Makes points or a line of all vertices from `first` on.
    pub fn push_round(&mut self, first: usize, is_points: bool) {
        let count = (self.round_vertices.len() - first) as u32;
        if count == 0 {
            self.ignored += 1;
            return;
        }
        self.rounds.push(RoundElement { statement: self.statements.len() as u32, count, is_points });
    }

    /// Returns true if there is nothing to render, and nothing that the vertices were meant for.
    pub fn is_bare(&self) -> bool {
        self.faces == 0 && self.rounds.is_empty() && self.degenerate == 0 && self.ignored == 0
    }

    /// Makes points of all vertices of the file, as MeshLab, trimesh and scanners write clouds.
    pub fn push_cloud(&mut self, vertices: usize) {
        self.round_vertices = (0..vertices as u32).collect();
        self.push_round(0, true);
        self.is_cloud = true;
    }

    /// Makes a face of all corners from `first` on.
    #[inline]
    pub fn push_face(&mut self, first: usize) {
        let corners = &self.corners[first..];
        let arity = corners.len();
        if arity < 3 {
            self.corners.truncate(first);
            self.degenerate += 1;
            return;
        }
        let uv = corners.iter().all(|c| c.vt != NO_INDEX);
        let normal = corners.iter().all(|c| c.vn != NO_INDEX);
        let format = VertexFormat { uv, normal };
        if self.format != Some(format) {
            self.format = Some(format);
            self.push_statement(Statement::VertexFormat(format));
        }
        let corners = &mut self.corners[first..];
        // An attribute that only some corners of a face have is dropped from all of them.
        if !uv {
            corners.iter_mut().for_each(|c| c.vt = NO_INDEX);
        }
        if !normal {
            corners.iter_mut().for_each(|c| c.vn = NO_INDEX);
        }
        if arity != 3 || !self.arities.is_empty() {
            self.arities.resize(self.faces, 3);
            self.arities.push(arity as u32);
        }
        self.faces += 1;
    }

    /// Encodes the relative index of the element that was defined `back` elements ago. `kind` is 0 for
    /// positions, 1 for texture coordinates, 2 for normals.
    #[inline]
    pub fn relative_index(&mut self, kind: usize, back: u32) -> u32 {
        let so_far = [self.positions.len(), self.uvs.len(), self.normals.len()][kind] as i64;
        self.has_relative = true;
        self.max_lookback[kind] = self.max_lookback[kind].max(i64::from(back) - so_far);
        // A chunk has a few megabytes and `back` is below 10^9, so this stays within 31 bits.
        RELATIVE_BIT | (so_far + RELATIVE_BIAS - i64::from(back)) as u32
    }

    /// Number of triangles that the faces are cut into.
    pub fn triangle_count(&self) -> usize {
        self.corners.len() - 2 * self.faces
    }

    /// Makes all indices relative to the start of the file. `before` and `totals` count the positions,
    /// texture coordinates and normals before this chunk and in the whole file. Returns false if an
    /// index is out of range.
    #[must_use]
    pub fn resolve_indices(&mut self, before: [usize; 3], totals: [usize; 3]) -> bool {
        let outside =
            |k: usize| self.max_index[k] as usize > totals[k] || self.max_lookback[k] > before[k] as i64;
        if (0..3).any(outside) {
            return false;
        }
        if self.has_relative {
            let absolute = |index: &mut u32, k: usize| {
                if *index != NO_INDEX && *index & RELATIVE_BIT != 0 {
                    *index = (before[k] as i64 + i64::from(*index & !RELATIVE_BIT) - RELATIVE_BIAS) as u32;
                }
            };
            self.round_vertices.iter_mut().for_each(|v| absolute(v, 0));
            for corner in &mut self.corners {
                absolute(&mut corner.v, 0);
                absolute(&mut corner.vt, 1);
                absolute(&mut corner.vn, 2);
            }
        }
        true
    }
}
