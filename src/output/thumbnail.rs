//! Downscaled JPEG thumbnails for reports.

use std::io;

use super::display_colors::DisplayColors;
use super::jpeg;
use super::picture::Picture;

/// The grey background behind transparent pixels.
const BACKGROUND: u32 = 0x60;
const QUALITY: u8 = 80;

/// Encodes a JPEG of at most `max_side` pixels a side, box-filtered in display values.
///
/// # Errors
/// The encoder fails.
pub fn encode_thumbnail(picture: &Picture, max_side: u32) -> io::Result<Vec<u8>> {
    let (width, height) = picture.size();
    let pixels = picture.display.to_rgba8(&picture.pixels);
    let factor = width.max(height).div_ceil(max_side.max(1)).max(1);
    let small_width = (width / factor).max(1);
    let small_height = (height / factor).max(1);
    let mean = |x: u32, y: u32| {
        let mut sum = [0u32; 3];
        let mut count = 0;
        for row in y * factor..((y + 1) * factor).min(height) {
            for column in x * factor..((x + 1) * factor).min(width) {
                let pixel = pixels[row as usize * width as usize + column as usize];
                let [rgb @ .., a] = pixel.map(u32::from);
                for (sum, c) in sum.iter_mut().zip(rgb) {
                    *sum += (c * a + BACKGROUND * (255 - a)) / 255;
                }
                count += 1;
            }
        }
        sum.map(|c| (c / count.max(1)) as u8)
    };
    let small = (0..small_height)
        .flat_map(|y| (0..small_width).map(move |x| (x, y)))
        .map(|(x, y)| mean(x, y))
        .collect();
    jpeg::encode((small_width, small_height), &DisplayColors::Rgb(small), QUALITY, None)
}
