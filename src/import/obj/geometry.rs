//! Assembles the chunks of a file: makes indices absolute, applies statements to faces, triangulates polygons.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::chunk::{Chunk, Corner, NO_COLOR, RoundElement, Statement, VertexFormat};
use super::rounds::RoundGroups;
use super::segment::{Segment, SegmentKey};
use super::smoothing::add_smooth_normals;
use crate::polygons::triangulator::{Triangulator, WORK_BUDGET, spend_work};
use blinn_scene::Polygons;

/// The geometry and statements of an OBJ file.
#[derive(Debug, Default)]
pub(super) struct ObjGeometry {
    pub positions: Vec<Vec3>,
    /// Vertex colours as written. Empty if no vertex has a colour; [`NO_COLOR`] for a vertex without one.
    pub colors: Vec<Vec4>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<Vec3>,
    /// Triangles as consecutive triples of corners, a list per chunk.
    pub triangles: Vec<Vec<Corner>>,
    /// The polygons of the triangles, for each chunk.
    pub polygons: Vec<Polygons>,
    pub segments: Vec<Segment>,
    pub objects: Vec<String>,
    pub materials: Vec<String>,
    /// The rest of each `mtllib` line.
    pub libraries: Vec<String>,
    pub rounds: RoundGroups,
    /// True if all vertices are points: normals belong to them.
    pub is_cloud: bool,
    /// Number of faces with fewer than three corners.
    pub degenerate: u64,
    /// Number of concave polygons too large for ear clipping.
    pub too_large: u64,
    /// Number of self-intersecting polygons too large for ear clipping.
    pub self_intersecting: u64,
}

impl ObjGeometry {
    /// Assembles the chunks of a file, whose `o` statements reset the material at will. Returns `None` if an index is out of
    /// range.
    pub fn assemble(mut chunks: Vec<Chunk>, objects_reset_materials: bool) -> Option<ObjGeometry> {
        let is_bare = chunks.iter().all(Chunk::is_bare);
        let count = |b: &Chunk| [b.positions.len(), b.uvs.len(), b.normals.len()];
        let mut before = Vec::with_capacity(chunks.len());
        let mut totals = [0; 3];
        for chunk in &chunks {
            before.push(totals);
            (0..3).for_each(|k| totals[k] += count(chunk)[k]);
        }
        if let Some(last) = chunks.last_mut()
            && totals[0] > 0
            && is_bare
        {
            last.push_cloud(totals[0]);
        }
        let resolve = |(chunk, before): (&mut Chunk, &[usize; 3])| chunk.resolve_indices(*before, totals);
        if !chunks.par_iter_mut().zip(&before).all(resolve) {
            return None;
        }
        let mut out = ObjGeometry {
            degenerate: chunks.iter().map(|b| b.degenerate).sum(),
            is_cloud: chunks.iter().any(|b| b.is_cloud),
            ..Default::default()
        };
        let objects_from_o = has_o_statements(&chunks);
        let mut state = StatementState { objects_from_o, objects_reset_materials, ..Default::default() };
        for (i, chunk) in chunks.iter().enumerate() {
            state.apply_chunk(i, chunk, &mut out);
        }
        let positions = take_lists(&mut chunks, |b| &mut b.positions);
        let uvs = take_lists(&mut chunks, |b| &mut b.uvs);
        let normals = take_lists(&mut chunks, |b| &mut b.normals);
        (out.positions, (out.uvs, out.normals)) =
            rayon::join(|| concat(positions), || rayon::join(|| concat(uvs), || concat(normals)));
        if chunks.iter().any(|b| !b.colors.is_empty()) {
            for (chunk, before) in chunks.iter_mut().zip(&before) {
                out.colors.resize(before[0], NO_COLOR);
                out.colors.append(&mut chunk.colors);
            }
            out.colors.resize(out.positions.len(), NO_COLOR);
        }
        add_smooth_normals(&mut chunks, &out.segments, &out.positions, &mut out.normals);
        out.triangulate(chunks);
        Some(out)
    }

