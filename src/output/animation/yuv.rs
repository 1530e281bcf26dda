//! RGB to Y′CbCr 4:2:0 for video: Rec. ITU-R BT.709 in limited range, fixed point.

/// The planes of an image with even sides.
pub(super) struct Yuv420 {
    /// Columns of the luma plane. The chroma planes have half as many.
    pub width: usize,
    /// Rows of the luma plane. The chroma planes have half as many.
    pub height: usize,
    pub y: Vec<u8>,
    pub u: Vec<u8>,
    pub v: Vec<u8>,
}

impl Yuv420 {
    /// Converts opaque pixels. The last column or row of an odd side is repeated.
    pub fn from_rgba(pixels: &[[u8; 4]], columns: usize, rows: usize) -> Yuv420 {
        let width = columns.next_multiple_of(2);
        let height = rows.next_multiple_of(2);
        let rgb = |x: usize, y: usize| {
            let [r, g, b, _] = pixels[y.min(rows - 1) * columns + x.min(columns - 1)];
            [r, g, b].map(i32::from)
        };
        let mut yuv = Yuv420 {
            width,
            height,
            y: Vec::with_capacity(width * height),
            u: Vec::with_capacity(width * height / 4),
            v: Vec::with_capacity(width * height / 4),
        };
        for y in 0..height {
            yuv.y.extend((0..width).map(|x| luma(rgb(x, y))));
        }
        for y in (0..height).step_by(2) {
            for x in (0..width).step_by(2) {
                let block = [rgb(x, y), rgb(x + 1, y), rgb(x, y + 1), rgb(x + 1, y + 1)];
                let sum = [0, 1, 2].map(|c| block.iter().map(|rgb| rgb[c]).sum());
                yuv.u.push(chroma(CB, sum));
                yuv.v.push(chroma(CR, sum));
            }
        }
        yuv
    }
}

/// Fractional bits of the weights.
const SHIFT: i32 = 16;
/// Weights of red, green and blue in luma, for 219 steps of 255.
const LUMA: [i32; 3] = [11_966, 40_254, 4_064];
/// Weights in the blue and red colour differences, for 224 steps.
const CB: [i32; 3] = [-6_596, -22_189, 28_785];
const CR: [i32; 3] = [28_785, -26_145, -2_640];

fn dot(a: [i32; 3], b: [i32; 3]) -> i32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn luma(rgb: [i32; 3]) -> u8 {
    (((dot(LUMA, rgb) + (1 << (SHIFT - 1))) >> SHIFT) + 16).clamp(16, 235) as u8
}

/// A colour difference of the mean of four pixels, given their sum.
fn chroma(weights: [i32; 3], sum: [i32; 3]) -> u8 {
    (((dot(weights, sum) + (1 << (SHIFT + 1))) >> (SHIFT + 2)) + 128).clamp(16, 240) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yuv(rgb: [u8; 3]) -> (u8, u8, u8) {
        let rgb = rgb.map(i32::from);
        let sum = rgb.map(|c| 4 * c);
        (luma(rgb), chroma(CB, sum), chroma(CR, sum))
    }

    /// The colour bars of the standard.
    #[test]
    fn colours_match_bt_709() {
        assert_eq!(yuv([0, 0, 0]), (16, 128, 128));
        assert_eq!(yuv([255, 255, 255]), (235, 128, 128));
        assert_eq!(yuv([255, 0, 0]), (63, 102, 240));
        assert_eq!(yuv([0, 255, 0]), (173, 42, 26));
        assert_eq!(yuv([0, 0, 255]), (32, 240, 118));
    }

    #[test]
    fn odd_sides_repeat_the_last_pixel() {
        let pixels = [[255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 255]];
        let planes = Yuv420::from_rgba(&pixels, 3, 1);
        assert_eq!((planes.width, planes.height), (4, 2));
        assert_eq!(planes.y, [235, 235, 16, 16, 235, 235, 16, 16]);
        assert_eq!(planes.u.len(), 2);
    }
}
