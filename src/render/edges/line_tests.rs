//! Tests of samples against lines, several at a time: which line over each sample is nearest to the camera.

#[cfg(test)]
mod tests;

use glam::DVec2;

use super::batch_lines::{CellLines, LANES, Line, LineBounds, LineBoxes, mask};
use super::projection::Projector;
use blinn_core::simd::AutovecKernel;

/// The depth of a line at a sample, and its edge. Lines over a sample are in this order.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineKey {
    depth: f64,
    /// As wide as the depth, so that as many lanes hold it.
    edge: i64,
}

impl LineKey {
    /// Before all lines.
    const FIRST: LineKey = LineKey { depth: f64::NEG_INFINITY, edge: 0 };
    /// Behind all lines.
    const LAST: LineKey = LineKey { depth: f64::INFINITY, edge: i64::MAX };

    #[inline(always)]
    fn is_before(self, other: LineKey) -> bool {
        (self.depth < other.depth) | ((self.depth == other.depth) & (self.edge < other.edge))
    }
}

/// A key for each sample of a group.
#[derive(Clone, Copy)]
struct LineKeys {
    depths: [f64; LANES],
    edges: [i64; LANES],
}

impl LineKeys {
    #[inline(always)]
    fn splat(key: LineKey) -> LineKeys {
        LineKeys { depths: [key.depth; LANES], edges: [key.edge; LANES] }
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> LineKey {
        LineKey { depth: self.depths[lane], edge: self.edges[lane] }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, key: LineKey) {
        (self.depths[lane], self.edges[lane]) = (key.depth, key.edge);
    }
}

/// Some samples that lie close together.
pub(super) struct SampleGroup {
    /// Indices of the samples.
    pub samples: [u32; LANES],
    /// The lines of their cell.
    cell: CellLines,
    /// Positions in pixels from the upper left corner of the picture.
    position: [[f64; LANES]; 2],
    /// The same, rounded.
    rounded: [[f32; LANES]; 2],
    /// A bit for each sample whose next line is searched.
    open: u32,
    /// The line after which the next line of each sample comes.
    after: LineKeys,
}

impl SampleGroup {
    /// Makes a group of at most [`LANES`] samples of a cell from their indices and positions.
    pub fn new(cell: CellLines, samples: impl Iterator<Item = (u32, DVec2)>) -> SampleGroup {
        let mut group = SampleGroup {
            samples: [0; LANES],
            cell,
            position: [[0.0; LANES]; 2],
            rounded: [[0.0; LANES]; 2],
            open: 0,
            after: LineKeys::splat(LineKey::FIRST),
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

    /// Returns the least and the greatest rounded position of open samples.
    #[inline(always)]
    fn bounds(&self) -> [[f32; 2]; 2] {
        let mut bounds = [[0.0; 2]; 2];
        for axis in 0..2 {
            let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
            for i in 0..LANES {
                let is_open = self.open >> i & 1 == 1;
                low[i] = if is_open { self.rounded[axis][i] } else { low[i] };
                high[i] = if is_open { self.rounded[axis][i] } else { high[i] };
            }
            for x in &mut low {
                *x = -*x;
            }
            bounds[0][axis] = -greatest(low);
            bounds[1][axis] = greatest(high);
        }
        bounds
    }

    /// Searches the next line of no sample.
    pub fn close(&mut self) {
        self.open = 0;
    }

    /// Searches the line over a sample that comes after a given one.
    pub fn continue_behind(&mut self, lane: usize, key: LineKey) {
        self.open |= 1 << lane;
        self.after.set(lane, key);
    }
}

/// Returns the greatest number, by halves, which are lanes.
#[inline(always)]
fn greatest<T: Copy + PartialOrd>(mut numbers: [T; LANES]) -> T {
    let mut count = LANES;
    while count > 1 {
        count /= 2;
        for i in 0..count {
            let (a, b) = (numbers[i], numbers[i + count]);
            numbers[i] = if a > b { a } else { b };
        }
    }
    numbers[0]
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
    /// The bounds of the lines.
    pub boxes: &'a [LineBoxes],
    pub projector: &'a Projector,
    pub groups: &'a [SampleGroup],
    pub found: &'a mut Vec<CoveringLine>,
}

/// The nearest lines over the samples of a group.
struct NearestLines {
    keys: LineKeys,
    /// The depths of the keys, rounded.
    rounded: [f32; LANES],
    /// The indices of the lines; [`NO_LINE`] where there is none.
    lines: [i64; LANES],
    s: [f64; LANES],
}

/// In place of the index of a line.
const NO_LINE: i64 = -1;

impl NearestLines {
    /// Returns no lines: of samples that are not open, all lines come after.
    #[inline(always)]
    fn new(open: u32) -> NearestLines {
        let mut nearest = NearestLines {
            keys: LineKeys::splat(LineKey::LAST),
            rounded: [f32::INFINITY; LANES],
            lines: [NO_LINE; LANES],
            s: [0.0; LANES],
        };
        for i in 0..LANES {
            if open >> i & 1 == 0 {
                nearest.keys.set(i, LineKey::FIRST);
                nearest.rounded[i] = f32::NEG_INFINITY;
            }
        }
        nearest
    }

    /// Keeps a line for the samples that it covers, if it is nearer than their nearest one and comes after the last one. Returns
    /// true if there are such samples.
    #[inline(always)]
    fn add(&mut self, number: usize, line: &Line, projector: &Projector, group: &SampleGroup) -> bool {
        let [x, y] = &group.position;
        let has_length = line.length2 > 0.0;
        let mut is_nearer = 0;
        for i in 0..LANES {
            let dot = (x[i] - line.start.x) * line.along.x + (y[i] - line.start.y) * line.along.y;
            let s = if has_length { (dot / line.length2).clamp(0.0, 1.0) } else { 0.0 };
            let dx = line.start.x + line.along.x * s - x[i];
            let dy = line.start.y + line.along.y * s - y[i];
            let linear = line.linear_at(s);
            let half_width = projector.half_width(linear);
            // Also true for NaN.
            let is_covered = !(dx * dx + dy * dy > half_width * half_width);
            let key = LineKey { depth: projector.depth(linear), edge: i64::from(line.edge) };
            let (nearest, after) = (self.keys.get(i), group.after.get(i));
            let is_next = is_covered & key.is_before(nearest) & after.is_before(key);
            self.keys.depths[i] = if is_next { key.depth } else { nearest.depth };
            self.keys.edges[i] = if is_next { key.edge } else { nearest.edge };
            self.lines[i] = if is_next { number as i64 } else { self.lines[i] };
            self.s[i] = if is_next { s } else { self.s[i] };
            is_nearer |= i64::from(is_next);
        }
        for i in 0..LANES {
            self.rounded[i] = self.keys.depths[i] as f32;
        }
        is_nearer != 0
    }
}

impl AutovecKernel for FindCoveringLines<'_> {
    #[inline(always)]
    fn run(self) {
        let FindCoveringLines { lines, boxes, projector, groups, found } = self;
        for (index, group) in groups.iter().enumerate() {
            if group.open == 0 {
                continue;
            }
            let mut nearest = NearestLines::new(group.open);
            let mut start = f64::INFINITY;
            for i in 0..LANES {
                if group.open >> i & 1 == 1 {
                    start = start.min(group.after.depths[i]);
                }
            }
            let bounds = group.bounds();
            // The depth behind which no line is the nearest one of a sample.
            let mut end = f64::INFINITY;
            for boxes in &boxes[group.cell.clone()] {
                if lines[boxes.first_line].depths[0] > end {
                    break;
                }
                let mut near = boxes.touching(bounds);
                while near != 0 {
                    let number = boxes.first_line + near.trailing_zeros() as usize;
                    near &= near - 1;
                    let line = &lines[number];
                    let [least, greatest_depth] = line.depths;
                    if least > end {
                        break;
                    }
                    // Few lines have an open sample within their bounds that no nearer line covers.
                    let may_cover = may_cover(&line.bounds, group, &nearest.rounded) & group.open != 0;
                    if greatest_depth >= start && may_cover && nearest.add(number, line, projector, group) {
                        end = greatest(nearest.keys.depths);
                    }
                }
            }
            for i in 0..LANES {
                if nearest.lines[i] != NO_LINE {
                    let (line, s, key) = (nearest.lines[i] as usize, nearest.s[i], nearest.keys.get(i));
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
