//! Sets of pixels as runs.

use crate::film::PixelRect;

/// A rectangle of pixels that may reach beyond the picture. Column 0 and row 0 are the picture's first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskRect {
    /// Leftmost column.
    pub x: i32,
    /// Topmost row.
    pub y: i32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl From<PixelRect> for MaskRect {
    fn from(rect: PixelRect) -> MaskRect {
        let PixelRect { x, y, width, height } = rect;
        MaskRect { x: clamp(x.into()), y: clamp(y.into()), width, height }
    }
}

impl MaskRect {
    /// The column behind the last.
    pub fn right(&self) -> i32 {
        clamp(i64::from(self.x) + i64::from(self.width))
    }

    /// The row behind the last.
    pub fn bottom(&self) -> i32 {
        clamp(i64::from(self.y) + i64::from(self.height))
    }

    /// Returns true if the pixel lies in the rectangle.
    pub fn contains(&self, x: i32, y: i32) -> bool {
        (self.x..self.right()).contains(&x) && (self.y..self.bottom()).contains(&y)
    }
}

fn clamp(v: i64) -> i32 {
    v.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

/// Successive pixels of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    x: i32,
    y: i32,
    length: u32,
}

/// A set of pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelMask {
    /// By row, then by column.
    runs: Vec<Run>,
}

impl PixelMask {
    /// Adds a pixel to the right of or below all others; adding the last one again changes nothing.
    pub fn add(&mut self, x: i32, y: i32) {
        if let Some(run) = self.runs.last_mut().filter(|run| run.y == y) {
            let end = i64::from(run.x) + i64::from(run.length);
            if i64::from(x) < end {
                return;
            }
            if i64::from(x) == end {
                run.length += 1;
                return;
            }
        }
        self.runs.push(Run { x, y, length: 1 });
    }

    /// Appends the pixels of lower rows.
    pub(super) fn extend(&mut self, below: PixelMask) {
        self.runs.extend(below.runs);
    }

    /// Number of pixels.
    pub fn area(&self) -> u64 {
        self.runs.iter().map(|run| u64::from(run.length)).sum()
    }

    /// The smallest rectangle around the pixels; `None` if there are none.
    pub fn bounds(&self) -> Option<MaskRect> {
        let right = |run: &Run| clamp(i64::from(run.x) + i64::from(run.length));
        let x = self.runs.iter().map(|run| run.x).min()?;
        let end = self.runs.iter().map(right).max()?;
        let (y, last) = (self.runs.first()?.y, self.runs.last()?.y);
        Some(MaskRect { x, y, width: end.abs_diff(x), height: last.abs_diff(y) + 1 })
    }

    /// The pixels within a rectangle, counted from its upper left corner.
    pub fn cropped(&self, rect: MaskRect) -> PixelMask {
        let crop = |run: &Run| {
            let from = run.x.max(rect.x);
            let to = clamp(i64::from(run.x) + i64::from(run.length)).min(rect.right());
            let is_inside = (rect.y..rect.bottom()).contains(&run.y) && from < to;
            is_inside.then(|| Run { x: from - rect.x, y: run.y - rect.y, length: to.abs_diff(from) })
        };
        PixelMask { runs: self.runs.iter().filter_map(crop).collect() }
    }

    /// One byte for each pixel of an image of `width` × `height` pixels, row-major: 255 in the mask, else 0.
    pub fn to_bytes(&self, width: u32, height: u32) -> Vec<u8> {
        let whole = MaskRect { x: 0, y: 0, width, height };
        let mut bytes = vec![0; width as usize * height as usize];
        for run in self.cropped(whole).runs {
            let start = run.y as usize * width as usize + run.x as usize;
            bytes[start..start + run.length as usize].fill(255);
        }
        bytes
    }

    /// Lengths of the runs outside and inside of the mask in turn, starting outside, down the columns of an image of
    /// `height` rows from left to right, for `width` columns: the run lengths of COCO.
    pub fn column_runs(&self, width: u32, height: u32) -> Vec<u64> {
        let mask = self.cropped(MaskRect { x: 0, y: 0, width, height });
        let total = u64::from(width) * u64::from(height);
        let Some(bounds) = mask.bounds() else { return vec![total] };
        let (columns, rows) = (bounds.width as usize, bounds.height as usize);
        // Column by column, within the bounds.
        let mut inside = vec![false; columns * rows];
        for run in &mask.runs {
            let first = run.x.abs_diff(bounds.x) as usize;
            let row = run.y.abs_diff(bounds.y) as usize;
            (first..first + run.length as usize).for_each(|column| inside[column * rows + row] = true);
        }
        let mut lengths = Vec::new();
        let mut position = 0;
        for (start, length) in runs_of(&inside, rows, bounds, height) {
            if start == position && !lengths.is_empty() {
                // It continues the run of the column before.
                *lengths.last_mut().unwrap_or(&mut 0) += length;
            } else {
                lengths.extend([start - position, length]);
            }
            position = start + length;
        }
        lengths.extend((position < total).then_some(total - position));
        lengths
    }
}

/// Starts and lengths of the runs of each column, counted down the columns of an image of `height` rows.
fn runs_of(inside: &[bool], rows: usize, bounds: MaskRect, height: u32) -> Vec<(u64, u64)> {
    let mut runs = Vec::new();
    for (column, pixels) in inside.chunks_exact(rows.max(1)).enumerate() {
        let top = (u64::from(bounds.x.unsigned_abs()) + column as u64) * u64::from(height)
            + u64::from(bounds.y.unsigned_abs());
        let mut row = 0;
        for run in pixels.chunk_by(|a, b| a == b) {
            if run[0] {
                runs.push((top + row, run.len() as u64));
            }
            row += run.len() as u64;
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(pixels: &[(i32, i32)]) -> PixelMask {
        let mut mask = PixelMask::default();
        pixels.iter().for_each(|&(x, y)| mask.add(x, y));
        mask
    }

    #[test]
    fn masks_have_areas_and_bounds() {
        let mask = mask(&[(-2, 1), (-1, 1), (-1, 1), (3, 1), (0, 4)]);
        assert_eq!(mask.area(), 4);
        assert_eq!(mask.bounds(), Some(MaskRect { x: -2, y: 1, width: 6, height: 4 }));
        assert_eq!(PixelMask::default().bounds(), None);
        let cropped = mask.cropped(MaskRect { x: -1, y: 1, width: 5, height: 3 });
        assert_eq!(cropped, self::mask(&[(0, 0), (4, 0)]));
        assert_eq!(cropped.to_bytes(5, 2), [255, 0, 0, 0, 255, 0, 0, 0, 0, 0]);
    }

    /// Every set of pixels of a 3 × 3 image has the run lengths of its pixels, column by column.
    #[test]
    fn column_runs_are_the_pixels_in_columns() {
        for bits in 0..512u32 {
            let is_set = |x: i32, y: i32| bits >> (3 * y + x) & 1 == 1;
            let pixels = (0..3).flat_map(|y| (0..3).map(move |x| (x, y)));
            let set: Vec<(i32, i32)> = pixels.filter(|&(x, y)| is_set(x, y)).collect();
            let runs = mask(&set).column_runs(3, 3);
            let values = [false, true].into_iter().cycle();
            let expanded: Vec<bool> =
                runs.iter().zip(values).flat_map(|(&n, v)| vec![v; n as usize]).collect();
            let expected: Vec<bool> = (0..3).flat_map(|x| (0..3).map(move |y| is_set(x, y))).collect();
            assert_eq!(expanded, expected);
            assert!(runs.iter().skip(1).all(|&n| n > 0), "{runs:?}");
        }
    }
}
