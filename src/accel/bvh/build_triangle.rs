//! A triangle in a BVH build, before it is packed into a block.

use crate::bvh::canonical_triangle::CanonicalTriangle;
use crate::bvh::surface_flags::SurfaceFlags;

/// A triangle in the build: canonical, with its flags and index.
#[derive(Clone, Copy)]
pub(crate) struct BuildTriangle {
    pub triangle: CanonicalTriangle,
    pub flags: SurfaceFlags,
    /// Index of the triangle in the input, or a mark and the index of a set of coincident triangles ([`COINCIDENT`]).
    ///
    /// [`COINCIDENT`]: crate::bvh::triangle4::COINCIDENT
    pub index: u32,
}

impl BuildTriangle {
    /// A rejected triangle.
    pub const REJECTED: BuildTriangle =
        BuildTriangle { triangle: CanonicalTriangle::ZERO, flags: SurfaceFlags::OPAQUE, index: u32::MAX };
}
