//! The layered points of a block.

use crate::integrator::layers::layered_point::LayeredPoint;
use crate::integrator::surface::soa::LANES;

/// Layered points by lane. Blocks of plain materials hold none, and no memory.
#[derive(Clone, Default)]
pub(crate) struct LayeredPoints {
    /// The lanes that have one, as a bit mask.
    mask: u32,
    /// Empty, or one for each lane, of which those outside of `mask` are arbitrary.
    points: Vec<LayeredPoint>,
}

impl LayeredPoints {
    /// No points.
    pub const NONE: LayeredPoints = LayeredPoints { mask: 0, points: Vec::new() };

    /// Removes all points and keeps the memory.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.mask = 0;
    }

    /// The lanes of layered points, as a bit mask.
    #[inline(always)]
    pub fn mask(&self) -> u32 {
        self.mask
    }

    /// The lanes of layered points.
    pub fn lanes(&self) -> impl Iterator<Item = usize> + use<> {
        let mask = self.mask;
        (0..LANES).filter(move |i| mask >> i & 1 != 0)
    }

    /// The point in lane `i`; `None` for a plain one.
    #[inline]
    pub fn get(&self, i: usize) -> Option<&LayeredPoint> {
        if self.mask >> i & 1 != 0 { self.points.get(i) } else { None }
    }

    /// The point in lane `i`, to change it.
    pub fn get_mut(&mut self, i: usize) -> Option<&mut LayeredPoint> {
        if self.mask >> i & 1 != 0 { self.points.get_mut(i) } else { None }
    }

    /// Sets the point in lane `i`.
    pub fn set(&mut self, i: usize, point: LayeredPoint) {
        if self.points.is_empty() {
            self.points.resize(LANES, point);
        }
        self.points[i] = point;
        self.mask |= 1 << i;
    }
}
