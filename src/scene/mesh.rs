//! Triangle meshes.

use glam::{Vec2, Vec3, Vec4};

use super::GeneratedFrames;

/// Indexed triangles of one material, in a local frame. Attribute arrays are as long as
/// `positions`, or empty where the file has none.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Its name in the file.
    pub name: String,
    /// Vertices in metres.
    pub positions: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from the front; all within `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Unit vertex normals; empty means flat.
    pub normals: Vec<Vec3>,
    /// True: between vertices, normals are blended in the mesh's own frame, then taken to the world. Else
    /// each is of unit length in the world before. The two differ where a node scales unevenly.
    pub interpolate_normals_locally: bool,
    /// Unit tangents with the bitangent's sign in w, along the set of the normal map.
    pub tangents: Vec<Vec4>,
    /// What of those the file does not have.
    pub generated_frames: GeneratedFrames,
    /// Texture coordinates by set, as glTF has them: v runs down from the image's top.
    pub uvs: Vec<Vec<Vec2>>,
    /// Vertex colours, linear RGBA.
    pub colors: Vec<Vec4>,
    /// Index of its material.
    pub material: u32,
    /// Shapes to blend in.
    pub morph_targets: Vec<MorphTarget>,
    /// Weights of the morph targets at rest.
    pub morph_weights: Vec<f32>,
    /// Which joints move which vertex.
    pub influences: Influences,
}

impl Mesh {
    /// A set of texture coordinates, if it has that.
    pub fn uv_set(&self, set: u32) -> Option<&[Vec2]> {
        self.uvs.get(set as usize).filter(|uvs| !uvs.is_empty()).map(Vec::as_slice)
    }

    /// The texture coordinates of a set at a triangle's corners; the origin where there is no such set.
    pub fn uvs_at(&self, corners: [u32; 3], set: u32) -> [Vec2; 3] {
        self.uv_set(set).map_or([Vec2::ZERO; 3], |uvs| corners.map(|c| uvs[c as usize]))
    }
}

/// Displacements from a mesh's rest shape; arrays are as long as the mesh's, or empty.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Its name in the file.
    pub name: String,
    /// Added to the positions.
    pub positions: Vec<Vec3>,
    /// Added to the normals.
    pub normals: Vec<Vec3>,
    /// Added to the tangents' xyz.
    pub tangents: Vec<Vec3>,
}

/// Joint weights of a skinned mesh: `per_vertex` pairs for each vertex, weights summing to one.
#[derive(Clone, Debug, Default)]
pub struct Influences {
    /// Pairs for each vertex: 4, 8, …; 0 for a mesh without skin.
    pub per_vertex: usize,
    /// Indices into the skin's joints.
    pub joints: Vec<u16>,
    /// Their weights.
    pub weights: Vec<f32>,
}
