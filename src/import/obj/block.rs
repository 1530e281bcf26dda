//! What a stretch of an OBJ's text says: the form in which both readers hand it on.

use glam::{Vec3, Vec4};

/// In place of an index: the corner has none.
pub(super) const NONE: u32 = u32::MAX;
/// In place of a colour: the vertex has none.
pub(super) const COLORLESS: Vec4 = Vec4::NEG_INFINITY;
/// Marks an index that counts from the start of its block: the rest is [`RELATIVE_ZERO`] more.
const RELATIVE: u32 = 1 << 31;
const RELATIVE_ZERO: i64 = 1 << 30;

/// A corner of a face: indices from 0, or [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub v: u32,
    pub vt: u32,
    pub vn: u32,
}

/// A statement that holds for the faces behind it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Statement {
    /// `o`
    Object(String),
    /// `g`
    Group(String),
    /// `s`; 0 is off.
    Smoothing(u32),
    /// `usemtl`
    Material(String),
    /// `mtllib`, the whole rest of the line.
    Library(String),
    /// Not written as such: all corners of the faces behind have these.
    Form { uv: bool, normal: bool },
}

/// A statement, and before which face of its block it stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub face: usize,
    pub statement: Statement,
}

/// Everything in a stretch of text, in order.
#[derive(Debug, Default)]
pub(super) struct Block {
    pub positions: Vec<Vec3>,
    /// As the file writes them, or [`COLORLESS`]; shorter than `positions` where the last ones have none.
    pub colors: Vec<Vec4>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<Vec3>,
    /// The corners of all faces.
    pub corners: Vec<Corner>,
    /// Corners by face; empty where all have three.
    pub arities: Vec<u32>,
    pub faces: usize,
    pub marks: Vec<Mark>,
    /// Where `RELATIVE` indices are among the corners.
    relative: bool,
    /// The highest index from the start of the file, of vertices, coordinates and normals, plus one.
    pub reach: [u32; 3],
    /// How far before this block indices point, of each kind.
    depth: [i64; 3],
    pub lines_and_points: u64,
    /// Faces with fewer than three corners.
    pub degenerate: u64,
    form: Option<(bool, bool)>,
}

impl Block {
    pub fn mark(&mut self, statement: Statement) {
        self.marks.push(Mark { face: self.faces, statement });
    }

    /// Adds a vertex, perhaps with a colour.
    #[inline]
    pub fn vertex(&mut self, position: Vec3, color: Option<Vec4>) {
        if let Some(color) = color {
            self.colors.resize(self.positions.len(), COLORLESS);
            self.colors.push(color);
        }
        self.positions.push(position);
    }

    /// Makes a face of the corners from `first` on.
    #[inline]
    pub fn face(&mut self, first: usize) {
        let corners = &mut self.corners[first..];
        let arity = corners.len();
        if arity < 3 {
            self.corners.truncate(first);
            self.degenerate += 1;
            return;
        }
        let uv = corners.iter().all(|c| c.vt != NONE);
        let normal = corners.iter().all(|c| c.vn != NONE);
        if self.form != Some((uv, normal)) {
            self.form = Some((uv, normal));
            self.marks.push(Mark { face: self.faces, statement: Statement::Form { uv, normal } });
        }
        // A face that has something at some of its corners only has it nowhere.
        if !uv {
            corners.iter_mut().for_each(|c| c.vt = NONE);
        }
        if !normal {
            corners.iter_mut().for_each(|c| c.vn = NONE);
        }
        if arity != 3 || !self.arities.is_empty() {
            self.arities.resize(self.faces, 3);
            self.arities.push(arity as u32);
        }
        self.faces += 1;
    }

    /// An index of the vertex, coordinate or normal that was given `back` ago.
    #[inline]
    pub fn back(&mut self, kind: usize, back: u32) -> u32 {
        let so_far = [self.positions.len(), self.uvs.len(), self.normals.len()][kind] as i64;
        self.relative = true;
        self.depth[kind] = self.depth[kind].max(i64::from(back) - so_far);
        // Blocks are of a few megabytes and `back` is below 10^9: this stays within 31 bits.
        RELATIVE | (so_far + RELATIVE_ZERO - i64::from(back)) as u32
    }

    /// Triangles that the faces will be.
    pub fn triangles(&self) -> usize {
        self.corners.len() - 2 * self.faces
    }

    /// Makes all indices count from the start of the file, where `before` and `totals` are how many
    /// vertices, coordinates and normals come before this block and are in the file. False where an
    /// index points at nothing.
    #[must_use]
    pub fn resolve(&mut self, before: [usize; 3], totals: [usize; 3]) -> bool {
        let outside = |k: usize| self.reach[k] as usize > totals[k] || self.depth[k] > before[k] as i64;
        if (0..3).any(outside) {
            return false;
        }
        if self.relative {
            let absolute = |index: &mut u32, k: usize| {
                if *index != NONE && *index & RELATIVE != 0 {
                    *index = (before[k] as i64 + i64::from(*index & !RELATIVE) - RELATIVE_ZERO) as u32;
                }
            };
            for corner in &mut self.corners {
                absolute(&mut corner.v, 0);
                absolute(&mut corner.vt, 1);
                absolute(&mut corner.vn, 2);
            }
        }
        true
    }
}
