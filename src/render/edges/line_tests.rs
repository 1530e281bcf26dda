//! Tests of samples against lines, several at a time: which line over each sample is nearest to the camera.

#[cfg(test)]
mod tests;

use std::ops::Range;

use glam::DVec2;

use super::batch_lines::{LANES, Line, LineBounds, LineBoxes};
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

/// Some samples that lie close together.
pub(super) struct SampleGroup {
    /// Indices of the samples.
    pub samples: [u32; LANES],
    /// The lines near them: a range of a list, nearest first.
    pub near: Range<usize>,
    /// Positions in pixels from the upper left corner of the picture.
    position: [[f64; LANES]; 2],
    /// The same, rounded.
    rounded: [[f32; LANES]; 2],
    /// A bit for each sample whose next line is searched.
    open: u32,
    /// The line after which the next line of each sample comes.
    after: [LineKey; LANES],
}

impl SampleGroup {
    /// Makes a group of at most [`LANES`] samples from their indices and positions.
    pub fn new(samples: impl Iterator<Item = (u32, DVec2)>) -> SampleGroup {
        let mut group = SampleGroup {
            samples: [0; LANES],
            near: 0..0,
            position: [[0.0; LANES]; 2],
            rounded: [[0.0; LANES]; 2],
            open: 0,
            after: [LineKey::FIRST; LANES],
        };
        for (i, (sample, position)) in samples.take(LANES).enumerate() {
            group.samples[i] = sample;
            for (axis, x) in position.to_array().into_iter().enumerate() {
                group.position[axis][i] = x;
                group.rounded[axis][i] = x as f32;
            }
            group.open |= 1 << i;
        }
        group
    }

    /// Returns the least and the greatest rounded position of samples, while all are open.
    #[inline(always)]
    fn bounds(&self) -> [[f32; 2]; 2] {
        let count = self.open.count_ones() as usize;
        let least = |row: &[f32; LANES]| row[..count].iter().copied().fold(f32::INFINITY, f32::min);
        let most = |row: &[f32; LANES]| row[..count].iter().copied().fold(f32::NEG_INFINITY, f32::max);
        [self.rounded.each_ref().map(least), self.rounded.each_ref().map(most)]
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
        for (block, LineBoxes { min, max }) in boxes.iter().enumerate() {
            let mut bits = [0; LANES];
            for i in 0..LANES {
                let is_near =
                    (min[0][i] <= max_x) & (min[1][i] <= max_y) & (max[0][i] >= min_x) & (max[1][i] >= min_y);
                bits[i] = u32::from(is_near) << i;
            }
            let mut is_near = mask(bits);
            while is_near != 0 {
                near.push((first + block * LANES) as u32 + is_near.trailing_zeros());
                is_near &= is_near - 1;
            }
        }
        group.near = start..near.len();
    }
}

