//! Axis-aligned bounding boxes and bounding spheres in f64, for bounds of whole scenes.

use glam::DVec3;

/// An axis-aligned bounding box (AABB) in f64. It is empty where `min > max`.
///
/// It bounds points before the scene is recentred, where f32 would lose precision. BVHs have a box in f32.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lowest corner.
    pub min: DVec3,
    /// Highest corner.
    pub max: DVec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Aabb::EMPTY
    }
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Aabb = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Extends the box to contain `p`. Ignores points that are not finite.
    pub fn extend(&mut self, p: DVec3) {
        if p.is_finite() {
            self.min = self.min.min(p);
            self.max = self.max.max(p);
        }
    }

    /// Extends the box to contain `other`.
    pub fn extend_box(&mut self, other: &Aabb) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    /// Returns true if `other` lies within this box.
    pub fn contains_box(&self, other: &Aabb) -> bool {
        self.min.cmple(other.min).all() && self.max.cmpge(other.max).all()
    }

    /// Returns true if the box contains no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Returns the centre; the origin for an empty box.
    pub fn centre(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * self.min + 0.5 * self.max }
    }

    /// Returns the squared distance from `p` to the farthest corner; 0 for an empty box.
    pub fn max_distance_squared(&self, p: DVec3) -> f64 {
        let far = (self.min - p).abs().max((self.max - p).abs());
        if self.is_empty() { 0.0 } else { far.length_squared() }
    }

    /// Returns the size along each axis; zero for an empty box.
    pub fn extent(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { self.max - self.min }
    }
}

/// A sphere in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub centre: DVec3,
    /// Radius.
    pub radius: f64,
}
