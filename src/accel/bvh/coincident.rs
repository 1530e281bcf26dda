//! Coincident triangles: equal vertices, of either winding. They share one lane of a block.

use crate::bvh::surface_flags::SurfaceFlags;

/// Coincident triangles with equal surface flags, by ascending index.
#[derive(Clone, Debug)]
pub(crate) struct CoincidentGroup {
    pub flags: SurfaceFlags,
    pub indices: Vec<u32>,
}

/// Groups coincident triangles, given by ascending index, by their surface flags.
pub(crate) fn group_by_flags(triangles: impl Iterator<Item = (u32, SurfaceFlags)>) -> Vec<CoincidentGroup> {
    let mut groups: Vec<CoincidentGroup> = Vec::new();
    for (index, flags) in triangles {
        match groups.iter_mut().find(|group| group.flags == flags) {
            Some(group) => group.indices.push(index),
            None => groups.push(CoincidentGroup { flags, indices: vec![index] }),
        }
    }
    groups
}
