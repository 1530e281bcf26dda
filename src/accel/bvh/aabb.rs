//! Axis-aligned bounding box (AABB) in f32: the bounds of BVH nodes, triangles and instances.

use glam::{DVec3, Vec3};

/// An axis-aligned bounding box in f32; empty where `min > max`.
///
/// obvhs's boxes are SIMD-aligned and a third larger; nodes, instances and hashes want these 24 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    /// Lowest corner.
    pub min: Vec3,
    /// Highest corner.
    pub max: Vec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Aabb::EMPTY
    }
}

impl Aabb {
    /// The box of nothing: [`Aabb::union`] with it returns the other box.
    pub const EMPTY: Aabb = Aabb { min: Vec3::MAX, max: Vec3::MIN };

    /// Returns the smallest box around both.
    #[inline(always)]
    pub fn union(self, other: Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the smallest box around all of `boxes`; [`Aabb::EMPTY`] for none.
    pub fn union_of(boxes: impl Iterator<Item = Aabb>) -> Aabb {
        boxes.fold(Aabb::EMPTY, Aabb::union)
    }

    /// Returns the smallest box around three vertices.
    #[inline(always)]
    pub fn of_triangle([a, b, c]: &[Vec3; 3]) -> Aabb {
        Aabb { min: a.min(*b).min(*c), max: a.max(*b).max(*c) }
    }

    /// Returns the box enlarged by `padding` on every side.
    #[inline(always)]
    pub fn padded(self, padding: f32) -> Aabb {
        let padding = Vec3::splat(padding);
        Aabb { min: self.min - padding, max: self.max + padding }
    }

    /// Half of the surface area, to which the number of random lines that hit the box is proportional (SAH).
    pub fn half_area(self) -> f64 {
        let d = self.max.as_dvec3() - self.min.as_dvec3();
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// The largest absolute coordinate of any corner.
    #[inline(always)]
    pub fn max_abs_coordinate(self) -> f32 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// The centre in f64.
    pub fn centre(self) -> DVec3 {
        0.5 * (self.min.as_dvec3() + self.max.as_dvec3())
    }

    /// Returns true if `other` is inside or equal.
    #[cfg(test)]
    pub fn contains(self, other: Aabb) -> bool {
        self.min.cmple(other.min).all() && self.max.cmpge(other.max).all()
    }

    /// The bit patterns of all coordinates, for sorting and exact comparison.
    pub fn to_bits(self) -> [[u32; 3]; 2] {
        [self.min, self.max].map(|p| p.to_array().map(f32::to_bits))
    }
}

impl From<obvhs::aabb::Aabb> for Aabb {
    #[inline(always)]
    fn from(aabb: obvhs::aabb::Aabb) -> Self {
        Aabb { min: aabb.min.into(), max: aabb.max.into() }
    }
}

impl From<Aabb> for obvhs::aabb::Aabb {
    #[inline(always)]
    fn from(aabb: Aabb) -> Self {
        obvhs::aabb::Aabb { min: aabb.min.into(), max: aabb.max.into() }
    }
}
