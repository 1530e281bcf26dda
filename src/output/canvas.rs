//! Lines and labels on an 8-bit picture.

use glam::DVec2;

use super::stroke_font;

/// A picture of 8-bit sRGB with straight alpha to draw on. Positions are in pixels from the upper left corner, with
/// pixel centres at ½.
#[derive(Clone, Debug)]
pub struct Canvas {
    width: u32,
    pixels: Vec<[u8; 4]>,
}

/// Size, weight and colour of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextStyle {
    /// Height of capitals in pixels.
    pub height: f64,
    /// Width of the strokes in pixels.
    pub stroke: f64,
    /// 8-bit sRGB.
    pub color: [u8; 3],
}

/// The point of a text that is placed, halfway up the capitals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The left end.
    Left,
    /// The middle.
    Middle,
    /// The right end.
    Right,
}

impl Canvas {
    /// Creates a canvas of one colour.
    pub fn new((width, height): (u32, u32), color: [u8; 4]) -> Canvas {
        Canvas { width, pixels: vec![color; width as usize * height as usize] }
    }

    /// Returns the pixels, row-major, row 0 on top.
    pub fn into_pixels(self) -> Vec<[u8; 4]> {
        self.pixels
    }

    fn height(&self) -> usize {
        self.pixels.len() / (self.width as usize).max(1)
    }

    /// Copies a picture of `width` pixels a row to the position of its upper left corner. Parts outside are left out.
    pub fn copy(&mut self, picture: &[[u8; 4]], width: u32, [left, top]: [u32; 2]) {
        let columns = self.width.saturating_sub(left).min(width) as usize;
        if columns == 0 {
            return;
        }
        let rows = self.pixels.chunks_exact_mut(self.width.max(1) as usize).skip(top as usize);
        for (row, source) in rows.zip(picture.chunks_exact(width.max(1) as usize)) {
            row[left as usize..][..columns].copy_from_slice(&source[..columns]);
        }
    }

    /// Draws a line with round ends.
    pub fn line(&mut self, from: DVec2, to: DVec2, width: f64, color: [u8; 3]) {
        self.stroke(&[from, to], width, color);
    }

    /// Draws a text, turned counter-clockwise by a right angle if `upward`. Returns its width in pixels.
    pub fn text(&mut self, text: &str, at: DVec2, anchor: Anchor, upward: bool, style: &TextStyle) -> f64 {
        let layout = stroke_font::layout(text);
        let start = match anchor {
            Anchor::Left => 0.0,
            Anchor::Middle => -0.5 * layout.width,
            Anchor::Right => -layout.width,
        };
        let place = |p: &DVec2| {
            let p = DVec2::new(p.x + start, 0.5 - p.y) * style.height;
            at + if upward { DVec2::new(p.y, -p.x) } else { p }
        };
        for stroke in &layout.strokes {
            let stroke: Vec<DVec2> = stroke.iter().map(place).collect();
            self.stroke(&stroke, style.stroke, style.color);
        }
        layout.width * style.height
    }

    /// Returns the width of a text in pixels.
    pub fn text_width(text: &str, style: &TextStyle) -> f64 {
        stroke_font::layout(text).width * style.height
    }

    /// Draws a polyline with round joints and ends, antialiased by the distance to it.
    fn stroke(&mut self, points: &[DVec2], width: f64, color: [u8; 3]) {
        let (Some(first), radius) = (points.first(), 0.5 * width) else { return };
        let (min, max) = points.iter().fold((*first, *first), |(min, max), p| (min.min(*p), max.max(*p)));
        let range = |low: f64, high: f64, end: usize| {
            let low = (low - radius - 1.0).max(0.0) as usize;
            let high = (high + radius + 1.0).max(0.0) as usize;
            low.min(end)..(high + 1).min(end)
        };
        let columns = range(min.x, max.x, self.width as usize);
        for y in range(min.y, max.y, self.height()) {
            for x in columns.clone() {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let distance = distance_to_polyline(p, points);
                let coverage = (radius + 0.5 - distance).clamp(0.0, 1.0);
                if coverage > 0.0 {
                    let pixel = &mut self.pixels[y * self.width as usize + x];
                    *pixel = blend(*pixel, color, coverage);
                }
            }
        }
    }
}

fn distance_to_polyline(p: DVec2, points: &[DVec2]) -> f64 {
    let Some(first) = points.first() else { return f64::INFINITY };
    let segments = points.windows(2).map(|ends| distance_to_segment(p, ends[0], ends[1]));
    segments.fold(p.distance(*first), f64::min)
}

fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let length_squared = along.length_squared();
    let t = if length_squared > 0.0 { ((p - a).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + along * t)
}

/// Blends an opaque colour of a coverage over a pixel with straight alpha, in encoded values.
fn blend(pixel: [u8; 4], color: [u8; 3], coverage: f64) -> [u8; 4] {
    let [rgb @ .., alpha] = pixel.map(f64::from);
    let under = alpha / 255.0 * (1.0 - coverage);
    let total = coverage + under;
    let channel = |i: usize| (f64::from(color[i]) * coverage + rgb[i] * under) / total + 0.5;
    [channel(0) as u8, channel(1) as u8, channel(2) as u8, (total * 255.0 + 0.5) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLACK: TextStyle = TextStyle { height: 12.0, stroke: 2.0, color: [0; 3] };

    fn dark_pixels(canvas: &Canvas) -> usize {
        canvas.pixels.iter().filter(|p| p[3] > 128 && p[0] < 128).count()
    }

    #[test]
    fn a_line_covers_its_area_wherever_it_lies() {
        for offset in [0.0, 0.25, 0.7] {
            let mut canvas = Canvas::new((40, 20), [255; 4]);
            canvas.line(DVec2::new(5.0, 8.0 + offset), DVec2::new(35.0, 8.0 + offset), 3.0, [0; 3]);
            let ink: f64 = canvas.pixels.iter().map(|p| 1.0 - f64::from(p[0]) / 255.0).sum();
            // The round ends add nearly the area of a disc.
            assert!((ink - 90.0 - 7.0).abs() < 2.0, "{offset}: {ink}");
        }
    }

    #[test]
    fn drawing_outside_and_on_transparent_pixels_is_possible() {
        let mut canvas = Canvas::new((8, 8), [9, 9, 9, 0]);
        canvas.text("blinn", DVec2::new(-1e9, 4.0), Anchor::Left, false, &BLACK);
        canvas.line(DVec2::new(-50.0, -50.0), DVec2::new(f64::NAN, 4.0), 1.0, [0; 3]);
        assert!(canvas.pixels.iter().all(|p| *p == [9, 9, 9, 0]));
        canvas.line(DVec2::new(-50.0, 4.0), DVec2::new(50.0, 4.0), 2.0, [1, 2, 3]);
        assert_eq!(canvas.pixels[4 * 8], [1, 2, 3, 255]);
        assert_eq!(canvas.pixels[6 * 8], [9, 9, 9, 0]);
        Canvas::new((0, 0), [0; 4]).text("x", DVec2::ZERO, Anchor::Middle, true, &BLACK);
    }

    #[test]
    fn text_turns_upward_and_hangs_at_its_anchor() {
        let ink = |anchor, upward| {
            let mut canvas = Canvas::new((80, 80), [255; 4]);
            canvas.text("HH", DVec2::splat(40.0), anchor, upward, &BLACK);
            let dark = (0..6400).filter(|&i| canvas.pixels[i][0] < 128).map(|i| [i % 80, i / 80]);
            let all: Vec<[usize; 2]> = dark.collect();
            let side = |axis: usize| {
                let values = || all.iter().map(|p| p[axis]);
                (values().min().unwrap_or(0), values().max().unwrap_or(0))
            };
            (side(0), side(1), dark_pixels(&canvas))
        };
        let (across, down, count) = ink(Anchor::Left, false);
        assert!(across.0 >= 38 && across.1 > 55 && down.0 <= 34 && down.1 >= 45, "{across:?} {down:?}");
        let (across, down, turned) = ink(Anchor::Left, true);
        assert!(down.1 <= 41 && down.0 < 25 && across.0 <= 34 && across.1 >= 45, "{across:?} {down:?}");
        assert!(count > 60 && count.abs_diff(turned) < 4, "{count} {turned}");
        let (across, ..) = ink(Anchor::Right, false);
        assert!(across.1 <= 41, "{across:?}");
    }

    #[test]
    fn pictures_are_copied_and_cut_off_at_the_edge() {
        let mut canvas = Canvas::new((3, 2), [0; 4]);
        canvas.copy(&[[1; 4], [2; 4], [3; 4], [4; 4]], 2, [2, 1]);
        assert_eq!(canvas.pixels[5], [1; 4]);
        assert_eq!(canvas.pixels[..5], [[0; 4]; 5]);
        canvas.copy(&[[1; 4]], 1, [9, 0]);
    }
}
