//! Blocks to one whole: every index from the start of the file, every face with what holds for it.

use std::collections::HashMap;
use std::ops::Range;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::block::{Block, COLORLESS, Corner, Statement};
use super::polygon::{MOST_SQUARES, Triangulator, pay};
use super::smoothing::smooth;

/// What the faces of a segment have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    /// Index into [`Parsed::objects`].
    pub object: u32,
    /// 0 is off.
    pub smoothing: u32,
    /// Index into [`Parsed::materials`]; `None` before any `usemtl`.
    pub material: Option<u32>,
    pub has_uv: bool,
    pub has_normal: bool,
}

/// Triangles that follow each other in the file and have everything in common.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub key: Key,
    /// Index into [`Parsed::triangles`], and where they stand there.
    pub block: usize,
    pub range: Range<usize>,
}

/// An OBJ's text, understood.
#[derive(Debug, Default)]
pub(super) struct Parsed {
    pub positions: Vec<Vec3>,
    /// By vertex, as the file writes them; empty where no vertex has one, [`COLORLESS`] where this one
    /// has none.
    pub colors: Vec<Vec4>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<Vec3>,
    /// Corners by threes, a list for each block.
    pub triangles: Vec<Vec<Corner>>,
    pub segments: Vec<Segment>,
    pub objects: Vec<String>,
    pub materials: Vec<String>,
    /// The whole rest of each `mtllib` line.
    pub libraries: Vec<String>,
    pub lines_and_points: u64,
    /// Faces with fewer than three corners.
    pub degenerate: u64,
    /// Polygons that are too large to be cut rightly.
    pub too_large: u64,
    /// Polygons that cross themselves and are too large to be cut with care.
    pub crossing: u64,
}

impl Parsed {
    /// Puts blocks together. `None` where a face points at nothing.
    pub fn new(mut blocks: Vec<Block>) -> Option<Parsed> {
        let count = |b: &Block| [b.positions.len(), b.uvs.len(), b.normals.len()];
        let mut before = Vec::with_capacity(blocks.len());
        let mut totals = [0; 3];
        for block in &blocks {
            before.push(totals);
            (0..3).for_each(|k| totals[k] += count(block)[k]);
        }
        if !blocks.par_iter_mut().zip(&before).all(|(block, before)| block.resolve(*before, totals)) {
            return None;
        }
        let mut out = Parsed {
            lines_and_points: blocks.iter().map(|b| b.lines_and_points).sum(),
            degenerate: blocks.iter().map(|b| b.degenerate).sum(),
            ..Default::default()
        };
        let mut reader = Statements { by_o: has_objects(&blocks), ..Default::default() };
        for (i, block) in blocks.iter().enumerate() {
            reader.block(i, block, &mut out);
        }
        out.positions = joined(&mut blocks, |b| std::mem::take(&mut b.positions));
        out.uvs = joined(&mut blocks, |b| std::mem::take(&mut b.uvs));
        out.normals = joined(&mut blocks, |b| std::mem::take(&mut b.normals));
        if blocks.iter().any(|b| !b.colors.is_empty()) {
            for (block, own) in blocks.iter_mut().zip(&before) {
                out.colors.resize(own[0], COLORLESS);
                out.colors.append(&mut block.colors);
            }
            out.colors.resize(out.positions.len(), COLORLESS);
        }
        smooth(&mut blocks, &out.segments, &out.positions, &mut out.normals);
        out.triangulate(blocks);
        Some(out)
    }

