//! Cameras: lens shift, depth of field, and which of them is active.

use glam::DVec2;

use super::Members;
use crate::error::Warnings;
use blinn_scene::ThinLens;

/// Lens shifts beyond this many picture sides are wrong.
const MAX_SHIFT: f64 = 1e3;

/// Least distance in focus, as in Cycles.
const MIN_FOCUS_DISTANCE: f64 = 1e-5;
/// Apertures of more corners are discs.
const MAX_BLADES: i64 = 1000;

/// The lens of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lens {
    /// Shift to the right and up, in units of the larger side of the picture.
    pub shift: DVec2,
    /// The lens of a depth of field.
    pub lens: Option<ThinLens>,
}

/// Reads the lens of camera `index` from its `extras`.
pub fn lens(extras: Option<&str>, index: usize, warnings: &mut Warnings) -> Lens {
    let Some(members) = Members::of(extras, format_args!("cameras[{index}]"), warnings) else {
        return Lens::default();
    };
    let shift = members.numbers("shift", -MAX_SHIFT..=MAX_SHIFT, warnings).map_or(DVec2::ZERO, DVec2::from);
    let depth_of_field = members.child("depthOfField", warnings);
    Lens { shift, lens: depth_of_field.and_then(|members| thin_lens(&members, warnings)) }
}

/// Reads the lens of a depth of field; `None` if its aperture or its distance in focus is missing.
fn thin_lens(members: &Members, warnings: &mut Warnings) -> Option<ThinLens> {
    let aperture_radius = members.number("apertureRadius", 0.0.., warnings)?;
    let focus_distance = members.number("focusDistance", 0.0.., warnings)?.max(MIN_FOCUS_DISTANCE);
    let blades = members.whole("blades", 0..=MAX_BLADES, warnings).unwrap_or(0) as u32;
    let rotation = members.number("rotation", .., warnings).unwrap_or(0.0);
    let ratio = members.number("ratio", 1e-3..=1e3, warnings).unwrap_or(1.0);
    Some(ThinLens { aperture_radius, focus_distance, blades, rotation, ratio })
}

/// Returns true if the camera of node `index` is the one that pictures are taken with.
pub fn is_active_camera(extras: Option<&str>, index: usize, warnings: &mut Warnings) -> bool {
    let members = Members::of(extras, format_args!("nodes[{index}]"), warnings);
    members.and_then(|members| members.flag("activeCamera", warnings)).unwrap_or(false)
}
