//! A comparison as one picture: a row for each view, with the pictures before and after and their difference.

use std::io;

use glam::DVec2;

use super::comparison::Comparison;
use blinn_output::{Anchor, Canvas, TextStyle, encode_png};

/// Space between pictures in pixels.
const GAP: u32 = 4;
/// Height of the line above each row, as a fraction of a picture's height.
const HEADING: f64 = 0.09;
const PAPER: [u8; 4] = [0xf4, 0xf5, 0xf7, 0xff];
const INK: [u8; 3] = [0x2b, 0x30, 0x38];

/// Encodes the pictures of all views as one PNG.
///
/// # Errors
/// The encoder fails; there is no picture.
pub fn encode(comparison: &Comparison) -> io::Result<Vec<u8>> {
    let Some(first) = comparison.views.first() else {
        let reason = comparison.mismatch.as_deref().unwrap_or("nothing was compared");
        return Err(io::Error::other(format!("there is no picture of the difference: {reason}")));
    };
    // Views of one comparison have one size.
    let (width, height) = (first.width, first.height);
    let heading = ((f64::from(height) * HEADING) as u32).clamp(14, 40);
    let row_height = heading + height + GAP;
    let size = (3 * width + 2 * GAP, row_height * comparison.views.len() as u32);
    let text_height = 0.42 * f64::from(heading);
    let style = TextStyle { height: text_height, stroke: (text_height / 7.0).max(1.0), color: INK };
    let mut canvas = Canvas::new(size, PAPER);
    for (row, view) in comparison.views.iter().enumerate() {
        let top = row as u32 * row_height;
        let summary = &view.summary;
        let facts = match summary.changed {
            0 => "equal".to_string(),
            1 => format!("1 pixel, by up to {:.3}", summary.max),
            count => format!("{count} pixels, by up to {:.3}", summary.max),
        };
        let titles = [format!("{}: before", view.name), "after".into(), facts];
        let pictures = [&view.before, &view.after, &view.difference];
        for (column, (picture, title)) in pictures.into_iter().zip(titles).enumerate() {
            let left = column as u32 * (width + GAP);
            canvas.copy(picture, width, [left, top + heading]);
            let at = DVec2::new(f64::from(left) + text_height, f64::from(top) + 0.5 * f64::from(heading));
            canvas.text(&title, at, Anchor::Left, false, &style);
        }
    }
    encode_png(size, &canvas.into_pixels())
}
