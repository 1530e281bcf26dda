//! A mesh of polygons with attributes of vertices, corners and faces, and its triangles.

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::interned::Interned;
use super::triangulator::{Triangulator, WORK_BUDGET};
use super::vertex_dedup::{NO_INDEX, VertexDeduplicator};
use crate::Limits;
use crate::error::{LoadError, Warnings};
use blinn_core::cancellation::CancelToken;
use blinn_scene::{Mesh, Polygons, Rounds};

/// Number of faces between two looks at the cancellation.
const CANCEL_INTERVAL: usize = 1 << 16;

/// A mesh as PLY and STL files have it. Attributes are as long as what they belong to, or empty.
#[derive(Debug, Default)]
pub(crate) struct PolygonMesh {
    /// Names of the objects.
    pub objects: Vec<String>,
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Normals of vertices, of any length.
    pub normals: Vec<Vec3>,
    /// Linear colours of vertices.
    pub colors: Vec<Vec4>,
    /// Texture coordinates of vertices. v runs down.
    pub uvs: Vec<Vec2>,
    /// The vertex of each corner, face by face.
    pub corners: Vec<u32>,
    /// Texture coordinates of corners. v runs down.
    pub corner_uvs: Vec<Vec2>,
    /// Number of corners of each face. Empty if all faces are triangles.
    pub arities: Vec<u32>,
    /// Number of faces.
    pub faces: usize,
    /// The ends of loose edges, which are lines.
    pub edges: Vec<[u32; 2]>,
    /// Linear colours of loose edges.
    pub edge_colors: Vec<Vec4>,
    /// Linear colours of faces.
    pub face_colors: Vec<Vec4>,
    /// The part that each face belongs to.
    pub face_parts: Vec<u32>,
    /// The parts; one of the first object and texture if empty.
    pub parts: Vec<Part>,
}

/// The triangles of a part, as indices of corners.
#[derive(Clone, Debug, Default)]
struct PartTriangles {
    triangles: Vec<[u32; 3]>,
    /// The faces that they were cut from.
    polygons: Polygons,
}

/// Faces of one object with one material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Part {
    /// Index into the objects.
    pub object: u32,
    /// Index into the materials.
    pub material: u32,
}

impl PolygonMesh {
    /// Makes a face of all corners from `first` on. Returns false, and removes them, if they are fewer than three.
    pub fn push_face(&mut self, first: usize) -> bool {
        let arity = self.corners.len() - first;
        if arity < 3 {
            self.corners.truncate(first);
            return false;
        }
        if arity != 3 || !self.arities.is_empty() {
            self.arities.resize(self.faces, 3);
            self.arities.push(arity as u32);
        }
        self.faces += 1;
        true
    }

    /// Returns the positions of the corners of all faces. Corners of vertices that do not exist are left out.
    pub fn corner_positions(&self) -> impl Iterator<Item = Vec3> {
        self.corners.iter().filter_map(|&vertex| self.positions.get(vertex as usize).copied())
    }

    /// Returns the vertices of a mesh without faces as points.
    pub fn into_points(self) -> Mesh {
        let PolygonMesh { positions, mut normals, colors, uvs, .. } = self;
        normals.iter_mut().for_each(|n| *n = n.as_dvec3().normalize_or_zero().as_vec3());
        let uvs = if uvs.is_empty() { Vec::new() } else { vec![uvs] };
        Mesh { positions, normals, colors, uvs, rounds: Rounds::Points, ..Mesh::default() }
    }

    /// Returns the meshes of the parts that have triangles.
    ///
    /// # Errors
    /// A corner's vertex does not exist, a limit is exceeded, or the import was cancelled.
    pub fn into_meshes(
        mut self,
        limits: &Limits,
        cancel: &CancelToken,
        warnings: &mut Warnings,
    ) -> Result<Vec<(Part, Mesh)>, LoadError> {
        self.check_corners()?;
        LoadError::check_limit("vertices", self.positions.len() as u64, limits.vertices)?;
        if self.parts.is_empty() {
            self.parts.push(Part::default());
        }
        if !self.has_face_colors() {
            self.face_colors = Vec::new();
        }
        let (face_colors, colors) = self.corner_colors();
        let mut parts = self.triangulate(limits, cancel, warnings)?;
        self.repair_normals(&parts);
        let mut out = Vec::new();
        if parts.len() == 1
            && colors.is_empty()
            && self.corner_uvs.is_empty()
            && let Some(part) = parts.pop()
        {
            if !part.triangles.is_empty() {
                out.push((self.parts[0], self.welded_mesh(part)));
            }
            return Ok(out);
        }
        let (uvs, corner_uvs) = self.interned_uvs();
        let mut vertices = VertexDeduplicator::new(self.positions.len());
        let mut vertex_count = 0;
        let drawn = self.parts.iter().zip(parts).filter(|(_, part)| !part.triangles.is_empty());
        for (part, PartTriangles { triangles, polygons }) in drawn {
            cancel.check()?;
            vertices.clear();
            let number = |list: &[u32], corner: u32| list.get(corner as usize).copied().unwrap_or(NO_INDEX);
            let triangles = triangles.iter().map(|corners| {
                corners.map(|c| {
                    let vertex = self.corners[c as usize];
                    vertices.number_of(vertex, number(&face_colors, c), number(&corner_uvs, c))
                })
            });
            let mut mesh = Mesh { triangles: triangles.collect(), polygons, ..Mesh::default() };
            let keys = vertices.keys().iter();
            vertex_count += vertices.keys().len() as u64;
            LoadError::check_limit("vertices", vertex_count, limits.vertices)?;
            mesh.positions = keys.clone().map(|key| self.positions[key.v as usize]).collect();
            mesh.normals = keys.clone().filter_map(|key| self.normals.get(key.v as usize).copied()).collect();
            let color = |vertex: u32, id: u32| {
                colors.get(id as usize).or_else(|| self.colors.get(vertex as usize)).copied()
            };
            mesh.colors = keys.clone().filter_map(|key| color(key.v, key.a)).collect();
            let uv = |vertex: u32, id: u32| {
                let of_corner = uvs.get(id as usize).map(|uv| uv.truncate().truncate());
                of_corner.or_else(|| self.uvs.get(vertex as usize).copied())
            };
            let uvs: Vec<Vec2> = keys.filter_map(|key| uv(key.v, key.b)).collect();
            mesh.uvs = if uvs.is_empty() { Vec::new() } else { vec![uvs] };
            out.push((*part, mesh));
        }
        Ok(out)
    }

