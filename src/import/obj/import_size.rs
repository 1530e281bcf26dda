//! Peak memory of an OBJ import, from the number of its elements.

use super::chunk::{Chunk, Statement};

/// Bytes of a position or normal.
const VECTOR: u64 = 12;
const UV: u64 = 8;
const COLOR: u64 = 16;
/// Bytes of a corner: three indices.
const CORNER: u64 = 12;
/// Bytes of a triangle of a mesh, and of the corners that it is made of.
const TRIANGLE: u64 = 12 + 3 * CORNER;
/// Bytes of a triangle in a block that is welded, with its vertices, and the number of triangles in all blocks at once.
const BLOCK_TRIANGLE: u64 = 32;
const BLOCK_TRIANGLES: u64 = 1 << 20;
/// Bytes of a vertex while vertices are welded: its key, and a number for each position.
const KEY: u64 = 16;
const NUMBER: u64 = 4;
/// Bytes of a vertex of a smoothing group: a key, the sum of its normals and the normal.
const SMOOTH_VERTEX: u64 = 52;
/// Bytes of a vertex of points and lines, in its lists.
const ROUND_VERTEX: u64 = 16;
/// Bytes of a statement, with its text and the segment that it begins.
const STATEMENT: u64 = 160;
/// Bytes of an object, with its mesh.
const OBJECT: u64 = 512;

/// Number of elements of a file, or of a part of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ImportSize {
    positions: u64,
    colors: u64,
    uvs: u64,
    normals: u64,
    corners: u64,
    triangles: u64,
    arities: u64,
    round_vertices: u64,
    statements: u64,
    objects: u64,
    is_smooth: bool,
}

impl ImportSize {
    pub fn of(chunk: &Chunk) -> ImportSize {
        let is_object =
            |statement: &Statement| matches!(statement, Statement::Object(_) | Statement::Group(_));
        let is_smooth =
            |statement: &Statement| matches!(statement, Statement::Smoothing(group) if *group > 0);
        let statements = || chunk.statements.iter().map(|at| &at.statement);
        ImportSize {
            positions: chunk.positions.len() as u64,
            colors: chunk.colors.len() as u64,
            uvs: chunk.uvs.len() as u64,
            normals: chunk.normals.len() as u64,
            corners: chunk.corners.len() as u64,
            triangles: chunk.triangle_count() as u64,
            arities: chunk.arities.len() as u64,
            round_vertices: (chunk.round_vertices.len() + chunk.rounds.len()) as u64,
            statements: chunk.statements.len() as u64,
            objects: statements().filter(|statement| is_object(statement)).count() as u64,
            is_smooth: statements().any(is_smooth),
        }
    }

    pub fn add(&mut self, other: ImportSize) {
        self.positions += other.positions;
        self.colors += other.colors;
        self.uvs += other.uvs;
        self.normals += other.normals;
        self.corners += other.corners;
        self.triangles += other.triangles;
        self.arities += other.arities;
        self.round_vertices += other.round_vertices;
        self.statements += other.statements;
        self.objects += other.objects;
        self.is_smooth |= other.is_smooth;
    }

    /// Bytes of the attributes as parsed.
    fn attributes(&self) -> u64 {
        VECTOR * (self.positions + self.normals) + UV * self.uvs + COLOR * self.colors
    }

    /// Bytes of what is parsed.
    pub fn parsed_bytes(&self) -> u64 {
        let faces = CORNER * self.corners + 4 * self.arities;
        self.attributes() + faces + ROUND_VERTEX * self.round_vertices + STATEMENT * self.statements
    }

    /// Upper estimate of the vertices of all meshes: the corners that differ in position, texture coordinates or normal.
    fn vertices(&self) -> u64 {
        let all = 3 * self.triangles;
        // A list that is shorter than the positions is shared by vertices that differ.
        let is_shared = |count: u64| count > 0 && count < self.positions;
        if self.is_smooth || is_shared(self.uvs) || is_shared(self.normals) {
            return all;
        }
        let seams = |count: u64| count.saturating_sub(self.positions);
        all.min(self.positions + seams(self.uvs) + seams(self.normals))
    }

    /// Peak bytes of the import: while lists are joined, or while vertices are welded.
    pub fn peak_bytes(&self) -> u64 {
        let joined = self.parsed_bytes() + self.attributes();
        let vertices = self.vertices();
        let has = |count: u64, bytes: u64| if count > 0 { bytes } else { 0 };
        let smooth = if self.is_smooth { SMOOTH_VERTEX * vertices } else { 0 };
        let vertex = VECTOR + has(self.normals, VECTOR) + has(self.uvs, UV) + has(self.colors, COLOR);
        let rounds = self.round_vertices * (ROUND_VERTEX + vertex);
        let welded = self.attributes()
            + TRIANGLE * self.triangles
            + BLOCK_TRIANGLE * self.triangles.min(BLOCK_TRIANGLES)
            + vertices * (KEY + vertex)
            + NUMBER * self.positions
            + self.arities;
        joined.max(welded + smooth + rounds + STATEMENT * self.statements) + OBJECT * self.objects
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Limits;
    use crate::obj::fast_parser;

    fn size(text: &str) -> ImportSize {
        fast_parser::parse(text.as_bytes(), 16, &Limits::default(), None).unwrap().size
    }

    #[test]
    fn vertices_are_positions_unless_attributes_divide_them() {
        let quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
        let bare = size(&format!("{quad}f 1 2 3 4\n"));
        assert_eq!((bare.positions, bare.corners, bare.triangles, bare.vertices()), (4, 4, 2, 4));
        let one_normal = size(&format!("{quad}vn 0 0 1\nf 1//1 2//1 3//1 4//1\n"));
        assert_eq!(one_normal.vertices(), 6);
        let seam = "vt 0 0\nvt 0 1\nvt 1 0\nvt 1 1\nvt 2 2\n";
        assert_eq!(size(&format!("{quad}{seam}f 1/1 2/2 3/3\nf 1/5 3/3 4/4\n")).vertices(), 5);
        assert!(bare.peak_bytes() > bare.parsed_bytes());
    }

    #[test]
    fn the_size_of_a_file_that_does_not_fit_is_that_of_all_of_it() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\n".repeat(100) + "f 1 2 3\n";
        let whole = size(&text);
        for memory_bytes in [0, 500, whole.parsed_bytes() - 1] {
            let limits = Limits { memory_bytes, ..Limits::default() };
            let parsed = fast_parser::parse(text.as_bytes(), 64, &limits, None).unwrap();
            assert_eq!(parsed.size.peak_bytes(), whole.peak_bytes());
            assert!(
                parsed.chunks.iter().map(|chunk| 12 * chunk.positions.len() as u64).sum::<u64>()
                    <= memory_bytes
            );
        }
    }
}
