//! Frustum culling of small boxes, on every SIMD level.

use super::*;
use crate::SimdLevel;
use crate::bvh::aabb::Aabb;
use crate::bvh::bvh8::LEAF_BIT;
use crate::bvh::huge_pages::HugePageArray;

/// A BVH of small boxes around `points`.
fn bvh(points: &[Vec3]) -> Bvh8 {
    let leaf = |&p: &Vec3| (Aabb { min: p - 0.01, max: p + 0.01 }, LEAF_BIT);
    let leaves: Vec<(Aabb, u32)> = points.iter().map(leaf).collect();
    let bounds = Aabb::union_of(leaves.iter().map(|(bounds, _)| *bounds));
    let nodes = HugePageArray::from_parts(&[leaves], |_| 1, |leaves, to| to.fill(Bvh8Node::new(leaves)));
    Bvh8 { nodes, root: Some(0), bounds, ..Bvh8::default() }
}

struct MayIntersectKernel<'a> {
    frustum: &'a Frustum,
    bvh: &'a Bvh8,
}

impl SimdKernel for MayIntersectKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self) -> bool {
        self.frustum.may_intersect::<S>(self.bvh, 0.0)
    }
}

/// Tests a frustum on all SIMD levels, which have to agree.
fn may_intersect(frustum: &Frustum, bvh: &Bvh8) -> bool {
    let mut levels = SimdLevel::ALL.into_iter().filter(|level| level.is_supported());
    let result = levels.next().is_some_and(|level| level.run(MayIntersectKernel { frustum, bvh }));
    assert!(levels.all(|level| level.run(MayIntersectKernel { frustum, bvh }) == result));
    result
}

/// Rays along −z through the corners of a rectangle at distance 1, or parallel ones from its corners.
fn corner_rays(min: [f32; 2], max: [f32; 2], parallel: bool, order: [usize; 4]) -> [Ray; 4] {
    let corners = [[min[0], min[1]], [max[0], min[1]], [max[0], max[1]], [min[0], max[1]]];
    order.map(|i| {
        let corner = Vec3::new(corners[i][0], corners[i][1], 0.0);
        match parallel {
            true => Ray { o: corner, d: Vec3::NEG_Z },
            false => Ray { o: Vec3::ZERO, d: corner + Vec3::NEG_Z },
        }
    })
}

#[test]
fn a_frustum_intersects_boxes_inside_and_no_others() {
    let positions = [(0.5, 0.5), (3.0, 0.5), (-3.0, 0.5), (0.5, 3.0), (0.5, -3.0)];
    for order in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 3, 0, 1]] {
        for parallel in [false, true] {
            let frustum = Frustum::new(&corner_rays([0.0, 0.0], [1.0, 1.0], parallel, order));
            for (i, (x, y)) in positions.into_iter().enumerate() {
                // At distance 10, rays from one origin are ten times as far apart.
                let scale = if parallel { 1.0 } else { 10.0 };
                let position = Vec3::new(x * scale, y * scale, -10.0);
                assert_eq!(may_intersect(&frustum, &bvh(&[position])), i == 0, "{position}");
            }
            // A BVH around the frustum without a leaf inside.
            let beside = [Vec3::new(-50.0, -50.0, -10.0), Vec3::new(50.0, 50.0, -10.0)];
            assert!(!may_intersect(&frustum, &bvh(&beside)));
            let inside = Vec3::new(0.5, 0.5, -10.0);
            assert!(may_intersect(&frustum, &bvh(&[beside[0], inside, beside[1]])));
        }
    }
    let frustum = Frustum::new(&corner_rays([0.0, 0.0], [1.0, 1.0], false, [0, 1, 2, 3]));
    let behind_the_eye = Vec3::new(-5.0, -5.0, 10.0);
    assert!(!may_intersect(&frustum, &bvh(&[behind_the_eye])));
    assert!(!may_intersect(&frustum, &Bvh8::default()));
}

/// Planes of NaN cull nothing.
#[test]
fn a_degenerate_frustum_culls_nothing() {
    let nan = Ray { o: Vec3::NAN, d: Vec3::NAN };
    assert!(may_intersect(&Frustum::new(&[nan; 4]), &bvh(&[Vec3::ONE])));
    let ray = Ray { o: Vec3::ZERO, d: Vec3::NEG_Z };
    assert!(may_intersect(&Frustum::new(&[ray; 4]), &bvh(&[Vec3::ONE])));
}
