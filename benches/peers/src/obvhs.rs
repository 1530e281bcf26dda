//! obvhs's own BVH and traversal: `CwBvh` over `RtTriangle`, single rays.

use std::hint::black_box;
use std::time::Duration;

use blinn_scenes::GeneratedMesh;
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

use crate::engines::{HitDistances, time};
use crate::rays::{Batch, RaySet};

/// A mesh with its BVH.
pub struct ObvhsScene {
    bvh: CwBvh,
    /// In the order of the BVH's leaves, as obvhs advises.
    triangles: Vec<RtTriangle>,
}

impl ObvhsScene {
    /// Builds a BVH with the parameters that obvhs calls medium.
    pub fn new(mesh: &GeneratedMesh) -> ObvhsScene {
        let corner = |v: u32| Vec3A::from(mesh.positions[v as usize]);
        let triangle = |t: &[u32; 3]| Triangle { v0: corner(t[0]), v1: corner(t[1]), v2: corner(t[2]) };
        let triangles: Vec<Triangle> = mesh.triangles.iter().map(triangle).collect();
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let ordered = bvh.primitive_indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize]));
        ObvhsScene { triangles: ordered.collect(), bvh }
    }

    /// Seconds to trace all rays.
    pub fn time(&self, set: &RaySet, threads: usize) -> f64 {
        time(threads, set.batches.len(), false, |i| {
            self.trace(&set.batches[i], set.margin, |_, t| {
                black_box(t);
            });
        })
    }

    /// The results in the order of blinn's batches.
    pub fn found(&self, set: &RaySet) -> HitDistances {
        let one = |batch: &Batch| {
            let mut found = vec![f32::INFINITY; batch.len()];
            self.trace(batch, set.margin, |i, t| found[i] = t);
            found
        };
        set.batches.iter().map(one).collect()
    }

    fn trace(&self, batch: &Batch, margin: f32, mut out: impl FnMut(usize, f32)) {
        let is_any = matches!(batch, Batch::Any(_));
        for i in 0..batch.len() {
            let (o, d, far) = batch.ray(i);
            // A direction of −0 misses everything.
            let ray = Ray::new(o.into(), (d + Vec3::ZERO).into(), margin, far);
            let t = if is_any {
                let is_miss = self.bvh.ray_traverse_miss(ray, |ray, id| self.triangles[id].intersect(ray));
                if is_miss { f32::INFINITY } else { 0.0 }
            } else {
                let mut hit = RayHit::none();
                self.bvh.ray_traverse(ray, &mut hit, |ray, id| self.triangles[id].intersect(ray));
                hit.t
            };
            out(i, t);
        }
    }
}
