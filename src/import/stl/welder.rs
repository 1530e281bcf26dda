//! Vertices of triangles that share none: those at one place become one.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use crate::error::LoadError;
use crate::memory::MemoryBudget;
use crate::polygons::meshes_bytes::POSITION;
use crate::polygons::polygon_mesh::PolygonMesh;

/// Vertices whose memory is charged at first: as many as a hash table of 4,096 slots takes. Later as many again are, as
/// tables and lists grow.
const CHARGED_VERTICES: usize = 7 << 9;
/// Bytes of a position in a slot of the hash table, with its number and a byte of the hash.
const SLOT: u64 = 17;

/// Numbers positions in the order of their first use.
pub(super) struct Welder<'b> {
    vertices: HashMap<[u32; 3], u32>,
    origin: DVec3,
    budget: &'b MemoryBudget,
    /// Number of vertices whose memory is charged, and the bytes charged for the hash table.
    charged_vertices: usize,
    charged_table: u64,
}

/// Returns the bytes of a hash table for `vertices` vertices while it grows from half of its size.
fn table_bytes(vertices: usize) -> u64 {
    // At most seven of eight slots are used, and their number is a power of two.
    let slots = (vertices as u64 * 8).div_ceil(7).next_power_of_two();
    SLOT * (slots + slots / 2)
}

impl<'b> Welder<'b> {
    /// Creates a welder of positions relative to `origin`, which charges vertices to `budget`.
    pub fn new(origin: DVec3, budget: &'b MemoryBudget) -> Welder<'b> {
        Welder { vertices: HashMap::new(), origin, budget, charged_vertices: 0, charged_table: 0 }
    }

    /// Returns the bytes charged for what ends with the welder.
    pub fn charged_table(&self) -> u64 {
        self.charged_table
    }

    /// Charges further vertices before they are added.
    #[cold]
    fn charge(&mut self) -> Result<(), LoadError> {
        let more = self.charged_vertices.max(CHARGED_VERTICES);
        self.charged_vertices += more;
        let table = table_bytes(self.charged_vertices);
        self.budget.charge(POSITION * more as u64 + table - self.charged_table)?;
        self.charged_table = table;
        Ok(())
    }

    /// Adds a corner to the mesh.
    ///
    /// # Errors
    /// Its vertex takes more memory than allowed.
    pub fn push_corner(&mut self, position: DVec3, mesh: &mut PolygonMesh) -> Result<(), LoadError> {
        if self.vertices.len() == self.charged_vertices {
            self.charge()?;
        }
        // Adding zero turns -0 into 0.
        let position = (position - self.origin).as_vec3() + Vec3::ZERO;
        let vertex = *self.vertices.entry(position.to_array().map(f32::to_bits)).or_insert_with(|| {
            mesh.positions.push(position);
            mesh.positions.len() as u32 - 1
        });
        mesh.corners.push(vertex);
        Ok(())
    }
}
