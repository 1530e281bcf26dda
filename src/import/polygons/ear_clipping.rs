//! Ear clipping in Blender's order. A planar polygon looks the same however it is cut; a non-planar one does
//! not, and its author modelled it by looking at it in Blender.

use std::cmp::Ordering::{self, Equal, Greater, Less};

use glam::{DVec2, USizeVec2};

/// Polygons with more corners than this find the corners inside an ear with a grid.
const GRID_MIN_CORNERS: usize = 64;

/// Clips polygons one after the other and reuses its buffers.
#[derive(Default)]
pub(crate) struct EarClipper {
    next: Vec<usize>,
    prev: Vec<usize>,
    /// Turn at each remaining corner: [`Greater`] is convex, [`Equal`] straight, [`Less`] reflex.
    turns: Vec<Ordering>,
    /// Number of remaining corners that are not convex. Only those can lie inside an ear.
    not_convex: usize,
    /// For each corner, a corner that was last found inside its triangle, or itself.
    blocker: Vec<usize>,
    /// Number of search passes (convex tips, then straight ones) that found no ear in a large polygon.
    failed_passes: usize,
    grid: Grid,
}

impl EarClipper {
    /// Prepares to clip a counter-clockwise polygon. Returns true if it is strictly convex.
    pub fn start(&mut self, p: &[DVec2]) -> bool {
        let n = p.len();
        self.next.clear();
        self.next.extend((1..n).chain([0]));
        self.prev.clear();
        self.prev.extend((n - 1..n).chain(0..n - 1));
        self.turns.clear();
        self.turns.extend((0..n).map(|i| orientation([self.prev[i], i, self.next[i]].map(|k| p[k]))));
        self.failed_passes = 0;
        self.blocker.clear();
        self.blocker.extend(0..n);
        self.not_convex = self.turns.iter().filter(|&&turn| turn != Greater).count();
        self.not_convex == 0
    }

    /// Adds the n − 2 triangles of a polygon of n ≥ 4 corners as triples of indices. All have the polygon's
    /// winding unless it intersects itself.
    pub fn clip(&mut self, p: &[DVec2], out: &mut Vec<usize>) {
        if p.len() > GRID_MIN_CORNERS && self.not_convex > 0 {
            self.grid.fill(p, self.not_convex, |i| self.turns[i] != Greater);
        }
        // The first remaining corner.
        let mut first = 0;
        let mut start = 0;
        let mut backward = false;
        for left in (4..=p.len()).rev() {
            let tip = self.find_ear(p, start, left, backward);
            let a = self.prev[tip];
            let b = self.next[tip];
            out.extend([a, tip, b]);
            self.next[a] = b;
            self.prev[b] = a;
            first = if tip == first { b } else { first };
            self.set_turn(tip, Greater);
            for k in [a, b] {
                if self.turns[k] != Greater {
                    self.set_turn(k, orientation([self.prev[k], k, self.next[k]].map(|k| p[k])));
                }
            }
            // Adjacent ears would form a fan: skip every other corner, forward and then backward.
            start = if backward { self.prev[a] } else { self.next[b] };
            if self.turns[start] != Greater {
                start = if backward { self.prev[start] } else { self.next[start] };
                backward = !backward;
            }
        }
        out.extend([first, self.next[first], self.prev[first]]);
    }

    fn set_turn(&mut self, corner: usize, turn: Ordering) {
        self.not_convex -= usize::from(self.turns[corner] != Greater && turn == Greater);
        self.turns[corner] = turn;
    }

