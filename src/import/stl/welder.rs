//! Vertices of triangles that share none: those at one place become one.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use crate::polygons::polygon_mesh::PolygonMesh;

/// Numbers positions in the order of their first use.
#[derive(Default)]
pub(super) struct Welder {
    vertices: HashMap<[u32; 3], u32>,
    origin: DVec3,
}

impl Welder {
    /// Creates a welder of positions relative to `origin`.
    pub fn new(origin: DVec3) -> Welder {
        Welder { vertices: HashMap::new(), origin }
    }

    /// Adds a corner to the mesh.
    pub fn push_corner(&mut self, position: DVec3, mesh: &mut PolygonMesh) {
        // Adding zero turns -0 into 0.
        let position = (position - self.origin).as_vec3() + Vec3::ZERO;
        let vertex = *self.vertices.entry(position.to_array().map(f32::to_bits)).or_insert_with(|| {
            mesh.positions.push(position);
            mesh.positions.len() as u32 - 1
        });
        mesh.corners.push(vertex);
    }
}
