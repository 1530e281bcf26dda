//! The shape of a ray packet, and arrays with an element for each of its rays.

use crate::simd::Lanes;

/// Rays in a ray group, each in a SIMD lane.
pub(crate) const RAY_GROUP: usize = 16;
/// Ray groups in a quad. With the four triangles of a leaf block, they make sixteen pairs of group and triangle, each
/// in a SIMD lane.
pub(super) const QUAD: usize = 4;
/// Quads in a packet.
pub(super) const QUADS: usize = 4;
/// Ray groups in a packet.
pub(super) const RAY_GROUPS: usize = QUADS * QUAD;
/// Rays in a packet.
pub(crate) const PACKET_SIZE: usize = RAY_GROUP * RAY_GROUPS;

/// A bit for each ray of a packet, by ray group.
pub(super) type RayMask = [u32; RAY_GROUPS];

/// An element for each ray of a packet.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(super) struct PerRay<T> {
    /// By quad, ray group and ray.
    pub quads: [[[T; RAY_GROUP]; QUAD]; QUADS],
}

impl<T: Copy> PerRay<T> {
    #[inline(always)]
    pub fn splat(x: T) -> Self {
        PerRay { quads: [[[x; RAY_GROUP]; QUAD]; QUADS] }
    }

    #[inline(always)]
    pub fn set(&mut self, ray: usize, x: T) {
        self.group_mut(ray / RAY_GROUP)[ray % RAY_GROUP] = x;
    }

    #[inline(always)]
    pub fn get(&self, ray: usize) -> T {
        self.group(ray / RAY_GROUP)[ray % RAY_GROUP]
    }

    #[inline(always)]
    pub fn group(&self, g: usize) -> &[T; RAY_GROUP] {
        &self.quads[g / QUAD % QUADS][g % QUAD]
    }

    #[inline(always)]
    pub fn group_mut(&mut self, g: usize) -> &mut [T; RAY_GROUP] {
        &mut self.quads[g / QUAD % QUADS][g % QUAD]
    }
}

impl PerRay<f32> {
    /// Loads the four groups of a quad.
    #[inline(always)]
    pub fn load_quad<L: Lanes<RAY_GROUP>>(&self, q: usize) -> [L; QUAD] {
        let [a, b, c, d] = &self.quads[q];
        [L::load(a), L::load(b), L::load(c), L::load(d)]
    }
}
