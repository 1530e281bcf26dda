//! Triangles that can be seen: those with area that alpha does not hide at every time. Bounds hold exactly their
//! corners.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use glam::{DAffine3, DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::animation::clip_alpha::ClipAlpha;
use crate::animation::extremes::{Extremes, VertexAt};
use crate::{Mesh, Scene};
use blinn_core::geometry::Aabb;

/// Sine of the angle between two edges below which a triangle has no area: what rounding leaves of corners on a line.
const MIN_SINE: f64 = 1.0 / (1 << 22) as f64;
/// Larger coordinates are not rendered.
const MAX_COORDINATE: f64 = 1e18;
/// Sine and relative volume below which a transform counts as flat.
const FLAT: f64 = 1e-12;
/// Triangles that a search tests at once.
const SEARCH_BLOCK: usize = 256;
/// Vertices in the same place for which all triangles are searched.
const THOROUGH_TIES: usize = 4;
/// Blocks that are searched for each of the others.
const TIE_BLOCKS: usize = 16;
/// Most vertices in the same place that are tried.
const MAX_TIES: usize = 64;
/// Triangles that a thread marks at once.
const MARK_BLOCK: usize = 1 << 13;

/// Returns true if a triangle has area and finite corners.
pub(super) fn has_area(corners: &[DVec3; 3]) -> bool {
    let a = corners[1] - corners[0];
    let b = corners[2] - corners[0];
    let limit = MIN_SINE * MIN_SINE * a.length_squared() * b.length_squared();
    // False for NaN.
    a.cross(b).length_squared() > limit && corners.iter().all(in_range)
}

fn in_range(p: &DVec3) -> bool {
    p.abs().cmple(DVec3::splat(MAX_COORDINATE)).all()
}

/// The dimensions that a transform keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rank {
    /// Triangles keep an area.
    Full,
    /// Some triangles may lose their area.
    Flat,
    /// No triangle has an area.
    Line,
}

impl Rank {
    pub fn of(to_world: &DMat3) -> Rank {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *to_world;
        let spans = |a: DVec3, b: DVec3| {
            a.cross(b).length_squared() > FLAT * FLAT * a.length_squared() * b.length_squared()
        };
        if !(spans(x, y) || spans(y, z) || spans(z, x)) {
            return Rank::Line;
        }
        let volume = x.dot(y.cross(z)).abs();
        if volume > FLAT * x.length() * y.length() * z.length() { Rank::Full } else { Rank::Flat }
    }
}

/// An instance at one time.
pub(super) struct InstanceShape<'a, P> {
    pub scene: &'a Scene,
    pub mesh: &'a Mesh,
    pub alpha: &'a ClipAlpha,
    pub to_world: DAffine3,
    /// Returns a vertex in the space that `to_world` maps from.
    pub position: P,
}

impl<P: FnMut(u32) -> Vec3> InstanceShape<'_, P> {
    /// Returns true if a triangle, point or line that can be seen attains a part of `extremes`, as `vertex` does.
    pub fn attains<E: Extremes>(&mut self, extremes: &E, part: usize, vertex: u32) -> bool {
        if self.mesh.has_rounds() {
            return in_range(&self.point(vertex));
        }
        if self.is_drawn(vertex, usize::MAX) {
            return true;
        }
        // Spheres have several vertices at their poles, of which triangles use only some.
        let count = self.mesh.positions.len() as u32;
        let mut ties = 0;
        for v in alternate(vertex + 1..count, (0..vertex).rev()) {
            if extremes.attains(part, self.point(v)) {
                let max_blocks = if ties < THOROUGH_TIES { usize::MAX } else { TIE_BLOCKS };
                if self.is_drawn(v, max_blocks) {
                    return true;
                }
                ties += 1;
                if ties == MAX_TIES {
                    break;
                }
            }
        }
        false
    }

    fn point(&mut self, vertex: u32) -> DVec3 {
        self.to_world.transform_point3((self.position)(vertex).as_dvec3())
    }

    /// Returns true if a triangle that can be seen uses `vertex`. Searches at most `max_blocks` blocks of triangles.
    fn is_drawn(&mut self, vertex: u32, max_blocks: usize) -> bool {
        let mesh = self.mesh;
        let blocks = mesh.triangles.len().div_ceil(SEARCH_BLOCK);
        // Files mostly store vertices in the order of their triangles.
        let likely = vertex as usize * blocks / mesh.positions.len().max(1);
        alternate(likely..blocks, (0..likely).rev()).take(max_blocks).any(|block| {
            let triangles = &mesh.triangles[block * SEARCH_BLOCK..];
            let triangles = &triangles[..triangles.len().min(SEARCH_BLOCK)];
            // Without an early exit, so that it is vectorised.
            let is_used = triangles.as_flattened().iter().fold(false, |found, &v| found | (v == vertex));
            is_used
                && triangles.iter().any(|corners| {
                    corners.contains(&vertex)
                        && has_area(&corners.map(|v| self.point(v)))
                        && self.alpha.may_show(self.scene, mesh, *corners)
                })
        })
    }
}

