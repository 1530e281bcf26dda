//! Loose edges of polygon meshes as lines.

use super::polygon_mesh::PolygonMesh;
use crate::compact::compact;
use crate::error::LoadError;
use blinn_scene::{Mesh, Rounds};

impl PolygonMesh {
    /// Returns the loose edges as lines, and removes them. They have the colours of edges, or else of vertices, and no
    /// normals: those of their vertices belong to faces.
    ///
    /// # Errors
    /// The vertex of an end does not exist.
    pub fn take_lines(&mut self) -> Result<Option<Mesh>, LoadError> {
        let mut lines = std::mem::take(&mut self.edges);
        let edge_colors = std::mem::take(&mut self.edge_colors);
        if lines.is_empty() {
            return Ok(None);
        }
        let count = self.positions.len();
        if let Some(vertex) = lines.as_flattened().iter().find(|&&vertex| vertex as usize >= count) {
            return Err(LoadError::invalid(
                "edges",
                format!("vertex index {vertex} is out of range: the file has {count} vertices"),
            ));
        }
        let (used, colors) = if edge_colors.is_empty() {
            let used = compact(&mut lines);
            let colors = used.iter().filter_map(|&v| self.colors.get(v as usize).copied()).collect();
            (used, colors)
        } else {
            let used = lines.as_flattened().to_vec();
            for (i, line) in lines.iter_mut().enumerate() {
                *line = [2 * i as u32, 2 * i as u32 + 1];
            }
            (used, edge_colors.iter().flat_map(|&color| [color; 2]).collect())
        };
        let positions = used.iter().map(|&v| self.positions[v as usize]).collect();
        Ok(Some(Mesh { positions, colors, rounds: Rounds::Lines(lines), ..Mesh::default() }))
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec4};

    use super::*;

    #[test]
    fn edges_have_their_own_colours_or_those_of_their_vertices() {
        let mesh = |edge_colors: &[Vec4]| PolygonMesh {
            positions: [0.0, 1.0, 2.0, 3.0].map(Vec3::splat).to_vec(),
            colors: [0.0, 0.1, 0.2, 0.3].map(Vec4::splat).to_vec(),
            edges: vec![[1, 3], [3, 1]],
            edge_colors: edge_colors.to_vec(),
            ..PolygonMesh::default()
        };
        let lines = mesh(&[]).take_lines().unwrap().unwrap();
        assert_eq!(lines.rounds, Rounds::Lines(vec![[0, 1], [1, 0]]));
        assert_eq!((lines.positions[1].x, lines.colors[1].x, lines.colors.len()), (3.0, 0.3, 2));
        let lines = mesh(&[Vec4::X, Vec4::Y]).take_lines().unwrap().unwrap();
        assert_eq!(lines.rounds, Rounds::Lines(vec![[0, 1], [2, 3]]));
        assert_eq!(lines.positions.iter().map(|p| p.x).collect::<Vec<_>>(), [1.0, 3.0, 3.0, 1.0]);
        assert_eq!(lines.colors, [Vec4::X, Vec4::X, Vec4::Y, Vec4::Y]);
        let mut missing = PolygonMesh { edges: vec![[0, 4]], ..mesh(&[]) };
        assert!(missing.take_lines().unwrap_err().to_string().contains("vertex index 4 is out of range"));
    }
}
