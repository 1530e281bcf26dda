//! Generated meshes.

use super::vector::{add, cross, sub, unit};

/// Indexed triangles, counter-clockwise from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GeneratedMesh {
    /// The name.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit vertex normals; empty for flat shading.
    pub normals: Vec<[f32; 3]>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// Linear base colour.
    pub color: [f32; 3],
}

impl GeneratedMesh {
    /// An empty mesh.
    pub(super) fn named(name: &str, color: [f32; 3]) -> GeneratedMesh {
        GeneratedMesh { name: name.into(), color, ..GeneratedMesh::default() }
    }

    /// Sets vertex normals: the area-weighted mean of the adjacent triangles' normals.
    pub(super) fn smooth(&mut self) {
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

    /// Appends `other` without its normals. `transform` transforms its points.
    pub(super) fn append(&mut self, other: &GeneratedMesh, transform: impl Fn([f32; 3]) -> [f32; 3]) {
        let base = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|&p| transform(p)));
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
    }

    /// Hashes all numbers.
    pub(super) fn hash(&self, hash: &mut Fnv1a) {
        for p in self.positions.iter().chain(&self.normals) {
            p.iter().for_each(|x| hash.add(x.to_bits()));
        }
        self.triangles.iter().flatten().for_each(|&v| hash.add(v));
    }
}

/// The hash FNV-1a, over 32-bit words.
pub(super) struct Fnv1a(u64);

impl Default for Fnv1a {
    fn default() -> Fnv1a {
        Fnv1a(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv1a {
    pub fn add(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
    }

    pub fn value(&self) -> u64 {
        self.0
    }
}
