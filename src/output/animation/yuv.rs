//! RGB to what video is made of: brightness for each pixel, colour for each four.

/// Planes of a picture with even sides, BT.709 in the range of television.
pub(crate) struct Planes {
    pub width: usize,
    pub height: usize,
    pub y: Vec<u8>,
    pub u: Vec<u8>,
    pub v: Vec<u8>,
}

impl Planes {
    /// Of opaque pixels. An odd side's last column or row is repeated.
    pub fn of(pixels: &[[u8; 4]], columns: usize, rows: usize) -> Planes {
        let (width, height) = (columns.next_multiple_of(2), rows.next_multiple_of(2));
        let at = |x: usize, y: usize| {
            let [r, g, b, _] = pixels[y.min(rows - 1) * columns + x.min(columns - 1)];
            [r, g, b].map(i32::from)
        };
        let mut planes = Planes {
            width,
            height,
            y: Vec::with_capacity(width * height),
            u: Vec::with_capacity(width * height / 4),
            v: Vec::with_capacity(width * height / 4),
        };
        for y in 0..height {
            planes.y.extend((0..width).map(|x| brightness(at(x, y))));
        }
        for y in (0..height).step_by(2) {
            for x in (0..width).step_by(2) {
                let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
                let sum = [0, 1, 2].map(|c| four.iter().map(|rgb| rgb[c]).sum());
                let (u, v) = colour(sum);
                planes.u.push(u);
                planes.v.push(v);
            }
        }
        planes
    }
}

/// Digits of the fixed point.
const SHIFT: i32 = 16;
/// Rec. ITU-R BT.709, 219 steps of 255: the weights of red, green and blue.
const Y: [i32; 3] = [11_966, 40_254, 4_064];
/// And 224 steps, for blue and red less brightness.
const U: [i32; 3] = [-6_596, -22_189, 28_785];
const V: [i32; 3] = [28_785, -26_145, -2_640];

fn dot(a: [i32; 3], b: [i32; 3]) -> i32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn brightness(rgb: [i32; 3]) -> u8 {
    (((dot(Y, rgb) + (1 << (SHIFT - 1))) >> SHIFT) + 16).clamp(16, 235) as u8
}

/// Of the sum of four pixels.
fn colour(sum: [i32; 3]) -> (u8, u8) {
    let one = |weights| ((dot(weights, sum) + (1 << (SHIFT + 1))) >> (SHIFT + 2)) + 128;
    (one(U).clamp(16, 240) as u8, one(V).clamp(16, 240) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rgb: [u8; 3]) -> (u8, u8, u8) {
        let rgb = rgb.map(i32::from);
        let (u, v) = colour(rgb.map(|c| 4 * c));
        (brightness(rgb), u, v)
    }

    /// The standard's own numbers of the colour bars.
    #[test]
    fn colours_are_those_of_bt_709() {
        assert_eq!(of([0, 0, 0]), (16, 128, 128));
        assert_eq!(of([255, 255, 255]), (235, 128, 128));
        assert_eq!(of([255, 0, 0]), (63, 102, 240));
        assert_eq!(of([0, 255, 0]), (173, 42, 26));
        assert_eq!(of([0, 0, 255]), (32, 240, 118));
    }

    #[test]
    fn odd_sides_repeat_their_last() {
        let planes = Planes::of(&[[255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 255]], 3, 1);
        assert_eq!((planes.width, planes.height), (4, 2));
        assert_eq!(planes.y, [235, 235, 16, 16, 235, 235, 16, 16]);
        assert_eq!(planes.u.len(), 2);
    }
}
