//! Sorts samples by cell and place, so that those that are tested together lie close together: fewer lines are near them than
//! near all samples of a pixel, which lie as far apart as the filter reaches.

use glam::{DVec2, UVec2};

use super::screen_grid::ScreenGrid;
use blinn_core::geometry::morton2;

/// Places in a pixel, on each side.
const PLACES_PER_PIXEL: f64 = 4.0;

/// The samples of a batch of pixels in order.
#[derive(Default)]
pub(super) struct SampleOrder {
    /// The cell and the place in the picture, and the index of each sample.
    samples: Vec<((usize, u64), u32)>,
    positions: Vec<DVec2>,
}

impl SampleOrder {
    /// Sorts samples, of which positions in pixels are given, by the cells of the batch's pixels that they are nearest to. The
    /// lines of a cell include all that touch samples of its pixels, so also those as far from it as the filter reaches.
    pub fn sort(&mut self, grid: &ScreenGrid, pixels: &[UVec2], positions: impl Iterator<Item = DVec2>) {
        self.positions.clear();
        self.positions.extend(positions);
        let (mut first, mut last) = ([u32::MAX; 2], [0; 2]);
        for pixel in pixels {
            for (axis, x) in pixel.to_array().into_iter().enumerate() {
                (first[axis], last[axis]) = (first[axis].min(x), last[axis].max(x));
            }
        }
        let key = |position: &DVec2| {
            let [x, y] = position.to_array();
            let pixel = UVec2::new((x as u32).clamp(first[0], last[0]), (y as u32).clamp(first[1], last[1]));
            let place = UVec2::new((x * PLACES_PER_PIXEL) as u32, (y * PLACES_PER_PIXEL) as u32);
            (grid.cell(pixel), morton2(place))
        };
        self.samples.clear();
        self.samples.extend(self.positions.iter().map(key).zip(0..));
        self.samples.sort_unstable();
    }

    /// Returns the samples of each cell: keys and indices.
    pub fn cells(&self) -> impl Iterator<Item = (usize, &[((usize, u64), u32)])> {
        self.samples.chunk_by(|((a, _), _), ((b, _), _)| a == b).map(|samples| (samples[0].0.0, samples))
    }

    /// Returns the position of a sample.
    pub fn position(&self, sample: u32) -> DVec2 {
        self.positions[sample as usize]
    }
}
