//! Small pictures of pictures.

use std::io;

use super::{Picture, jpeg};

/// Behind what is transparent.
const GREY: u32 = 0x60;

/// A JPEG of the picture, at most `side` pixels wide and high: the means of its display values.
///
/// # Errors
/// What the encoder says.
pub fn encode_thumbnail(picture: &Picture, side: u32) -> io::Result<Vec<u8>> {
    let (width, height) = (picture.pixels.width, picture.pixels.height);
    let shown = picture.display.to_rgba8(&picture.pixels);
    let times = width.max(height).div_ceil(side.max(1)).max(1);
    let (w, h) = ((width / times).max(1), (height / times).max(1));
    let mean = |x: u32, y: u32| {
        let (mut sum, mut count) = ([0u32; 3], 0);
        for row in y * times..((y + 1) * times).min(height) {
            for column in x * times..((x + 1) * times).min(width) {
                let [rgb @ .., a] = shown[row as usize * width as usize + column as usize].map(u32::from);
                for (sum, c) in sum.iter_mut().zip(rgb) {
                    *sum += (c * a + GREY * (255 - a)) / 255;
                }
                count += 1;
            }
        }
        let [r, g, b] = sum.map(|c| (c / count.max(1)) as u8);
        [r, g, b, 255]
    };
    let small: Vec<[u8; 4]> =
        (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect();
    jpeg::encode((w, h), &small, 80, None)
}
