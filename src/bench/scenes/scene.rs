//! The generated scenes in memory.

use super::mesh::{Fnv1a, GeneratedMesh};
use super::vector::unit;

/// A scene with a camera and lights. Metres, +Y up.
#[derive(Clone, Debug)]
pub struct GeneratedScene {
    /// The name of its kind.
    pub name: String,
    /// The meshes in local coordinates.
    pub meshes: Vec<GeneratedMesh>,
    /// The instances of the meshes.
    pub instances: Vec<GeneratedInstance>,
    /// Position of the camera.
    pub eye: [f32; 3],
    /// The point that the camera looks at.
    pub target: [f32; 3],
    /// Vertical field of view in degrees.
    pub yfov: f32,
    /// Position of the point light.
    pub light: [f32; 3],
    /// The direction in which sunlight travels.
    pub sun_direction: [f32; 3],
    /// True if the meshes are textured.
    pub textured: bool,
}

/// An instance of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneratedInstance {
    /// Index of the mesh.
    pub mesh: usize,
    /// Columns of the local-to-world transform: x, y, z axes and the origin.
    pub columns: [[f32; 3]; 4],
}

impl GeneratedInstance {
    /// An instance whose local coordinates are world coordinates.
    pub fn identity(mesh: usize) -> GeneratedInstance {
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
        GeneratedInstance { mesh, columns }
    }

    /// Transforms a point to the world.
    pub fn transform_point(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z, o] = self.columns;
        [0, 1, 2].map(|a| x[a] * p[0] + y[a] * p[1] + z[a] * p[2] + o[a])
    }

    /// Transforms a normal to the world. Transforms are rotations, uniform scales and translations.
    pub fn transform_normal(&self, n: [f32; 3]) -> [f32; 3] {
        let [x, y, z, _] = self.columns;
        unit([0, 1, 2].map(|a| x[a] * n[0] + y[a] * n[1] + z[a] * n[2]))
    }
}

impl GeneratedScene {
    /// The number of triangles, counted for each instance.
    pub fn drawn_triangles(&self) -> usize {
        self.instances.iter().map(|i| self.meshes[i.mesh].triangles.len()).sum()
    }

    /// The number of triangles, counted once per mesh.
    pub fn stored_triangles(&self) -> usize {
        self.meshes.iter().map(|m| m.triangles.len()).sum()
    }

    /// A hash of all numbers (FNV-1a), for tests.
    pub fn hash(&self) -> u64 {
        let mut hash = Fnv1a::default();
        for mesh in &self.meshes {
            mesh.hash(&mut hash);
        }
        for instance in &self.instances {
            hash.add(instance.mesh as u32);
            instance.columns.iter().flatten().for_each(|x| hash.add(x.to_bits()));
        }
        for x in [self.eye, self.target, self.light, self.sun_direction].iter().flatten() {
            hash.add(x.to_bits());
        }
        hash.value()
    }
}
