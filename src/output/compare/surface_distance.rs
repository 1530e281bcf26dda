//! Distances between surfaces.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use blinn_core::geometry::Aabb;

/// Triangles of a leaf.
const LEAF_TRIANGLES: usize = 4;
/// Levels of the tree: halves of 2^32 triangles.
const MAX_DEPTH: usize = 34;
/// Triangles whose distances a task finds.
const TASK_TRIANGLES: usize = 256;
/// Halvings of a line to the border of where surfaces are apart.
const BISECTIONS: usize = 12;
/// The samples of a triangle beside each: along the edges, and to and from the centre.
const NEIGHBOURS: [&[usize]; 7] =
    [&[3, 5, 6], &[3, 4, 6], &[4, 5, 6], &[0, 1, 6], &[1, 2, 6], &[2, 0, 6], &[0, 1, 2, 3, 4, 5]];

/// The distance of triangles from a surface, and its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Largest distance. Infinite if there is no surface; of no meaning up to the tolerance.
    pub distance: f64,
    /// Bounds of the points that are farther than the tolerance.
    pub bounds: Aabb,
}

impl Default for Apart {
    fn default() -> Apart {
        Apart { distance: 0.0, bounds: Aabb::EMPTY }
    }
}

impl Apart {
    /// Returns the larger distance, and the bounds of both.
    pub fn join(mut self, other: Apart) -> Apart {
        self.distance = self.distance.max(other.distance);
        self.bounds.extend_box(&other.bounds);
        self
    }
}

/// A set of triangles that finds the closest of them to a point: a binary BVH, split at the median.
pub struct Surface {
    triangles: Vec<[Vec3; 3]>,
    nodes: Vec<Node>,
}

struct Node {
    min: Vec3,
    max: Vec3,
    /// The first triangle of a leaf, else the first of two children.
    first: u32,
    /// Number of triangles; 0 for an inner node.
    count: u32,
}

impl Surface {
    /// Makes a surface of the triangles with finite corners. Triangles without area are points and lines.
    pub fn new(triangles: impl Iterator<Item = [Vec3; 3]>) -> Surface {
        let mut triangles: Vec<[Vec3; 3]> = triangles.filter(is_finite).collect();
        let mut nodes = Vec::new();
        if triangles.is_empty() {
            return Surface { triangles, nodes };
        }
        nodes.push(bounding_node(&triangles, 0));
        let mut pending = vec![0];
        while let Some(node) = pending.pop() {
            let Node { min, max, first, count } = nodes[node];
            if count as usize <= LEAF_TRIANGLES {
                continue;
            }
            let part = &mut triangles[first as usize..][..count as usize];
            let axis = (max - min).max_position();
            let middle = part.len() / 2;
            // Twice the middle of the box along the axis; the halves keep values from overflowing.
            let place = |corners: &[Vec3; 3]| {
                let [a, b, c] = corners.map(|corner| corner[axis] * 0.5);
                a.min(b).min(c) + a.max(b).max(c)
            };
            part.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
            let (left, right) = part.split_at(middle);
            let children = nodes.len();
            let halves = [bounding_node(left, first), bounding_node(right, first + middle as u32)];
            nodes.extend(halves);
            nodes[node] = Node { min, max, first: children as u32, count: 0 };
            pending.extend([children, children + 1]);
        }
        Surface { triangles, nodes }
    }

    /// Finds where these triangles are farther than `tolerance` from the surface, by their corners, the middles of their
    /// edges and their centres.
    pub fn compare(&self, triangles: &[[Vec3; 3]], tolerance: f64) -> Apart {
        let of_task = |task: &[[Vec3; 3]]| {
            let mut apart = Apart::default();
            task.iter().filter(|corners| is_finite(corners)).for_each(|corners| {
                self.extend(&mut apart, &samples(corners), tolerance);
            });
            apart
        };
        triangles.par_chunks(TASK_TRIANGLES).map(of_task).reduce(Apart::default, Apart::join)
    }

