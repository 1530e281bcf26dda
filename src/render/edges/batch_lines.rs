//! The lines of edges near a batch of pixels, prepared for tests against samples.

use std::ops::Range;

use glam::DVec2;

use super::projection::{Projector, Segment};
use super::screen_grid::ScreenGrid;

/// Pixels by which the bounds of lines are larger than they are: more than rounding errs by.
const SLACK: f64 = 1e-3;

/// Lines or samples that are tested at once.
pub(super) const LANES: usize = 16;

/// Returns the bits of all lanes.
#[inline(always)]
pub(super) fn mask(bits: [u32; LANES]) -> u32 {
    bits.iter().fold(0, |mask, bit| mask | bit)
}

/// The line of an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Index of the edge.
    pub edge: u32,
    /// The first end.
    pub start: DVec2,
    /// From the first end to the second.
    pub along: DVec2,
    /// The square of its length in pixels.
    pub length2: f64,
    /// The number that is linear in the picture at the first end ([`Projector::depth`]), and its change to the second.
    pub linear: [f64; 2],
    /// Bounds of its depths.
    pub depths: [f64; 2],
    /// Bounds of the line and of its depths in f32, for tests that keep more lines than touch.
    pub bounds: LineBounds,
}

/// Bounds of a line with its width. Rounding keeps order: a position within the bounds is within them in f32 too.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineBounds {
    /// The least x and y in pixels.
    pub min: [f32; 2],
    /// The greatest.
    pub max: [f32; 2],
    pub least_depth: f32,
}

/// The lines of the cells that a batch of pixels lies in.
#[derive(Default)]
pub(super) struct BatchLines {
    lines: Vec<Line>,
    /// The bounds of the lines of each cell, in blocks of their own.
    boxes: Vec<LineBoxes>,
    /// The least depths of a cell's lines, with their edges.
    order: Vec<(f64, u32)>,
}

/// The lines of a cell: indices of their boxes.
pub(super) type CellLines = Range<usize>;

/// Bounds of some lines in the picture, with their widths; empty where there are fewer lines.
#[derive(Clone, Copy)]
pub(super) struct LineBoxes {
    /// Index of the first line, which has the least depth.
    pub first_line: usize,
    /// The least x and y of each line.
    min: [[f32; LANES]; 2],
    /// The greatest.
    max: [[f32; LANES]; 2],
}

impl LineBoxes {
    /// Returns the bounds of at most [`LANES`] lines.
    fn new(first_line: usize, lines: &[Line]) -> LineBoxes {
        let (mut min, mut max) = ([[f32::INFINITY; LANES]; 2], [[f32::NEG_INFINITY; LANES]; 2]);
        for (lane, Line { bounds, .. }) in lines.iter().enumerate() {
            for axis in 0..2 {
                (min[axis][lane], max[axis][lane]) = (bounds.min[axis], bounds.max[axis]);
            }
        }
        LineBoxes { first_line, min, max }
    }

    /// Returns a bit for each line whose bounds touch others, of which the least and the greatest x and y are given.
    #[inline(always)]
    pub fn touching(&self, [low, high]: [[f32; 2]; 2]) -> u32 {
        let LineBoxes { min, max, .. } = self;
        let mut bits = [0; LANES];
        for i in 0..LANES {
            let touches = (min[0][i] <= high[0])
                & (min[1][i] <= high[1])
                & (max[0][i] >= low[0])
                & (max[1][i] >= low[1]);
            bits[i] = u32::from(touches) << i;
        }
        mask(bits)
    }
}

impl LineBounds {
    fn new(segment: &Segment, least_depth: f64, projector: &Projector) -> LineBounds {
        let [a, b] = segment.depths.map(|depth| projector.half_width(depth));
        let reach = a.max(b) + SLACK;
        let [a, b] = segment.ends;
        let min = (a.min(b) - reach).to_array().map(|x| x as f32);
        let max = (a.max(b) + reach).to_array().map(|x| x as f32);
        LineBounds { min, max, least_depth: least_depth as f32 }
    }
}

impl BatchLines {
    /// Removes all lines and keeps the memory.
    pub fn clear(&mut self) {
        self.lines.clear();
        self.boxes.clear();
    }

    /// Adds the lines of a cell, by their least depth.
    pub fn add_cell(&mut self, grid: &ScreenGrid, cell: usize) -> CellLines {
        let edge = |edge: u32| &grid.edges[edge as usize].segment;
        self.order.clear();
        let least_depth = |&number: &u32| (grid.projector.depth_bounds(edge(number).depths)[0], number);
        self.order.extend(grid.edges_in(cell).iter().map(least_depth));
        self.order.sort_unstable_by(|(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
        let (first_line, first_box) = (self.lines.len(), self.boxes.len());
        self.lines.extend(self.order.iter().map(|(_, i)| Line::new(*i, edge(*i), &grid.projector)));
        let starts = (first_line..).step_by(LANES);
        let lines = self.lines[first_line..].chunks(LANES);
        self.boxes.extend(starts.zip(lines).map(|(first, lines)| LineBoxes::new(first, lines)));
        first_box..self.boxes.len()
    }

    /// Returns all lines.
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Returns the bounds of all lines.
    pub fn boxes(&self) -> &[LineBoxes] {
        &self.boxes
    }
}

impl Line {
    fn new(edge: u32, segment: &Segment, projector: &Projector) -> Line {
        let ([start, end], [a, b]) = (segment.ends, segment.depths);
        let along = end - start;
        let depths = projector.depth_bounds([a, b]);
        let bounds = LineBounds::new(segment, depths[0], projector);
        Line { edge, start, along, length2: along.length_squared(), linear: [a, b - a], depths, bounds }
    }

    /// Returns the number that is linear in the picture, at a point between the ends.
    #[inline(always)]
    pub fn linear_at(&self, s: f64) -> f64 {
        let [a, step] = self.linear;
        a + step * s
    }

    /// Returns the point of the picture between the ends.
    #[inline(always)]
    pub fn at(&self, s: f64) -> DVec2 {
        self.start + self.along * s
    }

    /// Returns the half width in pixels between the ends.
    #[inline(always)]
    pub fn half_width_at(&self, projector: &Projector, s: f64) -> f64 {
        projector.half_width(self.linear_at(s))
    }
}
