//! The BVHs of a posed scene: two over world-space triangles, and a two-level one over mesh instances.

use std::collections::BTreeMap;

use crate::bvh::blas::Blas;
use crate::bvh::tlas::Tlas;

/// All BVHs of a posed scene.
#[derive(Debug, Default)]
pub(crate) struct SceneBvh {
    /// World-space triangles of static instances.
    pub static_world: Blas,
    /// World-space triangles of dynamic instances.
    pub dynamic_world: Blas,
    /// Local-space triangles of instanced meshes, by mesh. The TLAS numbers them in this order.
    pub mesh_blases: BTreeMap<u32, Blas>,
    /// The instances of `mesh_blases`.
    pub tlas: Tlas,
}

impl SceneBvh {
    /// The BVHs over world-space triangles.
    #[inline(always)]
    pub fn worlds(&self) -> [&Blas; 2] {
        [&self.static_world, &self.dynamic_world]
    }

    /// All BVHs over triangles that are not empty.
    pub fn blases(&self) -> impl Iterator<Item = &Blas> {
        self.worlds().into_iter().chain(self.mesh_blases.values()).filter(|blas| !blas.is_empty())
    }
}