    fn extend(&self, apart: &mut Apart, samples: &[DVec3; 7], tolerance: f64) {
        let accepted = tolerance * tolerance;
        let farthest = apart.distance * apart.distance;
        if samples.iter().all(|&point| apart.bounds.contains_box(&Aabb { min: point, max: point })) {
            let squared =
                |farthest: f64, &point: &DVec3| farthest.max(self.squared_distance(point, farthest));
            apart.distance = samples.iter().fold(farthest.max(accepted), squared).sqrt();
            return;
        }
        let squared = samples.map(|point| self.squared_distance(point, accepted));
        let is_apart = squared.map(|squared| squared > accepted);
        apart.distance = squared.into_iter().fold(farthest, f64::max).sqrt();
        for (i, _) in is_apart.iter().enumerate().filter(|(_, is_apart)| **is_apart) {
            apart.bounds.extend(samples[i]);
            let ends = NEIGHBOURS[i].iter().filter(|end| !is_apart[**end]);
            ends.for_each(|&end| apart.bounds.extend(self.last_apart(samples[i], samples[end], accepted)));
        }
    }

    /// The last point from `from`, which is apart, to `to`, which is not, that is still apart.
    fn last_apart(&self, from: DVec3, to: DVec3, accepted: f64) -> DVec3 {
        let (mut apart, mut near) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (apart + near);
            let is_apart = self.squared_distance(from.lerp(to, middle), accepted) > accepted;
            *(if is_apart { &mut apart } else { &mut near }) = middle;
        }
        from.lerp(to, apart)
    }

    /// The squared distance of a point, or any smaller value than `enough` if it is below that.
    fn squared_distance(&self, point: DVec3, enough: f64) -> f64 {
        let mut closest = f64::INFINITY;
        let mut stack = [(0.0, 0); MAX_DEPTH + 1];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 && closest > enough {
            height -= 1;
            let (distance, node) = stack[height];
            if distance >= closest {
                continue;
            }
            let Node { first, count, .. } = self.nodes[node];
            let first = first as usize;
            if count > 0 {
                for corners in &self.triangles[first..first + count as usize] {
                    closest = closest.min(point.distance_squared(closest_point(point, corners)));
                }
                continue;
            }
            let mut children =
                [first, first + 1].map(|child| (self.nodes[child].squared_distance(point), child));
            // The closer child is on top.
            if children[0].0 < children[1].0 {
                children.swap(0, 1);
            }
            stack[height..height + 2].copy_from_slice(&children);
            height += 2;
        }
        closest
    }
}

impl Node {
    fn squared_distance(&self, point: DVec3) -> f64 {
        point.distance_squared(point.clamp(self.min.as_dvec3(), self.max.as_dvec3()))
    }
}

fn bounding_node(triangles: &[[Vec3; 3]], first: u32) -> Node {
    let corners = || triangles.iter().flatten();
    let min = corners().fold(Vec3::INFINITY, |min, corner| min.min(*corner));
    let max = corners().fold(Vec3::NEG_INFINITY, |max, corner| max.max(*corner));
    Node { min, max, first, count: triangles.len() as u32 }
}

fn is_finite(corners: &[Vec3; 3]) -> bool {
    corners.iter().all(|corner| corner.is_finite())
}

fn samples(corners: &[Vec3; 3]) -> [DVec3; 7] {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    [a, b, c, a.midpoint(b), b.midpoint(c), c.midpoint(a), (a + b + c) / 3.0]
}