    /// Faces to triangles, in each block by itself.
    fn triangulate(&mut self, blocks: Vec<Block>) {
        let mut segments: Vec<Vec<&mut Segment>> = Vec::new();
        segments.resize_with(blocks.len(), Vec::new);
        for segment in &mut self.segments {
            segments[segment.block].push(segment);
        }
        let positions = &self.positions;
        // What those before have left, wherever blocks begin.
        let mut left = MOST_SQUARES;
        let lefts: Vec<u64> = blocks
            .iter()
            .map(|block| {
                let before = left;
                block.arities.iter().for_each(|&arity| _ = pay(&mut left, arity as usize));
                before
            })
            .collect();
        let done: Vec<(Vec<Corner>, [u64; 2])> = blocks
            .into_par_iter()
            .zip(segments)
            .zip(lefts)
            .map(|((block, segments), left)| {
                if block.arities.is_empty() {
                    return (block.corners, [0, 0]);
                }
                let mut cut = Triangulator::with(left);
                let mut out = Vec::with_capacity(3 * block.triangles());
                let mut start = 0;
                for segment in segments {
                    let first = out.len() / 3;
                    for &arity in &block.arities[segment.range.clone()] {
                        let corners = &block.corners[start..start + arity as usize];
                        start += arity as usize;
                        if let [_, _, _] = corners {
                            out.extend_from_slice(corners);
                        } else {
                            let at = |c: &Corner| positions[c.v as usize];
                            out.extend(cut.triangulate(corners.iter().map(at)).map(|i| corners[i]));
                        }
                    }
                    segment.range = first..out.len() / 3;
                }
                (out, [cut.too_large, cut.crossing])
            })
            .collect();
        for (triangles, [too_large, crossing]) in done {
            self.triangles.push(triangles);
            self.too_large += too_large;
            self.crossing += crossing;
        }
    }

    /// The triangles of a segment.
    pub fn triangles_of(&self, segment: &Segment) -> &[[Corner; 3]] {
        &self.triangles[segment.block].as_chunks::<3>().0[segment.range.clone()]
    }
}

/// One list of all blocks' lists.
fn joined<T: Copy>(blocks: &mut [Block], mut list: impl FnMut(&mut Block) -> Vec<T>) -> Vec<T> {
    let lists: Vec<Vec<T>> = blocks.iter_mut().map(&mut list).collect();
    match <[Vec<T>; 1]>::try_from(lists) {
        Ok([only]) => only,
        Err(lists) => lists.concat(),
    }
}

fn has_objects(blocks: &[Block]) -> bool {
    let is_object = |s: &Statement| matches!(s, Statement::Object(_));
    blocks.iter().any(|b| b.marks.iter().any(|m| is_object(&m.statement)))
}

/// What the statements so far have set.
#[derive(Default)]
struct Statements {
    /// True: `o` names objects and `g` counts for nothing; else `g` does.
    by_o: bool,
    group_of: HashMap<String, u32>,
    material_of: HashMap<String, u32>,
    known_libraries: std::collections::HashSet<String>,
    object: Option<u32>,
    smoothing: u32,
    material: Option<u32>,
    form: (bool, bool),
}

impl Statements {
    fn block(&mut self, index: usize, block: &Block, out: &mut Parsed) {
        let mut start = 0;
        for mark in &block.marks {
            self.faces(index, start..mark.face, out);
            start = mark.face;
            self.statement(&mark.statement, out);
        }
        self.faces(index, start..block.faces, out);
    }

    fn faces(&mut self, block: usize, range: Range<usize>, out: &mut Parsed) {
        if range.is_empty() {
            return;
        }
        let object = *self.object.get_or_insert_with(|| new_object(out, "default"));
        let (has_uv, has_normal) = self.form;
        let smoothing = if has_normal { 0 } else { self.smoothing };
        let key = Key { object, smoothing, material: self.material, has_uv, has_normal };
        match out.segments.last_mut() {
            Some(last) if last.key == key && last.block == block => last.range.end = range.end,
            _ => out.segments.push(Segment { key, block, range }),
        }
    }

    fn statement(&mut self, statement: &Statement, out: &mut Parsed) {
        match statement {
            Statement::Object(name) => self.object = Some(new_object(out, name)),
            Statement::Group(_) if self.by_o => {}
            Statement::Group(name) => {
                // A group that is taken up again is the same object.
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
            Statement::Form { uv, normal } => self.form = (*uv, *normal),
        }
    }
}

fn new_object(out: &mut Parsed, name: &str) -> u32 {
    out.objects.push(name.to_string());
    out.objects.len() as u32 - 1
}