    /// Returns true if the colours of faces are seen: those of vertices are finer, unless all are the same.
    pub(super) fn has_face_colors(&self) -> bool {
        !self.face_colors.is_empty() && self.colors.windows(2).all(|pair| pair[0] == pair[1])
    }

    fn check_corners(&self) -> Result<(), LoadError> {
        let count = self.positions.len();
        LoadError::check_limit("corners of faces", self.corners.len() as u64, u64::from(NO_INDEX) - 1)?;
        match self.corners.iter().find(|&&vertex| vertex as usize >= count) {
            None => Ok(()),
            Some(vertex) => Err(LoadError::invalid(
                "faces",
                format!("vertex index {vertex} is out of range: the file has {count} vertices"),
            )),
        }
    }

    /// Returns the colour number of each corner and the distinct colours, if faces have colours.
    fn corner_colors(&self) -> (Vec<u32>, Vec<Vec4>) {
        let mut colors = Interned::default();
        let mut numbers = Vec::new();
        for (face, color) in self.face_colors.iter().enumerate() {
            let arity = self.arities.get(face).map_or(3, |&arity| arity as usize);
            let number = colors.number_of(*color);
            numbers.resize(numbers.len() + arity, number);
        }
        (numbers, colors.values)
    }

    /// Returns the distinct texture coordinates of corners, and the number of each corner's.
    fn interned_uvs(&self) -> (Vec<Vec4>, Vec<u32>) {
        let mut uvs = Interned::default();
        let numbers = self.corner_uvs.iter().map(|uv| uvs.number_of(uv.extend(0.0).extend(0.0))).collect();
        (uvs.values, numbers)
    }

    /// Returns the triangles of each part. Triangles with two equal vertices are left out.
    fn triangulate(
        &self,
        limits: &Limits,
        cancel: &CancelToken,
        warnings: &mut Warnings,
    ) -> Result<Vec<PartTriangles>, LoadError> {
        let mut parts = vec![PartTriangles::default(); self.parts.len()];
        if let [part] = &mut parts[..] {
            part.triangles.reserve_exact(self.corners.len().saturating_sub(2 * self.faces));
        }
        let mut triangulator = Triangulator::with_budget(WORK_BUDGET);
        let (mut start, mut count) = (0u32, 0);
        for face in 0..self.faces {
            if face % CANCEL_INTERVAL == 0 {
                cancel.check()?;
            }
            let arity = self.arities.get(face).copied().unwrap_or(3);
            let first = start;
            start += arity;
            let part = self.face_parts.get(face).map_or(0, |&part| part as usize);
            let Some(PartTriangles { triangles, polygons }) = parts.get_mut(part) else { continue };
            count += u64::from(arity) - 2;
            LoadError::check_limit("triangles", count, limits.triangles)?;
            let first_triangle = triangles.len();
            let mut push = |corners: [u32; 3]| {
                let [a, b, c] = corners.map(|corner| self.corners[corner as usize]);
                if a != b && b != c && c != a {
                    triangles.push(corners);
                }
            };
            if arity == 3 {
                push([first, first + 1, first + 2]);
                continue;
            }
            let vertices = &self.corners[first as usize..start as usize];
            let polygon = vertices.iter().map(|&vertex| self.positions[vertex as usize]);
            let mut corners = triangulator.triangulate(polygon).map(|corner| first + corner as u32);
            while let (Some(a), Some(b), Some(c)) = (corners.next(), corners.next(), corners.next()) {
                push([a, b, c]);
            }
            (first_triangle + 1..triangles.len()).for_each(|triangle| polygons.join(triangle));
        }
        let fans = triangulator.too_large + triangulator.self_intersecting;
        if fans > 0 {
            let why = "concave or self-intersecting, with too many corners";
            warnings.add("", format!("triangulated {fans} polygons as fans: {why}"));
        }
        Ok(parts)
    }

