//! The outcome of a comparison.

use std::path::Path;

use glam::DVec3;

use super::length::LengthUnit;
use crate::args::CompareArgs;
use blinn_output::compare::{
    DifferenceMap, DifferenceSummary, FLIP_PIXELS_PER_DEGREE, JsonDifference, ObjectDifference, flip,
};
use blinn_output::heat_color;
use blinn_render::PixelRect;

/// The files of a comparison and how they were compared, for reports.
pub struct Heading<'a> {
    pub old: &'a Path,
    pub new: &'a Path,
    pub tolerance: f32,
    pub flip: bool,
}

/// Two scenes or two pictures, and what differs.
#[derive(Default)]
pub struct Comparison {
    pub views: Vec<ViewComparison>,
    pub objects: Vec<ObjectDifference>,
    /// Differences of what `blinn info` prints.
    pub properties: Vec<JsonDifference>,
    /// Differences of properties that do not make the scenes different.
    pub information: Vec<JsonDifference>,
    /// Options that would make the scenes more alike.
    pub hint: Option<String>,
    /// Largest distance of surfaces that was accepted, if any moved.
    pub accepted_distance: Option<f64>,
    /// The reason why no pixels could be compared.
    pub mismatch: Option<String>,
    /// The old and the new picture, if their pixels could not be compared.
    pub apart: Vec<ShownPicture>,
    /// True if the pictures alone decide: with a tolerance, small differences of scenes are accepted.
    pub pictures_decide: bool,
    /// True if pictures do not count, since surfaces moved by an accepted distance.
    pub ignores_pictures: bool,
    /// The unit of lengths of both scenes.
    pub unit: LengthUnit,
}

/// A picture to look at.
pub struct ShownPicture {
    pub width: u32,
    pub height: u32,
    /// 8-bit sRGB with straight alpha.
    pub pixels: Vec<[u8; 4]>,
}

/// A view of two scenes, or two pictures.
pub struct ViewComparison {
    /// Name, such as `front` or `camera 'Close'`.
    pub name: String,
    pub width: u32,
    pub height: u32,
    pub summary: DifferenceSummary,
    /// Pixels that differ by noise only, which the summary does not count.
    pub noise: u64,
    /// Pictures in 8-bit sRGB with straight alpha.
    pub before: Vec<[u8; 4]>,
    pub after: Vec<[u8; 4]>,
    pub difference: Vec<[u8; 4]>,
    /// Where changed objects stand: their index, and their box.
    pub objects: Vec<(usize, PixelRect)>,
}

impl Comparison {
    pub fn is_different(&self) -> bool {
        let is_changed = self.views.iter().any(|view| view.summary.changed > 0);
        let pictures = self.mismatch.is_some() || is_changed && !self.ignores_pictures;
        let scenes = !self.objects.is_empty() || !self.properties.is_empty();
        pictures || scenes && !self.pictures_decide
    }
}

/// Two pictures of one size.
pub struct PicturePair {
    pub width: u32,
    pub height: u32,
    /// Absolute differences of the values.
    pub map: DifferenceMap,
    /// Colours as displayed, 0 to 1, over black.
    pub colors: [Vec<DVec3>; 2],
    /// The same in 8 bits, with straight alpha.
    pub shown: [Vec<[u8; 4]>; 2],
}

impl PicturePair {
    pub fn compare(self, name: String, args: &CompareArgs) -> ViewComparison {
        let PicturePair { width, height, map, colors: [old, new], shown: [before, after] } = self;
        let tolerance = args.tolerance.unwrap_or(0.0);
        let map = if args.flip {
            let errors = flip(width as usize, &old, &new, FLIP_PIXELS_PER_DEGREE);
            // NaN beside a number has no colour to compare.
            let error = |(error, difference): (f32, &f32)| if difference.is_finite() { error } else { 1.0 };
            let magnitudes = errors.into_iter().zip(&map.magnitudes).map(error).collect();
            DifferenceMap { magnitudes, ..map }
        } else {
            map
        };
        let summary = map.summary(tolerance);
        let difference = difference_picture(&map, &before, tolerance);
        ViewComparison {
            name,
            width,
            height,
            summary,
            noise: 0,
            before,
            after,
            difference,
            objects: Vec::new(),
        }
    }
}

/// Draws changed pixels in the colours of a heat map over a dim copy of the picture.
fn difference_picture(map: &DifferenceMap, picture: &[[u8; 4]], tolerance: f32) -> Vec<[u8; 4]> {
    let finite = map.magnitudes.iter().copied().filter(|m| m.is_finite());
    let max = finite.fold(f32::MIN_POSITIVE, f32::max);
    let pixel = |(&magnitude, &[r, g, b, a]): (&f32, &[u8; 4])| {
        if magnitude <= tolerance {
            let grey = (u32::from(r) * 2 + u32::from(g) * 5 + u32::from(b)) * u32::from(a) / 255 / 8 / 4;
            let grey = grey as u8;
            return [grey, grey, grey, 255];
        }
        // The smallest change is visible.
        let [r, g, b] = heat_color(0.4 + 0.6 * (magnitude / max).min(1.0));
        [r, g, b, 255]
    };
    map.magnitudes.iter().zip(picture).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_a_tolerance_the_pictures_decide() {
        let property = JsonDifference { path: "lights".into(), old: None, new: None };
        let comparison = |pictures_decide| Comparison {
            properties: vec![property.clone()],
            pictures_decide,
            ..Comparison::default()
        };
        assert!(comparison(false).is_different() && !comparison(true).is_different());
        assert!(!Comparison::default().is_different());
        assert!(Comparison { mismatch: Some("sizes".into()), ..comparison(true) }.is_different());
    }

    #[test]
    fn changed_pixels_are_brighter_than_the_rest() {
        let map = DifferenceMap { width: 3, height: 1, magnitudes: vec![0.0, f32::MIN_POSITIVE, 1.0] };
        let shown = difference_picture(&map, &[[255; 4]; 3], 0.0);
        let sum = |i: usize| shown[i][..3].iter().map(|c| u32::from(*c)).sum::<u32>();
        assert!(sum(0) < sum(1) && sum(1) < sum(2), "{shown:?}");
    }
}
