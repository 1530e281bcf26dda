//! Canonical triangles: vertices in an order that depends on their positions only, degenerate ones rejected.

use glam::{BVec3, DVec3, Vec3};

use crate::bvh::aabb::Aabb;
use blinn_core::geometry::EPSILON;

/// Larger coordinates are rejected: their products would overflow.
pub(crate) const MAX_COORDINATE: f32 = 1e18;

/// Padding of boxes at the origin. Times the largest reciprocal of a direction it is still farther than any
/// hit: 1e-20 · 1e30 = 1e10.
pub(crate) const MIN_PADDING: f32 = 1e-20;

/// A triangle with sorted vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CanonicalTriangle {
    vertices: [Vec3; 3],
    /// Upper bound on the lengths of the two edges at the first vertex.
    max_edge: f32,
}

/// The reason why a triangle cannot be hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Degeneracy {
    NonFinite,
    ZeroArea,
}

impl CanonicalTriangle {
    /// A triangle that is all zero.
    pub const ZERO: CanonicalTriangle = CanonicalTriangle { vertices: [Vec3::ZERO; 3], max_edge: 0.0 };

    /// Sorts the vertices, so that coincident triangles have bit for bit the same t, whatever their winding.
    /// Returns true with it where sorting flips the winding. Subnormal coordinates become 0: each test of the triangle
    /// would be slow.
    pub fn new(vertices: [Vec3; 3]) -> Result<(CanonicalTriangle, bool), Degeneracy> {
        // Not `map`, which is not always inlined.
        let [a, b, c] = vertices;
        let [a, b, c] = [flush_subnormal(a), flush_subnormal(b), flush_subnormal(c)];
        let mut vertices = [a, b, c];
        let largest = a.abs().max(b.abs()).max(c.abs());
        // `max` may drop NaN. Times 0, NaN stays and infinity becomes NaN.
        let finite = (a + b + c) * 0.0 == Vec3::ZERO;
        if !(finite && largest.max_element() <= MAX_COORDINATE) {
            return Err(Degeneracy::NonFinite);
        }
        if doubled_area_vector(&vertices) == DVec3::ZERO {
            return Err(Degeneracy::ZeroArea);
        }
        let mut flipped = false;
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            let a = vertices[i];
            let b = vertices[j];
            // Without branches: the order of vertices cannot be predicted.
            let swaps = (b.x < a.x) | (b.x == a.x) & ((b.y < a.y) | (b.y == a.y) & (b.z < a.z));
            vertices[i] = Vec3::select(BVec3::splat(swaps), b, a);
            vertices[j] = Vec3::select(BVec3::splat(swaps), a, b);
            flipped ^= swaps;
        }
        let edge = |i: usize| (vertices[i].as_dvec3() - vertices[0].as_dvec3()).length_squared();
        let max_edge = (edge(1).max(edge(2)).sqrt() * (1.0 + 4.0 * f64::from(EPSILON))) as f32;
        Ok((CanonicalTriangle { vertices, max_edge: max_edge.max(f32::MIN_POSITIVE) }, flipped))
    }

    pub fn vertices(&self) -> &[Vec3; 3] {
        &self.vertices
    }

    /// Upper bound on the lengths of the two edges at the first vertex.
    pub fn max_edge(&self) -> f32 {
        self.max_edge
    }

    /// The bit patterns of the nine coordinates: equal for coincident triangles.
    pub fn to_bits(self) -> [u32; 9] {
        let [a, b, c] = self.vertices.map(|p| p.to_array().map(f32::to_bits));
        [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
    }

    /// The area of one side.
    pub fn area(&self) -> f64 {
        0.5 * doubled_area_vector(&self.vertices).length()
    }

    /// The bounds, padded for BVHs.
    pub fn bounds(&self) -> Aabb {
        padded_bounds(&self.vertices)
    }
}

/// Returns a vertex with 0 for subnormal coordinates and for −0: equal positions must have equal bits, by which they are
/// compared.
#[inline(always)]
fn flush_subnormal(vertex: Vec3) -> Vec3 {
    // By bits, so that no comparison meets a subnormal number.
    let flush = |x: f32| if x.to_bits() << 1 < f32::MIN_POSITIVE.to_bits() << 1 { 0.0 } else { x };
    Vec3::new(flush(vertex.x), flush(vertex.y), flush(vertex.z))
}

/// The cross product of the edges at the first vertex: the normal, as long as twice the area.
#[inline(always)]
fn doubled_area_vector(vertices: &[Vec3; 3]) -> DVec3 {
    let v0 = vertices[0].as_dvec3();
    (vertices[1].as_dvec3() - v0).cross(vertices[2].as_dvec3() - v0)
}

/// Returns the bounds of the canonical triangle of these vertices, padded for BVHs, without making it.
#[inline(always)]
pub(crate) fn canonical_bounds([a, b, c]: [Vec3; 3]) -> Aabb {
    padded_bounds(&[flush_subnormal(a), flush_subnormal(b), flush_subnormal(c)])
}

/// Returns a triangle's bounds for BVHs: padded by a few ulps of the largest coordinate, so that they are nowhere
/// flat and rays along their faces hit them.
pub(crate) fn padded_bounds(vertices: &[Vec3; 3]) -> Aabb {
    let bounds = Aabb::of_triangle(vertices);
    bounds.padded(3.0 * EPSILON * bounds.max_abs_coordinate() + 4.0 * MIN_PADDING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subnormal_coordinates_become_zero() {
        let v = [
            Vec3::new(1e-39, 2.0, -0.0),
            Vec3::new(-1e-44, -1e-39, 1.0),
            Vec3::new(1.0, f32::MIN_POSITIVE, 3.0),
        ];
        let (triangle, _) = CanonicalTriangle::new(v).unwrap();
        assert!(
            triangle.vertices().iter().flat_map(|v| v.to_array()).all(|x| x.to_bits() == 0 || x.is_normal())
        );
        assert!(triangle.vertices().contains(&v[2]), "the smallest normal number stays");
        let subnormal = v.map(|v| v * 1e-39);
        assert_eq!(CanonicalTriangle::new(subnormal).unwrap_err(), Degeneracy::ZeroArea);
    }
}
