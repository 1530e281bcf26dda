//! A tree that follows its triangles to other places: its boxes change, its shape stays.
//!
//! A tree's shape is right for the places it was built for. The more its boxes have grown beyond what
//! they were then, the longer rays take: then a new tree is quicker for all.

use glam::Vec3;
use rayon::prelude::*;

use crate::accel::BuildReport;
use crate::accel::build::canonical_triangle::{CanonicalTriangle, Degeneracy, padded_bounds};
use crate::accel::build::cluster_prims::alike;
use crate::accel::build::duplicate_filter::{DuplicateFilter, Inserter};
use crate::accel::build::input_triangles::{InputTriangle, MOST, SurfaceFlags, TriangleRef};
use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::bvh8::{Bvh8, Bvh8Node, LEAF_BIT};
use crate::accel::bvh::triangle4::{COINCIDENT, TRIANGLE_LANES, Triangle4};
use crate::accel::traverse::traversal_stats::expected;

/// A tree that costs rays so many times what it did when it was built is built again.
const GROWTH: f64 = 1.25;

impl Blas {
    /// Takes every triangle to where `raw` has it now. False where a new tree is needed: others than before
    /// cannot be hit or share a place, or rays would take too long. This one is of no use then.
    pub fn refit(&mut self, raw: impl Fn(usize) -> InputTriangle + Sync) -> bool {
        let cost = |tree: &Bvh8| expected(tree, |_| 1.0);
        let built = *self.built_cost.get_or_insert_with(|| cost(&self.bvh));
        if !(self.regroup(&raw) && self.refill(&raw) && self.same_left_out(&raw)) {
            return false;
        }
        self.bvh.refit(|leaf| leaf_bounds(&self.blocks[leaf as usize..]));
        self.enclose();
        cost(&self.bvh) <= GROWTH * built
    }

    /// SurfaceFlagsCache at the triangles of each group again. False where they share a place no longer.
    fn regroup(&mut self, raw: &(impl Fn(usize) -> InputTriangle + Sync)) -> bool {
        self.coincident.par_iter_mut().all(|group| {
            let mut ids: Vec<u32> = group.iter().flat_map(|a| &a.ids).copied().collect();
            ids.sort_unstable();
            let sorted = |&id: &u32| raw(id as usize).sorted().ok();
            let Some(places) =
                ids.iter().map(sorted).collect::<Option<Vec<(CanonicalTriangle, SurfaceFlags)>>>()
            else {
                return false;
            };
            *group = alike(ids.into_iter().zip(places.iter().map(|(_, look)| *look)));
            places.windows(2).all(|two| two[0].0.bits() == two[1].0.bits())
        })
    }

    /// Fills all blocks anew. False where a triangle cannot be hit any more, or is where another has come.
    fn refill(&mut self, raw: &(impl Fn(usize) -> InputTriangle + Sync)) -> bool {
        let groups = &self.coincident;
        let again = DuplicateFilter::new(self.entries());
        let fill = |watch: &mut Inserter, block: &mut Triangle4| {
            let mut triangles = [TriangleRef::NOWHERE; TRIANGLE_LANES];
            let count = block.count();
            for (to, &entry) in triangles.iter_mut().zip(&block.ids[..count]) {
                let index = match entry & COINCIDENT {
                    0 => entry,
                    _ => groups[(entry & !COINCIDENT) as usize][0].ids[0],
                };
                let Ok((corners, look)) = raw(index as usize).sorted() else { return false };
                watch.see(&corners.bounds());
                *to = TriangleRef { corners, look, id: entry };
            }
            *block = Triangle4::new(&triangles[..count], block.is_last_in_leaf());
            true
        };
        let filled = self.blocks.par_iter_mut().with_min_len(256).map_init(|| again.watch(), fill);
        if !filled.all(|fits| fits) {
            return false;
        }
        let suspects = |block: &Triangle4| {
            let corners = (0..block.count()).map(|lane| block.vertices(lane));
            let bits = |v: [Vec3; 3]| v.map(|p| p.to_array().map(f32::to_bits));
            corners.filter(|v| again.repeated(&padded_bounds(v))).map(bits).collect::<Vec<_>>()
        };
        let mut places: Vec<_> = self.blocks.par_iter().with_min_len(256).flat_map_iter(suspects).collect();
        places.par_sort_unstable();
        places.windows(2).all(|two| two[0] != two[1])
    }

    /// False where a triangle that could not be hit can be.
    fn same_left_out(&self, raw: &(impl Fn(usize) -> InputTriangle + Sync)) -> bool {
        let BuildReport { non_finite, zero_area, .. } = self.report;
        if non_finite + zero_area == 0 {
            return true;
        }
        // Those that could be hit still can: if as many cannot, they are the same.
        let unfit = |i: usize| match raw(i).sorted() {
            Ok(_) => [0, 0],
            Err(Degeneracy::NonFinite) => [1, 0],
            Err(Degeneracy::ZeroArea) => [0, 1],
        };
        let all = (0..self.count.min(MOST)).into_par_iter().with_min_len(1 << 12).map(unfit);
        all.reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]]) == [non_finite, zero_area]
    }
}

/// The box of the leaf that begins with the first of `blocks`.
fn leaf_bounds(blocks: &[Triangle4]) -> Aabb {
    let end = blocks.iter().position(Triangle4::is_last_in_leaf).map_or(blocks.len(), |last| last + 1);
    Aabb::union_of(blocks[..end].iter().map(Triangle4::bounds))
}

