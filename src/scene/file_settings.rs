//! Render settings that a file holds beside its scene. Options of users take precedence over them.

use std::ops::RangeInclusive;

/// Gammas of displays.
pub const GAMMAS: RangeInclusive<f64> = 1e-3..=100.0;

/// The render settings of a file: `extras.blinn` of a glTF scene. `None` and empty where the file holds nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileSettings {
    /// Width and height of pictures in pixels.
    pub size: Option<(u32, u32)>,
    /// Width over height of a pixel.
    pub pixel_aspect: Option<f64>,
    /// The part of the picture to render.
    pub region: Option<PictureRegion>,
    /// The frames of an animation.
    pub frames: Option<FileFrames>,
    /// Name of the view transform.
    pub view_transform: Option<String>,
    /// Name of the look.
    pub look: Option<String>,
    /// Gamma of the display, greater than zero.
    pub gamma: Option<f64>,
    /// Exposure in stops.
    pub exposure: Option<f64>,
    /// True to show no background, false to show the environment.
    pub film_transparent: Option<bool>,
    /// Maximum diffuse bounces along a path.
    pub indirect: Option<u8>,
    /// True for light that specular surfaces send to matte ones.
    pub caustics: Option<bool>,
    /// Index of the camera that pictures are taken with.
    pub camera: Option<usize>,
}

/// A rectangle in fractions of a picture, from its lower left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureRegion {
    /// Left and lower edge.
    pub min: [f32; 2],
    /// Right and upper edge, greater than `min`.
    pub max: [f32; 2],
}

impl PictureRegion {
    /// Returns the first column and the first row from the top, width and height in a picture of `size` = (width, height)
    /// pixels; `None` if it has no pixels. Edges are rounded towards the lower left, as in Blender.
    pub fn pixels(&self, (width, height): (u32, u32)) -> Option<[u32; 4]> {
        let edge = |fraction: f32, pixels: u32| ((fraction * pixels as f32) as u32).min(pixels);
        let [left, right] = [self.min[0], self.max[0]].map(|x| edge(x, width));
        let [bottom, top] = [self.min[1], self.max[1]].map(|y| edge(y, height));
        let (width, rows) = (right.checked_sub(left)?, top.checked_sub(bottom)?);
        (width > 0 && rows > 0).then(|| [left, height - top, width, rows])
    }
}

/// The frames of an animation. Frame N is at N / rate seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileFrames {
    /// The first frame.
    pub start: i64,
    /// The last frame.
    pub end: i64,
    /// From one rendered frame to the next.
    pub step: i64,
    /// Frames per second.
    pub rate: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_rounded_towards_the_lower_left() {
        let region = PictureRegion { min: [0.25, 0.1], max: [0.7, 0.6] };
        assert_eq!(region.pixels((480, 270)), Some([120, 108, 216, 135]));
        assert_eq!(region.pixels((7, 5)), Some([1, 2, 3, 3]));
        assert_eq!(region.pixels((1, 1)), None);
        let whole = PictureRegion { min: [0.0; 2], max: [1.0; 2] };
        assert_eq!(whole.pixels((u32::MAX, 1)), Some([0, 0, u32::MAX, 1]));
    }
}
