//! Welds vertices: those with equal position, normal and texture coordinates are one to MikkTSpace.

use std::hash::{BuildHasher, RandomState};

use blinn_scene::Mesh;
use glam::Vec2;

/// Stands for a vertex, or for the vertices of a triangle, that MikkTSpace skips.
pub(super) const SKIPPED: u32 = u32::MAX;

/// Numbers of a vertex must be smaller: MikkTSpace multiplies up to four of them.
const MAX_VALUE: f32 = 1e15;

/// Marks a free slot. No vertex has the index `u32::MAX`.
const FREE: u64 = u64::MAX;

/// Returns the welded vertices of all triangles. Those of a triangle without three distinct positions, or with a vertex
/// that has invalid numbers, are [`SKIPPED`].
pub(super) fn weld_triangles(mesh: &Mesh, uvs: &[Vec2]) -> Vec<[u32; 3]> {
    let welded = weld_vertices(mesh, uvs);
    let weld = |corners: &[u32; 3]| {
        let ids = corners.map(|v| welded[v as usize]);
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
        let is_valid = !ids.contains(&SKIPPED) && a != b && b != c && c != a;
        if is_valid { ids } else { [SKIPPED; 3] }
    };
    mesh.triangles.iter().map(weld).collect()
}

/// Returns for each vertex the first vertex that equals it.
fn weld_vertices(mesh: &Mesh, uvs: &[Vec2]) -> Vec<u32> {
    let values = |v: u32| {
        let p = mesh.positions[v as usize];
        let n = mesh.normals[v as usize];
        let t = uvs[v as usize];
        // Adding zero turns -0 into 0.
        [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y].map(|x| x + 0.0)
    };
    let vertices = mesh.positions.len();
    let mut slots = vec![FREE; (2 * vertices).next_power_of_two()];
    let mask = slots.len() - 1;
    let keys = HashKeys::random();
    let mut weld = |v: u32| {
        let own = values(v);
        if !own.iter().all(|x| x.abs() < MAX_VALUE) {
            return SKIPPED;
        }
        let hash = keys.hash(own.map(f32::to_bits));
        // A slot has the upper half of the hash, and a vertex.
        let tag = hash & !u64::from(u32::MAX);
        let mut at = hash as usize & mask;
        loop {
            let slot = slots[at];
            if slot == FREE {
                slots[at] = tag | u64::from(v);
                return v;
            }
            let first = slot as u32;
            if slot ^ u64::from(first) == tag && values(first) == own {
                return first;
            }
            at = (at + 1) & mask;
        }
    };
    (0..vertices as u32).map(&mut weld).collect()
}

/// Keys of a hash by multiplication. They are random, so that no file has vertices that share their hashes.
struct HashKeys([u64; 5]);

impl HashKeys {
    fn random() -> HashKeys {
        let state = RandomState::new();
        HashKeys([0u8, 1, 2, 3, 4].map(|i| state.hash_one(i)))
    }

    fn hash(&self, values: [u32; 8]) -> u64 {
        let HashKeys(keys) = self;
        let word = |i: usize| (u64::from(values[2 * i]) | u64::from(values[2 * i + 1]) << 32) ^ keys[i];
        let folded = fold(word(0), word(1)) ^ fold(word(2), word(3)).rotate_left(32);
        fold(folded, keys[4])
    }
}

/// Multiplies to 128 bits and folds the halves together.
fn fold(a: u64, b: u64) -> u64 {
    let product = u128::from(a) * u128::from(b);
    product as u64 ^ (product >> 64) as u64
}
