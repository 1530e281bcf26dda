//! Polygons cut ear by ear, in Blender's order. What is flat looks the same however it is cut; what is not
//! flat does not, and is modelled by looking at it in Blender.

use std::cmp::Ordering::{self, Equal, Greater, Less};

use glam::{DVec2, USizeVec2};

/// Corners beyond which those that may lie in an ear are looked up by where they are.
const MANY: usize = 64;

/// Cuts polygons, one after the other in the same memory.
#[derive(Default)]
pub(crate) struct Ears {
    next: Vec<usize>,
    prev: Vec<usize>,
    /// How the polygon turns at each corner that is left.
    turns: Vec<Ordering>,
    /// Corners left that do not turn left: others lie in no ear.
    odd: usize,
    /// For each corner one that lay in its triangle, or itself.
    in_way: Vec<usize>,
    /// Looks around a polygon of many corners that found no ear: for corners that turn left, and for others.
    failed: usize,
    grid: Grid,
}

impl Ears {
    /// Looks at a counter-clockwise polygon, which is then cut. True where it turns left everywhere.
    pub fn look(&mut self, p: &[DVec2]) -> bool {
        let n = p.len();
        self.next.clear();
        self.next.extend((1..n).chain([0]));
        self.prev.clear();
        self.prev.extend((n - 1..n).chain(0..n - 1));
        self.turns.clear();
        self.turns.extend((0..n).map(|i| side([self.prev[i], i, self.next[i]].map(|k| p[k]))));
        self.failed = 0;
        self.in_way.clear();
        self.in_way.extend(0..n);
        self.odd = self.turns.iter().filter(|&&turn| turn != Greater).count();
        self.odd == 0
    }

    /// Adds the triangles of a polygon of four corners or more, as indices by threes: as many as it has corners,
    /// less two, all wound as it is where it does not cross itself.
    pub fn cut(&mut self, p: &[DVec2], out: &mut Vec<usize>) {
        if p.len() > MANY && self.odd > 0 {
            self.grid.fill(p, self.odd, |i| self.turns[i] != Greater);
        }
        // The first corner of those that are left.
        let mut first = 0;
        let (mut start, mut back) = (0, false);
        for left in (4..=p.len()).rev() {
            let tip = self.find(p, start, left, back);
            let (a, b) = (self.prev[tip], self.next[tip]);
            out.extend([a, tip, b]);
            (self.next[a], self.prev[b]) = (b, a);
            first = if tip == first { b } else { first };
            self.turn(tip, Greater);
            for k in [a, b] {
                if self.turns[k] != Greater {
                    self.turn(k, side([self.prev[k], k, self.next[k]].map(|k| p[k])));
                }
            }
            // Ears side by side would make a fan: every other one is taken, there and back again.
            start = if back { self.prev[a] } else { self.next[b] };
            if self.turns[start] != Greater {
                start = if back { self.prev[start] } else { self.next[start] };
                back = !back;
            }
        }
        out.extend([first, self.next[first], self.prev[first]]);
    }

    fn turn(&mut self, corner: usize, turn: Ordering) {
        self.odd -= usize::from(self.turns[corner] != Greater && turn == Greater);
        self.turns[corner] = turn;
    }

    /// The next ear's tip from `start` on. What is straight is cut where nothing else can be, and anything where
    /// nothing is an ear, as where a polygon crosses itself.
    fn find(&mut self, p: &[DVec2], start: usize, left: usize, back: bool) -> usize {
        for (i, least) in [Greater, Equal].into_iter().enumerate().skip(self.failed) {
            let mut tip = start;
            for _ in 0..left {
                if self.turns[tip] >= least && self.is_ear(p, tip) {
                    return tip;
                }
                tip = if back { self.prev[tip] } else { self.next[tip] };
            }
            // Many corners are not all asked again and again for what none of them had.
            self.failed = if p.len() > MANY { i + 1 } else { 0 };
        }
        let mut all = std::iter::successors(Some(start), |&i| Some(self.next[i])).take(left);
        all.find(|&i| self.turns[i] != Less).unwrap_or(start)
    }

    /// True where no other corner lies in the triangle at `tip`, or on its edge.
    fn is_ear(&mut self, p: &[DVec2], tip: usize) -> bool {
        if self.odd == 0 {
            return true;
        }
        let ear = [self.prev[tip], tip, self.next[tip]];
        let [a, b, c] = ear.map(|i| p[i]);
        let within = |k: &usize| {
            self.turns[*k] != Greater
                && [[c, a], [a, b], [b, c]].iter().all(|&[from, to]| side([from, to, p[*k]]) != Less)
                && !ear.contains(k)
        };
        // What was in the way is so, most often, when the same corner is asked again.
        if within(&self.in_way[tip]) {
            return false;
        }
        let found = if self.turns.len() > MANY {
            self.grid.find([a.min(b).min(c), a.max(b).max(c)], within)
        } else {
            let others = std::iter::successors(Some(self.next[ear[2]]), |&k| Some(self.next[k]));
            others.take_while(|&k| k != ear[0]).find(within)
        };
        self.in_way[tip] = found.unwrap_or(tip);
        found.is_none()
    }
}

/// On which side of the way from `a` to `b` is `c`: [`Greater`] is left.
#[inline]
fn side([a, b, c]: [DVec2; 3]) -> Ordering {
    let (to, on) = (b - a, c - a);
    let across = to.perp_dot(on);
    // Numbers with six digits turn a little along a straight edge.
    if across * across <= 1e-12 * to.length_squared() * on.length_squared() {
        Equal
    } else {
        across.total_cmp(&0.0)
    }
}

