//! Rays and what they hit.

use glam::{DVec3, Vec3};

/// A half-line `r(t) = o + t·d`. The direction need not be unit length: eye rays are `s − e`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin.
    pub o: Vec3,
    /// Direction; `t` counts in its length.
    pub d: Vec3,
}

/// How an eye ray changes from a sample to the next one on the film: to the right, and upward.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct RayDifferential {
    /// Of the origin.
    pub o: [DVec3; 2],
    /// Of the direction.
    pub d: [DVec3; 2],
}

/// Which triangle of which instance: indices into the posed scene's instances and into that
/// instance's mesh's triangles. Ordered, so that ties between equal distances have one answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct HitId {
    /// Index of the instance in the scene.
    pub instance: u32,
    /// Index of the triangle in the instance's mesh.
    pub triangle: u32,
}

impl HitId {
    /// No triangle: greater than every real id.
    pub const NONE: HitId = HitId { instance: u32::MAX, triangle: u32::MAX };
}

/// The closest hit of a ray. Barycentrics are not kept: they are recomputed when shading.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Hit {
    /// Where along the ray, in lengths of its direction; +∞ for a miss.
    pub t: f32,
    /// What was hit; [`HitId::NONE`] for a miss.
    pub id: HitId,
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Hit = Hit { t: f32::INFINITY, id: HitId::NONE };

    /// True where nothing was hit.
    pub fn is_miss(&self) -> bool {
        self.id == HitId::NONE
    }

    /// The order in which a ray meets surfaces: by `t`, then by id.
    pub fn before(&self, other: &Hit) -> bool {
        self.t < other.t || (self.t == other.t && self.id < other.id)
    }
}
