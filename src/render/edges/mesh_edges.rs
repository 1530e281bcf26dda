//! The edges of meshes, each with the triangles beside it.
//!
//! Vertices with the same position are one vertex: split normals, seams of texture coordinates and borders of materials are
//! no borders of the surface.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use blinn_scene::Mesh;

/// In place of a triangle beside an edge: there is none.
const NONE: u32 = u32::MAX;
/// In place of the second triangle beside an edge: there are several.
const MANY: u32 = u32::MAX - 1;
/// Set in the second triangle if it is wound against the first.
const IS_TURNED: u32 = 1 << 31;
/// Vertices whose edges one task finds.
const VERTICES_PER_TASK: usize = 1 << 14;

/// The triangles beside an edge, besides the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OtherSide {
    /// None: a border.
    None,
    /// One triangle.
    Triangle {
        /// Its number.
        triangle: u32,
        /// True if one of both shows its back where the other shows its front.
        is_turned: bool,
    },
    /// Several.
    Many,
}

/// An edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MeshEdge {
    /// Its vertices, numbered over all meshes.
    pub ends: [u32; 2],
    /// The first triangle beside it, numbered over all meshes.
    pub triangle: u32,
    other: u32,
}

impl MeshEdge {
    /// Returns what is on its other side.
    pub fn other_side(&self) -> OtherSide {
        match self.other {
            NONE => OtherSide::None,
            MANY => OtherSide::Many,
            other => OtherSide::Triangle { triangle: other & !IS_TURNED, is_turned: other & IS_TURNED != 0 },
        }
    }
}

/// The edges of meshes that form one object.
#[derive(Debug, Default)]
pub(super) struct MeshEdges {
    /// All edges.
    pub edges: Vec<MeshEdge>,
    /// Marks of the edges; empty if the file has none and all polygons are triangles.
    pub marks: Vec<EdgeMark>,
    /// Colours from files, linear RGBA, not premultiplied.
    pub palette: Vec<Vec4>,
    /// For each edge 0, or one more than the index of its colour. Empty if no edge has a colour.
    pub colors: Vec<u32>,
    /// Normals of the faces beside silhouettes of files, by edge.
    silhouette_normals: Vec<(u32, [Vec3; 2])>,
    /// Number of the first vertex and of the first triangle of each mesh, and of one more.
    starts: Vec<[u32; 2]>,
}

/// Mark of an edge in a file (glTF: EXT_mesh_primitive_edge_visibility).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum EdgeMark {
    /// Nothing: its mesh has no marks.
    None,
    /// Never drawn.
    Hidden,
    /// Drawn as a silhouette.
    Silhouette,
    /// Drawn always.
    Hard,
    /// A diagonal of a polygon: drawn where it is part of the outline.
    Diagonal,
}

impl EdgeMark {
    /// Reads the lowest two bits.
    fn from_bits(bits: u8) -> EdgeMark {
        match bits & 3 {
            0 => EdgeMark::Hidden,
            1 => EdgeMark::Silhouette,
            _ => EdgeMark::Hard,
        }
    }
}

/// Set in a [`HalfEdge`] whose triangle runs from its higher to its lower vertex.
const RUNS_DOWN: u32 = 1 << 31;

/// A triangle at the lower of an edge's vertices.
#[derive(Clone, Copy)]
struct HalfEdge {
    /// The other vertex.
    to: u32,
    /// The triangle's third vertex.
    apex: u32,
    /// The triangle, and [`RUNS_DOWN`].
    run: u32,
}

impl HalfEdge {
    fn triangle(&self) -> u32 {
        self.run & !RUNS_DOWN
    }
}

