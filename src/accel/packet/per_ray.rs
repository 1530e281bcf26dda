//! The shape of a ray packet, and arrays with an element for each of its rays.

use blinn_core::simd::Lanes;

/// Rays in a ray group, each in a SIMD lane.
pub(crate) const RAYS_PER_GROUP: usize = 16;
/// Ray groups in a quad. With the four triangles of a block, they make sixteen pairs of group and triangle, each
/// in a SIMD lane.
pub(super) const GROUPS_PER_QUAD: usize = 4;
/// Quads in a packet.
pub(super) const QUADS_PER_PACKET: usize = 4;
/// Ray groups in a packet.
pub(super) const GROUPS_PER_PACKET: usize = QUADS_PER_PACKET * GROUPS_PER_QUAD;
/// Rays in a packet.
pub(crate) const PACKET_SIZE: usize = RAYS_PER_GROUP * GROUPS_PER_PACKET;

/// A bit for each ray of a packet, by ray group.
pub(super) type RayMask = [u32; GROUPS_PER_PACKET];

/// An element for each ray of a packet.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(super) struct PerRay<T> {
    /// By quad, ray group and ray.
    pub quads: [[[T; RAYS_PER_GROUP]; GROUPS_PER_QUAD]; QUADS_PER_PACKET],
}

impl<T: Copy> PerRay<T> {
    #[inline(always)]
    pub fn splat(x: T) -> Self {
        PerRay { quads: [[[x; RAYS_PER_GROUP]; GROUPS_PER_QUAD]; QUADS_PER_PACKET] }
    }

    #[inline(always)]
    pub fn set(&mut self, ray: usize, x: T) {
        self.group_mut(ray / RAYS_PER_GROUP)[ray % RAYS_PER_GROUP] = x;
    }

    #[inline(always)]
    pub fn get(&self, ray: usize) -> T {
        self.group(ray / RAYS_PER_GROUP)[ray % RAYS_PER_GROUP]
    }

    #[inline(always)]
    pub fn group(&self, g: usize) -> &[T; RAYS_PER_GROUP] {
        &self.quads[g / GROUPS_PER_QUAD % QUADS_PER_PACKET][g % GROUPS_PER_QUAD]
    }

    #[inline(always)]
    pub fn group_mut(&mut self, g: usize) -> &mut [T; RAYS_PER_GROUP] {
        &mut self.quads[g / GROUPS_PER_QUAD % QUADS_PER_PACKET][g % GROUPS_PER_QUAD]
    }
}

impl PerRay<f32> {
    /// Loads the four groups of a quad.
    #[inline(always)]
    pub fn load_quad<L: Lanes<RAYS_PER_GROUP>>(&self, q: usize) -> [L; GROUPS_PER_QUAD] {
        let [a, b, c, d] = &self.quads[q];
        [L::load(a), L::load(b), L::load(c), L::load(d)]
    }
}