    /// Returns the tip of the next ear from `start` on among `left` corners. Straight corners are clipped only if
    /// no convex one is an ear, and any corner if there is no ear, as in a self-intersecting polygon.
    fn find_ear(&mut self, p: &[DVec2], start: usize, left: usize, backward: bool) -> usize {
        for (pass, min_turn) in [Greater, Equal].into_iter().enumerate().skip(self.failed_passes) {
            let mut tip = start;
            for _ in 0..left {
                if self.turns[tip] >= min_turn && self.is_ear(p, tip) {
                    return tip;
                }
                tip = if backward { self.prev[tip] } else { self.next[tip] };
            }
            // A large polygon does not repeat a pass that failed.
            self.failed_passes = if p.len() > GRID_MIN_CORNERS { pass + 1 } else { 0 };
        }
        let mut remaining = std::iter::successors(Some(start), |&i| Some(self.next[i])).take(left);
        remaining.find(|&i| self.turns[i] != Less).unwrap_or(start)
    }

    /// Returns true if no other corner lies in the triangle at `tip` or on its edges.
    fn is_ear(&mut self, p: &[DVec2], tip: usize) -> bool {
        if self.not_convex == 0 {
            return true;
        }
        let ear = [self.prev[tip], tip, self.next[tip]];
        let [a, b, c] = ear.map(|i| p[i]);
        let is_inside = |k: &usize| {
            self.turns[*k] != Greater
                && [[c, a], [a, b], [b, c]].iter().all(|&[from, to]| orientation([from, to, p[*k]]) != Less)
                && !ear.contains(k)
        };
        // The last blocker usually still blocks.
        if is_inside(&self.blocker[tip]) {
            return false;
        }
        let found = if self.turns.len() > GRID_MIN_CORNERS {
            self.grid.find([a.min(b).min(c), a.max(b).max(c)], is_inside)
        } else {
            let others = std::iter::successors(Some(self.next[ear[2]]), |&k| Some(self.next[k]));
            others.take_while(|&k| k != ear[0]).find(is_inside)
        };
        self.blocker[tip] = found.unwrap_or(tip);
        found.is_none()
    }
}

/// Returns the orientation of the triangle abc: [`Greater`] is counter-clockwise, [`Equal`] nearly collinear.
#[inline]
fn orientation([a, b, c]: [DVec2; 3]) -> Ordering {
    let ab = b - a;
    let ac = c - a;
    let area = ab.perp_dot(ac);
    // Rounding to six digits bends a straight edge a little.
    if area * area <= 1e-12 * ab.length_squared() * ac.length_squared() {
        Equal
    } else {
        area.total_cmp(&0.0)
    }
}

/// A uniform grid over the corners of a polygon.
#[derive(Default)]
struct Grid {
    lo: DVec2,
    cells_per_unit: DVec2,
    /// Cells along each axis.
    cells: usize,
    /// Start of each cell in `corners`, and the end of the last one.
    starts: Vec<usize>,
    corners: Vec<usize>,
}

