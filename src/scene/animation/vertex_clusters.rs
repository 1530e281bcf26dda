//! Bounds of clusters of vertices. Extremes over all vertices of a mesh skip clusters that cannot change the
//! result.

use std::borrow::Cow;

use glam::{DAffine3, DVec3, UVec3, Vec3};

use crate::animation::extremes::{Extremes, VertexAt};
use blinn_core::geometry::{Aabb, morton3};

/// The vertices of a mesh in clusters of neighbours, in local coordinates. Many instances side by side may
/// each extend the bounds a little, but only with a few of their clusters.
pub(super) struct VertexClusters<'m> {
    points: Cow<'m, [Vec3]>,
    /// Indices of the sorted vertices; empty if the points are in their order.
    order: Vec<u32>,
    /// Points of a cluster. The last may have fewer.
    size: usize,
    boxes: Vec<Aabb>,
    bounds: Aabb,
}

/// Instances of a mesh from which on sorting its vertices pays off.
const MIN_INSTANCES: usize = 16;
/// Points of a cluster.
pub(super) const CLUSTER_SIZE: usize = 64;

impl<'m> VertexClusters<'m> {
    /// Clusters the vertices of a mesh with this number of instances. Sorts them in Morton order if there
    /// are many, else makes a single cluster.
    pub fn new(positions: &'m [Vec3], instances: usize) -> VertexClusters<'m> {
        let bounds = bounds_of(positions);
        let mut clusters = VertexClusters::of(Cow::Borrowed(positions), positions.len().max(1), bounds);
        if instances >= MIN_INSTANCES && positions.len() > CLUSTER_SIZE {
            let point = |i: &u32| positions[*i as usize];
            let mut order: Vec<u32> = (0..positions.len() as u32).collect();
            order.sort_by_cached_key(|i| morton_code(point(i).as_dvec3(), &bounds));
            let points = order.iter().map(point).collect();
            clusters =
                VertexClusters { order, ..VertexClusters::of(Cow::Owned(points), CLUSTER_SIZE, bounds) };
        }
        clusters
    }

    /// Clusters the vertices in their order: files mostly store neighbours together.
    pub fn in_order(positions: &'m [Vec3]) -> VertexClusters<'m> {
        VertexClusters::of(Cow::Borrowed(positions), CLUSTER_SIZE, bounds_of(positions))
    }

    fn of(points: Cow<'m, [Vec3]>, size: usize, bounds: Aabb) -> VertexClusters<'m> {
        let boxes = points.chunks(size).map(bounds_of).collect();
        VertexClusters { points, order: Vec::new(), size, boxes, bounds }
    }

    /// Includes the transformed vertices of an instance. Skips clusters that cannot change the result.
    pub fn add_to<E: Extremes>(&self, to_world: &DAffine3, instance: VertexAt, extremes: &mut E) {
        let skip = |e: &E, b: &Aabb| !b.is_empty() && e.covers(&transformed_bounds(to_world, b));
        if skip(extremes, &self.bounds) {
            return;
        }
        for (cluster, (points, b)) in self.points.chunks(self.size).zip(&self.boxes).enumerate() {
            if skip(extremes, b) {
                continue;
            }
            let first = cluster * self.size;
            match self.order.get(first..first + points.len()) {
                Some(order) => add_points(to_world, points, instance, extremes, |i| order[i]),
                None => add_points(to_world, points, instance, extremes, |i| (first + i) as u32),
            }
        }
    }
}

/// Includes all transformed points. `vertex` returns the index of the vertex at a point.
pub(super) fn add_points<E: Extremes>(
    to_world: &DAffine3,
    points: &[Vec3],
    instance: VertexAt,
    extremes: &mut E,
    vertex: impl Fn(usize) -> u32,
) {
    for (i, p) in points.iter().enumerate() {
        let at = VertexAt { vertex: vertex(i), ..instance };
        extremes.add(to_world.transform_point3(p.as_dvec3()), at);
    }
}

/// Returns the bounds of points.
pub(super) fn bounds_of(points: &[Vec3]) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    points.iter().for_each(|p| bounds.extend(p.as_dvec3()));
    bounds
}

/// Returns the Morton code of a point's cell in a grid of 1024³ over `bounds`.
fn morton_code(p: DVec3, bounds: &Aabb) -> u64 {
    let cell = ((p - bounds.min) / bounds.extent() * 1024.0).to_array();
    // An axis without extent gives NaN, which `min` maps to the same cell for all points.
    morton3(UVec3::from(cell.map(|x| x.min(1023.0) as u32)))
}

/// Returns a box that contains `local` after the transform, including rounding errors.
pub(super) fn transformed_bounds(to_world: &DAffine3, local: &Aabb) -> Aabb {
    let columns = [to_world.matrix3.x_axis, to_world.matrix3.y_axis, to_world.matrix3.z_axis];
    let centre = local.centre();
    let half = 0.5 * local.extent();
    let abs_transform =
        |v: DVec3| columns[0].abs() * v.x.abs() + columns[1].abs() * v.y.abs() + columns[2].abs() * v.z.abs();
    let rounding = 1e-12 * (abs_transform(centre) + abs_transform(half) + to_world.translation.abs());
    let world_centre = to_world.transform_point3(centre);
    let world_half = abs_transform(half) + rounding;
    Aabb { min: world_centre - world_half, max: world_centre + world_half }
}
