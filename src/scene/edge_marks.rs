//! Marks and colours that a file has for the edges of a mesh.

use glam::{Vec3, Vec4};

/// Marks of the edges of a mesh's triangles. All lists are empty if the file does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EdgeMarks {
    /// Marks of the sides of each triangle, in two bits each, the first side in the lowest: 0 never drawn, 1 as a
    /// silhouette, 2 and 3 always.
    pub sides: Vec<u8>,
    /// Colours of edges, linear RGBA, not premultiplied.
    pub colors: Vec<Vec4>,
    /// For each side of each triangle 0, or one more than the index of its colour. Empty if no edge has a colour.
    pub side_colors: Vec<[u16; 3]>,
    /// Normals of the two faces beside each side that is marked as a silhouette, in the order of the sides, of any
    /// length. Empty if the triangles decide.
    pub silhouette_normals: Vec<[Vec3; 2]>,
}

impl EdgeMarks {
    /// Returns true if the file does not say which edges are drawn.
    pub fn is_empty(&self) -> bool {
        self.sides.is_empty()
    }

    /// Returns the mark of a side of a triangle.
    pub fn side(&self, triangle: usize, side: usize) -> u8 {
        self.sides[triangle] >> (2 * side) & 3
    }

    /// Returns the bytes of the lists.
    pub(crate) fn memory_size(&self) -> usize {
        size_of_val(&self.sides[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.side_colors[..])
            + size_of_val(&self.silhouette_normals[..])
    }
}
