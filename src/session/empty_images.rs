//! Images that show nothing of the scene: the reason, and the option that helps.

use std::collections::BTreeMap;
use std::sync::Mutex;

use glam::{DVec2, DVec3};

use crate::empty_reason::EmptyReason;
use crate::notice::Notice;
use crate::round_sizes::{RoundWidth, round_sizes};
use blinn_accel::RoundSizes;
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::geometry::Aabb;
use blinn_render::integrator::Frame;
use blinn_render::{Pixels, RenderSettings, count_hit_pixels};
use blinn_scene::{Camera, ClipPlanes, Projection};

/// Longer side of the images that search for the reason, in pixels.
const SEARCH_SIDE: u32 = 256;

/// Returns the reason why `pixels`, an image of `frame`, shows nothing of the scene; `None` if it shows something. A
/// ground or a background is not part of the scene.
///
/// # Errors
/// The image was cancelled.
pub fn empty_reason(
    frame: &Frame,
    settings: &RenderSettings,
    pixels: &Pixels,
    cancel: &CancelToken,
) -> Result<Option<EmptyReason>, Cancelled> {
    let is_covered = pixels.colors.iter().any(|color| color.w > 0.0);
    let shows_scene_only = frame.ground.is_none() && frame.background.is_none();
    if is_covered && (shows_scene_only || shows_object(frame, settings, cancel)?) {
        return Ok(None);
    }
    find_reason(frame, settings, cancel).map(Some)
}

/// Returns true if an object is visible at the centre of a pixel.
fn shows_object(frame: &Frame, settings: &RenderSettings, cancel: &CancelToken) -> Result<bool, Cancelled> {
    let hits = |settings: &RenderSettings| -> Result<bool, Cancelled> {
        let frame = Frame { ground: None, ..frame.clone() };
        Ok(count_hit_pixels(&frame, settings, 1, cancel)? > 0)
    };
    // Few pixels decide for most images.
    Ok(settings.crop.is_none() && hits(&smaller(settings))? || hits(settings)?)
}

/// The same view with fewer pixels, without crop.
pub(crate) fn smaller(settings: &RenderSettings) -> RenderSettings {
    let longer = settings.width.max(settings.height).max(1);
    let side = |pixels: u32| match longer > SEARCH_SIDE {
        true => (u64::from(pixels) * u64::from(SEARCH_SIDE) / u64::from(longer)).max(1) as u32,
        false => pixels,
    };
    RenderSettings { width: side(settings.width), height: side(settings.height), crop: None, ..*settings }
}

/// Finds the reason by changing one setting after the other, then from the bounds of the scene.
fn find_reason(
    frame: &Frame,
    settings: &RenderSettings,
    cancel: &CancelToken,
) -> Result<EmptyReason, Cancelled> {
    let bounds = frame.posed.bounds();
    if frame.posed.scene.instances.is_empty() {
        return Ok(EmptyReason::NoObjects);
    }
    if bounds.is_empty() {
        let is_shown_later = !frame.posed.clip_bounds().is_empty();
        cancel.check()?;
        return Ok(match () {
            _ if is_shown_later => EmptyReason::HiddenNow,
            _ if !frame.posed.instances.iter().any(|instance| instance.visible) => EmptyReason::Hidden,
            // The bounds are those of what alpha does not hide, the BVHs have all that has an area.
            _ if frame.accel.stats().triangles > 0 || frame.accel.round_counts() != [0; 2] => {
                EmptyReason::AllTransparent
            }
            _ => EmptyReason::NoArea,
        });
    }
    // Surfaces are found whatever their alpha.
    if shows_object(frame, settings, cancel)? {
        return Ok(EmptyReason::Transparent);
    }
    let small = smaller(settings);
    let shows = |clip: ClipPlanes, cull_back_faces: bool| {
        let camera = Camera { clip, ..frame.camera };
        shows_object(&Frame { camera, cull_back_faces, ..frame.clone() }, &small, cancel)
    };
    let clip = frame.camera.clip;
    if settings.crop.is_some() && shows(clip, frame.cull_back_faces)? {
        return Ok(EmptyReason::Crop);
    }
    if clip != ClipPlanes::OFF && shows(ClipPlanes::OFF, frame.cull_back_faces)? {
        let without_near = ClipPlanes { near: 0.0, ..clip };
        let is_near = shows(without_near, frame.cull_back_faces)?;
        return Ok(if is_near { EmptyReason::NearPlane } else { EmptyReason::FarPlane });
    }
    if frame.cull_back_faces && shows(clip, false)? {
        let eye = Aabb { min: frame.camera.view_point, max: frame.camera.view_point };
        return Ok(if bounds.contains_box(&eye) { EmptyReason::Inside } else { EmptyReason::BackFaces });
    }
    if let Some(reason) = thin_rounds(frame, &small, cancel)? {
        return Ok(reason);
    }
    Ok(match ProjectedSize::of(&bounds, &frame.camera) {
        None => EmptyReason::LooksAway,
        Some(ProjectedSize(size)) if size * f64::from(settings.height) < 2.0 => EmptyReason::TooSmall,
        Some(_) => EmptyReason::NothingInView,
    })
}

/// Pixels of points and lines that are looked for where none is seen.
const SEARCH_WIDTH: RoundWidth = RoundWidth::Pixels(2.0);

