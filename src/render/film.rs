//! The film: collects rendered tiles as a picture.

use std::sync::Mutex;

use glam::UVec2;

use crate::integrator::Aov;
use blinn_core::geometry::{Rgba, decode_morton2, morton2};

/// A rectangle of pixels of the picture, row 0 on top: a crop window or a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct PixelRect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl PixelRect {
    /// Its pixels along the Morton curve: consecutive pixels are close together, so that their rays are coherent.
    #[inline]
    pub fn pixels(self) -> impl Iterator<Item = UVec2> {
        let side = self.width.max(self.height).next_power_of_two();
        (0..side * side)
            .map(decode_morton2)
            .filter(move |p| p.x < self.width && p.y < self.height)
            .map(move |p| UVec2::new(self.x, self.y) + p)
    }

    /// Its first and its last pixel.
    pub fn corners(self) -> [UVec2; 2] {
        let first = UVec2::new(self.x, self.y);
        [first, first + UVec2::new(self.width.saturating_sub(1), self.height.saturating_sub(1))]
    }
}

/// A rendered tile.
#[derive(Clone, Debug)]
pub struct TileBuffer {
    /// Its pixels.
    pub tile: PixelRect,
    /// Premultiplied linear RGBA, in the order of [`PixelRect::pixels`]. Pixels without one keep their colour on the film.
    pub colors: Vec<Rgba>,
}

/// A rendered picture: linear RGB premultiplied by alpha, row-major, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// `width · height` colours.
    pub colors: Vec<Rgba>,
}

/// A rendered layer of an AOV: [`Aov::channel_count`] numbers per pixel, interleaved, row-major, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct AovLayer {
    /// The AOV.
    pub aov: Aov,
    /// Its values.
    pub values: Vec<f32>,
}

/// Collects tiles in any order. Every pixel belongs to one tile, so the order makes no difference.
#[derive(Debug)]
pub struct Film {
    window: PixelRect,
    colors: Mutex<Vec<Rgba>>,
}

impl Film {
    /// A black film of the pixels of `window`.
    pub fn new(window: PixelRect) -> Film {
        Film::with_memory(window, Vec::new())
    }

    /// A film in the memory of an earlier picture's [`Pixels::colors`], whose colours its pixels may have until they are
    /// stored or cleared.
    pub(super) fn with_memory(window: PixelRect, mut memory: Vec<Rgba>) -> Film {
        let pixels = window.width as usize * window.height as usize;
        if memory.capacity() < pixels {
            memory = vec![Rgba::ZERO; pixels];
        } else {
            memory.resize(pixels, Rgba::ZERO);
        }
        Film { window, colors: Mutex::new(memory) }
    }

    /// Makes a tile black.
    pub(super) fn clear(&self, tile: PixelRect) {
        let mut colors = self.colors.lock().unwrap_or_else(|e| e.into_inner());
        for row in self.rows(&mut colors, tile) {
            row.fill(Rgba::ZERO);
        }
    }

    /// The pixels of a tile, row by row.
    fn rows<'a>(
        &self,
        colors: &'a mut [Rgba],
        tile: PixelRect,
    ) -> impl Iterator<Item = &'a mut [Rgba]> + use<'a> {
        let length = self.window.width as usize;
        let first = (tile.y - self.window.y) as usize * length + (tile.x - self.window.x) as usize;
        let (width, height) = (tile.width as usize, tile.height as usize);
        let rows = colors.get_mut(first..).unwrap_or_default().chunks_mut(length).take(height);
        rows.map(move |row| &mut row[..width])
    }

    /// Cuts the film into tiles of `side` by `side` pixels, at most 4096, and smaller ones at its right and lower edge. They
    /// are sorted along the Morton curve: tiles rendered at the same time are close together and share cached data.
    pub fn tiles(&self, side: u32) -> Vec<PixelRect> {
        Film::cut(self.window, side)
    }

    /// Cuts a window into the tiles of [`Film::tiles`].
    pub(super) fn cut(w: PixelRect, side: u32) -> Vec<PixelRect> {
        // The Morton codes of `PixelRect::pixels` have 32 bits.
        let side = side.clamp(1, 1 << 12);
        let starts = |from: u32, len: u32| (0..len.div_ceil(side)).map(move |i| from + i * side);
        let mut tiles = Vec::new();
        for y in starts(w.y, w.height) {
            for x in starts(w.x, w.width) {
                let width = side.min(w.x + w.width - x);
                let height = side.min(w.y + w.height - y);
                tiles.push(PixelRect { x, y, width, height });
            }
        }
        tiles.sort_by_key(|tile| morton2(UVec2::new(tile.x - w.x, tile.y - w.y) / side));
        tiles
    }

    /// Stores a rendered tile.
    pub fn store(&self, buffer: &TileBuffer) {
        /// The bits of x in a Morton code.
        const X_BITS: u32 = 0x5555_5555;
        let mut colors = self.colors.lock().unwrap_or_else(|e| e.into_inner());
        let TileBuffer { tile, colors: tile_colors } = buffer;
        let side = tile.width;
        if side == tile.height && side.is_power_of_two() && tile_colors.len() == (side * side) as usize {
            // A square holds all Morton codes, which are counted along its rows.
            for (y, row) in self.rows(&mut colors, *tile).enumerate() {
                let mut code = morton2(UVec2::new(0, y as u32)) as u32;
                for color in row {
                    *color = tile_colors[code as usize];
                    code = ((code | !X_BITS).wrapping_add(1) & X_BITS) | (code & !X_BITS);
                }
            }
            return;
        }
        for (p, color) in tile.pixels().zip(tile_colors) {
            let x = (p.x - self.window.x) as usize;
            let y = (p.y - self.window.y) as usize;
            colors[y * self.window.width as usize + x] = *color;
        }
    }

    /// The picture.
    pub fn into_pixels(self) -> Pixels {
        let colors = self.colors.into_inner().unwrap_or_else(|e| e.into_inner());
        Pixels { width: self.window.width, height: self.window.height, colors }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once_along_the_morton_curve() {
        let window = PixelRect { x: 3, y: 5, width: 37, height: 21 };
        for side in [1, 8, 16, 64] {
            let film = Film::new(window);
            let mut covered = std::collections::HashSet::new();
            let code = |t: &PixelRect| morton2(UVec2::new(t.x - window.x, t.y - window.y) / side);
            assert!(film.tiles(side).is_sorted_by_key(code));
            for tile in film.tiles(side) {
                let code = |p: UVec2| morton2(UVec2::new(p.x - tile.x, p.y - tile.y));
                assert!(tile.pixels().is_sorted_by_key(code));
                for p in tile.pixels() {
                    assert!(covered.insert(p));
                }
                let colors = tile.pixels().map(|p| Rgba::splat((p.x * 100 + p.y) as f32)).collect();
                film.store(&TileBuffer { tile, colors });
            }
            assert_eq!(covered.len(), 37 * 21);
            let pixels = film.into_pixels();
            assert_eq!(pixels.colors[0].x, 305.0);
            assert_eq!(pixels.colors[37 * 21 - 1].x, (39 * 100 + 25) as f32);
        }
    }

    #[test]
    fn cleared_films_in_used_memory_are_black() {
        let window = PixelRect { x: 1, y: 2, width: 3, height: 2 };
        for used in [0, 5, 6, 100] {
            let film = Film::with_memory(window, vec![Rgba::ONE; used]);
            film.tiles(2).into_iter().for_each(|tile| film.clear(tile));
            assert_eq!(film.into_pixels(), Pixels { width: 3, height: 2, colors: vec![Rgba::ZERO; 6] });
        }
    }
}
