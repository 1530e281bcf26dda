//! Rays, ray differentials and hits.

use glam::{DVec3, Vec3};

/// A ray `r(t) = o + t·d`. The direction need not have unit length: eye rays have `d = s − e`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin.
    pub o: Vec3,
    /// Direction; `t` is measured in its length.
    pub d: Vec3,
}

/// Change of an eye ray from one sample to the next on the film: one step right, one step up.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct RayDifferential {
    /// Change of the origin.
    pub o: [DVec3; 2],
    /// Change of the direction.
    pub d: [DVec3; 2],
}

/// Identifies a triangle of an instance. Ordered, so that ties between equal distances are broken
/// the same way everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct HitId {
    /// Index into the posed scene's instances.
    pub instance: u32,
    /// Index into the triangles of the instance's mesh.
    pub triangle: u32,
}

impl HitId {
    /// No triangle. Greater than every valid id.
    pub const NONE: HitId = HitId { instance: u32::MAX, triangle: u32::MAX };
}

/// The closest hit of a ray. Shading recomputes the barycentrics.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Hit {
    /// Ray parameter of the hit, in lengths of the direction; +∞ for a miss.
    pub t: f32,
    /// The triangle; [`HitId::NONE`] for a miss.
    pub id: HitId,
}

impl Hit {
    /// A miss.
    pub const MISS: Hit = Hit { t: f32::INFINITY, id: HitId::NONE };

    /// Returns true for a miss.
    pub fn is_miss(&self) -> bool {
        self.id == HitId::NONE
    }

    /// Returns true if this hit comes before `other` along a ray. Equal distances are ordered by id.
    pub fn before(&self, other: &Hit) -> bool {
        self.t < other.t || (self.t == other.t && self.id < other.id)
    }
}
