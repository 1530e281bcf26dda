//! Outlines of pixel masks as polygons along the edges of pixels.

use std::collections::HashMap;

use super::pixel_mask::PixelMask;

/// Neighbours by direction: to the right, downward, to the left and upward.
const STEPS: [(i32, i32); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

impl PixelMask {
    /// Polygons that cover exactly the pixels: one for each set of pixels that are connected by edges. Each is a list of
    /// corners x, y in turn, in pixels from the upper left corner of the picture, clockwise as seen. Holes are joined to
    /// the outline by vertical edges that go there and back.
    pub fn outlines(&self) -> Vec<Vec<i32>> {
        let Some(bounds) = self.bounds() else { return Vec::new() };
        let pixels = self.cropped(bounds).to_bytes(bounds.width, bounds.height);
        let grid = PixelGrid { width: bounds.width as i32, height: bounds.height as i32, pixels: &pixels };
        let mut outlines = OutlineSet::trace(&grid);
        outlines.join_holes(&grid);
        let moved = |(x, y): (i32, i32)| [x.saturating_add(bounds.x), y.saturating_add(bounds.y)];
        let outer = outlines.loops.iter().filter(|outline| !outline.is_hole);
        outer.map(|outline| outlines.corners(outline.start).into_iter().flat_map(moved).collect()).collect()
    }
}

/// The pixels within the bounds of a mask.
struct PixelGrid<'m> {
    width: i32,
    height: i32,
    /// Row-major; 0 outside of the mask.
    pixels: &'m [u8],
}

impl PixelGrid<'_> {
    fn is_inside(&self, x: i32, y: i32) -> bool {
        (0..self.width).contains(&x)
            && (0..self.height).contains(&y)
            && self.pixels[y as usize * self.width as usize + x as usize] != 0
    }

    /// The pixel to the right of the edge that leads from a corner of pixels in a direction.
    fn pixel_at_right(&self, (x, y): (i32, i32), direction: usize) -> (i32, i32) {
        match direction {
            0 => (x, y),
            1 => (x - 1, y),
            2 => (x - 1, y - 1),
            _ => (x, y - 1),
        }
    }

    /// Returns true if the edge from a corner in a direction has the mask on its right side only.
    fn is_outline(&self, corner: (i32, i32), direction: usize) -> bool {
        let (x, y) = self.pixel_at_right(corner, direction);
        // The pixel on the left side is a quarter turn back.
        let (dx, dy) = STEPS[(direction + 3) % 4];
        self.is_inside(x, y) && !self.is_inside(x + dx, y + dy)
    }
}

/// A corner of pixels on an outline.
#[derive(Clone, Copy)]
struct OutlineNode {
    at: (i32, i32),
    next: usize,
    previous: usize,
}

/// A closed outline.
struct Outline {
    /// One of its nodes; for holes the leftmost of the topmost ones.
    start: usize,
    is_hole: bool,
}

/// All outlines of a mask.
#[derive(Default)]
struct OutlineSet {
    nodes: Vec<OutlineNode>,
    loops: Vec<Outline>,
}

impl OutlineSet {
    /// Follows all edges between pixels of the mask and others. Where two pixels touch at a corner only, outlines stay with
    /// the same pixel.
    fn trace(grid: &PixelGrid) -> OutlineSet {
        let mut outlines = OutlineSet::default();
        // Every outline has an edge to the right, above a pixel.
        let mut is_done = vec![false; grid.pixels.len()];
        for y in 0..grid.height {
            for x in 0..grid.width {
                if !is_done[(y * grid.width + x) as usize] && grid.is_outline((x, y), 0) {
                    outlines.trace_from((x, y), grid, &mut is_done);
                }
            }
        }
        outlines
    }

    /// Follows the outline that leads to the right from a corner.
    fn trace_from(&mut self, start: (i32, i32), grid: &PixelGrid, is_done: &mut [bool]) {
        let first = self.nodes.len();
        let (mut at, mut direction) = (start, 0);
        let (mut highest, mut doubled_area) = (first, 0i64);
        loop {
            if direction == 0 {
                is_done[(at.1 * grid.width + at.0) as usize] = true;
            }
            let index = self.nodes.len();
            self.nodes.push(OutlineNode { at, next: index + 1, previous: index.wrapping_sub(1) });
            let height = |node: usize| (self.nodes[node].at.1, self.nodes[node].at.0);
            if height(index) < height(highest) {
                highest = index;
            }
            let (dx, dy) = STEPS[direction];
            doubled_area += i64::from(at.0) * i64::from(dy) - i64::from(at.1) * i64::from(dx);
            at = (at.0 + dx, at.1 + dy);
            // Right, straight on, or left.
            let turns = [1, 0, 3].map(|turn| (direction + turn) % 4);
            direction = turns.into_iter().find(|&turn| grid.is_outline(at, turn)).unwrap_or(0);
            if (at, direction) == (start, 0) {
                break;
            }
        }
        let last = self.nodes.len() - 1;
        self.nodes[last].next = first;
        self.nodes[first].previous = last;
        self.loops.push(Outline { start: highest, is_hole: doubled_area < 0 });
    }

