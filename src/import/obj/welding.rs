//! Welds corners with the same position, texture coordinate and normal into one vertex.
//!
//! Vertices are numbered in the order of their first use. In large meshes blocks of triangles are welded side by side, each with
//! numbers of its own, and then the vertices of one block after the other get their numbers in the mesh.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::chunk::{Corner, NO_INDEX};
use super::geometry::ObjGeometry;
use crate::polygons::vertex_dedup::{VertexDeduplicator, VertexKey};
use blinn_scene::Polygons;

/// Triangles of a block: its vertices fit the cache of a core.
const BLOCK_TRIANGLES: usize = 1 << 14;

/// Blocks that are welded before their vertices are numbered: bounds the memory they hold.
const BLOCKS_AT_ONCE: usize = 64;

/// A block has a list of all vertices from its first to its last, at most so many for each corner.
const MAX_VERTICES_PER_CORNER: usize = 4;

/// Welds the triangles of a file.
pub(super) struct Welder<'g> {
    geometry: &'g ObjGeometry,
    /// True if a normal of the file is zero.
    any_zero_normal: bool,
    block_triangles: usize,
}

/// Triangles with welded vertices.
#[derive(Debug, Default, PartialEq)]
pub(super) struct WeldedTriangles {
    pub triangles: Vec<[u32; 3]>,
    pub polygons: Polygons,
    /// The vertices of corners whose normal is zero, in ascending order, with the normals of their triangles.
    pub face_normals: Vec<(u32, Vec3)>,
}

/// Triangles of a chunk of the file, from the first of a polygon on.
struct Part {
    chunk: usize,
    range: Range<usize>,
}

/// Welded triangles with the numbers of a block.
struct Block {
    welded: WeldedTriangles,
    /// The vertices, counted from `first_vertex`.
    keys: Vec<VertexKey>,
    first_vertex: u32,
}

