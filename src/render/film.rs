//! The film: where tiles become a picture.

use std::sync::Mutex;

use glam::UVec2;

use crate::geometry::Rgba;
use crate::integrator::{Aov, morton};

/// A rectangle of pixels of the picture, row 0 on top: a crop window or a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl PixelRect {
    /// Its pixels along Morton's curve: any run of them lies close together, so that rays through
    /// them can be traced together.
    pub fn pixels(self) -> impl Iterator<Item = UVec2> {
        let side = self.width.max(self.height).next_power_of_two();
        (0..side * side)
            .map(|i| UVec2::new(every_other_bit(i), every_other_bit(i >> 1)))
            .filter(move |p| p.x < self.width && p.y < self.height)
            .map(move |p| UVec2::new(self.x, self.y) + p)
    }
}

/// The even bits of a number, side by side.
fn every_other_bit(x: u32) -> u32 {
    [(1, 0x3333_3333), (2, 0x0f0f_0f0f), (4, 0x00ff_00ff), (8, 0x0000_ffff)]
        .into_iter()
        .fold(x & 0x5555_5555, |x, (shift, mask)| (x | x >> shift) & mask)
}

/// A finished tile: a colour for each of its pixels.
#[derive(Clone, Debug)]
pub struct TileBuffer {
    /// Where it goes.
    pub tile: PixelRect,
    /// Premultiplied linear RGBA, in the order of [`PixelRect::pixels`].
    pub colors: Vec<Rgba>,
}

/// Finished pixels: linear RGB premultiplied by alpha, row-major, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width · height` colours.
    pub colors: Vec<Rgba>,
}

/// A layer of pixels: [`Aov::width`] numbers for each, interleaved, row-major, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct AovLayer {
    /// What it shows.
    pub aov: Aov,
    /// Its numbers.
    pub values: Vec<f32>,
}

/// Collects tiles in any order. Every pixel belongs to one tile, so the order does not matter.
#[derive(Debug)]
pub struct Film {
    window: PixelRect,
    colors: Mutex<Vec<Rgba>>,
}

impl Film {
    /// A black film for `window`.
    pub fn new(window: PixelRect) -> Film {
        let pixels = window.width as usize * window.height as usize;
        Film { window, colors: Mutex::new(vec![Rgba::ZERO; pixels]) }
    }

    /// The tiles that cover it, of `side` by `side` pixels (4096 at most) where they fit, along Morton's
    /// curve: those that are rendered at the same time lie close together, and share what caches hold.
    pub fn tiles(&self, side: u32) -> Vec<PixelRect> {
        // Tiles are walked along a square's curve, which counts in 32 bits.
        let side = side.clamp(1, 1 << 12);
        let w = self.window;
        let starts = |from: u32, len: u32| (0..len.div_ceil(side)).map(move |i| from + i * side);
        let mut tiles = Vec::new();
        for y in starts(w.y, w.height) {
            for x in starts(w.x, w.width) {
                let width = side.min(w.x + w.width - x);
                let height = side.min(w.y + w.height - y);
                tiles.push(PixelRect { x, y, width, height });
            }
        }
        tiles.sort_by_key(|tile| morton(UVec2::new(tile.x - w.x, tile.y - w.y) / side));
        tiles
    }

    /// Takes a finished tile.
    pub fn put(&self, buffer: &TileBuffer) {
        let mut colors = self.colors.lock().unwrap_or_else(|e| e.into_inner());
        for (p, color) in buffer.tile.pixels().zip(&buffer.colors) {
            let (x, y) = ((p.x - self.window.x) as usize, (p.y - self.window.y) as usize);
            colors[y * self.window.width as usize + x] = *color;
        }
    }

    /// The picture.
    pub fn finish(self) -> Pixels {
        let colors = self.colors.into_inner().unwrap_or_else(|e| e.into_inner());
        Pixels { width: self.window.width, height: self.window.height, colors }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        let window = PixelRect { x: 3, y: 5, width: 37, height: 21 };
        for side in [1, 8, 16, 64] {
            let film = Film::new(window);
            let mut seen = std::collections::HashSet::new();
            let place = |t: &PixelRect| morton(UVec2::new(t.x - window.x, t.y - window.y) / side);
            assert!(film.tiles(side).is_sorted_by_key(place));
            for tile in film.tiles(side) {
                for p in tile.pixels() {
                    assert!(seen.insert(p));
                }
                let colors = tile.pixels().map(|p| Rgba::splat((p.x * 100 + p.y) as f32)).collect();
                film.put(&TileBuffer { tile, colors });
            }
            assert_eq!(seen.len(), 37 * 21);
            let pixels = film.finish();
            assert_eq!(pixels.colors[0].x, 305.0);
            assert_eq!(pixels.colors[37 * 21 - 1].x, (39 * 100 + 25) as f32);
        }
    }
}
