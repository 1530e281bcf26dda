//! Tests of samples against lines, several at a time: which line over each sample is nearest to the camera.

#[cfg(test)]
mod tests;

use std::ops::Range;

use glam::DVec2;

use super::batch_lines::{LANES, Line, LineBoxes};
use super::projection::Projector;
use blinn_core::simd::AutovecKernel;

/// The depth of a line at a sample, and its edge. Lines over a sample are in this order.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineKey {
    depth: f64,
    edge: u32,
}

impl LineKey {
    /// Before all lines.
    const FIRST: LineKey = LineKey { depth: f64::NEG_INFINITY, edge: 0 };
    /// Behind all lines.
    const LAST: LineKey = LineKey { depth: f64::INFINITY, edge: u32::MAX };

    #[inline(always)]
    fn is_before(&self, other: &LineKey) -> bool {
        self.depth.total_cmp(&other.depth).then(self.edge.cmp(&other.edge)).is_lt()
    }
}

/// Some samples of a pixel.
pub(super) struct SampleGroup {
    /// Index of the first sample.
    pub first: usize,
    /// The lines near them: a range of a list, nearest first.
    pub near: Range<usize>,
    /// Positions in pixels from the upper left corner of the picture.
    position: [[f64; LANES]; 2],
    /// A bit for each sample whose next line is searched.
    open: u32,
    /// The line after which the next line of each sample comes.
    after: [LineKey; LANES],
}

impl SampleGroup {
    /// Makes a group of at most [`LANES`] samples, of which the first has the index `first`.
    pub fn new(first: usize, positions: impl Iterator<Item = DVec2>) -> SampleGroup {
        let mut position = [[0.0; LANES]; 2];
        let mut count = 0;
        for (i, at) in positions.take(LANES).enumerate() {
            [position[0][i], position[1][i]] = at.to_array();
            count = i + 1;
        }
        let open = (1u32 << count) - 1;
        SampleGroup { first, near: 0..0, position, open, after: [LineKey::FIRST; LANES] }
    }

    /// Returns the least and the greatest position of samples, while all are open.
    #[inline(always)]
    fn bounds(&self) -> [[f64; 2]; 2] {
        let count = self.open.count_ones() as usize;
        let least = |row: &[f64; LANES]| row[..count].iter().copied().fold(f64::INFINITY, f64::min);
        let most = |row: &[f64; LANES]| row[..count].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        [self.position.each_ref().map(least), self.position.each_ref().map(most)]
    }

    /// Searches the next line of no sample.
    pub fn close(&mut self) {
        self.open = 0;
    }

    /// Searches the line over a sample that comes after a given one.
    pub fn continue_behind(&mut self, lane: usize, key: LineKey) {
        self.open |= 1 << lane;
        self.after[lane] = key;
    }
}

/// Adds the lines whose bounds touch those of a group's samples to `near`, in order.
pub(super) struct FindNearLines<'a> {
    /// Index of the first line.
    pub first: usize,
    /// The bounds of the lines.
    pub boxes: &'a [LineBoxes],
    pub group: &'a mut SampleGroup,
    pub near: &'a mut Vec<u32>,
}

impl AutovecKernel for FindNearLines<'_> {
    #[inline(always)]
    fn run(self) {
        let FindNearLines { first, boxes, group, near } = self;
        let [[min_x, min_y], [max_x, max_y]] = group.bounds();
        let start = near.len();
        near.resize(start + boxes.len() * LANES, 0);
        let mut end = start;
        for (block, LineBoxes { min, max }) in boxes.iter().enumerate() {
            let mut is_near = [false; LANES];
            for i in 0..LANES {
                is_near[i] =
                    (min[0][i] <= max_x) & (min[1][i] <= max_y) & (max[0][i] >= min_x) & (max[1][i] >= min_y);
            }
            // Each number is written, and kept if its line is near.
            for (i, is_near) in is_near.into_iter().enumerate() {
                near[end] = (first + block * LANES + i) as u32;
                end += usize::from(is_near);
            }
        }
        near.truncate(end);
        group.near = start..end;
    }
}

