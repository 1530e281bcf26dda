//! Is there anything at all between four rays?

use glam::DVec3;

use super::Accel;
use super::wide::{Box3, LEAF, Wide};
use crate::geometry::Ray;

/// What lies between four rays that leave one place, or all go one way: the inner sides of four planes.
struct Wedge([Plane; 4]);

/// A plane, not of unit length: what is on its inner side has a product with `n` of `at` or more.
#[derive(Clone, Copy)]
struct Plane {
    n: DVec3,
    at: f64,
    /// The size of what `at` is the sum of.
    size: f64,
}

/// A box counts as that much larger, relative to its place and the eye's: far more than rays in f32, and
/// the boxes of trees, are off by.
const SLACK: f64 = 1e-5;

impl Accel {
    /// False where no ray between `around`, four in order about it that leave one place or all go one
    /// way, can meet a triangle. True says nothing.
    pub fn may_meet(&self, around: &[Ray; 4]) -> bool {
        let wedge = Wedge::between(around);
        let pad = around.iter().fold(0f32, |pad, ray| pad.max(self.top.pad(ray.o.as_dvec3())));
        self.worlds.iter().any(|world| wedge.meets(&world.tree, 0.0))
            || wedge.meets(&self.top.tree, f64::from(pad))
    }
}

impl Wedge {
    fn between(around: &[Ray; 4]) -> Wedge {
        let rays = around.map(|ray| (ray.o.as_dvec3(), ray.d.as_dvec3()));
        let middle = rays.iter().map(|(o, d)| (*o + *d) * 0.25).sum::<DVec3>();
        Wedge(std::array::from_fn(|i| {
            let ((o, d), (next_o, next_d)) = (rays[i], rays[(i + 1) % 4]);
            let n = d.cross(next_o + next_d - o);
            let n = if n.dot(middle - o) < 0.0 { -n } else { n };
            Plane { n, at: n.dot(o), size: n.abs().dot(o.abs()) }
        }))
    }

    /// True where a leaf of the tree, whose boxes are `pad` wider, is between the rays, as far as boxes say.
    fn meets(&self, tree: &Wide, pad: f64) -> bool {
        let Some(root) = tree.root.filter(|_| !self.excludes(tree.bounds, pad)) else { return false };
        let mut todo = vec![root];
        while let Some(here) = todo.pop() {
            if here & LEAF != 0 {
                return true;
            }
            let node = &tree.nodes[here as usize];
            let inside = (0..node.count()).filter(|&slot| !self.excludes(node.bounds(slot), pad));
            todo.extend(inside.map(|slot| node.child[slot]));
        }
        false
    }

    /// True where all of a box, so much wider, is on the outer side of a plane.
    fn excludes(&self, (lo, hi): Box3, pad: f64) -> bool {
        let (lo, hi) = (lo.as_dvec3() - pad, hi.as_dvec3() + pad);
        let size = lo.abs().max(hi.abs());
        self.0.iter().any(|plane| {
            let innermost = (lo * plane.n).max(hi * plane.n).element_sum();
            // Written so that what is no number excludes nothing.
            innermost - plane.at < -SLACK * (plane.n.abs().dot(size) + plane.size)
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::pages::Pages;
    use super::super::wide::{Node, union};
    use super::*;

    /// A tree of small boxes about `places`.
    fn tree(places: &[Vec3]) -> Wide {
        let small = |&p: &Vec3| ((p - 0.01, p + 0.01), LEAF);
        let leaves: Vec<(Box3, u32)> = places.iter().map(small).collect();
        let bounds = union(leaves.iter().map(|(bounds, _)| *bounds));
        let nodes = Pages::filled(&[leaves], |_| 1, |leaves, to| to.fill(Node::new(leaves)));
        Wide { nodes, root: Some(0), bounds, ..Wide::default() }
    }

    /// Rays down −z through the corners of a rectangle one unit away, or beside each other.
    fn around(low: [f32; 2], high: [f32; 2], parallel: bool, way: [usize; 4]) -> [Ray; 4] {
        let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
        way.map(|i| {
            let across = Vec3::new(corners[i][0], corners[i][1], 0.0);
            match parallel {
                true => Ray { o: across, d: Vec3::NEG_Z },
                false => Ray { o: Vec3::ZERO, d: across + Vec3::NEG_Z },
            }
        })
    }

    #[test]
    fn what_is_between_the_rays_is_found_and_nothing_else_is() {
        let places = [(0.5, 0.5), (3.0, 0.5), (-3.0, 0.5), (0.5, 3.0), (0.5, -3.0)];
        for way in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 3, 0, 1]] {
            for parallel in [false, true] {
                let wedge = Wedge::between(&around([0.0, 0.0], [1.0, 1.0], parallel, way));
                for (i, (x, y)) in places.into_iter().enumerate() {
                    // Ten times as far, rays from the eye are ten times as far apart.
                    let by = if parallel { 1.0 } else { 10.0 };
                    let place = Vec3::new(x * by, y * by, -10.0);
                    assert_eq!(wedge.meets(&tree(&[place]), 0.0), i == 0, "{place}");
                }
                // A tree about the rays without a leaf between them.
                let beside = [Vec3::new(-50.0, -50.0, -10.0), Vec3::new(50.0, 50.0, -10.0)];
                assert!(!wedge.meets(&tree(&beside), 0.0));
                assert!(wedge.meets(&tree(&[beside[0], Vec3::new(0.5, 0.5, -10.0), beside[1]]), 0.0));
            }
        }
        // Behind the eye there is nothing to see.
        let wedge = Wedge::between(&around([0.0, 0.0], [1.0, 1.0], false, [0, 1, 2, 3]));
        assert!(!wedge.meets(&tree(&[Vec3::new(-5.0, -5.0, 10.0)]), 0.0));
        assert!(!wedge.meets(&Wide::default(), 0.0));
    }

    /// Where the planes are no numbers nothing is left out.
    #[test]
    fn doubt_leaves_nothing_out() {
        let nowhere = Ray { o: Vec3::NAN, d: Vec3::NAN };
        assert!(Wedge::between(&[nowhere; 4]).meets(&tree(&[Vec3::ONE]), 0.0));
        let same = Ray { o: Vec3::ZERO, d: Vec3::NEG_Z };
        assert!(Wedge::between(&[same; 4]).meets(&tree(&[Vec3::ONE]), 0.0));
    }
}