/// The closest point of a triangle, by the regions of its corners, edges and face (Ericson, Real-Time Collision
/// Detection, section 5.1.5).
fn closest_point(point: DVec3, corners: &[Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let normal = (b - a).cross(c - a);
    let is_inside = |from: DVec3, to: DVec3| normal.cross(to - from).dot(point - from) >= 0.0;
    let area = normal.length_squared();
    if area > 0.0 && is_inside(a, b) && is_inside(b, c) && is_inside(c, a) {
        return point - normal * (normal.dot(point - a) / area);
    }
    let on_edges = [(a, b), (b, c), (c, a)].map(|(from, to)| closest_point_of_edge(point, from, to));
    let closer = |p: DVec3, q: DVec3| {
        if point.distance_squared(q) < point.distance_squared(p) { q } else { p }
    };
    closer(closer(on_edges[0], on_edges[1]), on_edges[2])
}

fn closest_point_of_edge(point: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let along = to - from;
    let length = along.length_squared();
    if length == 0.0 {
        return from;
    }
    from + along * ((point - from).dot(along) / length).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square from 0 to 1 in x and y at a height, of `2 n n` triangles.
    fn square(height: f32, n: u16) -> Vec<[Vec3; 3]> {
        let at =
            |x: u16, y: u16| Vec3::new(f32::from(x), f32::from(y), 0.0) / f32::from(n) + height * Vec3::Z;
        let cells = (0..n).flat_map(|y| (0..n).map(move |x| (x, y)));
        let halves = cells.flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        });
        halves.collect()
    }

    #[test]
    fn parallel_squares_are_as_far_apart_as_their_planes() {
        for (n, m) in [(1, 1), (1, 7), (16, 5)] {
            let distance = Surface::new(square(0.0, n).into_iter()).compare(&square(0.25, m), 0.0).distance;
            assert!((distance - 0.25).abs() < 1e-7, "{n} {m} {distance}");
        }
        let same = Surface::new(square(0.0, 3).into_iter()).compare(&square(0.0, 8), 0.0);
        assert_eq!(same, Apart::default());
    }

    #[test]
    fn closest_triangles_are_those_of_a_search_through_all() {
        let triangles: Vec<_> = square(0.0, 9).into_iter().chain(square(0.3, 4)).collect();
        let surface = Surface::new(triangles.iter().copied());
        for i in 0..200 {
            let t = f64::from(i) / 200.0;
            let point = DVec3::new(1.4 * libm::sin(40.0 * t), 1.4 * libm::cos(17.0 * t), t - 0.4);
            let all = triangles.iter().map(|corners| point.distance_squared(closest_point(point, corners)));
            let expected = all.fold(f64::INFINITY, f64::min);
            assert_eq!(surface.squared_distance(point, 0.0), expected, "{point}");
        }
    }

    #[test]
    fn closest_points_are_on_faces_edges_and_corners() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (point, expected) in [
            ((0.2, 0.3, 2.0), (0.2, 0.3, 0.0)),
            ((0.5, -1.0, 1.0), (0.5, 0.0, 0.0)),
            ((1.0, 1.0, -1.0), (0.5, 0.5, 0.0)),
            ((3.0, -1.0, 0.0), (1.0, 0.0, 0.0)),
        ] {
            let found = closest_point(DVec3::from(point), &corners);
            assert!(found.distance(DVec3::from(expected)) < 1e-12, "{found}");
        }
        // Without area it is a line.
        let line = [Vec3::ZERO, Vec3::X, Vec3::X];
        assert_eq!(closest_point(DVec3::new(0.5, 2.0, 0.0), &line), DVec3::new(0.5, 0.0, 0.0));
    }

    #[test]
    fn an_empty_surface_is_infinitely_far_and_invalid_triangles_do_not_count() {
        let nan = [[Vec3::NAN, Vec3::X, Vec3::Y]];
        let empty = Surface::new(nan.into_iter());
        assert_eq!(empty.compare(&square(0.0, 1), 0.0).distance, f64::INFINITY);
        assert_eq!(Surface::new(square(0.0, 1).into_iter()).compare(&nan, 0.0), Apart::default());
    }

    /// A large square, half of which is on another one.
    #[test]
    fn bounds_hold_the_part_of_a_triangle_that_is_apart() {
        let half =
            Surface::new(square(0.0, 8).into_iter().filter(|corners| corners.iter().all(|c| c.x <= 0.5)));
        let apart = half.compare(&square(0.0, 1), 1e-6);
        assert!((apart.distance - 0.5).abs() < 1e-6, "{apart:?}");
        let Aabb { min, max } = apart.bounds;
        assert!((min.x - 0.5).abs() < 1e-3 && min.y == 0.0 && max == DVec3::new(1.0, 1.0, 0.0), "{apart:?}");
        assert_eq!(half.compare(&square(0.0, 1), 0.6).bounds, Aabb::EMPTY);
    }
}