/// Returns the reason if points or lines are in view that are not drawn or thinner than a pixel.
fn thin_rounds(
    frame: &Frame,
    settings: &RenderSettings,
    cancel: &CancelToken,
) -> Result<Option<EmptyReason>, Cancelled> {
    if frame.accel.round_counts() == [0; 2] {
        return Ok(None);
    }
    let shows = |points: RoundWidth, lines: RoundWidth| {
        let rounds = round_sizes(points, lines, frame.accel, &frame.camera, settings.height);
        shows_object(&Frame { rounds, ..frame.clone() }, settings, cancel)
    };
    let RoundSizes { points, lines } = frame.rounds;
    let reason = |is_drawn: bool, off: EmptyReason| if is_drawn { EmptyReason::ThinRounds } else { off };
    if shows(SEARCH_WIDTH, RoundWidth::Off)? {
        return Ok(Some(reason(points.is_drawn(), EmptyReason::PointsOff)));
    }
    let shows_lines = shows(RoundWidth::Off, SEARCH_WIDTH)?;
    Ok(shows_lines.then(|| reason(lines.is_drawn(), EmptyReason::LinesOff)))
}

/// The approximate size of a box in an image, as a fraction of its height.
struct ProjectedSize(f64);

impl ProjectedSize {
    /// `None` if the box is certainly out of view.
    fn of(bounds: &Aabb, camera: &Camera) -> Option<ProjectedSize> {
        let is_perspective = camera.projection == Projection::Perspective;
        let unit = if is_perspective { camera.proj_distance } else { 1.0 };
        let half = 0.5 * DVec2::new(camera.view_width, camera.view_height) / unit;
        let centre = camera.view_centre / unit;
        let to_camera = |p: DVec3| {
            let offset = p - camera.view_point;
            DVec3::new(offset.dot(camera.basis.u), offset.dot(camera.basis.v), -offset.dot(camera.basis.w))
        };
        let corner = |i: usize| {
            let pick = |k: usize| if i >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
            to_camera(DVec3::new(pick(0), pick(1), pick(2)))
        };
        let all = |is_outside: &dyn Fn(DVec3) -> bool| (0..8).all(|i| is_outside(corner(i)));
        let scale = |p: DVec3| if is_perspective { p.z } else { 1.0 };
        let is_outside = all(&|p| p.z <= 0.0)
            || all(&|p| p.x > (centre.x + half.x) * scale(p))
            || all(&|p| p.x < (centre.x - half.x) * scale(p))
            || all(&|p| p.y > (centre.y + half.y) * scale(p))
            || all(&|p| p.y < (centre.y - half.y) * scale(p));
        let nearest = (0..8).map(|i| corner(i).z).fold(f64::INFINITY, f64::min);
        let distance = if is_perspective { nearest.max(f64::MIN_POSITIVE) } else { 1.0 };
        (!is_outside).then(|| ProjectedSize(bounds.extent().length() / (2.0 * half.y * distance)))
    }
}

/// Frame numbers that a message lists for a reason.
const LISTED: usize = 3;

/// The images of a scene that show nothing, for one message.
#[derive(Debug, Default)]
pub struct EmptyImages(Mutex<BTreeMap<EmptyReason, EmptyFrames>>);

#[derive(Debug, Default)]
struct EmptyFrames {
    count: usize,
    first: Vec<i64>,
}

impl EmptyImages {
    /// Adds an image. Returns the message about it alone.
    pub fn add(&self, reason: EmptyReason, frame: i64) -> Option<Notice> {
        let mut reasons = self.0.lock().unwrap_or_else(|e| e.into_inner());
        let frames = reasons.entry(reason).or_default();
        frames.count += 1;
        if frames.first.len() < LISTED {
            frames.first.push(frame);
        }
        (reason != EmptyReason::NoObjects).then_some(Notice::EmptyImage { frame, reason })
    }

    /// The message about all images, of `total`. `None` if there is none, or if it is known that there are no objects.
    pub fn summary(&self, total: usize) -> Option<Notice> {
        let reasons = self.0.lock().unwrap_or_else(|e| e.into_inner());
        let unknown = reasons.iter().filter(|(reason, _)| **reason != EmptyReason::NoObjects);
        let unknown: Vec<_> = unknown.collect();
        let count: usize = unknown.iter().map(|(_, frames)| frames.count).sum();
        match unknown[..] {
            [] => None,
            [(reason, _)] if total == 1 => {
                Some(Notice::EmptyImages(format!("the image shows nothing: {reason}")))
            }
            _ => {
                let parts: Vec<String> =
                    unknown.iter().map(|(reason, frames)| format!("{}: {}", frames.list(), reason)).collect();
                let parts = parts.join("; ");
                Some(Notice::EmptyImages(format!("{count} of {total} images show nothing; {parts}")))
            }
        }
    }
}

impl EmptyFrames {
    /// `frames 1, 2, 3 and 7 more`
    fn list(&self) -> String {
        let numbers = self.first.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        match self.count - self.first.len() {
            0 if self.count == 1 => format!("frame {numbers}"),
            0 => format!("frames {numbers}"),
            more => format!("frames {numbers} and {more} more"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_message_counts_the_images_and_lists_the_first() {
        let images = EmptyImages::default();
        assert_eq!(images.summary(9), None);
        assert_eq!(images.add(EmptyReason::NoObjects, 1), None);
        assert_eq!(images.summary(9), None, "a warning says that there is nothing to render");
        let images = EmptyImages::default();
        assert!(
            images
                .add(EmptyReason::LooksAway, 7)
                .is_some_and(|notice| notice.to_string().contains("frame 7"))
        );
        let text = images.summary(1).unwrap().to_string();
        assert!(text.starts_with("the image shows nothing: the camera looks away"), "{text}");
        (8..12).for_each(|number| drop(images.add(EmptyReason::LooksAway, number)));
        images.add(EmptyReason::NearPlane, 20);
        assert_eq!(
            images.summary(36).unwrap().to_string(),
            "6 of 36 images show nothing; frame 20: the near plane cuts off everything in view; use `clip off`; \
             frames 7, 8, 9 and 2 more: the camera looks away from the scene; use `look-at` or `orbit`"
        );
    }
}