impl<'g> Welder<'g> {
    pub fn new(geometry: &'g ObjGeometry, any_zero_normal: bool) -> Welder<'g> {
        Welder { geometry, any_zero_normal, block_triangles: BLOCK_TRIANGLES }
    }

    /// Welds the triangles of parts of the file: chunks and ranges in them, which begin with a polygon. Triangles that use
    /// a vertex twice are left out. `vertices` is empty, and gets the vertices of the others.
    pub fn weld(
        &self,
        parts: impl Iterator<Item = (usize, Range<usize>)> + Clone,
        vertices: &mut VertexDeduplicator,
    ) -> WeldedTriangles {
        let mut out = WeldedTriangles::default();
        let count: usize = parts.clone().map(|(_, range)| range.len()).sum();
        out.triangles.reserve_exact(count);
        // One thread would number vertices twice.
        if count <= self.block_triangles.saturating_mul(2) || rayon::current_num_threads() == 1 {
            for (chunk, range) in parts {
                self.add(&Part { chunk, range }, 0, vertices, &mut out);
            }
            return out;
        }
        for blocks in self.blocks(parts).chunks(BLOCKS_AT_ONCE) {
            let welded: Vec<Option<Block>> =
                blocks.par_iter().with_max_len(1).map(|parts| self.weld_block(parts)).collect();
            let number = |(parts, block): (&Vec<Part>, Option<Block>)| match block {
                Some(mut block) => {
                    let numbers = block.number(vertices);
                    (block.welded, numbers)
                }
                None => {
                    let mut welded = WeldedTriangles::default();
                    parts.iter().for_each(|part| self.add(part, 0, vertices, &mut welded));
                    (welded, Vec::new())
                }
            };
            let mut numbered: Vec<(WeldedTriangles, Vec<u32>)> =
                blocks.iter().zip(welded).map(number).collect();
            numbered.par_iter_mut().for_each(|(welded, numbers)| welded.renumber(numbers));
            numbered.into_iter().for_each(|(welded, _)| out.append(welded));
        }
        out
    }

    /// Divides parts into blocks of about as many triangles. No polygon is divided.
    fn blocks(&self, parts: impl Iterator<Item = (usize, Range<usize>)>) -> Vec<Vec<Part>> {
        let mut blocks = Vec::new();
        let mut block = Vec::new();
        let mut room = self.block_triangles;
        for (chunk, range) in parts {
            let polygons = &self.geometry.polygons[chunk];
            let mut start = range.start;
            while start < range.end {
                let mut end = range.end.min(start + room);
                while end < range.end && polygons.is_joined(end) {
                    end += 1;
                }
                block.push(Part { chunk, range: start..end });
                room = room.saturating_sub(end - start);
                if room == 0 {
                    blocks.push(std::mem::take(&mut block));
                    room = self.block_triangles;
                }
                start = end;
            }
        }
        blocks.push(block);
        blocks
    }

    /// Welds a block. Returns `None` if its triangles use vertices from all over the file.
    fn weld_block(&self, parts: &[Part]) -> Option<Block> {
        let corners = parts.iter().flat_map(|part| self.triangles(part)).flatten();
        let (least, most, count) = corners.fold((u32::MAX, 0, 0), |(least, most, count), corner| {
            (corner.v.min(least), corner.v.max(most), count + 1)
        });
        let first_vertex = least.min(most);
        let vertex_count = (most - first_vertex) as usize + 1;
        if vertex_count > MAX_VERTICES_PER_CORNER * count {
            return None;
        }
        let mut vertices = VertexDeduplicator::new(vertex_count);
        let mut welded = WeldedTriangles::default();
        welded.triangles.reserve_exact(count / 3);
        parts.iter().for_each(|part| self.add(part, first_vertex, &mut vertices, &mut welded));
        Some(Block { welded, keys: vertices.into_keys(), first_vertex })
    }

    /// Adds the triangles of a part. `vertices` counts from `first_vertex`.
    fn add(
        &self,
        part: &Part,
        first_vertex: u32,
        vertices: &mut VertexDeduplicator,
        out: &mut WeldedTriangles,
    ) {
        let ObjGeometry { polygons, normals, positions, .. } = self.geometry;
        let polygons = &polygons[part.chunk];
        let mut begins_polygon = true;
        for (index, t) in part.range.clone().zip(self.triangles(part)) {
            begins_polygon |= !polygons.is_joined(index);
            let [a, b, c] = t;
            // The triangle has no area.
            if a.v == b.v || b.v == c.v || c.v == a.v {
                continue;
            }
            if !std::mem::take(&mut begins_polygon) {
                out.polygons.join(out.triangles.len());
            }
            let triangle = t.map(|c| {
                if self.any_zero_normal && c.vn != NO_INDEX && normals[c.vn as usize] == Vec3::ZERO {
                    let vertex = vertices.add_unique(c.v - first_vertex, c.vt, c.vn);
                    let normal = face_normal(t, positions).unwrap_or(DVec3::Y);
                    out.face_normals.push((vertex, normal.as_vec3()));
                    return vertex;
                }
                vertices.number_of(c.v - first_vertex, c.vt, c.vn)
            });
            out.triangles.push(triangle);
        }
    }

    fn triangles(&self, part: &Part) -> &'g [[Corner; 3]] {
        &self.geometry.triangles[part.chunk].as_chunks::<3>().0[part.range.clone()]
    }
}

impl Block {
    /// Adds the vertices of the block to those of the mesh, and returns their numbers there.
    fn number(&mut self, vertices: &mut VertexDeduplicator) -> Vec<u32> {
        let mut unique = self.welded.face_normals.iter_mut().peekable();
        let number = |(i, key): (usize, &VertexKey)| {
            let v = self.first_vertex + key.v;
            match unique.next_if(|(vertex, _)| *vertex as usize == i) {
                Some((vertex, _)) => {
                    *vertex = vertices.add_unique(v, key.a, key.b);
                    *vertex
                }
                None => vertices.number_of(v, key.a, key.b),
            }
        };
        self.keys.iter().enumerate().map(number).collect()
    }
}