    /// Triangulates the faces of each chunk in parallel.
    fn triangulate(&mut self, chunks: Vec<Chunk>) {
        let mut segments: Vec<Vec<&mut Segment>> = Vec::new();
        segments.resize_with(chunks.len(), Vec::new);
        for segment in &mut self.segments {
            segments[segment.chunk].push(segment);
        }
        let positions = &self.positions;
        // The budget at the start of each chunk: the result does not depend on where chunks begin.
        let mut budget = WORK_BUDGET;
        let budgets: Vec<u64> = chunks
            .iter()
            .map(|chunk| {
                let at_start = budget;
                chunk.arities.iter().for_each(|&arity| _ = spend_work(&mut budget, arity as usize));
                at_start
            })
            .collect();
        let triangulated: Vec<TriangulatedChunk> = chunks
            .into_par_iter()
            .zip(segments)
            .zip(budgets)
            .map(|((chunk, segments), budget)| triangulate_chunk(chunk, segments, positions, budget))
            .collect();
        for chunk in triangulated {
            self.triangles.push(chunk.triangles);
            self.polygons.push(chunk.polygons);
            self.too_large += chunk.too_large;
            self.self_intersecting += chunk.self_intersecting;
        }
    }

    /// Returns the positions of the corners of all triangles, and of points and lines.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> {
        let rounds = self.rounds.groups.iter().flat_map(|group| &group.vertices);
        let vertices = self.triangles.iter().flatten().map(|corner| corner.v).chain(rounds.copied());
        vertices.map(|v| self.positions[v as usize])
    }
}

/// The triangles of one chunk, and the polygons that were cut as fans.
#[derive(Default)]
struct TriangulatedChunk {
    triangles: Vec<Corner>,
    polygons: Polygons,
    too_large: u64,
    self_intersecting: u64,
}

/// Triangulates a chunk and makes the ranges of its segments count triangles. `budget` is what is left of
/// [`WORK_BUDGET`].
fn triangulate_chunk(
    chunk: Chunk,
    segments: Vec<&mut Segment>,
    positions: &[Vec3],
    budget: u64,
) -> TriangulatedChunk {
    if chunk.arities.is_empty() {
        return TriangulatedChunk { triangles: chunk.corners, ..Default::default() };
    }
    let mut triangulator = Triangulator::with_budget(budget);
    let mut triangles = Vec::with_capacity(3 * chunk.triangle_count());
    let mut polygons = Polygons::default();
    let mut start = 0;
    for segment in segments {
        let first = triangles.len() / 3;
        for &arity in &chunk.arities[segment.range.clone()] {
            let corners = &chunk.corners[start..start + arity as usize];
            start += arity as usize;
            if let [_, _, _] = corners {
                triangles.extend_from_slice(corners);
            } else {
                let polygon = corners.iter().map(|c| positions[c.v as usize]);
                let first = triangles.len() / 3;
                triangles.extend(triangulator.triangulate(polygon).map(|i| corners[i]));
                (first + 1..triangles.len() / 3).for_each(|triangle| polygons.join(triangle));
            }
        }
        segment.range = first..triangles.len() / 3;
    }
    TriangulatedChunk {
        triangles,
        polygons,
        too_large: triangulator.too_large,
        self_intersecting: triangulator.self_intersecting,
    }
}

/// Takes one list of every chunk.
fn take_lists<T>(chunks: &mut [Chunk], list: impl Fn(&mut Chunk) -> &mut Vec<T>) -> Vec<Vec<T>> {
    chunks.iter_mut().map(|chunk| std::mem::take(list(chunk))).collect()
}

/// Concatenates lists, without a copy if there is only one.
fn concat<T: Copy>(lists: Vec<Vec<T>>) -> Vec<T> {
    match <[Vec<T>; 1]>::try_from(lists) {
        Ok([only]) => only,
        Err(lists) => lists.concat(),
    }
}

fn has_o_statements(chunks: &[Chunk]) -> bool {
    let is_object = |s: &Statement| matches!(s, Statement::Object(_));
    chunks.iter().any(|chunk| chunk.statements.iter().any(|s| is_object(&s.statement)))
}

