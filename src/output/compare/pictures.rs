//! Differences of two pictures, pixel by pixel.

use super::regions::{Regions, regions};
use blinn_import::{PictureEncoding, StoredPicture};
use blinn_render::PixelRect;

/// The difference of each pixel of two pictures: 0 where they are equal.
#[derive(Clone, Debug, PartialEq)]
pub struct DifferenceMap {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Largest absolute difference over the channels, or the FLIP error. Row-major, row 0 on top.
    pub magnitudes: Vec<f32>,
}

/// The pixels that differ by more than a tolerance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DifferenceSummary {
    /// Number of changed pixels.
    pub changed: u64,
    /// Largest difference of all pixels.
    pub max: f64,
    /// Mean difference of all pixels.
    pub mean: f64,
    /// Boxes around connected changed pixels, those with the most changed pixels first.
    pub boxes: Vec<PixelRect>,
    /// Number of boxes beyond those.
    pub more_boxes: usize,
}

/// Two pictures that have no pixels in common to compare.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Mismatch {
    /// Different sizes.
    #[error("the sizes differ: {} by {} and {} by {} pixels", .0.0, .0.1, .1.0, .1.1)]
    Size((u32, u32), (u32, u32)),
    /// Different channels.
    #[error("the channels differ: {} and {}", .0.join(" "), .1.join(" "))]
    Channels(Vec<String>, Vec<String>),
    /// Display colours against linear light.
    #[error("one picture has colours as displayed, the other linear light")]
    Encoding,
}

impl DifferenceMap {
    /// Summarises the pixels that differ by more than `tolerance`.
    pub fn summary(&self, tolerance: f32) -> DifferenceSummary {
        // NaN counts as a change.
        let is_changed = |i: usize| !(self.magnitudes[i] <= tolerance);
        let Regions { boxes, more } = regions((self.width, self.height), is_changed);
        let sum: f64 = self.magnitudes.iter().map(|&m| f64::from(m)).sum();
        DifferenceSummary {
            changed: (0..self.magnitudes.len()).filter(|&i| is_changed(i)).count() as u64,
            max: self.magnitudes.iter().fold(0.0, |max, &m| f64::from(m).max(max)),
            mean: sum / (self.magnitudes.len() as f64).max(1.0),
            boxes,
            more_boxes: more,
        }
    }
}

/// Compares the values of two pictures, channel by channel.
///
/// # Errors
/// The pictures differ in size, channels or encoding.
pub fn compare_pictures(old: &StoredPicture, new: &StoredPicture) -> Result<DifferenceMap, Mismatch> {
    if old.encoding != new.encoding {
        return Err(Mismatch::Encoding);
    }
    if (old.width, old.height) != (new.width, new.height) {
        return Err(Mismatch::Size((old.width, old.height), (new.width, new.height)));
    }
    let mut magnitudes = vec![0f32; old.pixel_count()];
    let names = |picture: &StoredPicture| picture.channels.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
    let mut pairs = Vec::new();
    for channel in &old.channels {
        match new.channel(&channel.name) {
            Some(other) if new.channels.len() == old.channels.len() => pairs.push((&channel.values, other)),
            _ => return Err(Mismatch::Channels(names(old), names(new))),
        }
    }
    for (a, b) in pairs {
        for ((magnitude, &a), &b) in magnitudes.iter_mut().zip(a).zip(b) {
            *magnitude = magnitude.max(distance(a, b));
        }
    }
    if old.encoding == PictureEncoding::Display {
        forgive_transparent(&mut magnitudes, old, new);
    }
    Ok(DifferenceMap { width: old.width, height: old.height, magnitudes })
}

/// The absolute difference; infinite between NaN or infinity and another value.
fn distance(a: f64, b: f64) -> f32 {
    let is_same = a == b || a.is_nan() && b.is_nan();
    match (a - b).abs() {
        _ if is_same => 0.0,
        d if d.is_nan() => f32::INFINITY,
        // A difference below the precision of f32 is one all the same.
        d => (d as f32).max(f32::MIN_POSITIVE),
    }
}

/// Pixels that are fully transparent in both pictures are equal, whatever their colours.
fn forgive_transparent(magnitudes: &mut [f32], old: &StoredPicture, new: &StoredPicture) {
    let (Some(a), Some(b)) = (old.channel("A"), new.channel("A")) else { return };
    for ((magnitude, &a), &b) in magnitudes.iter_mut().zip(a).zip(b) {
        if a == 0.0 && b == 0.0 {
            *magnitude = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_import::PictureChannel;

    fn picture(encoding: PictureEncoding, channels: &[(&str, [f64; 4])]) -> StoredPicture {
        let channels = channels
            .iter()
            .map(|(name, values)| PictureChannel { name: name.to_string(), values: values.to_vec() });
        StoredPicture { width: 2, height: 2, encoding, channels: channels.collect() }
    }

    #[test]
    fn differences_are_exact_and_take_channels_by_name() {
        let linear = PictureEncoding::Linear;
        let old = picture(linear, &[("R", [0.0, 1.0, f64::NAN, 4e9]), ("Z", [1.0; 4])]);
        let same = picture(linear, &[("Z", [1.0; 4]), ("R", [-0.0, 1.0, f64::NAN, 4e9])]);
        assert_eq!(compare_pictures(&old, &same).unwrap().summary(0.0).changed, 0);
        let new = picture(linear, &[("R", [1e-300, 1.5, 0.0, 4e9 + 1.0]), ("Z", [1.0; 4])]);
        let map = compare_pictures(&old, &new).unwrap();
        assert_eq!(map.magnitudes, [f32::MIN_POSITIVE, 0.5, f32::INFINITY, 1.0]);
        let summary = map.summary(0.5);
        assert_eq!((summary.changed, summary.max), (2, f64::INFINITY));
        assert_eq!(map.summary(0.0).boxes, [PixelRect { x: 0, y: 0, width: 2, height: 2 }]);
    }

    #[test]
    fn colours_of_transparent_pixels_do_not_matter() {
        let display = PictureEncoding::Display;
        let old = picture(display, &[("R", [0.0, 0.2, 0.0, 0.0]), ("A", [0.0, 0.0, 1.0, 0.0])]);
        let new = picture(display, &[("R", [1.0, 0.3, 0.0, 0.0]), ("A", [0.0, 0.0, 1.0, 0.1])]);
        assert_eq!(compare_pictures(&old, &new).unwrap().magnitudes, [0.0, 0.0, 0.0, 0.1]);
    }

    #[test]
    fn pictures_of_other_sizes_channels_or_meanings_do_not_match() {
        let old = picture(PictureEncoding::Linear, &[("R", [0.0; 4])]);
        let other = picture(PictureEncoding::Linear, &[("R", [0.0; 4]), ("Z", [0.0; 4])]);
        assert!(matches!(compare_pictures(&old, &other), Err(Mismatch::Channels(..))));
        assert!(matches!(compare_pictures(&other, &old), Err(Mismatch::Channels(..))));
        let wide = StoredPicture { width: 4, height: 1, ..old.clone() };
        assert_eq!(compare_pictures(&old, &wide), Err(Mismatch::Size((2, 2), (4, 1))));
        let shown = StoredPicture { encoding: PictureEncoding::Display, ..old.clone() };
        assert_eq!(compare_pictures(&old, &shown), Err(Mismatch::Encoding));
    }
}
