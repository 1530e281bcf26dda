//! Boxes, columns, grids, places.

use super::mesh::GeneratedMesh;

const QUADS: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

impl GeneratedMesh {
    /// Adds a box of 12 triangles between two corners.
    pub(crate) fn block(&mut self, low: [f32; 3], high: [f32; 3]) {
        let base = self.positions.len() as u32;
        for i in 0..8 {
            self.positions.push([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
        }
        for [a, b, c, d] in QUADS {
            self.triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|v| v + base)));
        }
    }

    /// Adds the inside of a box: its triangles face inward.
    pub(crate) fn room(&mut self, low: [f32; 3], high: [f32; 3]) {
        let first = self.triangles.len();
        self.block(low, high);
        self.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
    }

    /// Adds a surface of revolution around the vertical through `foot`: rings of `profile`
    /// (radius, height), `sides` around, without ends. 2·sides·(profile − 1) triangles.
    pub(crate) fn turned(&mut self, foot: [f32; 3], profile: &[(f32, f32)], sides: u32, flutes: f64) {
        let base = self.positions.len() as u32;
        for &(r, y) in profile {
            for s in 0..sides {
                let angle = std::f64::consts::TAU * f64::from(s) / f64::from(sides);
                let r = f64::from(r) * (1.0 - flutes * libm::cos(20.0 * angle).max(0.0));
                let (x, z) = ((r * libm::cos(angle)) as f32, (r * libm::sin(angle)) as f32);
                self.positions.push([foot[0] + x, foot[1] + y, foot[2] + z]);
            }
        }
        for ring in 0..profile.len() as u32 - 1 {
            for s in 0..sides {
                let (a, b) = (ring * sides + s, ring * sides + (s + 1) % sides);
                let (c, d) = (b + sides, a + sides);
                self.triangles.extend([[a, c, b], [a, d, c]].map(|t| t.map(|v| v + base)));
            }
        }
    }

    /// Adds a grid of `columns` × `rows` cells: the point at (u, v), both 0…1, is `at(u, v)`.
    pub(crate) fn grid(&mut self, columns: u32, rows: u32, at: impl Fn(f64, f64) -> [f32; 3]) {
        let base = self.positions.len() as u32;
        for j in 0..=rows {
            for i in 0..=columns {
                self.positions.push(at(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows)));
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let a = base + j * (columns + 1) + i;
                let d = a + columns + 1;
                self.triangles.extend([[a, d + 1, a + 1], [a, d, d + 1]]);
            }
        }
    }
}

/// Turned about the vertical by `angle`, `size` times as large, then moved to `to`.
pub fn placed(size: f32, angle: f32, to: [f32; 3]) -> [[f32; 3]; 4] {
    let (s, c) = (libm::sin(f64::from(angle)) as f32 * size, libm::cos(f64::from(angle)) as f32 * size);
    [[c, 0.0, -s], [0.0, size, 0.0], [s, 0.0, c], to]
}
