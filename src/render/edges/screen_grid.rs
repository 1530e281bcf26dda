//! A grid of cells over the picture, each with the edges whose lines may touch it.

use glam::{DVec2, UVec2};

use super::edge_selection::{EdgeColors, ScreenEdge, ScreenEdges};
use super::projection::Projector;
use crate::film::PixelRect;
use crate::settings::RenderSettings;

/// Sides of cells in pixels, by the number of edges: at most this many.
const CELLS: [(usize, f64); 3] = [(1 << 16, 16.0), (1 << 19, 8.0), (usize::MAX, 4.0)];

/// Pixels that rounding of positions stays below.
const SLACK: f64 = 0.01;

/// The edges of a picture by cell.
pub(super) struct ScreenGrid {
    pub edges: Vec<ScreenEdge>,
    pub projector: Projector,
    pub colors: EdgeColors,
    window: PixelRect,
    /// Side of a cell in pixels.
    cell: f64,
    columns: usize,
    rows: usize,
    /// For each cell the start of its part of `entries`, and the end of the last.
    starts: Vec<usize>,
    entries: Vec<u32>,
}

impl ScreenGrid {
    /// Sorts edges into the cells of a picture's window.
    pub fn new(edges: ScreenEdges, settings: &RenderSettings) -> ScreenGrid {
        let ScreenEdges { edges, projector, colors } = edges;
        let window = settings.window();
        // Samples lie around the centre of their pixel.
        let reach = (settings.filter.radius() - 0.5).max(0.0) + SLACK;
        let widest =
            edges.iter().flat_map(|edge| edge.segment.depths).map(|depth| projector.half_width(depth));
        let widest = widest.fold(0.0, f64::max);
        let (_, least) = CELLS.into_iter().find(|(count, _)| edges.len() <= *count).unwrap_or(CELLS[2]);
        let cell = least.max((2.0 * widest).ceil());
        let count = |pixels: u32| (f64::from(pixels) / cell).ceil().max(1.0) as usize;
        let (columns, rows) = (count(window.width), count(window.height));
        let mut grid = ScreenGrid {
            edges: Vec::new(),
            projector,
            colors,
            window,
            cell,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            entries: Vec::new(),
        };
        let margin = |edge: &ScreenEdge, grid: &ScreenGrid| {
            let [a, b] = edge.segment.depths.map(|depth| grid.projector.half_width(depth));
            a.max(b) + reach
        };
        let mut starts = std::mem::take(&mut grid.starts);
        for edge in &edges {
            grid.for_each_cell(edge, margin(edge, &grid), |cell| starts[cell + 1] += 1);
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let mut entries = vec![0; starts[starts.len() - 1]];
        for (i, edge) in (0..).zip(&edges) {
            grid.for_each_cell(edge, margin(edge, &grid), |cell| {
                entries[next[cell]] = i;
                next[cell] += 1;
            });
        }
        ScreenGrid { edges, starts, entries, ..grid }
    }

    /// Returns the number of the cell of a pixel.
    pub fn cell(&self, pixel: UVec2) -> usize {
        let [column, row] = self.cell_of(pixel);
        row * self.columns + column
    }

    /// Returns the edges whose lines may touch samples of the pixels of a cell.
    pub fn edges_in(&self, cell: usize) -> &[u32] {
        &self.entries[self.starts[cell]..self.starts[cell + 1]]
    }

    /// Returns true if no line touches samples of the pixels from `first` to `last`.
    pub fn is_empty_between(&self, first: UVec2, last: UVec2) -> bool {
        let ([left, top], [right, bottom]) = (self.cell_of(first), self.cell_of(last));
        (top..=bottom).all(|row| {
            let start = row * self.columns;
            self.starts[start + left] == self.starts[start + right + 1]
        })
    }

    /// Returns the column and the row of the cell of a pixel.
    fn cell_of(&self, pixel: UVec2) -> [usize; 2] {
        let index = |at: u32, first: u32, count: usize| {
            ((f64::from(at.saturating_sub(first)) / self.cell) as usize).min(count - 1)
        };
        [index(pixel.x, self.window.x, self.columns), index(pixel.y, self.window.y, self.rows)]
    }

    /// Calls `add` with each cell that lies within `margin` pixels of an edge.
    fn for_each_cell(&self, edge: &ScreenEdge, margin: f64, mut add: impl FnMut(usize)) {
        let origin = DVec2::new(f64::from(self.window.x), f64::from(self.window.y));
        let [a, b] = edge.segment.ends.map(|end| end - origin);
        let (top, bottom) = if a.y <= b.y { (a, b) } else { (b, a) };
        // All of it is near each of its few rows.
        let is_short = (b - a).abs().max_element() <= self.cell;
        let index = |at: f64, count: usize| ((at / self.cell).floor().max(-1.0) as i64).min(count as i64);
        let first = index(top.y - margin, self.rows).max(0);
        let last = index(bottom.y + margin, self.rows).min(self.rows as i64 - 1);
        for row in first..=last {
            // The part of the edge near the row.
            let low = row as f64 * self.cell - margin;
            let high = (row + 1) as f64 * self.cell + margin;
            let x_at = |y: f64| {
                let s = if bottom.y > top.y { (y - top.y) / (bottom.y - top.y) } else { 0.0 };
                top.x + (bottom.x - top.x) * s.clamp(0.0, 1.0)
            };
            let is_cut = bottom.y > top.y && !is_short;
            let ends = if is_cut { [x_at(low), x_at(high)] } else { [top.x, bottom.x] };
            let left = index(ends[0].min(ends[1]) - margin, self.columns).max(0);
            let right = index(ends[0].max(ends[1]) + margin, self.columns).min(self.columns as i64 - 1);
            for column in left..=right {
                add(row as usize * self.columns + column as usize);
            }
        }
    }
}
