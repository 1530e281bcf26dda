//! Compares two image files.

use std::path::Path;

use anyhow::Result;
use glam::DVec3;

use super::comparison::{Comparison, PicturePair, ShownPicture};
use crate::args::CompareArgs;
use blinn_import::{Limits, PictureEncoding, StoredFrame, StoredFrames, StoredPicture};
use blinn_output::compare::compare_pictures;
use blinn_scene::linear_to_srgb;

/// Frames that differ and are shown.
const SHOWN_FRAMES: usize = 32;

/// Compares two image files. Pictures of other sizes or channels are different, and so are animations with other numbers
/// or times of frames.
pub fn compare(old: &Path, new: &Path, args: &CompareArgs, limits: &Limits) -> Result<Comparison> {
    let animations = (StoredFrames::open(old, limits)?, StoredFrames::open(new, limits)?);
    if matches!(animations, (None, None)) {
        let (old, new) = (StoredPicture::load(old, limits)?, StoredPicture::load(new, limits)?);
        return Ok(compare_stored(&old, &new, "image", args));
    }
    let frames = |animation: Option<StoredFrames>, file: &Path| match animation {
        Some(frames) => Ok(frames),
        None => StoredPicture::load(file, limits).map(StoredFrames::still),
    };
    compare_animations(frames(animations.0, old)?, frames(animations.1, new)?, args)
}

/// Compares frame by frame: those that differ are shown, else the first.
fn compare_animations(
    mut old: StoredFrames,
    mut new: StoredFrames,
    args: &CompareArgs,
) -> Result<Comparison> {
    let mut comparison = Comparison::default();
    let mut first = None;
    let mut hidden = 0;
    for number in 1u64.. {
        let (a, b) = match (old.next().transpose()?, new.next().transpose()?) {
            (Some(a), Some(b)) => (a, b),
            (None, None) => break,
            (a, b) => {
                let rest = |rest: StoredFrames, next: Option<StoredFrame>| {
                    number - 1 + u64::from(next.is_some()) + rest.count() as u64
                };
                let counts = (rest(old, a), rest(new, b));
                let text = format!("the numbers of frames differ: {} and {}", counts.0, counts.1);
                comparison.mismatch = Some(text);
                break;
            }
        };
        if a.delay != b.delay {
            let [a, b] = [a.delay, b.delay].map(|delay| delay.as_millis());
            let text = format!("the times of frames differ: frame {number} is shown for {a} and {b} ms");
            comparison.mismatch.get_or_insert(text);
        }
        let frame = compare_stored(&a.picture, &b.picture, &format!("frame {number}"), args);
        if frame.mismatch.is_some() {
            comparison.mismatch = frame.mismatch;
            comparison.apart = frame.apart;
            break;
        }
        for view in frame.views {
            match view.summary.changed {
                0 if first.is_none() => first = Some(view),
                0 => {}
                _ if comparison.views.len() < SHOWN_FRAMES => comparison.views.push(view),
                _ => hidden += 1,
            }
        }
    }
    if hidden > 0 {
        comparison.mismatch.get_or_insert(format!("{hidden} more frames differ"));
    }
    if comparison.views.is_empty() {
        comparison.views.extend(first);
    }
    Ok(comparison)
}

/// Compares two pictures that a report calls `name`.
fn compare_stored(old: &StoredPicture, new: &StoredPicture, name: &str, args: &CompareArgs) -> Comparison {
    let map = match compare_pictures(old, new) {
        Ok(map) => map,
        Err(mismatch) => {
            let apart = [old, new].map(shown).into();
            return Comparison { mismatch: Some(mismatch.to_string()), apart, ..Comparison::default() };
        }
    };
    let pair = PicturePair {
        width: old.width,
        height: old.height,
        map,
        colors: [old, new].map(display_colors),
        shown: [old, new].map(to_rgba8),
    };
    Comparison { views: vec![pair.compare(name.into(), args)], ..Comparison::default() }
}

/// The channel that a picture without R, G and B shows.
fn color_channels(picture: &StoredPicture) -> [&[f64]; 3] {
    let first = picture.channels.first().map_or(&[][..], |channel| &channel.values);
    ["R", "G", "B"].map(|name| picture.channel(name).unwrap_or(first))
}

/// Straight colours as displayed, 0 to 1. Linear light is clipped, and NaN is black.
fn straight_colors(picture: &StoredPicture) -> impl Iterator<Item = DVec3> {
    let channels = color_channels(picture);
    let alpha = picture.channel("A").filter(|_| picture.encoding == PictureEncoding::Linear);
    (0..picture.pixel_count()).map(move |i| {
        let value = |channel: &[f64]| channel.get(i).copied().filter(|v| !v.is_nan()).unwrap_or_default();
        let color = DVec3::from(channels.map(value));
        match picture.encoding {
            PictureEncoding::Display => color,
            PictureEncoding::Linear => {
                let alpha = alpha.map_or(1.0, |alpha| fraction(alpha[i]));
                let light = if alpha > 0.0 { color / alpha } else { DVec3::ZERO };
                DVec3::from(light.to_array().map(|v| f64::from(linear_to_srgb(v.clamp(0.0, 1.0) as f32))))
            }
        }
    })
}

fn alphas(picture: &StoredPicture) -> impl Fn(usize) -> f64 {
    let alpha = picture.channel("A");
    move |i| alpha.and_then(|alpha| alpha.get(i)).map_or(1.0, |alpha| fraction(*alpha))
}

/// An alpha from 0 to 1. NaN is 0.
fn fraction(alpha: f64) -> f64 {
    if alpha.is_nan() { 0.0 } else { alpha.clamp(0.0, 1.0) }
}

fn display_colors(picture: &StoredPicture) -> Vec<DVec3> {
    let alpha = alphas(picture);
    straight_colors(picture).enumerate().map(|(i, color)| color * alpha(i)).collect()
}

fn shown(picture: &StoredPicture) -> ShownPicture {
    ShownPicture { width: picture.width, height: picture.height, pixels: to_rgba8(picture) }
}

fn to_rgba8(picture: &StoredPicture) -> Vec<[u8; 4]> {
    let alpha = alphas(picture);
    let byte = |v: f64| (v * 255.0 + 0.5) as u8;
    let pixel = |(i, color): (usize, DVec3)| [byte(color.x), byte(color.y), byte(color.z), byte(alpha(i))];
    straight_colors(picture).enumerate().map(pixel).collect()
}