/// Returns the items of two iterators in turn, then the rest of the longer one.
fn alternate<T>(
    mut first: impl Iterator<Item = T>,
    mut second: impl Iterator<Item = T>,
) -> impl Iterator<Item = T> {
    let mut from_first = false;
    std::iter::from_fn(move || {
        from_first = !from_first;
        if from_first {
            first.next().or_else(|| second.next())
        } else {
            second.next().or_else(|| first.next())
        }
    })
}

/// Includes the corners of all triangles, and the vertices of all points and lines, that can be seen.
pub(super) fn add_drawn_triangles<E: Extremes>(
    scene: &Scene,
    mesh: &Mesh,
    positions: &[Vec3],
    to_world: &DAffine3,
    alpha: &ClipAlpha,
    extremes: &mut E,
) {
    if mesh.has_rounds() {
        let points = positions.iter().map(|p| to_world.transform_point3(p.as_dvec3()));
        points.filter(in_range).for_each(|p| extremes.add(p, VertexAt::default()));
        return;
    }
    for corners in &mesh.triangles {
        let points = corners.map(|v| to_world.transform_point3(positions[v as usize].as_dvec3()));
        let mut bounds = Aabb::EMPTY;
        points.iter().for_each(|&p| bounds.extend(p));
        if !extremes.covers(&bounds) && has_area(&points) && alpha.may_show(scene, mesh, *corners) {
            points.iter().for_each(|&p| extremes.add(p, VertexAt::default()));
        }
    }
}

/// The vertices, in the rest shape of each mesh, of the triangles that can be seen. Computed on first use.
#[derive(Debug)]
pub(super) struct DrawnPoints {
    /// One for each mesh. The value is `None` if all vertices are drawn.
    meshes: Vec<OnceLock<Option<Vec<Vec3>>>>,
}

impl DrawnPoints {
    pub fn new(scene: &Scene) -> DrawnPoints {
        DrawnPoints { meshes: scene.meshes.iter().map(|_| OnceLock::new()).collect() }
    }

    /// Returns the vertices of a mesh.
    pub fn of<'a>(&'a self, scene: &'a Scene, mesh: u32, alpha: &ClipAlpha) -> &'a [Vec3] {
        let own = &scene.meshes[mesh as usize];
        let cell = &self.meshes[mesh as usize];
        // Computed outside of the cell's lock: a thread that waits for parts of it may come here for another pose meanwhile.
        let drawn = match cell.get() {
            Some(drawn) => drawn,
            None => {
                let drawn = drawn_points(scene, own, alpha);
                cell.get_or_init(|| drawn)
            }
        };
        drawn.as_deref().unwrap_or(&own.positions)
    }
}

/// Returns the drawn vertices of a mesh at rest; `None` if all are drawn.
fn drawn_points(scene: &Scene, mesh: &Mesh, alpha: &ClipAlpha) -> Option<Vec<Vec3>> {
    if mesh.has_rounds() {
        let is_in_range = |p: &&Vec3| in_range(&p.as_dvec3());
        let all_in_range = mesh.positions.iter().all(|p| is_in_range(&p));
        return (!all_in_range).then(|| mesh.positions.iter().filter(is_in_range).copied().collect());
    }
    let is_drawn: Vec<AtomicBool> = mesh.positions.iter().map(|_| AtomicBool::new(false)).collect();
    let may_hide = alpha.may_hide(mesh);
    mesh.triangles.par_chunks(MARK_BLOCK).for_each(|triangles| {
        for corners in triangles {
            let points = corners.map(|v| mesh.positions[v as usize].as_dvec3());
            if has_area(&points) && (!may_hide || alpha.may_show(scene, mesh, *corners)) {
                corners.iter().for_each(|&v| is_drawn[v as usize].store(true, Relaxed));
            }
        }
    });
    let is_drawn = |i: usize| is_drawn[i].load(Relaxed);
    if (0..mesh.positions.len()).all(is_drawn) {
        return None;
    }
    Some(mesh.positions.iter().enumerate().filter(|(i, _)| is_drawn(*i)).map(|(_, &p)| p).collect())
}

#[cfg(test)]
mod tests;
