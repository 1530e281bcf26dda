//! Points and lines: meshes that are drawn as spheres and capsules in place of triangles.

use crate::Mesh;

/// The points or lines of a mesh without triangles. Their colours, normals and texture coordinates are those of the
/// mesh's vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Rounds {
    /// None: the mesh has triangles.
    #[default]
    None,
    /// A point at each vertex.
    Points,
    /// Line segments between pairs of vertices, whose indices are all valid. A segment without length is a dot.
    Lines(Vec<[u32; 2]>),
}

impl Mesh {
    /// Returns true if the mesh has points or lines.
    #[inline]
    pub fn has_rounds(&self) -> bool {
        self.rounds != Rounds::None
    }

    /// Returns the number of points.
    pub fn point_count(&self) -> usize {
        if self.rounds == Rounds::Points { self.positions.len() } else { 0 }
    }

    /// Returns the line segments.
    pub fn lines(&self) -> &[[u32; 2]] {
        match &self.rounds {
            Rounds::Lines(lines) => lines,
            Rounds::None | Rounds::Points => &[],
        }
    }

    /// Returns the number of triangles, points and lines.
    pub fn primitive_count(&self) -> usize {
        self.triangles.len() + self.point_count() + self.lines().len()
    }

    /// Returns the corners of a triangle. Those of a point are its vertex three times, those of a line its start and
    /// twice its end.
    #[inline(always)]
    pub fn corners(&self, primitive: u32) -> [u32; 3] {
        match self.triangles.get(primitive as usize) {
            Some(corners) => *corners,
            None => self.round_corners(primitive),
        }
    }

    #[cold]
    #[inline(never)]
    fn round_corners(&self, primitive: u32) -> [u32; 3] {
        match &self.rounds {
            Rounds::Lines(lines) => lines.get(primitive as usize).map_or([0; 3], |&[a, b]| [a, b, b]),
            Rounds::None | Rounds::Points => [primitive; 3],
        }
    }
}