/// The state set by the statements so far.
#[derive(Default)]
struct StatementState {
    /// True if `o` starts objects and `g` is ignored. Without any `o`, `g` starts them.
    objects_from_o: bool,
    /// True if an object has no material before its own `usemtl`.
    objects_reset_materials: bool,
    group_of: HashMap<String, u32>,
    material_of: HashMap<String, u32>,
    known_libraries: HashSet<String>,
    object: Option<u32>,
    smoothing: u32,
    material: Option<u32>,
    format: VertexFormat,
}

impl StatementState {
    /// Adds the faces of a chunk as segments and applies its statements in order.
    fn apply_chunk(&mut self, index: usize, chunk: &Chunk, out: &mut ObjGeometry) {
        let mut start = 0;
        let mut rounds = chunk.rounds.as_slice();
        let mut vertices = chunk.round_vertices.as_slice();
        for (i, at) in chunk.statements.iter().enumerate() {
            self.add_faces(index, start..at.face, out);
            start = at.face;
            self.add_rounds(i as u32, &mut rounds, &mut vertices, out);
            self.apply(&at.statement, out);
        }
        self.add_faces(index, start..chunk.faces, out);
        self.add_rounds(u32::MAX, &mut rounds, &mut vertices, out);
    }

    /// Adds faces with the current state, to the last segment if it has the same state.
    fn add_faces(&mut self, chunk: usize, range: Range<usize>, out: &mut ObjGeometry) {
        if range.is_empty() {
            return;
        }
        let object = *self.object.get_or_insert_with(|| new_object(out, "default"));
        let smoothing = if self.format.normal { 0 } else { self.smoothing };
        let key = SegmentKey { object, smoothing, material: self.material, format: self.format };
        match out.segments.last_mut() {
            Some(last) if last.key == key && last.chunk == chunk => last.range.end = range.end,
            _ => out.segments.push(Segment { key, chunk, range }),
        }
    }

    /// Adds the points and lines before statement `before` of a chunk with the current state, and removes them from the
    /// lists.
    fn add_rounds(
        &mut self,
        before: u32,
        rounds: &mut &[RoundElement],
        vertices: &mut &[u32],
        out: &mut ObjGeometry,
    ) {
        while let Some((first, rest)) = rounds.split_first().filter(|(first, _)| first.statement <= before) {
            let object = *self.object.get_or_insert_with(|| new_object(out, "default"));
            let (own, others) = vertices.split_at(first.count as usize);
            out.rounds.add(object, self.material, first.is_points, own);
            (*rounds, *vertices) = (rest, others);
        }
    }

    fn apply(&mut self, statement: &Statement, out: &mut ObjGeometry) {
        match statement {
            Statement::Object(name) => {
                self.object = Some(new_object(out, name));
                self.material = self.material.filter(|_| !self.objects_reset_materials);
            }
            Statement::Group(_) if self.objects_from_o => {}
            Statement::Group(name) => {
                // A group that occurs again is the same object.
                let known = self.group_of.get(name).copied();
                self.object = Some(known.unwrap_or_else(|| {
                    let new = new_object(out, name);
                    self.group_of.insert(name.to_string(), new);
                    new
                }));
            }
            Statement::Smoothing(group) => self.smoothing = *group,
            Statement::Material(name) => {
                let known = self.material_of.get(name).copied();
                self.material = Some(known.unwrap_or_else(|| {
                    let new = out.materials.len() as u32;
                    out.materials.push(name.to_string());
                    self.material_of.insert(name.to_string(), new);
                    new
                }));
            }
            Statement::Library(name) => {
                if !name.is_empty() && self.known_libraries.insert(name.to_string()) {
                    out.libraries.push(name.to_string());
                }
            }
            Statement::VertexFormat(format) => self.format = *format,
        }
    }
}

fn new_object(out: &mut ObjGeometry, name: &str) -> u32 {
    out.objects.push(name.to_string());
    out.objects.len() as u32 - 1
}