/// A line over a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoveringLine {
    /// Indices of the group and of the sample in it.
    pub group: usize,
    pub lane: usize,
    /// Index of the line.
    pub line: usize,
    /// Where between its ends the point lies that is nearest to the sample in the picture.
    pub s: f64,
    /// Its place in the order of the lines over the sample.
    pub key: LineKey,
}

impl CoveringLine {
    /// Returns the depth of the point.
    pub fn depth(&self) -> f64 {
        self.key.depth
    }
}

/// Finds the next line over each open sample, from the nearest to the camera on. Samples that no further line covers are not in
/// `found`.
pub(super) struct FindCoveringLines<'a> {
    pub lines: &'a [Line],
    pub near: &'a [u32],
    pub projector: &'a Projector,
    pub groups: &'a [SampleGroup],
    pub found: &'a mut Vec<CoveringLine>,
}

impl AutovecKernel for FindCoveringLines<'_> {
    #[inline(always)]
    fn run(self) {
        let FindCoveringLines { lines, near, projector, groups, found } = self;
        for (index, group) in groups.iter().enumerate() {
            if group.open == 0 {
                continue;
            }
            let mut best = [LineKey::LAST; LANES];
            let mut line_of = [u32::MAX; LANES];
            let mut s_of = [0.0; LANES];
            let mut start = f64::INFINITY;
            for i in 0..LANES {
                if group.open >> i & 1 == 1 {
                    start = start.min(group.after[i].depth);
                } else {
                    best[i] = LineKey::FIRST;
                }
            }
            // The depth behind which no line is the nearest one of a sample.
            let mut end = f64::INFINITY;
            for &number in &near[group.near.clone()] {
                let line = &lines[number as usize];
                let [least, greatest] = line.depths;
                if least > end {
                    break;
                }
                if greatest < start {
                    continue;
                }
                let mut s = [0.0; LANES];
                let mut covered = cover(line, projector, &group.position, &mut s) & group.open;
                if covered == 0 {
                    continue;
                }
                while covered != 0 {
                    let i = covered.trailing_zeros() as usize % LANES;
                    covered &= covered - 1;
                    let depth = projector.depth(line.linear_at(s[i]));
                    let key = LineKey { depth, edge: line.edge };
                    if key.is_before(&best[i]) && group.after[i].is_before(&key) {
                        (best[i], line_of[i], s_of[i]) = (key, number, s[i]);
                    }
                }
                end = f64::NEG_INFINITY;
                for key in &best {
                    end = if key.depth > end { key.depth } else { end };
                }
            }
            for i in 0..LANES {
                if line_of[i] != u32::MAX {
                    let (line, s, key) = (line_of[i] as usize, s_of[i], best[i]);
                    found.push(CoveringLine { group: index, lane: i, line, s, key });
                }
            }
        }
    }
}

/// Sets where on a line the point is that is nearest to each sample, and returns a bit for each sample that the line covers.
#[inline(always)]
fn cover(line: &Line, projector: &Projector, [x, y]: &[[f64; LANES]; 2], s: &mut [f64; LANES]) -> u32 {
    let has_length = line.length2 > 0.0;
    let mut covered = [0; LANES];
    for i in 0..LANES {
        let dot = (x[i] - line.start.x) * line.along.x + (y[i] - line.start.y) * line.along.y;
        s[i] = if has_length { (dot / line.length2).clamp(0.0, 1.0) } else { 0.0 };
        let dx = line.start.x + line.along.x * s[i] - x[i];
        let dy = line.start.y + line.along.y * s[i] - y[i];
        let half_width = line.half_width_at(projector, s[i]);
        // Also true for NaN.
        let is_covered = !(dx * dx + dy * dy > half_width * half_width);
        covered[i] = u32::from(is_covered) << i;
    }
    covered.iter().fold(0u32, |mask, bit| mask | bit)
}
