//! The lines of edges near a batch of pixels, prepared for tests against samples.

use glam::{DVec2, UVec2};

use super::projection::{Projector, Segment};
use super::screen_grid::ScreenGrid;

/// Pixels by which the bounds of lines are larger than they are: more than rounding errs by.
const SLACK: f64 = 1e-3;

/// Lines or samples that are tested at once.
pub(super) const LANES: usize = 16;

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
}

/// The lines of the cells that a batch of pixels lies in.
#[derive(Default)]
pub(super) struct BatchLines {
    lines: Vec<Line>,
    /// The bounds of the lines of each cell, in blocks of their own.
    boxes: Vec<LineBoxes>,
    cells: Vec<CellLines>,
    /// The least depths of a cell's lines, with their edges.
    order: Vec<(f64, u32)>,
}

/// The lines of a cell.
#[derive(Clone, Copy)]
pub(super) struct CellLines {
    cell: usize,
    /// Index of the first line.
    first_line: usize,
    first_box: usize,
    box_count: usize,
}

/// Bounds of some lines in the picture, with their widths; empty where there are fewer lines.
#[derive(Clone, Copy)]
pub(super) struct LineBoxes {
    /// The least x and y of each line.
    pub min: [[f64; LANES]; 2],
    /// The greatest.
    pub max: [[f64; LANES]; 2],
}

impl LineBoxes {
    const EMPTY: LineBoxes =
        LineBoxes { min: [[f64::INFINITY; LANES]; 2], max: [[f64::NEG_INFINITY; LANES]; 2] };

    fn set(&mut self, lane: usize, segment: &Segment, projector: &Projector) {
        let [a, b] = segment.depths.map(|depth| projector.half_width(depth));
        let reach = a.max(b) + SLACK;
        let [a, b] = segment.ends.map(|end| end.to_array());
        for axis in 0..2 {
            self.min[axis][lane] = a[axis].min(b[axis]) - reach;
            self.max[axis][lane] = a[axis].max(b[axis]) + reach;
        }
    }
}

impl BatchLines {
    /// Removes all lines and keeps the memory.
    pub fn clear(&mut self) {
        self.lines.clear();
        self.boxes.clear();
        self.cells.clear();
    }

    /// Adds the lines that may touch samples of a pixel, if they are not there yet: those of its cell, by their least depth.
    pub fn add_cell_of(&mut self, grid: &ScreenGrid, pixel: UVec2) -> CellLines {
        let cell = grid.cell(pixel);
        // Neighbours follow each other.
        if let Some(known) = self.cells.iter().rev().find(|known| known.cell == cell) {
            return *known;
        }
        let edge = |edge: u32| &grid.edges[edge as usize].segment;
        self.order.clear();
        let least_depth = |&number: &u32| (grid.projector.depth_bounds(edge(number).depths)[0], number);
        self.order.extend(grid.edges_in(cell).iter().map(least_depth));
        self.order.sort_unstable_by(|(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
        let (first_line, first_box) = (self.lines.len(), self.boxes.len());
        self.lines.extend(self.order.iter().map(|(_, i)| Line::new(*i, edge(*i), &grid.projector)));
        self.boxes.extend(self.order.chunks(LANES).map(|order| {
            let mut boxes = LineBoxes::EMPTY;
            order.iter().enumerate().for_each(|(lane, (_, i))| boxes.set(lane, edge(*i), &grid.projector));
            boxes
        }));
        let box_count = self.boxes.len() - first_box;
        let added = CellLines { cell, first_line, first_box, box_count };
        self.cells.push(added);
        added
    }

    /// Returns all lines.
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Returns the index of the first line of a cell, and the bounds of its lines.
    pub fn boxes(&self, cell: CellLines) -> (usize, &[LineBoxes]) {
        let CellLines { first_line, first_box, box_count, .. } = cell;
        (first_line, &self.boxes[first_box..first_box + box_count])
    }
}

impl Line {
    fn new(edge: u32, segment: &Segment, projector: &Projector) -> Line {
        let ([start, end], [a, b]) = (segment.ends, segment.depths);
        let along = end - start;
        let depths = projector.depth_bounds([a, b]);
        Line { edge, start, along, length2: along.length_squared(), linear: [a, b - a], depths }
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