impl Bvh8 {
    /// Gives all boxes new places, from those of the leaves upwards.
    fn refit(&mut self, leaf: impl Fn(u32) -> Aabb + Sync) {
        self.nodes.par_iter_mut().with_min_len(256).for_each(|node| {
            for slot in 0..node.count() {
                if node.child[slot] & LEAF_BIT != 0 {
                    node.put(slot, leaf(node.child[slot] & !LEAF_BIT));
                }
            }
        });
        // Children come after their parents.
        for i in (0..self.nodes.len()).rev() {
            for slot in 0..self.nodes[i].count() {
                let child = self.nodes[i].child[slot];
                if child & LEAF_BIT == 0 {
                    let bounds = around(&self.nodes[child as usize]);
                    self.nodes[i].put(slot, bounds);
                }
            }
        }
        self.nodes.par_iter_mut().with_min_len(256).for_each(|node| node.sort(node.count()));
        if let Some(root) = self.root {
            self.bounds = match root & LEAF_BIT {
                0 => around(&self.nodes[root as usize]),
                _ => leaf(root & !LEAF_BIT),
            };
        }
    }
}

/// The box of all children.
fn around(node: &Bvh8Node) -> Aabb {
    Aabb::union_of((0..node.count()).map(|slot| node.bounds(slot)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Preset;
    use crate::accel::bvh::triangle_ids::TriangleIdMap;

    const SIDE: usize = 40;

    /// A sheet of triangles above a square, as high as `height` says, with one more that has no area.
    fn sheet(height: impl Fn(f32, f32) -> f32 + Sync) -> impl Fn(usize) -> InputTriangle + Sync {
        move |i| {
            let (cell, second) = (i / 2, i % 2 == 1);
            let corner = |dx: usize, dy: usize| {
                let (x, y) =
                    ((cell % SIDE + dx) as f32 / SIDE as f32, (cell / SIDE + dy) as f32 / SIDE as f32);
                Vec3::new(x, y, height(x, y))
            };
            let v = match (cell < SIDE * SIDE, second) {
                (false, _) => [Vec3::ZERO; 3],
                (_, false) => [corner(0, 0), corner(1, 0), corner(0, 1)],
                (_, true) => [corner(1, 0), corner(1, 1), corner(0, 1)],
            };
            InputTriangle { v, look: SurfaceFlags::default() }
        }
    }

    /// So many times a wave.
    fn wave(times: f32) -> impl Fn(usize) -> InputTriangle + Sync {
        sheet(move |x, y| times * 0.3 * (3.0 * x + 2.0 * y).sin())
    }

    fn built() -> Blas {
        let spans = TriangleIdMap::new([(0, 2 * SIDE * SIDE + 1)].into_iter());
        Blas::build(spans, wave(1.0), Preset::Medium)
    }

    /// Every triangle is within all boxes above it.
    fn encloses(of: &Blas) -> bool {
        let mut todo = vec![(of.bvh.root.unwrap(), of.bounds.unwrap())];
        while let Some((child, bounds)) = todo.pop() {
            let inside = match child & LEAF_BIT {
                0 => {
                    let node = &of.bvh.nodes[child as usize];
                    todo.extend((0..node.count()).map(|slot| (node.child[slot], node.bounds(slot))));
                    around(node)
                }
                _ => leaf_bounds(&of.blocks[(child & !LEAF_BIT) as usize..]),
            };
            if !bounds.contains(inside) {
                return false;
            }
        }
        true
    }

    #[test]
    fn boxes_follow_what_bends() {
        let mut triangles = built();
        for step in 1..5 {
            let times = 1.0 + 0.1 * step as f32;
            assert!(triangles.refit(wave(times)), "{step}");
            assert!(encloses(&triangles));
            // Boxes are as tight as new ones.
            let new = Blas::build((triangles.ids.clone(), triangles.count), wave(times), Preset::Fast);
            assert_eq!(triangles.bounds, new.bounds);
            assert_eq!((triangles.centre, triangles.radius), (new.centre, new.radius));
        }
    }

    #[test]
    fn other_trees_are_needed_where_triangles_scatter_vanish_or_meet() {
        let scattered = sheet(|x, y| ((x * 12.9898 + y * 78.233).sin() * 43758.547).fract());
        assert!(!built().refit(scattered), "boxes grew");
        let rest = wave(1.0);
        let changed =
            |which: usize, to: InputTriangle| built().refit(|i| if i == which { to } else { rest(i) });
        let last = 2 * SIDE * SIDE;
        assert!(changed(last, rest(last)), "nothing changed");
        assert!(!changed(7, rest(last)), "one vanished");
        assert!(!changed(7, InputTriangle { v: [Vec3::NAN; 3], ..rest(7) }), "one is nowhere");
        assert!(!changed(last, InputTriangle { v: [Vec3::X, Vec3::Y, Vec3::Z], ..rest(7) }), "one came");
        let [a, b, c] = rest(100).v;
        assert!(!changed(7, InputTriangle { v: [c, b, a], ..rest(7) }), "two are in one place");
    }

    #[test]
    fn triangles_in_one_place_move_together_or_not_at_all() {
        let rest = wave(1.0);
        let count = 2 * SIDE * SIDE;
        // Every one twice.
        let twice = |i: usize| rest(i % count);
        let spans = || TriangleIdMap::new([(0, 2 * count)].into_iter());
        let bent = wave(1.1);
        let mut together = Blas::build(spans(), twice, Preset::Medium);
        assert_eq!(together.report.coincident, count as u64);
        assert!(together.refit(|i| bent(i % count)) && encloses(&together));
        assert!(!together.refit(|i| if i < count { bent(i) } else { rest(i - count) }));
    }
}