/// Returns the bits of all lanes.
#[inline(always)]
fn mask(bits: [u32; LANES]) -> u32 {
    bits.iter().fold(0, |mask, bit| mask | bit)
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

/// The nearest lines over the samples of a group.
struct NearestLines {
    keys: [LineKey; LANES],
    /// The depths of the keys, rounded.
    rounded: [f32; LANES],
    /// The indices of the lines; the greatest number where there is none.
    lines: [u32; LANES],
    s: [f64; LANES],
}

impl NearestLines {
    /// Returns no lines: of samples that are not open, all lines come after.
    #[inline(always)]
    fn new(open: u32) -> NearestLines {
        let mut nearest = NearestLines {
            keys: [LineKey::LAST; LANES],
            rounded: [f32::INFINITY; LANES],
            lines: [u32::MAX; LANES],
            s: [0.0; LANES],
        };
        for i in 0..LANES {
            if open >> i & 1 == 0 {
                (nearest.keys[i], nearest.rounded[i]) = (LineKey::FIRST, f32::NEG_INFINITY);
            }
        }
        nearest
    }

    /// Returns the depth behind which no line is the nearest one of a sample.
    #[inline(always)]
    fn greatest_depth(&self) -> f64 {
        let mut greatest = f64::NEG_INFINITY;
        for key in &self.keys {
            greatest = if key.depth > greatest { key.depth } else { greatest };
        }
        greatest
    }
}

impl AutovecKernel for FindCoveringLines<'_> {
    #[inline(always)]
    fn run(self) {
        let FindCoveringLines { lines, near, projector, groups, found } = self;
        for (index, group) in groups.iter().enumerate() {
            if group.open == 0 {
                continue;
            }
            let mut nearest = NearestLines::new(group.open);
            let mut start = f64::INFINITY;
            for i in 0..LANES {
                if group.open >> i & 1 == 1 {
                    start = start.min(group.after[i].depth);
                }
            }
            let mut end = f64::INFINITY;
            for &number in &near[group.near.clone()] {
                let line = &lines[number as usize];
                let [least, greatest] = line.depths;
                if least > end {
                    break;
                }
                // Few lines have an open sample within their bounds that no nearer line covers.
                if greatest < start || may_cover(&line.bounds, group, &nearest.rounded) & group.open == 0 {
                    continue;
                }
                let mut s = [0.0; LANES];
                let mut covered = cover(line, projector, &group.position, &mut s) & group.open;
                let mut is_nearer = false;
                while covered != 0 {
                    let i = covered.trailing_zeros() as usize % LANES;
                    covered &= covered - 1;
                    let depth = projector.depth(line.linear_at(s[i]));
                    let key = LineKey { depth, edge: line.edge };
                    if key.is_before(&nearest.keys[i]) && group.after[i].is_before(&key) {
                        (nearest.keys[i], nearest.rounded[i]) = (key, depth as f32);
                        (nearest.lines[i], nearest.s[i]) = (number, s[i]);
                        is_nearer = true;
                    }
                }
                if is_nearer {
                    end = nearest.greatest_depth();
                }
            }
            for i in 0..LANES {
                if nearest.lines[i] != u32::MAX {
                    let (line, s, key) = (nearest.lines[i] as usize, nearest.s[i], nearest.keys[i]);
                    found.push(CoveringLine { group: index, lane: i, line, s, key });
                }
            }
        }
    }
}

/// Returns a bit for each sample that lies within the bounds of a line and has no line that is surely nearer, and for some others.
#[inline(always)]
fn may_cover(bounds: &LineBounds, group: &SampleGroup, nearest: &[f32; LANES]) -> u32 {
    let LineBounds { min, max, least_depth } = bounds;
    let [x, y] = &group.rounded;
    let mut bits = [0; LANES];
    for i in 0..LANES {
        let is_within = (x[i] >= min[0]) & (x[i] <= max[0]) & (y[i] >= min[1]) & (y[i] <= max[1]);
        bits[i] = u32::from(is_within & (nearest[i] >= *least_depth)) << i;
    }
    mask(bits)
}

/// Sets where on a line the point is that is nearest to each sample, and returns a bit for each sample that the line covers.
#[inline(always)]
fn cover(line: &Line, projector: &Projector, [x, y]: &[[f64; LANES]; 2], s: &mut [f64; LANES]) -> u32 {
    let has_length = line.length2 > 0.0;
    let mut bits = [0; LANES];
    for i in 0..LANES {
        let dot = (x[i] - line.start.x) * line.along.x + (y[i] - line.start.y) * line.along.y;
        s[i] = if has_length { (dot / line.length2).clamp(0.0, 1.0) } else { 0.0 };
        let dx = line.start.x + line.along.x * s[i] - x[i];
        let dy = line.start.y + line.along.y * s[i] - y[i];
        let half_width = line.half_width_at(projector, s[i]);
        // Also true for NaN.
        let is_covered = !(dx * dx + dy * dy > half_width * half_width);
        bits[i] = u32::from(is_covered) << i;
    }
    mask(bits)
}
