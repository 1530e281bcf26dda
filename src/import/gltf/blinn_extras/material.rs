//! Materials: thin walls.

use super::Members;
use crate::error::Warnings;

/// Returns true if the surfaces of material `index` are thin walls, also those of closed meshes.
pub fn is_thin_wall(extras: Option<&str>, index: usize, warnings: &mut Warnings) -> bool {
    let members = Members::of(extras, format_args!("materials[{index}]"), warnings);
    members.and_then(|members| members.flag("thinWall", warnings)).unwrap_or(false)
}
