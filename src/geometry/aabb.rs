//! Bounding boxes and spheres.

use glam::DVec3;

/// An axis-aligned box in f64; empty when `min > max`.
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
    /// The box of nothing.
    pub const EMPTY: Aabb = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Grows to hold `p`; a point that is not finite is ignored.
    pub fn extend(&mut self, p: DVec3) {
        if p.is_finite() {
            self.min = self.min.min(p);
            self.max = self.max.max(p);
        }
    }

    /// Grows to hold `other`.
    pub fn extend_box(&mut self, other: &Aabb) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    /// True where nothing was added.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// The middle; the origin of an empty box.
    pub fn centre(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * self.min + 0.5 * self.max }
    }

    /// The squared distance of its farthest corner from `p`; 0 for an empty box.
    pub fn max_distance_squared(&self, p: DVec3) -> f64 {
        let far = (self.min - p).abs().max((self.max - p).abs());
        if self.is_empty() { 0.0 } else { far.length_squared() }
    }

    /// Size along each axis; zero for an empty box.
    pub fn extent(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { self.max - self.min }
    }
}

/// A sphere in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub centre: DVec3,
    /// Its radius.
    pub radius: f64,
}
