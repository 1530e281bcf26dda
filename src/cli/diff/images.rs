//! Compares two image files.

use std::path::Path;

use anyhow::Result;
use glam::DVec3;

use super::comparison::{Comparison, PicturePair};
use crate::args::CompareArgs;
use blinn_import::{Limits, PictureEncoding, StoredPicture};
use blinn_output::compare::compare_pictures;
use blinn_scene::linear_to_srgb;

/// Compares two image files. Pictures of other sizes or channels are different.
pub fn compare(old: &Path, new: &Path, args: &CompareArgs, limits: &Limits) -> Result<Comparison> {
    let old = StoredPicture::load(old, limits)?;
    let new = StoredPicture::load(new, limits)?;
    Ok(compare_stored(&old, &new, args))
}

fn compare_stored(old: &StoredPicture, new: &StoredPicture, args: &CompareArgs) -> Comparison {
    let map = match compare_pictures(old, new) {
        Ok(map) => map,
        Err(mismatch) => return Comparison { mismatch: Some(mismatch.to_string()), ..Comparison::default() },
    };
    let pair = PicturePair {
        width: old.width,
        height: old.height,
        map,
        colors: [old, new].map(display_colors),
        shown: [old, new].map(to_rgba8),
    };
    Comparison { views: vec![pair.compare("image".into(), args)], ..Comparison::default() }
}

/// The channel that a picture without R, G and B shows.
fn color_channels(picture: &StoredPicture) -> [&[f64]; 3] {
    let first = picture.channels.first().map_or(&[][..], |channel| &channel.values);
    ["R", "G", "B"].map(|name| picture.channel(name).unwrap_or(first))
}

/// Straight colours as displayed, 0 to 1. Linear light is clipped.
fn straight_colors(picture: &StoredPicture) -> impl Iterator<Item = DVec3> {
    let channels = color_channels(picture);
    let alpha = picture.channel("A").filter(|_| picture.encoding == PictureEncoding::Linear);
    (0..picture.pixel_count()).map(move |i| {
        let color = DVec3::from(channels.map(|channel| channel.get(i).copied().unwrap_or_default()));
        match picture.encoding {
            PictureEncoding::Display => color,
            PictureEncoding::Linear => {
                let alpha = alpha.map_or(1.0, |alpha| alpha[i].clamp(0.0, 1.0));
                let light = if alpha > 0.0 { color / alpha } else { DVec3::ZERO };
                DVec3::from(light.to_array().map(|v| f64::from(linear_to_srgb(v.clamp(0.0, 1.0) as f32))))
            }
        }
    })
}

fn alphas(picture: &StoredPicture) -> impl Fn(usize) -> f64 {
    let alpha = picture.channel("A");
    move |i| alpha.and_then(|alpha| alpha.get(i)).map_or(1.0, |alpha| alpha.clamp(0.0, 1.0))
}

fn display_colors(picture: &StoredPicture) -> Vec<DVec3> {
    let alpha = alphas(picture);
    straight_colors(picture).enumerate().map(|(i, color)| color * alpha(i)).collect()
}

fn to_rgba8(picture: &StoredPicture) -> Vec<[u8; 4]> {
    let alpha = alphas(picture);
    let byte = |v: f64| (v * 255.0 + 0.5) as u8;
    let pixel = |(i, color): (usize, DVec3)| [byte(color.x), byte(color.y), byte(color.z), byte(alpha(i))];
    straight_colors(picture).enumerate().map(pixel).collect()
}
