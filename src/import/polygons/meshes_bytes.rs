//! Memory that the meshes of a polygon mesh take.

use super::polygon_mesh::PolygonMesh;

/// Bytes of a triangle, as corners and then as vertices.
const TRIANGLE: u64 = 2 * 12;
/// Bytes of a vertex whose normal is repaired.
const NORMAL_SUM: u64 = 24;
/// Bytes of the number of a corner's value.
const NUMBER: u64 = 4;
/// Bytes of a distinct value, in its list and in a hash table that has just grown.
const INTERNED: u64 = 64;
/// Bytes of a vertex of the file while its keys are found, and of a key.
const LAST_KEY: u64 = 4;
const KEY: u64 = 16;
/// Bytes of the attributes of a vertex.
pub const POSITION: u64 = 12;
pub const NORMAL: u64 = 12;
pub const COLOR: u64 = 16;
pub const UV: u64 = 8;
/// Bytes of the ends of a line.
const LINE: u64 = 8;

impl PolygonMesh {
    /// Bytes of the attributes, corners and faces.
    pub fn bytes(&self) -> u64 {
        let bytes = size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.corners[..])
            + size_of_val(&self.corner_uvs[..])
            + size_of_val(&self.arities[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.edge_colors[..])
            + size_of_val(&self.face_colors[..])
            + size_of_val(&self.face_parts[..]);
        bytes as u64
    }

    /// Upper estimate of the bytes that [`PolygonMesh::take_lines`] and [`PolygonMesh::into_meshes`] need beside the mesh
    /// itself.
    pub fn meshes_bytes(&self) -> u64 {
        let lines = self.edges.len() as u64;
        let ends = match self.edge_colors.len() {
            0 => (2 * lines).min(self.positions.len() as u64),
            _ => 2 * lines,
        };
        let of_lines = LINE * lines + (POSITION + COLOR) * ends;
        // Points are the vertices themselves.
        if self.faces == 0 { of_lines } else { of_lines + self.triangle_bytes() }
    }

    fn triangle_bytes(&self) -> u64 {
        let [vertices, corners, faces] =
            [self.positions.len(), self.corners.len(), self.faces].map(|n| n as u64);
        let triangles = corners.saturating_sub(2 * faces);
        let bits = (vertices + triangles) / 8;
        let welded = TRIANGLE * triangles + bits + NORMAL_SUM * self.normals.len() as u64;
        let has = |is_empty: bool, bytes: u64| if is_empty { 0 } else { bytes };
        let no_face_colors = !self.has_face_colors();
        let no_corner_uvs = self.corner_uvs.is_empty();
        if self.parts.len() <= 1 && no_face_colors && no_corner_uvs {
            return welded;
        }
        // Seams of texture coordinates divide few vertices, colours of faces may divide all.
        let seamed = corners.min(2 * vertices);
        let split = if no_face_colors { seamed } else { corners };
        let attributes = POSITION
            + has(self.normals.is_empty(), NORMAL)
            + has(no_face_colors && self.colors.is_empty(), COLOR)
            + has(no_corner_uvs && self.uvs.is_empty(), UV);
        welded
            + has(no_face_colors, NUMBER * corners + INTERNED * faces)
            + has(no_corner_uvs, NUMBER * corners + INTERNED * seamed)
            + LAST_KEY * vertices
            + (KEY + attributes) * split
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3, Vec4};

    use super::*;

    #[test]
    fn points_take_no_more_and_lines_have_vertices_of_their_own() {
        let mut mesh = PolygonMesh { positions: vec![Vec3::ZERO; 8], ..PolygonMesh::default() };
        assert_eq!((mesh.bytes(), mesh.meshes_bytes()), (8 * POSITION, 0));
        mesh.edges = vec![[0, 1], [1, 2]];
        assert_eq!(mesh.meshes_bytes(), 2 * LINE + 4 * (POSITION + COLOR));
    }

    #[test]
    fn attributes_of_corners_and_faces_divide_vertices() {
        let mut mesh = PolygonMesh {
            positions: vec![Vec3::ZERO; 8],
            corners: vec![0, 1, 2, 2, 1, 3],
            faces: 2,
            ..PolygonMesh::default()
        };
        let welded = mesh.meshes_bytes();
        assert_eq!(welded, 2 * TRIANGLE + 1);
        mesh.corner_uvs = vec![Vec2::ZERO; 6];
        let with_uvs = mesh.meshes_bytes();
        assert_eq!(with_uvs, welded + 6 * (NUMBER + INTERNED + KEY + POSITION + UV) + 8 * LAST_KEY);
        mesh.face_colors = vec![Vec4::ONE; 2];
        assert_eq!(mesh.meshes_bytes(), with_uvs + 6 * (NUMBER + COLOR) + 2 * INTERNED);
        mesh.colors = vec![Vec4::X, Vec4::Y];
        assert_eq!(mesh.meshes_bytes(), with_uvs + 6 * COLOR);
    }
}
