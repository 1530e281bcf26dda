//! Meshes in memory.

use super::vector::{add, cross, sub, unit};

/// Indexed triangles, counter-clockwise from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GeneratedMesh {
    /// Its name.
    pub name: String,
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the vertices; empty where the mesh is flat.
    pub normals: Vec<[f32; 3]>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Linear base colour.
    pub color: [f32; 3],
}

impl GeneratedMesh {
    pub(crate) fn named(name: &str, color: [f32; 3]) -> GeneratedMesh {
        GeneratedMesh { name: name.into(), color, ..GeneratedMesh::default() }
    }

    /// Gives every vertex the mean of its triangles' normals, by area.
    pub(crate) fn smooth(&mut self) {
        let mut sums = vec![[0.0; 3]; self.positions.len()];
        for t in &self.triangles {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            let n = cross(sub(b, a), sub(c, a));
            for &v in t {
                sums[v as usize] = add(sums[v as usize], n);
            }
        }
        self.normals = sums.into_iter().map(unit).collect();
    }

    /// Adds `other`, each point moved by `place`. Without normals of its own.
    pub(crate) fn join(&mut self, other: &GeneratedMesh, place: impl Fn([f32; 3]) -> [f32; 3]) {
        let base = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|&p| place(p)));
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
    }

    pub(crate) fn add_to(&self, hash: &mut Fnv) {
        for p in self.positions.iter().chain(&self.normals) {
            p.iter().for_each(|x| hash.add(x.to_bits()));
        }
        self.triangles.iter().flatten().for_each(|&v| hash.add(v));
    }
}

/// The hash FNV-1a over words.
pub(crate) struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Fnv {
        Fnv(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    pub fn add(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
    }

    pub fn value(&self) -> u64 {
        self.0
    }
}
