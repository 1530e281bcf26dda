//! Is there anything at all between four rays?

use glam::{DVec3, Vec3};

use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::bvh8::{Bvh8, LEAF_BIT, plane_row};
use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::geometry::Ray;
use crate::simd::vec3::per_axis;
use crate::simd::{Lanes, Simd, SimdKernel};

/// What lies between four rays that leave one place, or all go one way: the inner sides of four planes.
struct Wedge([Plane; 4]);

/// A plane: what is on its inner side has a product with `n`, of unit length, of `at` or more.
#[derive(Clone, Copy)]
struct Plane {
    n: DVec3,
    at: f64,
    /// The size of what `at` is the sum of.
    size: f64,
}

/// Boxes count as that much larger, relative to their tree's size and the eye's place: far more than rays in
/// f32, and the boxes of trees, are off by.
const SLACK: f64 = 1e-5;

/// [`Accel::may_intersect`] at a SIMD level.
///
/// [`Accel::may_intersect`]: crate::accel::Accel::may_intersect
pub(crate) struct FrustumKernel<'a> {
    pub bvh: &'a SceneBvh,
    pub corner_rays: &'a [Ray; 4],
}

impl SimdKernel for FrustumKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self) -> bool {
        let FrustumKernel { bvh, corner_rays: around } = self;
        let wedge = Wedge::between(around);
        let top = &bvh.tlas;
        let pad = || around.iter().fold(0f32, |pad, ray| pad.max(top.padding(ray.o.as_dvec3())));
        bvh.worlds.iter().any(|world| wedge.meets::<S>(&world.bvh, 0.0))
            || (!top.is_empty() && wedge.meets::<S>(&top.bvh, f64::from(pad())))
    }
}

impl Wedge {
    #[inline(always)]
    fn between(around: &[Ray; 4]) -> Wedge {
        let rays = around.map(|ray| (ray.o.as_dvec3(), ray.d.as_dvec3()));
        let middle = rays.iter().map(|(o, d)| (*o + *d) * 0.25).sum::<DVec3>();
        Wedge(std::array::from_fn(|i| {
            let ((o, d), (next_o, next_d)) = (rays[i], rays[(i + 1) % 4]);
            let n = d.cross(next_o + next_d - o);
            let n = if n.dot(middle - o) < 0.0 { -n } else { n };
            // No number where rays make no plane.
            let n = n / n.length();
            Plane { n, at: n.dot(o), size: n.abs().dot(o.abs()) }
        }))
    }

    /// True where a leaf of the tree, whose boxes are `pad` wider, is between the rays, as far as boxes say.
    #[inline(always)]
    fn meets<S: Simd>(&self, tree: &Bvh8, pad: f64) -> bool {
        let Some(root) = tree.root else { return false };
        let Aabb { min, max } = tree.bounds;
        let size = min.abs().max(max.abs()).as_dvec3() + pad;
        let sides = self.0.map(|plane| {
            let widths = plane.n.abs();
            let least = plane.at - pad * widths.element_sum() - SLACK * (widths.dot(size) + plane.size);
            (
                per_axis(|axis| plane_row(axis, usize::from(plane.n[axis] > 0.0))),
                plane.n.as_vec3(),
                least as f32,
            )
        });
        let mut todo = Vec::with_capacity(64);
        todo.push(root);
        while let Some(here) = todo.pop() {
            if here & LEAF_BIT != 0 {
                return true;
            }
            let node = &tree.nodes[here as usize];
            let mut inside = node.child_mask();
            for &(innermost, n, least) in &sides {
                inside &= !below::<S>(node.rows(), innermost, n, least);
            }
            while inside != 0 {
                todo.push(node.child[inside.trailing_zeros() as usize & 7]);
                inside &= inside - 1;
            }
        }
        false
    }
}

/// The children of which all is surely on the outer side of a plane. What is no number is not.
#[inline(always)]
fn below<S: Simd>(rows: &[[f32; 8]; 8], innermost: [usize; 3], n: Vec3, least: f32) -> u32 {
    let along = |axis: usize| (S::F32x8::load(&rows[innermost[axis] & 7]), S::F32x8::splat(n[axis]));
    let [(x, nx), (y, ny), (z, nz)] = [along(0), along(1), along(2)];
    x.mul_add(nx, y.mul_add(ny, z * nz)).lt(S::F32x8::splat(least))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::SimdLevel;
    use crate::accel::bvh::aabb::Aabb;
    use crate::accel::bvh::bvh8::Bvh8Node;
    use crate::accel::bvh::huge_pages::HugePageVec;

    /// A tree of small boxes about `places`.
    fn tree(places: &[Vec3]) -> Bvh8 {
        let small = |&p: &Vec3| (Aabb { min: p - 0.01, max: p + 0.01 }, LEAF_BIT);
        let leaves: Vec<(Aabb, u32)> = places.iter().map(small).collect();
        let bounds = Aabb::union_of(leaves.iter().map(|(bounds, _)| *bounds));
        let nodes = HugePageVec::from_parts(&[leaves], |_| 1, |leaves, to| to.fill(Bvh8Node::new(leaves)));
        Bvh8 { nodes, root: Some(0), bounds, ..Bvh8::default() }
    }

    impl Wedge {
        /// On every tier.
        fn finds(&self, tree: &Bvh8) -> bool {
            struct Find<'a>(&'a Wedge, &'a Bvh8);
            impl SimdKernel for Find<'_> {
                type Output = bool;
                #[inline(always)]
                fn run<S: Simd>(self) -> bool {
                    self.0.meets::<S>(self.1, 0.0)
                }
            }
            let mut tiers = SimdLevel::ALL.into_iter().filter(|level| level.is_supported());
            let found = tiers.next().is_some_and(|level| level.run(Find(self, tree)));
            assert!(tiers.all(|level| level.run(Find(self, tree)) == found));
            found
        }
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
                    assert_eq!(wedge.finds(&tree(&[place])), i == 0, "{place}");
                }
                // A tree about the rays without a leaf between them.
                let beside = [Vec3::new(-50.0, -50.0, -10.0), Vec3::new(50.0, 50.0, -10.0)];
                assert!(!wedge.finds(&tree(&beside)));
                assert!(wedge.finds(&tree(&[beside[0], Vec3::new(0.5, 0.5, -10.0), beside[1]])));
            }
        }
        // Behind the eye there is nothing to see.
        let wedge = Wedge::between(&around([0.0, 0.0], [1.0, 1.0], false, [0, 1, 2, 3]));
        assert!(!wedge.finds(&tree(&[Vec3::new(-5.0, -5.0, 10.0)])));
        assert!(!wedge.finds(&Bvh8::default()));
    }

    /// Where the planes are no numbers nothing is left out.
    #[test]
    fn doubt_leaves_nothing_out() {
        let nowhere = Ray { o: Vec3::NAN, d: Vec3::NAN };
        assert!(Wedge::between(&[nowhere; 4]).finds(&tree(&[Vec3::ONE])));
        let same = Ray { o: Vec3::ZERO, d: Vec3::NEG_Z };
        assert!(Wedge::between(&[same; 4]).finds(&tree(&[Vec3::ONE])));
    }
}
