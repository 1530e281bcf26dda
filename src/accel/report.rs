//! Reports of BVH builds: rejected triangles and the size of the result.

/// The triangles that a build rejected or merged, each counted as often as it is instanced. Ids do not change:
/// a rejected triangle is never hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildReport {
    /// Rejected: a vertex is not finite, or has a coordinate beyond ±1e18.
    pub non_finite: u64,
    /// Points and lines that were rejected for the same reason.
    pub non_finite_rounds: u64,
    /// Rejected: no area.
    pub zero_area: u64,
    /// Merged: coincident with a triangle of a lower id, of either winding. They share a leaf entry, and all can
    /// be hit.
    pub coincident: u64,
}

impl BuildReport {
    /// Adds the counts of a mesh with that many instances.
    pub(crate) fn add(&mut self, mesh: BuildReport, instances: u64) {
        self.non_finite += mesh.non_finite * instances;
        self.zero_area += mesh.zero_area * instances;
        self.coincident += mesh.coincident * instances;
    }
}

/// The size of all BVHs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelStats {
    /// BVHs over triangles: those of the world and of instanced meshes.
    pub bvhs: usize,
    /// Inner nodes, those of the TLAS included.
    pub nodes: usize,
    /// Triangles in leaves; instanced and coincident ones count once.
    pub triangles: usize,
    /// Memory in bytes.
    pub bytes: usize,
}
