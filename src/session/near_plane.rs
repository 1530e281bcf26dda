//! Near planes of a file's camera that cut what is in view: some exporters write them in another unit than lengths.

use glam::DVec3;

use crate::empty_images::smaller;
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::geometry::Aabb;
use blinn_render::integrator::{Aov, Frame};
use blinn_render::{RenderSettings, render_aovs};
use blinn_scene::{Camera, ClipPlanes};

/// Share of the pixels above which cuts are reported.
const REPORTED: f64 = 0.01;

/// Returns true if a part of the `bounds` may lie between the camera and its near plane.
pub fn may_cut(bounds: &Aabb, camera: &Camera) -> bool {
    let depth = |corner: DVec3| -(corner - camera.view_point).dot(camera.basis.w);
    let corner = |i: usize| {
        let pick = |k: usize| if i >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let depths = || (0..8).map(|i| depth(corner(i)));
    camera.clip.near > 0.0 && depths().any(|d| d < camera.clip.near) && depths().any(|d| d > 0.0)
}

/// Returns true if the near plane of the frame's camera cuts what would be visible in the image.
///
/// # Errors
/// The search was cancelled.
pub fn cuts_picture(
    frame: &Frame,
    settings: &RenderSettings,
    cancel: &CancelToken,
) -> Result<bool, Cancelled> {
    let near = frame.camera.clip.near as f32;
    let clip = ClipPlanes { near: 0.0, ..frame.camera.clip };
    let whole = Frame { camera: Camera { clip, ..frame.camera }, ground: None, ..frame.clone() };
    let layers = render_aovs(&whole, &[Aov::Depth], &smaller(settings), cancel)?;
    let depths = || layers.iter().flat_map(|layer| &layer.values);
    let cut = depths().filter(|&&depth| depth < near).count();
    Ok(cut as f64 > REPORTED * depths().count() as f64)
}