/// Corners of a polygon by where they lie.
#[derive(Default)]
struct Grid {
    lo: DVec2,
    /// Cells in a unit.
    per: DVec2,
    /// Cells along each axis.
    cells: usize,
    /// Where each cell's corners begin among all, and where the last one's end.
    starts: Vec<usize>,
    corners: Vec<usize>,
}

impl Grid {
    /// Of `count` corners of `p`.
    fn fill(&mut self, p: &[DVec2], count: usize, held: impl Fn(usize) -> bool) {
        let (lo, hi) = p.iter().fold((p[0], p[0]), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        self.cells = count.isqrt().clamp(1, 1 << 10);
        (self.lo, self.per) = (lo, self.cells as f64 / (hi - lo).max(DVec2::splat(f64::MIN_POSITIVE)));
        let held = || (0..p.len()).filter(|&i| held(i));
        self.starts.clear();
        self.starts.resize(self.cells * self.cells + 1, 0);
        for i in held() {
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
        for i in held() {
            let cell = self.index(p[i]);
            self.starts[cell] -= 1;
            self.corners[self.starts[cell]] = i;
        }
    }

    fn cell(&self, p: DVec2) -> USizeVec2 {
        ((p - self.lo) * self.per).as_usizevec2().min(USizeVec2::splat(self.cells - 1))
    }

    fn index(&self, p: DVec2) -> usize {
        let cell = self.cell(p);
        cell.y * self.cells + cell.x
    }

    /// One of the corners in the cells that a box touches that is `wanted`.
    fn find(&self, [lo, hi]: [DVec2; 2], wanted: impl Fn(&usize) -> bool) -> Option<usize> {
        let (lo, hi) = (self.cell(lo), self.cell(hi));
        let row = |y: usize| self.starts[y * self.cells + lo.x]..self.starts[y * self.cells + hi.x + 1];
        (lo.y..=hi.y).find_map(|y| self.corners[row(y)].iter().copied().find(&wanted))
    }
}

#[cfg(test)]
mod tests {
    use crate::import::obj::polygon::Triangulator;
    use glam::Vec3;

    fn numbers<const N: usize, T: std::str::FromStr>(text: &str) -> Vec<[T; N]> {
        let one = |text: &str| {
            let all: Vec<T> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            all.try_into().ok().unwrap()
        };
        text.split(',').map(one).collect()
    }

    /// By threes, whichever corner of a triangle is its first.
    fn sorted(triangles: &[[usize; 3]]) -> Vec<[usize; 3]> {
        let from_least = |&[a, b, c]: &[usize; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
        let mut all: Vec<_> = triangles.iter().filter_map(from_least).collect();
        all.sort_unstable();
        all
    }

    /// As Blender 5.0.1 cut them, none of which is flat but the first.
    #[test]
    fn polygons_are_cut_as_blender_cuts_them() {
        for (name, corners, expected) in [
            ("a pentagon", "0 0 0, 2 0 0, 3 2 0, 1 4 0, -1 2 0", "4 0 1, 1 2 3, 1 3 4"),
            (
                "a convex one",
                "4 0 1, 3 3 0, 0 4 -1, -3 3 1, -4 0 0, -3 -3 -1, 0 -4 1, 3 -3 0",
                "7 0 1, 1 2 3, 3 4 5, 5 6 7, 7 1 3, 3 5 7",
            ),
            (
                "a star",
                "0 10 3, -2 3 0, -9 3 1, -4 -1 2, -6 -8 0, 0 -4 1, 6 -8 2, 4 -1 0, 9 3 3, 2 3 1",
                "9 0 1, 1 2 3, 3 4 5, 5 6 7, 7 8 9, 9 1 3, 3 5 7, 3 7 9",
            ),
            (
                "a ribbon that winds upward",
                "10 0 0, 7 7 1, 0 10 2, -7 7 3, -10 0 4, -7 -7 5, 0 -10 6, \
                 0 -5 6, -4 -4 5, -5 0 4, -4 4 3, 0 5 2, 4 4 1, 5 0 0",
                "13 0 1, 1 2 3, 3 4 5, 5 6 7, 5 7 8, 12 13 1, 11 12 1, 3 5 8, 3 8 9, 11 1 3, 3 9 10, 3 10 11",
            ),
            ("one that crosses itself", "0 10 0, -6 -8 1, 9 3 0, -9 3 1, 6 -8 0", "4 0 1, 1 2 3, 1 3 4"),
            ("a bent quad", "0 0 0, 4 1 3, 5 5 0, 1 4 3", "0 1 3, 1 2 3"),
            ("the same from its second corner", "4 1 3, 5 5 0, 1 4 3, 0 0 0", "0 1 2, 0 2 3"),
            ("a concave quad", "4 0 1, 1 1 0, 0 4 1, 0 0 0", "0 1 3, 1 2 3"),
            ("one that would fold", "11 -4 5, -6 -1 4, -2 4 -8, -1 -4 9", "0 1 3, 1 2 3"),
        ] {
            let corners = numbers(corners).into_iter().map(Vec3::from_array);
            let cut: Vec<usize> = Triangulator::default().triangulate(corners).collect();
            assert_eq!(sorted(cut.as_chunks::<3>().0), sorted(&numbers(expected)), "{name}");
        }
    }
}