    /// Joins each hole to the outline above it.
    fn join_holes(&mut self, grid: &PixelGrid) {
        if !self.loops.iter().any(|outline| outline.is_hole) {
            return;
        }
        let at: HashMap<(i32, i32), usize> = self.nodes.iter().enumerate().map(|(i, n)| (n.at, i)).collect();
        let holes: Vec<usize> =
            self.loops.iter().filter(|outline| outline.is_hole).map(|outline| outline.start).collect();
        for hole in holes {
            let (x, mut y) = self.nodes[hole].at;
            // The pixels on both sides of the edge upward are in the mask.
            loop {
                y -= 1;
                if !(grid.is_inside(x - 1, y - 1) && grid.is_inside(x, y - 1)) {
                    break;
                }
            }
            if let Some(&above) = at.get(&(x, y)) {
                self.join(above, hole);
            }
        }
    }

    /// Joins the outline of `hole` to the outline through `above`, by an edge there and back.
    fn join(&mut self, above: usize, hole: usize) {
        let (before_hole, after) = (self.nodes[hole].previous, self.nodes[above].next);
        let hole_again = self.nodes.len();
        let above_again = hole_again + 1;
        self.nodes.push(OutlineNode { at: self.nodes[hole].at, next: above_again, previous: before_hole });
        self.nodes.push(OutlineNode { at: self.nodes[above].at, next: after, previous: hole_again });
        self.nodes[before_hole].next = hole_again;
        self.nodes[after].previous = above_again;
        self.nodes[above].next = hole;
        self.nodes[hole].previous = above;
    }

    /// The nodes of an outline at which its direction changes.
    fn corners(&self, start: usize) -> Vec<(i32, i32)> {
        let direction =
            |from: (i32, i32), to: (i32, i32)| ((to.0 - from.0).signum(), (to.1 - from.1).signum());
        let mut corners = Vec::new();
        let mut node = start;
        loop {
            let OutlineNode { at, next, previous } = self.nodes[node];
            if direction(self.nodes[previous].at, at) != direction(at, self.nodes[next].at) {
                corners.push(at);
            }
            node = next;
            if node == start {
                return corners;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(pixels: impl Iterator<Item = (i32, i32)>) -> PixelMask {
        let mut mask = PixelMask::default();
        pixels.for_each(|(x, y)| mask.add(x, y));
        mask
    }

    /// Returns true if the centre of a pixel is inside of a polygon: edges above it in its column change sides.
    fn covers(polygon: &[i32], (x, y): (i32, i32)) -> bool {
        let corners: Vec<(i32, i32)> = polygon.chunks(2).map(|c| (c[0], c[1])).collect();
        let edges = (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]));
        let above = edges.filter(|&(a, b)| {
            assert!((a.0 == b.0) != (a.1 == b.1), "{polygon:?}: an edge is horizontal or vertical");
            a.1 == b.1 && a.1 <= y && (a.0.min(b.0)..a.0.max(b.0)).contains(&x)
        });
        above.count() % 2 == 1
    }

    /// Every set of pixels of a 4 × 4 image is covered by its outlines, each pixel by one.
    #[test]
    fn outlines_cover_exactly_the_pixels() {
        let all = || (0..4).flat_map(|y| (0..4).map(move |x| (x, y)));
        for bits in 0..1u32 << 16 {
            let is_set = |&(x, y): &(i32, i32)| bits >> (4 * y + x) & 1 == 1;
            let outlines = mask(all().filter(is_set)).outlines();
            for pixel in all() {
                let count = outlines.iter().filter(|polygon| covers(polygon, pixel)).count();
                assert_eq!(count, usize::from(is_set(&pixel)), "{bits:016b} at {pixel:?}: {outlines:?}");
            }
        }
    }

    #[test]
    fn outlines_are_simple_where_they_can_be() {
        let rectangle = mask((5..7).flat_map(|y| (-3..1).map(move |x| (x, y))));
        assert_eq!(rectangle.outlines(), [[-3, 5, 1, 5, 1, 7, -3, 7]]);
        // Two pixels that touch at a corner are two polygons.
        assert_eq!(mask([(0, 0), (1, 1)].into_iter()).outlines().len(), 2);
        assert!(PixelMask::default().outlines().is_empty());
    }

    /// Holes beside, above and inside of each other.
    #[test]
    fn holes_are_not_covered() {
        let picture =
            ["###########.", "#..##.#...#.", "####.##.#.##", "#.#####...##", "#.#.#######.", "###########."];
        let is_set = |x: i32, y: i32| picture[y as usize].as_bytes()[x as usize] == b'#';
        let all = || (0..6).flat_map(|y| (0..12).map(move |x| (x, y)));
        let outlines = mask(all().filter(|&(x, y)| is_set(x, y))).outlines();
        assert_eq!(outlines.len(), 2, "the picture and the pixel inside of a hole: {outlines:?}");
        for (x, y) in all() {
            assert_eq!(outlines.iter().any(|polygon| covers(polygon, (x, y))), is_set(x, y), "{x} {y}");
        }
    }
}