impl MeshEdges {
    /// Finds the edges of meshes with triangles.
    pub fn new(meshes: &[&Mesh]) -> MeshEdges {
        let mut starts = vec![[0u32; 2]];
        for mesh in meshes {
            let [vertices, triangles] = starts[starts.len() - 1];
            let next = |from: u32, count: usize| u32::try_from(count).ok().and_then(|n| from.checked_add(n));
            let (v, t) = (next(vertices, mesh.positions.len()), next(triangles, mesh.triangles.len()));
            // More do not fit in memory.
            let (Some(v), Some(t)) = (v, t.filter(|t| *t < IS_TURNED / 2)) else {
                return MeshEdges::default();
            };
            starts.push([v, t]);
        }
        let numbering = MeshEdges { starts, ..MeshEdges::default() };
        let welded = weld(meshes);
        // Half-edges by their lower vertex.
        let mut ends = vec![0u32; welded.len() + 1];
        numbering.for_each_side(meshes, &welded, |_, [a, b, _]| ends[a.min(b) as usize + 1] += 1);
        for v in 1..ends.len() {
            ends[v] += ends[v - 1];
        }
        let firsts = ends;
        let mut half_edges = vec![HalfEdge { to: 0, apex: 0, run: 0 }; firsts[welded.len()] as usize];
        let mut next = firsts.clone();
        numbering.for_each_side(meshes, &welded, |triangle, [a, b, apex]| {
            let at = &mut next[a.min(b) as usize];
            let run = triangle | if a < b { 0 } else { RUNS_DOWN };
            half_edges[*at as usize] = HalfEdge { to: a.max(b), apex, run };
            *at += 1;
        });
        drop(next);
        let vertices: Vec<usize> = (0..welded.len()).step_by(VERTICES_PER_TASK).collect();
        let edges_from = |&start: &usize| {
            let mut out = Vec::new();
            let mut own: Vec<HalfEdge> = Vec::new();
            for v in start..(start + VERTICES_PER_TASK).min(welded.len()) {
                own.clear();
                own.extend_from_slice(&half_edges[firsts[v] as usize..firsts[v + 1] as usize]);
                own.sort_unstable_by_key(|half| (half.to, half.triangle()));
                for beside in own.chunk_by(|a, b| a.to == b.to) {
                    out.push(edge([v as u32, beside[0].to], beside));
                }
            }
            out
        };
        let edges: Vec<Vec<MeshEdge>> = vertices.par_iter().map(edges_from).collect();
        let mut out = MeshEdges { edges: edges.concat(), ..numbering };
        if meshes.iter().any(|mesh| !mesh.edge_marks.is_empty()) {
            out.add_marks(meshes, &welded);
        }
        if meshes.iter().any(|mesh| !mesh.polygons.is_empty()) {
            out.mark_diagonals(meshes);
        }
        out
    }

    /// Calls `add` with each triangle, and the two ends of each of its sides and the third vertex.
    fn for_each_side(&self, meshes: &[&Mesh], welded: &[u32], mut add: impl FnMut(u32, [u32; 3])) {
        for (mesh, [first_vertex, first_triangle]) in meshes.iter().zip(&self.starts) {
            for (triangle, corners) in (*first_triangle..).zip(&mesh.triangles) {
                let [a, b, c] = corners.map(|corner| welded[(first_vertex + corner) as usize]);
                // A triangle with a vertex twice has no area.
                if a != b && b != c && c != a {
                    [[a, b, c], [b, c, a], [c, a, b]].into_iter().for_each(|side| add(triangle, side));
                }
            }
        }
    }

    /// Adds what files say of the edges. An edge between two triangles is what the one says that shows more.
    fn add_marks(&mut self, meshes: &[&Mesh], welded: &[u32]) {
        self.marks = vec![EdgeMark::None; self.edges.len()];
        if meshes.iter().any(|mesh| !mesh.edge_marks.side_colors.is_empty()) {
            self.colors = vec![0; self.edges.len()];
        }
        for (mesh, [first, _]) in meshes.iter().zip(&self.starts) {
            let file = &mesh.edge_marks;
            if file.is_empty() {
                continue;
            }
            let first_color = self.palette.len() as u32;
            self.palette.extend(&file.colors);
            let mut silhouette_normals = file.silhouette_normals.iter();
            for (t, triangle) in mesh.triangles.iter().enumerate() {
                let corners = triangle.map(|corner| welded[(first + corner) as usize]);
                for (side, ends) in sides(corners).into_iter().enumerate() {
                    let mark = EdgeMark::from_bits(file.side(t, side));
                    let normals = if mark == EdgeMark::Silhouette { silhouette_normals.next() } else { None };
                    // Edges are sorted by their ends.
                    let Ok(edge) = self.edges.binary_search_by_key(&ends, |edge| edge.ends) else { continue };
                    if mark > self.marks[edge] {
                        self.marks[edge] = mark;
                        if let Some(color) = file.side_colors.get(t).map(|colors| u32::from(colors[side])) {
                            self.colors[edge] = if color > 0 { first_color + color } else { 0 };
                        }
                    }
                    self.silhouette_normals.extend(normals.map(|normals| (edge as u32, *normals)));
                }
            }
        }
        self.silhouette_normals.sort_by_key(|(edge, _)| *edge);
    }

