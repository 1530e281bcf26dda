//! Near planes of a file's camera that cut what is in view: some exporters write them in another unit than lengths.

use glam::DVec3;

use crate::empty_images::smaller;
use crate::error::SessionError;
use crate::posed_frame::{PosedFrame, SceneSetup};
use blinn_core::geometry::Aabb;
use blinn_render::integrator::Frame;
use blinn_render::{RenderSettings, count_hit_pixels};
use blinn_scene::{Camera, ClipPlanes};

/// Share of the pixels above which cuts are reported.
const REPORTED: f64 = 0.01;

/// Returns true if the near plane of `camera` cuts a part of what would be visible in an image at the start of the clip. Not
/// if it cuts all: an image that shows nothing has a reason of its own.
///
/// # Errors
/// The acceleration structure cannot be built, or the search was cancelled.
pub fn cuts_picture(
    setup: &SceneSetup,
    first: &mut PosedFrame,
    camera: Camera,
    settings: &RenderSettings,
) -> Result<bool, SessionError> {
    if !may_cut(&first.posed.bounds(), &camera) {
        return Ok(false);
    }
    setup.build(first)?;
    let frame = Frame { ground: None, ..setup.frame(first, camera)? };
    let small = smaller(settings);
    let count = |frame: &Frame, limit: u64| count_hit_pixels(frame, &small, limit, &setup.cancel);
    let cut_off = ClipPlanes { near: 0.0, far: camera.clip.near.min(camera.clip.far) };
    let cut_off = Frame { camera: Camera { clip: cut_off, ..camera }, ..frame.clone() };
    let reported = (REPORTED * f64::from(small.width) * f64::from(small.height)) as u64 + 1;
    Ok(count(&cut_off, reported)? == reported && count(&frame, 1)? > 0)
}

/// Returns true if a part of the `bounds` may lie between the camera and its near plane.
fn may_cut(bounds: &Aabb, camera: &Camera) -> bool {
    let depth = |corner: DVec3| -(corner - camera.view_point).dot(camera.basis.w);
    let corner = |i: usize| {
        let pick = |k: usize| if i >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let depths = || (0..8).map(|i| depth(corner(i)));
    camera.clip.near > 0.0 && depths().any(|d| d < camera.clip.near) && depths().any(|d| d > 0.0)
}
