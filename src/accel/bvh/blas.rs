//! A tree over triangles in one frame.

use std::marker::PhantomData;

use glam::{DVec3, Vec3};

use crate::accel::build::builder;
use crate::accel::build::builder::Filled;
use crate::accel::build::cluster_prims::{Alike, Held, Neighbours};
use crate::accel::build::input_triangles::{InputTriangle, SurfaceFlags, clean};
use crate::accel::build::leaf_packing::Capacity;
use crate::accel::build::morton_clusters::MortonKey;
use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::bvh8::{BoxTestRay, Bvh8, Leaves, TraversalStack};
use crate::accel::bvh::huge_pages::HugePageVec;
use crate::accel::bvh::triangle_ids::TriangleIdMap;
use crate::accel::bvh::triangle4::{COINCIDENT, TRIANGLE_LANES, Triangle4};
use crate::accel::traverse::error_bounds::TriangleTestRay;
use crate::accel::traverse::hit::{LocalRay, TriangleHit};
use crate::accel::traverse::query::{CoincidentIds, RayQuery};
use crate::accel::{BuildReport, Preset};
use crate::scene::SurfaceClass;
use crate::simd::{OutlinedKernel, Simd};

/// Triangles and the tree over them.
#[derive(Debug, Default)]
pub(crate) struct Blas {
    pub bvh: Bvh8,
    /// Leaf n of the tree begins at blocks[n].
    pub blocks: HugePageVec<Triangle4>,
    pub ids: TriangleIdMap,
    /// Blas, with those that were left out.
    pub count: usize,
    pub coincident: Vec<Vec<Alike>>,
    entries: usize,
    /// Around all of them; `None` where there are none.
    pub bounds: Option<Aabb>,
    pub report: BuildReport,
    pub centre: DVec3,
    pub radius: f64,
    /// What its tree cost rays when it was built, once it has been refitted.
    pub built_cost: Option<f64>,
}

impl Blas {
    /// A tree over the triangles `raw(0..)` that `spans` tells the owners of.
    pub fn build(
        (spans, count): (TriangleIdMap, usize),
        raw: impl Fn(usize) -> InputTriangle + Sync,
        preset: Preset,
    ) -> Blas {
        let (fit, mut report) = clean(count, raw);
        let open = |keys: &[MortonKey]| Neighbours::new(&fit, keys);
        let (tree, parts) = builder::build(&fit, open, Capacity::BLOCKS, preset);
        report.coincident = parts.iter().map(|part| part.leaves.coincident).sum();
        let entries = parts.iter().map(|part| part.leaves.len()).sum();
        // How many groups there are before each part's.
        let mut next = 0;
        let before = |part: Filled<Held>| {
            let after = next + part.leaves.groups.len() as u32;
            (part, std::mem::replace(&mut next, after))
        };
        let mut parts: Vec<(Filled<Held>, u32)> = parts.into_iter().map(before).collect();
        let places = |(part, _): &(Filled<Held>, u32)| part.places as usize;
        let blocks = HugePageVec::filled(&parts, places, |(part, groups), blocks: &mut [Triangle4]| {
            part.leaves.fill(&fit, *groups, blocks);
        });
        let groups = parts.iter_mut().flat_map(|(part, _)| std::mem::take(&mut part.leaves.groups)).collect();
        let mut triangles = Blas {
            bvh: tree,
            blocks,
            ids: spans,
            count,
            coincident: groups,
            entries,
            report,
            ..Blas::default()
        };
        triangles.enclose();
        triangles
    }

    /// Says what its tree's box is.
    pub fn enclose(&mut self) {
        self.bounds = self.bvh.root.map(|_| self.bvh.bounds);
        let bounds = self.bounds.unwrap_or(Aabb { min: Vec3::ZERO, max: Vec3::ZERO });
        self.centre = bounds.centre();
        self.radius = 0.5 * bounds.min.as_dvec3().distance(bounds.max.as_dvec3());
    }

    /// Tells `query` of the triangles that `ray` meets under `from`, in any order. False once it
    /// has stopped. `instance` is whose triangles they are, where a shared mesh does not say.
    #[inline(always)]
    pub fn traverse<S: Simd, Q: RayQuery>(
        &self,
        from: u32,
        ray: &LocalRay,
        instance: Option<u32>,
        query: &mut Q,
        stack: &mut TraversalStack,
    ) -> bool {
        S::call_outlined(Visit { triangles: self, from, ray, instance, query, stack })
    }

