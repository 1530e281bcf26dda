//! Surface flags of a triangle: opaque, alpha tested or translucent; single sided or not.

use blinn_scene::SurfaceClass;

/// Properties of a triangle's surface that rays test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SurfaceFlags {
    pub class: SurfaceClass,
    pub single_sided: bool,
    /// True if the normal of the vertex order points out of the back face.
    pub reversed: bool,
}

impl SurfaceFlags {
    pub const OPAQUE: SurfaceFlags =
        SurfaceFlags { class: SurfaceClass::Opaque, single_sided: false, reversed: false };
}
