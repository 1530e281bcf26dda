//! The BVHs of a posed scene: two over world-space triangles, and a two-level one over mesh instances.

use std::collections::BTreeMap;

use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::tlas::Tlas;

/// All BVHs of a posed scene.
#[derive(Debug, Default)]
pub(crate) struct SceneBvh {
    /// World-space triangles of static and of dynamic instances.
    pub worlds: [Blas; 2],
    /// Local-space triangles of instanced meshes, by mesh. The TLAS numbers them in this order.
    pub meshes: BTreeMap<u32, Blas>,
    /// The instances of `meshes`.
    pub tlas: Tlas,
}

impl SceneBvh {
    /// All BVHs over triangles that are not empty.
    pub fn blases(&self) -> impl Iterator<Item = &Blas> {
        self.worlds.iter().chain(self.meshes.values()).filter(|blas| !blas.is_empty())
    }
}
