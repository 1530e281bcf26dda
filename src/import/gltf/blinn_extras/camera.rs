//! Cameras: lens shift, depth of field, and which of them is active.

use glam::DVec2;

use super::Members;
use crate::error::Warnings;

/// Lens shifts beyond this many picture sides are wrong.
const MAX_SHIFT: f64 = 1e3;

/// The lens of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lens {
    /// Shift to the right and up, in units of the larger side of the picture.
    pub shift: DVec2,
    /// True if the camera has a depth of field.
    pub has_depth_of_field: bool,
}

/// Reads the lens of camera `index` from its `extras`.
pub fn lens(extras: Option<&str>, index: usize, warnings: &mut Warnings) -> Lens {
    let Some(members) = Members::of(extras, format_args!("cameras[{index}]"), warnings) else {
        return Lens::default();
    };
    let shift = members.numbers("shift", -MAX_SHIFT..=MAX_SHIFT, warnings).map_or(DVec2::ZERO, DVec2::from);
    let has_depth_of_field = members.child("depthOfField", warnings).is_some();
    Lens { shift, has_depth_of_field }
}

/// Returns true if the camera of node `index` is the one that pictures are taken with.
pub fn is_active_camera(extras: Option<&str>, index: usize, warnings: &mut Warnings) -> bool {
    let members = Members::of(extras, format_args!("nodes[{index}]"), warnings);
    members.and_then(|members| members.flag("activeCamera", warnings)).unwrap_or(false)
}
