//! Sorts samples by cell and place, so that those that are tested together lie close together: fewer lines are near them than
//! near all samples of a pixel, which lie as far apart as the filter reaches.

use glam::{DVec2, UVec2};

use super::screen_grid::ScreenGrid;
use blinn_core::geometry::morton2;

/// Places in a pixel, on each side.
const PLACES_PER_PIXEL: f64 = 4.0;

/// A sample's cell, place and index in one number, which is compared at once.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key(u128);

impl Key {
    fn new(cell: usize, place: u64, index: u32) -> Key {
        Key(u128::from(cell as u32) << 96 | u128::from(place) << 32 | u128::from(index))
    }

    fn cell(self) -> usize {
        (self.0 >> 96) as usize
    }

    /// Returns the index of the sample.
    pub fn index(self) -> u32 {
        self.0 as u32
    }
}

/// The samples of a batch of pixels in order.
#[derive(Default)]
pub(super) struct SampleOrder {
    /// The cell, the place in the picture and the index of each sample.
    keys: Vec<Key>,
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
        let key = |(position, index): (&DVec2, u32)| {
            let [x, y] = position.to_array();
            let pixel = UVec2::new((x as u32).clamp(first[0], last[0]), (y as u32).clamp(first[1], last[1]));
            let place = UVec2::new((x * PLACES_PER_PIXEL) as u32, (y * PLACES_PER_PIXEL) as u32);
            Key::new(grid.cell(pixel), morton2(place), index)
        };
        self.keys.clear();
        self.keys.extend(self.positions.iter().zip(0..).map(key));
        self.keys.sort_unstable();
    }

    /// Returns the samples of each cell.
    pub fn cells(&self) -> impl Iterator<Item = (usize, &[Key])> {
        self.keys.chunk_by(|a, b| a.cell() == b.cell()).map(|keys| (keys[0].cell(), keys))
    }

    /// Returns the position of a sample.
    pub fn position(&self, sample: u32) -> DVec2 {
        self.positions[sample as usize]
    }
}
