//! Meshes of triangles, points or lines, with morph targets and joint influences for animation.

use glam::{Vec2, Vec3, Vec4};

use crate::{EdgeMarks, Polygons, Rounds};

/// Indexed triangles, or points or lines, of one material, in a local frame. Attribute arrays are as long as `positions`, or
/// empty where the mesh lacks the attribute.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name in the file.
    pub name: String,
    /// Vertex positions in metres.
    pub positions: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from the front. All are valid.
    pub triangles: Vec<[u32; 3]>,
    /// The edges that are drawn, where the file says so.
    pub edge_marks: EdgeMarks,
    /// The polygons that the triangles were cut from.
    pub polygons: Polygons,
    /// Points or lines in place of triangles.
    pub rounds: Rounds,
    /// Unit vertex normals. Empty means flat shading.
    pub normals: Vec<Vec3>,
    /// True interpolates the normals in the local frame and then transforms them. False transforms and
    /// normalises them before interpolation. The two differ under non-uniform scale.
    pub interpolate_normals_locally: bool,
    /// True leaves the normals on the front whatever their angle to a triangle: only the side that is seen turns them, as in
    /// Cycles. False turns them to the seen side of each triangle, as some files need whose normals point against the
    /// winding.
    pub keeps_normal_side: bool,
    /// Unit tangents, with the sign of the bitangent in w, for the texture coordinates of the normal map.
    pub tangents: Vec<Vec4>,
    /// The parts of normals and tangents that were generated at import.
    pub generated_frames: GeneratedFrames,
    /// Sets of texture coordinates. As in glTF, v runs down from the top of the image.
    pub uvs: Vec<Vec<Vec2>>,
    /// Vertex colours, linear RGBA.
    pub colors: Vec<Vec4>,
    /// Material.
    pub material: u32,
    /// True if the mesh, of a transmissive material, bounds a solid (a body); false if it is a thin wall.
    pub is_body: bool,
    /// Morph targets.
    pub morph_targets: Vec<MorphTarget>,
    /// Weights of the morph targets in the rest pose.
    pub morph_weights: Vec<f32>,
    /// Joint influences of a skinned mesh.
    pub influences: Influences,
}

impl Mesh {
    /// Returns a set of texture coordinates, if the mesh has it.
    pub fn uv_set(&self, set: u32) -> Option<&[Vec2]> {
        self.uvs.get(set as usize).filter(|uvs| !uvs.is_empty()).map(Vec::as_slice)
    }

    /// Returns the vertices without deformation.
    pub(crate) fn rest_shape(&self) -> DeformedMesh {
        DeformedMesh {
            positions: self.positions.clone(),
            normals: self.normals.clone(),
            tangents: self.tangents.clone(),
            ..DeformedMesh::default()
        }
    }

    /// Returns the texture coordinates at a triangle's corners; zeros if the mesh lacks the set.
    #[inline]
    pub fn uvs_at(&self, corners: [u32; 3], set: u32) -> [Vec2; 3] {
        uvs_at(&self.uvs, corners, set)
    }

    /// Returns true if a morph target displaces a set of texture coordinates.
    pub(crate) fn morphs_uvs(&self, set: u32) -> bool {
        let displaces =
            |target: &MorphTarget| target.uvs.get(set as usize).is_some_and(|uvs| !uvs.is_empty());
        self.morph_targets.iter().any(displaces)
    }

    /// Returns true if a morph target displaces the alpha of a vertex.
    pub(crate) fn morphs_alpha(&self, vertex: u32) -> bool {
        let displaces = |target: &MorphTarget| target.colors.get(vertex as usize).is_some_and(|c| c.w != 0.0);
        self.morph_targets.iter().any(displaces)
    }
}

/// Returns the texture coordinates at a triangle's corners; zeros if the set is missing.
#[inline]
pub fn uvs_at(sets: &[Vec<Vec2>], corners: [u32; 3], set: u32) -> [Vec2; 3] {
    let uvs = sets.get(set as usize).filter(|uvs| !uvs.is_empty());
    uvs.map_or([Vec2::ZERO; 3], |uvs| corners.map(|c| uvs[c as usize]))
}

/// The parts of a mesh's tangent frames that the importer generated from the rest shape. Generated parts
/// follow the deformed triangles; parts from the file follow morph targets and joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum GeneratedFrames {
    /// Nothing.
    #[default]
    None,
    /// The tangents.
    Tangents,
    /// Tangents and flat normals. The triangles share no vertices.
    NormalsAndTangents,
}

/// Displacements from the rest shape of a mesh. Arrays are as long as the mesh's, or empty.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Name in the file.
    pub name: String,
    /// Added to the positions.
    pub positions: Vec<Vec3>,
    /// Added to the normals.
    pub normals: Vec<Vec3>,
    /// Added to xyz of the tangents.
    pub tangents: Vec<Vec3>,
    /// Added to the sets of texture coordinates. Sets that are not displaced are empty or missing.
    pub uvs: Vec<Vec<Vec2>>,
    /// Added to the vertex colours, linear RGBA. The sums are clamped to 0 to 1.
    pub colors: Vec<Vec4>,
}

/// Joint indices and weights of a skinned mesh: `per_vertex` pairs for each vertex. The weights of a
/// vertex sum to 1.
#[derive(Clone, Debug, Default)]
pub struct Influences {
    /// Pairs for each vertex: 4, 8, …; 0 for a mesh without skin.
    pub per_vertex: usize,
    /// Indices into the skin's joints.
    pub joints: Vec<u16>,
    /// Weights.
    pub weights: Vec<f32>,
}

/// The vertex attributes of a mesh deformed by a skin or by morph targets.
#[derive(Clone, Debug, Default)]
pub struct DeformedMesh {
    /// Replaces the positions.
    pub positions: Vec<Vec3>,
    /// Replaces the normals; empty if the mesh has none.
    pub normals: Vec<Vec3>,
    /// Replaces the tangents; empty if the mesh has none.
    pub tangents: Vec<Vec4>,
    /// Replaces all sets of texture coordinates; empty if no morph target displaces one.
    pub uvs: Vec<Vec<Vec2>>,
    /// Replaces the vertex colours; empty if no morph target displaces them.
    pub colors: Vec<Vec4>,
}
