//! A window at half the resolution, for light that is smooth.

use super::window::{Rect, Window};

/// The cells of 2 × 2 pixels of a window. Cells lie the same in each crop.
pub(super) struct Coarse {
    pub window: Window,
    /// Column and row of the first pixel of cell 0, 0.
    first: [isize; 2],
}

impl Coarse {
    /// Averages the pixels of each cell by their weights.
    pub fn new(fine: &Window) -> Coarse {
        let first = fine.origin.map(|o| -o.rem_euclid(2));
        let cell = |x: isize, axis: usize| (x - first[axis]).div_euclid(2);
        let (x, y) = (cell(fine.rect.x + 1, 0), cell(fine.rect.y + 1, 1));
        let rect = Rect {
            x,
            y,
            width: (cell(fine.rect.x + fine.rect.width as isize, 0) - x) as usize,
            height: (cell(fine.rect.y + fine.rect.height as isize, 1) - y) as usize,
        };
        let origin = [0, 1].map(|axis| fine.origin[axis].div_euclid(2));
        let mut window = Window::empty(rect, origin, fine.features.len());
        let mut i = 0;
        for y in y..y + rect.height as isize {
            for x in x..x + rect.width as isize {
                let p = fine.index(first[0] + 2 * x, first[1] + 2 * y);
                let pixels = [p, p + 1, p + fine.rect.width, p + fine.rect.width + 1];
                let weight = pixels.map(|p| fine.weight[p]);
                let total = (weight[0] + weight[1]) + (weight[2] + weight[3]);
                window.weight[i] = total * 0.25;
                let share = weight.map(|w| if total > 0.0 { w / total } else { 0.25 });
                let mean = |plane: &[f32], share: [f32; 4]| {
                    let [a, b, c, d] = pixels.map(|p| plane[p]);
                    (a * share[0] + b * share[1]) + (c * share[2] + d * share[3])
                };
                for c in 0..3 {
                    window.light[c][i] = mean(&fine.light[c], share);
                    window.variance[c][i] = mean(&fine.variance[c], share.map(|s| s * s));
                }
                for (to, from) in window.features.iter_mut().zip(&fine.features) {
                    to[i] = mean(from, share);
                }
                i += 1;
            }
        }
        Coarse { window, first }
    }

    /// Returns the cells that pixels of `rect` lie in.
    pub fn cells(&self, rect: Rect) -> Rect {
        let cell = |x: isize, axis: usize| (x - self.first[axis]).div_euclid(2);
        let (x, y) = (cell(rect.x, 0), cell(rect.y, 1));
        Rect {
            x,
            y,
            width: (cell(rect.x + rect.width as isize - 1, 0) - x + 1) as usize,
            height: (cell(rect.y + rect.height as isize - 1, 1) - y + 1) as usize,
        }
    }

    /// Returns column and row of the first pixel of a cell.
    pub fn first_pixel(&self, cell: [isize; 2]) -> [isize; 2] {
        [self.first[0] + 2 * cell[0], self.first[1] + 2 * cell[1]]
    }
}
