//! Finds the triangles that share an edge, and triangles that are the same.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};

use super::welding::SKIPPED;

/// A half-edge without another one.
pub(super) const NONE: u32 = u32::MAX;

/// The edges of triangles by their smaller vertex. A half-edge runs from the corner that has its index to the next corner
/// of the triangle.
struct EdgeTable {
    /// Position of the first edge of each vertex, and the end of the last.
    starts: Vec<u32>,
    /// Larger vertex in the upper half, half-edge in the lower: sorted for each smaller vertex.
    edges: Vec<u64>,
}

impl EdgeTable {
    fn new(triangles: &[[u32; 3]], vertices: usize) -> EdgeTable {
        let half_edges = || {
            let of_triangle = |(t, &[a, b, c]): (usize, &[u32; 3])| {
                let first = 3 * t as u32;
                [(a, b, first), (b, c, first + 1), (c, a, first + 2)]
            };
            let used = |(_, ids): &(usize, &[u32; 3])| ids[0] != SKIPPED;
            triangles.iter().enumerate().filter(used).flat_map(of_triangle)
        };
        let mut starts = vec![0u32; vertices + 1];
        for (a, b, _) in half_edges() {
            starts[a.min(b) as usize] += 1;
        }
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        let mut edges = vec![0u64; end as usize];
        // Each start moves down from the end to the beginning of its edges.
        for (a, b, half_edge) in half_edges() {
            let start = &mut starts[a.min(b) as usize];
            *start -= 1;
            edges[*start as usize] = u64::from(a.max(b)) << 32 | u64::from(half_edge);
        }
        let mut table = EdgeTable { starts, edges };
        for v in 0..vertices {
            let range = table.starts[v] as usize..table.starts[v + 1] as usize;
            table.edges[range].sort_unstable();
        }
        table
    }

    /// Calls `visit` with a smaller vertex and all half-edges between it and a larger one, in order of their triangles.
    fn for_each(&self, mut visit: impl FnMut(u32, &[u64])) {
        for (v, range) in self.starts.windows(2).enumerate() {
            let edges = &self.edges[range[0] as usize..range[1] as usize];
            edges.chunk_by(|a, b| a >> 32 == b >> 32).for_each(|edge| visit(v as u32, edge));
        }
    }
}

/// The half-edges of triangles that MikkTSpace connects, and the triangles that it does not see.
pub(super) struct Neighbors {
    /// For each half-edge the opposite one of the neighbour, or [`NONE`].
    pub twins: Vec<u32>,
    /// Triangles with the same corners as others.
    pub duplicates: Vec<Duplicate>,
}

/// A triangle with the same corners as an earlier one.
pub(super) struct Duplicate {
    pub triangle: u32,
    pub original: u32,
    /// Position of the original's first corner in the duplicate.
    pub rotation: usize,
}

/// Pairs half-edges that run in opposite directions between the same two welded vertices, the earliest first. Of triangles
/// that are the same all but the first are marked as [`SKIPPED`].
pub(super) fn find_neighbors(triangles: &mut [[u32; 3]], vertices: usize) -> Neighbors {
    let mut table = EdgeTable::new(triangles, vertices);
    let mut duplicates = Vec::new();
    if has_repeated_half_edges(&table, triangles) {
        duplicates = skip_duplicates(triangles);
        if !duplicates.is_empty() {
            table = EdgeTable::new(triangles, vertices);
        }
    }
    let corners = triangles.as_flattened();
    let mut twins = vec![NONE; corners.len()];
    // Half-edges that wait for an opposite one. All have the same direction.
    let mut waiting: VecDeque<u32> = VecDeque::new();
    table.for_each(|v, edge| {
        let is_forward = |half_edge: u32| corners[half_edge as usize] == v;
        waiting.clear();
        for half_edge in edge.iter().map(|&e| e as u32) {
            match waiting.front() {
                Some(&first) if is_forward(first) != is_forward(half_edge) => {
                    waiting.pop_front();
                    twins[first as usize] = half_edge;
                    twins[half_edge as usize] = first;
                }
                _ => waiting.push_back(half_edge),
            }
        }
    });
    Neighbors { twins, duplicates }
}

/// Returns true if several triangles have the same half-edge, as all duplicates do.
fn has_repeated_half_edges(table: &EdgeTable, triangles: &[[u32; 3]]) -> bool {
    let corners = triangles.as_flattened();
    let mut repeated = false;
    table.for_each(|v, edge| {
        let forward = |&e: &u64| corners[e as u32 as usize] == v;
        repeated |= match edge {
            [_] => false,
            [a, b] => forward(a) == forward(b),
            _ => true,
        };
    });
    repeated
}

/// Finds duplicates and marks them as [`SKIPPED`].
fn skip_duplicates(triangles: &mut [[u32; 3]]) -> Vec<Duplicate> {
    let mut duplicates = Vec::new();
    let mut first: HashMap<[u32; 3], (u32, usize)> = HashMap::with_capacity(triangles.len());
    for (i, ids) in triangles.iter_mut().enumerate().filter(|(_, ids)| ids[0] != SKIPPED) {
        let triangle = i as u32;
        let start = (0..3).min_by_key(|&k| ids[k]).unwrap_or(0);
        match first.entry([ids[start], ids[(start + 1) % 3], ids[(start + 2) % 3]]) {
            Entry::Occupied(entry) => {
                let (original, original_start) = *entry.get();
                let rotation = (start + 3 - original_start) % 3;
                duplicates.push(Duplicate { triangle, original, rotation });
                *ids = [SKIPPED; 3];
            }
            Entry::Vacant(slot) => {
                slot.insert((triangle, start));
            }
        }
    }
    duplicates
}