impl WeldedTriangles {
    /// Replaces the number of each vertex of the triangles; none if `numbers` is empty.
    fn renumber(&mut self, numbers: &[u32]) {
        if !numbers.is_empty() {
            let vertices = self.triangles.as_flattened_mut();
            vertices.iter_mut().for_each(|vertex| *vertex = numbers[*vertex as usize]);
        }
    }

    /// Adds the triangles of a block with the numbers of the mesh.
    fn append(&mut self, mut block: WeldedTriangles) {
        let start = self.triangles.len();
        if !block.polygons.is_empty() {
            let joined = (0..block.triangles.len()).filter(|&i| block.polygons.is_joined(i));
            joined.for_each(|i| self.polygons.join(start + i));
        }
        self.triangles.append(&mut block.triangles);
        self.face_normals.append(&mut block.face_normals);
    }
}

/// Returns the normal of a triangle, or `None` if it has no area.
fn face_normal(corners: &[Corner; 3], positions: &[Vec3]) -> Option<DVec3> {
    let [a, b, c] = corners.map(|c| positions[c.v as usize].as_dvec3());
    (b - a).cross(c - a).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LoadOptions;
    use crate::obj::fast_parser;

    const SIDE: usize = 40;

    /// A grid of quads, triangles, pentagons and triangles without area, some of them with vertices far away, some with
    /// normals that are zero.
    fn geometry() -> ObjGeometry {
        let mut text = String::new();
        for i in 0..SIDE * SIDE {
            let (x, y) = (i % SIDE, i / SIDE);
            let normal = if i % 7 == 0 { 0 } else { 1 };
            let height = i % 3;
            text.push_str(&format!("v {x} {y} {height}\nvt 0.{x} 0.{y}\nvn 0 0 {normal}\n"));
        }
        for i in (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE < SIDE - 2) {
            let corner = |vertex: usize| format!("{0}/{0}/{1}", vertex + 1, vertex / 2 + 1);
            let far = (i * 37) % (SIDE * SIDE);
            let [a, b, c, d, e, far] = [i, i + 1, i + 1 + SIDE, i + SIDE, i + 2, far].map(corner);
            let faces = match i % 11 {
                0 => format!("f {a} {b} {c}\nf {a} {c} {c}\nf {a} {a} {d} {c}"),
                1 => format!("f {a} {b} {e} {c} {d}"),
                2 => format!("f {a} {b} {far}"),
                _ => format!("f {a} {b} {c} {d}"),
            };
            text.push_str(&faces);
            text.push('\n');
        }
        let limits = LoadOptions::default().limits;
        let parsed = fast_parser::parse(text.as_bytes(), 5000, &limits, None).unwrap();
        ObjGeometry::assemble(parsed.chunks, false).unwrap()
    }

    #[test]
    fn blocks_are_numbered_as_the_whole_mesh() {
        let geometry = geometry();
        let parts = || geometry.segments.iter().map(|segment| (segment.chunk, segment.range.clone()));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let weld = |block_triangles: usize| {
            let welder = Welder { block_triangles, ..Welder::new(&geometry, true) };
            let mut vertices = VertexDeduplicator::new(geometry.positions.len());
            let welded = pool.install(|| welder.weld(parts(), &mut vertices));
            let keys: Vec<_> = vertices.into_keys().iter().map(|key| (key.v, key.a, key.b)).collect();
            (welded, keys)
        };
        let whole = weld(usize::MAX);
        assert!(whole.0.triangles.len() > 2000 && !whole.0.polygons.is_empty());
        assert!(whole.0.face_normals.len() > 200 && whole.1.len() > SIDE * SIDE);
        // Small blocks with a vertex far away are welded with those of the mesh, larger ones on their own.
        for block_triangles in [1, 7, 64, 500] {
            assert!(weld(block_triangles) == whole, "{block_triangles}");
        }
    }
}