impl Grid {
    /// Sorts the `count` corners of `p` that `include` accepts into cells (counting sort).
    fn fill(&mut self, p: &[DVec2], count: usize, include: impl Fn(usize) -> bool) {
        let (lo, hi) = p.iter().fold((p[0], p[0]), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        self.cells = count.isqrt().clamp(1, 1 << 10);
        self.lo = lo;
        self.cells_per_unit = self.cells as f64 / (hi - lo).max(DVec2::splat(f64::MIN_POSITIVE));
        let included = || (0..p.len()).filter(|&i| include(i));
        self.starts.clear();
        self.starts.resize(self.cells * self.cells + 1, 0);
        for i in included() {
            let cell = self.index(p[i]);
            self.starts[cell] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.corners.clear();
        self.corners.resize(end, 0);
        for i in included() {
            let cell = self.index(p[i]);
            self.starts[cell] -= 1;
            self.corners[self.starts[cell]] = i;
        }
    }

    fn cell(&self, p: DVec2) -> USizeVec2 {
        ((p - self.lo) * self.cells_per_unit).as_usizevec2().min(USizeVec2::splat(self.cells - 1))
    }

    fn index(&self, p: DVec2) -> usize {
        let cell = self.cell(p);
        cell.y * self.cells + cell.x
    }

    /// Returns a corner in the cells that overlap a box and that `predicate` accepts.
    fn find(&self, [lo, hi]: [DVec2; 2], predicate: impl Fn(&usize) -> bool) -> Option<usize> {
        let lo = self.cell(lo);
        let hi = self.cell(hi);
        let row = |y: usize| self.starts[y * self.cells + lo.x]..self.starts[y * self.cells + hi.x + 1];
        (lo.y..=hi.y).find_map(|y| self.corners[row(y)].iter().copied().find(&predicate))
    }
}

#[cfg(test)]
mod tests {
    use crate::polygons::triangulator::Triangulator;
    use glam::Vec3;

    fn numbers<const N: usize, T: std::str::FromStr>(text: &str) -> Vec<[T; N]> {
        let one = |text: &str| {
            let all: Vec<T> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            all.try_into().ok().unwrap()
        };
        text.split(',').map(one).collect()
    }

    /// Sorts triangles, each rotated to start at its lowest index.
    fn sorted(triangles: &[[usize; 3]]) -> Vec<[usize; 3]> {
        let from_least = |&[a, b, c]: &[usize; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
        let mut all: Vec<_> = triangles.iter().filter_map(from_least).collect();
        all.sort_unstable();
        all
    }

    /// Expected triangles are from Blender 5.0.1. Only the first polygon is planar.
    #[test]
    fn polygons_are_triangulated_as_in_blender() {
        for (name, corners, expected) in [
            ("a pentagon", "0 0 0, 2 0 0, 3 2 0, 1 4 0, -1 2 0", "4 0 1, 1 2 3, 1 3 4"),
            (
                "a convex polygon",
                "4 0 1, 3 3 0, 0 4 -1, -3 3 1, -4 0 0, -3 -3 -1, 0 -4 1, 3 -3 0",
                "7 0 1, 1 2 3, 3 4 5, 5 6 7, 7 1 3, 3 5 7",
            ),
            (
                "a star",
                "0 10 3, -2 3 0, -9 3 1, -4 -1 2, -6 -8 0, 0 -4 1, 6 -8 2, 4 -1 0, 9 3 3, 2 3 1",
                "9 0 1, 1 2 3, 3 4 5, 5 6 7, 7 8 9, 9 1 3, 3 5 7, 3 7 9",
            ),
            (
                "a helical ribbon",
                "10 0 0, 7 7 1, 0 10 2, -7 7 3, -10 0 4, -7 -7 5, 0 -10 6, \
                 0 -5 6, -4 -4 5, -5 0 4, -4 4 3, 0 5 2, 4 4 1, 5 0 0",
                "13 0 1, 1 2 3, 3 4 5, 5 6 7, 5 7 8, 12 13 1, 11 12 1, 3 5 8, 3 8 9, 11 1 3, 3 9 10, 3 10 11",
            ),
            ("a self-intersecting pentagon", "0 10 0, -6 -8 1, 9 3 0, -9 3 1, 6 -8 0", "4 0 1, 1 2 3, 1 3 4"),
            ("a bent quad", "0 0 0, 4 1 3, 5 5 0, 1 4 3", "0 1 3, 1 2 3"),
            ("the same quad from its second corner", "4 1 3, 5 5 0, 1 4 3, 0 0 0", "0 1 2, 0 2 3"),
            ("a concave quad", "4 0 1, 1 1 0, 0 4 1, 0 0 0", "0 1 3, 1 2 3"),
            ("a quad that would fold", "11 -4 5, -6 -1 4, -2 4 -8, -1 -4 9", "0 1 3, 1 2 3"),
        ] {
            let corners = numbers(corners).into_iter().map(Vec3::from_array);
            let triangles: Vec<usize> = Triangulator::default().triangulate(corners).collect();
            assert_eq!(sorted(triangles.as_chunks::<3>().0), sorted(&numbers(expected)), "{name}");
        }
    }
}