    /// Returns the normals that a file has for the faces beside a silhouette, in the space of its mesh.
    pub fn silhouette_normals(&self, edge: usize) -> Option<[Vec3; 2]> {
        let at = self.silhouette_normals.binary_search_by_key(&(edge as u32), |(edge, _)| *edge).ok()?;
        Some(self.silhouette_normals[at].1)
    }

    /// Marks the edges between two triangles of the same polygon.
    fn mark_diagonals(&mut self, meshes: &[&Mesh]) {
        let mut marks = std::mem::take(&mut self.marks);
        marks.resize(self.edges.len(), EdgeMark::None);
        let is_diagonal = |edge: &MeshEdge| {
            let OtherSide::Triangle { triangle: other, .. } = edge.other_side() else { return false };
            let ((mesh, a), (other_mesh, b)) = (self.triangle(edge.triangle), self.triangle(other));
            mesh == other_mesh && meshes[mesh].polygons.are_same(a as usize, b as usize)
        };
        marks.par_iter_mut().zip(&self.edges).filter(|(_, edge)| is_diagonal(edge)).for_each(|(mark, _)| {
            *mark = EdgeMark::Diagonal;
        });
        self.marks = marks;
    }

    /// Returns the mesh of a vertex, and the vertex in it.
    pub fn vertex(&self, vertex: u32) -> (usize, u32) {
        let mesh = self.starts.partition_point(|[first, _]| *first <= vertex) - 1;
        (mesh, vertex - self.starts[mesh][0])
    }

    /// Returns the mesh of a triangle, and the triangle in it.
    pub fn triangle(&self, triangle: u32) -> (usize, u32) {
        let mesh = self.starts.partition_point(|[_, first]| *first <= triangle) - 1;
        (mesh, triangle - self.starts[mesh][1])
    }
}

/// Returns the sides of a triangle, the lower vertex first.
fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
}

/// Makes an edge of the triangles beside it. Of several with the same corners, as files write doubled faces, one counts.
fn edge(ends: [u32; 2], beside: &[HalfEdge]) -> MeshEdge {
    let first = beside[0];
    let mut other: Option<HalfEdge> = None;
    let mut has_many = false;
    for half in &beside[1..] {
        if half.apex == first.apex || other.is_some_and(|other| other.apex == half.apex) {
            continue;
        }
        if other.is_some() {
            has_many = true;
            break;
        }
        other = Some(*half);
    }
    let other = match other {
        _ if has_many => MANY,
        None => NONE,
        Some(half) => {
            let is_turned = (first.run ^ half.run) & RUNS_DOWN == 0;
            half.triangle() | if is_turned { IS_TURNED } else { 0 }
        }
    };
    MeshEdge { ends, triangle: first.triangle(), other }
}

/// Returns for each vertex the first one with the same position.
fn weld(meshes: &[&Mesh]) -> Vec<u32> {
    // 0 and −0 are the same position.
    let bits = |p: &Vec3| (*p + 0.0).to_array().map(f32::to_bits);
    let positions = meshes.iter().flat_map(|mesh| &mesh.positions);
    let mut keys: Vec<([u32; 3], u32)> = positions.zip(0..).map(|(p, vertex)| (bits(p), vertex)).collect();
    keys.par_sort_unstable();
    let mut welded = vec![0; keys.len()];
    for same in keys.chunk_by(|a, b| a.0 == b.0) {
        let first = same[0].1;
        same.iter().for_each(|(_, vertex)| welded[*vertex as usize] = first);
    }
    welded
}