    /// Makes the normals unit vectors. Those without a direction become those of the triangles around their vertex.
    fn repair_normals(&mut self, parts: &[PartTriangles]) {
        let mut invalid = false;
        for normal in &mut self.normals {
            *normal = normal.as_dvec3().normalize_or_zero().as_vec3();
            invalid |= *normal == Vec3::ZERO;
        }
        if !invalid {
            return;
        }
        let mut sums: Vec<DVec3> = vec![DVec3::ZERO; self.normals.len()];
        for triangle in parts.iter().flat_map(|part| &part.triangles) {
            let vertices = triangle.map(|corner| self.corners[corner as usize] as usize);
            let [a, b, c] = vertices.map(|vertex| self.positions[vertex].as_dvec3());
            let normal = (b - a).cross(c - a);
            if normal.is_finite() {
                vertices.into_iter().for_each(|vertex| sums[vertex] += normal);
            }
        }
        for (normal, sum) in self.normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == Vec3::ZERO) {
            *normal = sum.try_normalize().unwrap_or(DVec3::Y).as_vec3();
        }
    }

    /// Returns the mesh of triangles with attributes of vertices only.
    fn welded_mesh(&mut self, part: PartTriangles) -> Mesh {
        let corners = std::mem::take(&mut self.corners);
        let uvs = std::mem::take(&mut self.uvs);
        Mesh {
            triangles: part.triangles.iter().map(|t| t.map(|corner| corners[corner as usize])).collect(),
            polygons: part.polygons,
            positions: std::mem::take(&mut self.positions),
            normals: std::mem::take(&mut self.normals),
            colors: std::mem::take(&mut self.colors),
            uvs: if uvs.is_empty() { Vec::new() } else { vec![uvs] },
            ..Mesh::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meshes(mesh: PolygonMesh) -> Result<Vec<(Part, Mesh)>, LoadError> {
        mesh.into_meshes(&Limits::default(), &CancelToken::default(), &mut Warnings::default())
    }

    fn square() -> PolygonMesh {
        let mut mesh = PolygonMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            corners: vec![0, 1, 2, 3],
            ..PolygonMesh::default()
        };
        assert!(mesh.push_face(0));
        mesh
    }

    #[test]
    fn polygons_become_triangles_and_keep_their_vertices() {
        let (_, mesh) = meshes(square()).unwrap().remove(0);
        assert_eq!((mesh.triangles.as_slice(), mesh.positions.len()), (&[[0, 1, 2], [0, 2, 3]][..], 4));
        assert!(mesh.polygons.are_same(0, 1));
        let mut line = square();
        line.corners.extend([0, 1]);
        assert!(!line.push_face(4) && line.corners.len() == 4);
    }

    #[test]
    fn colours_of_faces_split_vertices_unless_those_of_vertices_differ() {
        let mut mesh = square();
        mesh.corners.extend([0, 2, 1]);
        mesh.push_face(4);
        mesh.face_colors = vec![Vec4::X, Vec4::Y];
        mesh.colors = vec![Vec4::ONE; 4];
        let (_, split) = meshes(mesh).unwrap().remove(0);
        assert_eq!((split.positions.len(), split.colors[0], split.colors[4]), (7, Vec4::X, Vec4::Y));
        let mut mesh = square();
        mesh.face_colors = vec![Vec4::X];
        mesh.colors = vec![Vec4::ONE, Vec4::ONE, Vec4::ONE, Vec4::Y];
        let (_, kept) = meshes(mesh).unwrap().remove(0);
        assert_eq!((kept.positions.len(), kept.colors[3]), (4, Vec4::Y));
    }

    #[test]
    fn corners_with_different_texture_coordinates_are_different_vertices() {
        let mut mesh = square();
        mesh.corners.extend([0, 2, 1]);
        mesh.push_face(4);
        mesh.corner_uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y, Vec2::ZERO, Vec2::Y, Vec2::X].to_vec();
        let (_, split) = meshes(mesh).unwrap().remove(0);
        assert_eq!((split.positions.len(), split.uvs[0].len()), (5, 5));
    }

    #[test]
    fn normals_without_direction_are_those_of_the_triangles_around() {
        let mut mesh = square();
        mesh.normals = vec![Vec3::ZERO, Vec3::new(0.0, 3.0, 0.0), Vec3::NAN, Vec3::Z];
        let (_, mesh) = meshes(mesh).unwrap().remove(0);
        assert_eq!(mesh.normals, [Vec3::Z, Vec3::Y, Vec3::Z, Vec3::Z]);
    }

    #[test]
    fn corners_of_missing_vertices_are_an_error() {
        let mut mesh = square();
        mesh.corners[2] = 4;
        assert!(meshes(mesh).unwrap_err().to_string().contains("vertex index 4 is out of range"));
    }
}