    /// Tells `query` that a ray has met a triangle of a block. True where it stops.
    #[inline(always)]
    pub fn report_hit(
        &self,
        block: &Triangle4,
        lane: usize,
        met: TriangleHit,
        instance: Option<u32>,
        query: &mut impl RayQuery,
    ) -> bool {
        let entry = block.ids[lane];
        let mut tell = |look: SurfaceFlags, ids: &[u32]| {
            // What blocks may do so twice.
            if look.class == SurfaceClass::Translucent && !met.owned {
                return false;
            }
            let ids = CoincidentIds { ids, spans: &self.ids, instance };
            query.record_hit(met.t, look, met.ccw == look.reversed, ids).is_break()
        };
        match entry & COINCIDENT {
            0 => tell(block.flags(lane), std::slice::from_ref(&entry)),
            _ => self.coincident[(entry & !COINCIDENT) as usize].iter().any(|a| tell(a.look, &a.ids)),
        }
    }

    /// The one triangle of a lane that holds no group.
    #[inline(always)]
    fn own<'b>(&'b self, block: &'b Triangle4, lane: usize, instance: Option<u32>) -> CoincidentIds<'b> {
        CoincidentIds { ids: std::slice::from_ref(&block.ids[lane]), spans: &self.ids, instance }
    }

    /// A place in the blocks: block times capacity plus lane.
    #[inline(always)]
    pub fn locate(&self, entry: u32) -> (&Triangle4, usize) {
        (&self.blocks[entry as usize / TRIANGLE_LANES], entry as usize % TRIANGLE_LANES)
    }

    /// The greatest coordinate.
    pub fn max_coordinate(&self) -> f32 {
        self.bounds.map_or(0.0, Aabb::max_abs_coordinate)
    }

    /// True where no triangle can be hit.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Entries: triangles, coincident ones counted once.
    pub fn entries(&self) -> usize {
        self.entries
    }

    /// Inner nodes of its tree.
    pub fn nodes(&self) -> usize {
        self.bvh.nodes.len()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        let lists: usize = self.coincident.iter().flatten().map(|a| a.ids.len() * size_of::<u32>()).sum();
        self.bvh.bytes() + self.blocks.bytes() + lists
    }
}

/// What trees need to know of the limit of a query.
#[inline(always)]
pub(crate) fn limit(ray: &LocalRay, query: &impl RayQuery) -> f32 {
    BoxTestRay::limit(ray.to_local_t(query.t_max()))
}

/// [`Blas::traverse`].
struct Visit<'a, Q> {
    triangles: &'a Blas,
    from: u32,
    ray: &'a LocalRay,
    instance: Option<u32>,
    query: &'a mut Q,
    stack: &'a mut TraversalStack,
}

impl<S: Simd, Q: RayQuery> OutlinedKernel<S> for Visit<'_, Q> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Visit { triangles, from, ray, instance, query, stack } = self;
        let boxes = BoxTestRay::new(ray.o, ray.d, 0.0, ray.to_local_t(query.t_min()));
        let test = TriangleTestRay::new(ray, triangles.centre, triangles.radius, query.early_out_t_max());
        let limit = limit(ray, query);
        let blocks: &[Triangle4] = &triangles.blocks;
        let mut leaves = Meeting { triangles, blocks, ray, test, instance, query, limit, simd: PhantomData };
        match Q::ANY_HIT {
            true => triangles.bvh.walk_any::<S>(from, &boxes, stack, limit, &mut leaves),
            false => triangles.bvh.walk::<S>(from, &boxes, stack, limit, &mut leaves),
        }
    }
}

/// A ray at the leaves.
struct Meeting<'a, S, Q> {
    triangles: &'a Blas,
    blocks: &'a [Triangle4],
    ray: &'a LocalRay,
    test: TriangleTestRay,
    instance: Option<u32>,
    query: &'a mut Q,
    limit: f32,
    simd: PhantomData<S>,
}

impl<S: Simd, Q: RayQuery> Leaves<S> for Meeting<'_, S, Q> {
    #[inline(always)]
    fn enter(&mut self, leaf: u32, _: &mut TraversalStack) -> Option<f32> {
        for block in &self.blocks[leaf as usize..] {
            let candidates = self.test.candidates::<S>(block, self.limit);
            let mut possible = candidates.possible;
            if possible == 0 {
                if block.is_last_in_leaf() {
                    break;
                }
                continue;
            }
            while possible != 0 {
                let lane = possible.trailing_zeros() as usize & (TRIANGLE_LANES - 1);
                possible &= possible - 1;
                if candidates.between >> lane & 1 == 1 {
                    let ids = self.triangles.own(block, lane, self.instance);
                    if self.query.early_out(block, lane, ids) {
                        return None;
                    }
                }
                let sure = candidates.sure >> lane & 1 == 1;
                let Some(met) = self.ray.intersect(&block.vertices(lane), sure) else { continue };
                if self.triangles.report_hit(block, lane, met, self.instance, self.query) {
                    return None;
                }
                self.limit = limit(self.ray, self.query);
            }
            if block.is_last_in_leaf() {
                break;
            }
        }
        Some(self.limit)
    }
}
