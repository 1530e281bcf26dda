//! A triangle's corners, as the hit test and the trees want them.

use glam::{DVec3, Vec3};

use crate::accel::bvh::aabb::Aabb;
use crate::geometry::EPSILON;

/// Coordinates beyond this are refused: their products would overflow.
pub(crate) const HUGE: f32 = 1e18;

/// The corners of a triangle, as the hit test wants them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CanonicalTriangle {
    v: [Vec3; 3],
    /// At least the length of the two edges at `v[0]`.
    edge: f32,
}

/// Why a triangle cannot be hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Degeneracy {
    NonFinite,
    ZeroArea,
}

impl CanonicalTriangle {
    /// Of no triangle.
    pub const NOWHERE: CanonicalTriangle = CanonicalTriangle { v: [Vec3::ZERO; 3], edge: 0.0 };

    /// Puts the corners into an order that depends on the positions alone, so that triangles in
    /// the same place have bit for bit the same t however they are wound. True comes with them
    /// where that turned the winding round.
    pub fn new(mut v: [Vec3; 3]) -> Result<(CanonicalTriangle, bool), Degeneracy> {
        let largest = v[0].abs().max(v[1].abs()).max(v[2].abs());
        // Written so that NaN, which `max` may drop, is refused: times 0 it stays, as infinity does.
        let numbers = (v[0] + v[1] + v[2]) * 0.0 == Vec3::ZERO;
        if !(numbers && largest.max_element() <= HUGE) {
            return Err(Degeneracy::NonFinite);
        }
        let (e1, e2) = edges(&v);
        if e1.cross(e2) == DVec3::ZERO {
            return Err(Degeneracy::ZeroArea);
        }
        let mut turned = false;
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            let (a, b) = (v[j], v[i]);
            if a.x < b.x || a.x == b.x && (a.y < b.y || a.y == b.y && a.z < b.z) {
                v.swap(i, j);
                turned = !turned;
            }
        }
        // −0 is 0: equal places must have equal bits, for they are compared by them.
        let v = [v[0] + Vec3::ZERO, v[1] + Vec3::ZERO, v[2] + Vec3::ZERO];
        let long = |i: usize| (v[i].as_dvec3() - v[0].as_dvec3()).length_squared();
        let edge = (long(1).max(long(2)).sqrt() * (1.0 + 4.0 * f64::from(EPSILON))) as f32;
        Ok((CanonicalTriangle { v, edge: edge.max(f32::MIN_POSITIVE) }, turned))
    }

    /// The corners.
    pub fn v(&self) -> &[Vec3; 3] {
        &self.v
    }

    /// At least the length of the two edges at the first corner.
    pub fn edge(&self) -> f32 {
        self.edge
    }

    /// The bits of the nine coordinates.
    pub fn bits(&self) -> [u32; 9] {
        let [a, b, c] = self.v.map(|p| p.to_array().map(f32::to_bits));
        [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
    }

    /// The area between them.
    pub fn area(&self) -> f64 {
        let (e1, e2) = edges(&self.v);
        0.5 * e1.cross(e2).length()
    }

    /// Its box for trees.
    pub fn bounds(&self) -> Aabb {
        padded_bounds(&self.v)
    }
}

/// The edges at the first corner.
#[inline(always)]
fn edges(v: &[Vec3; 3]) -> (DVec3, DVec3) {
    (v[1].as_dvec3() - v[0].as_dvec3(), v[2].as_dvec3() - v[0].as_dvec3())
}

/// The box of three corners for trees: wider by a few ulps of the greatest coordinate, so that it is
/// flat nowhere and rays along its faces are not lost.
pub(crate) fn padded_bounds(corners: &[Vec3; 3]) -> Aabb {
    let bounds = Aabb::of_triangle(corners);
    bounds.padded(3.0 * EPSILON * bounds.max_abs_coordinate() + 4.0 * TINY_LENGTH)
}

/// Padding for things at the very origin. Times the largest reciprocal of a direction it is still
/// farther than anything can be.
pub(crate) const TINY_LENGTH: f32 = 1e-20;
