//! Bounds of clusters of vertices. Folds over all vertices of a mesh skip clusters that cannot change the
//! result.

use std::borrow::Cow;

use glam::{DAffine3, DVec3, UVec3, Vec3};

use crate::geometry::{Aabb, morton3};

/// The vertices of a mesh in clusters of neighbours, in local coordinates. Many instances side by side may
/// each extend the bounds a little, but only with a few of their clusters.
pub(super) struct VertexClusters<'m> {
    points: Cow<'m, [Vec3]>,
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
        let mut points = Cow::Borrowed(positions);
        let mut size = positions.len().max(1);
        if instances >= MIN_INSTANCES && size > CLUSTER_SIZE {
            size = CLUSTER_SIZE;
            points.to_mut().sort_by_cached_key(|p| morton_code(p.as_dvec3(), &bounds));
        }
        VertexClusters::of(points, size, bounds)
    }

    /// Clusters the vertices in their order: files mostly store neighbours together.
    pub fn in_order(positions: &'m [Vec3]) -> VertexClusters<'m> {
        VertexClusters::of(Cow::Borrowed(positions), CLUSTER_SIZE, bounds_of(positions))
    }

    fn of(points: Cow<'m, [Vec3]>, size: usize, bounds: Aabb) -> VertexClusters<'m> {
        let boxes = points.chunks(size).map(bounds_of).collect();
        VertexClusters { points, size, boxes, bounds }
    }

    /// Folds `add` over the transformed vertices. Skips clusters whose bounds cannot change the result, as
    /// `covers` says.
    pub fn fold<T>(
        &self,
        to_world: &DAffine3,
        result: &mut T,
        covers: impl Fn(&T, Aabb) -> bool,
        add: impl Fn(&mut T, DVec3),
    ) {
        let skip = |result: &T, b: &Aabb| !b.is_empty() && covers(result, transformed_bounds(to_world, b));
        if skip(result, &self.bounds) {
            return;
        }
        for (points, b) in self.points.chunks(self.size).zip(&self.boxes) {
            if !skip(result, b) {
                fold_points(to_world, points, result, &add);
            }
        }
    }
}

/// Folds `add` over all transformed points.
pub(super) fn fold_points<T>(
    to_world: &DAffine3,
    points: &[Vec3],
    result: &mut T,
    add: impl Fn(&mut T, DVec3),
) {
    points.iter().for_each(|&p| add(result, to_world.transform_point3(p.as_dvec3())));
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
