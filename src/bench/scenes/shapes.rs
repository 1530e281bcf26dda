//! Boxes, surfaces of revolution, grids and transforms.

use super::mesh::GeneratedMesh;

/// The faces of a box. Bits 0, 1 and 2 of a corner select the upper x, y and z.
const BOX_FACES: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

impl GeneratedMesh {
    /// Adds a box of 12 triangles between two corners.
    pub(super) fn add_box(&mut self, low: [f32; 3], high: [f32; 3]) {
        let base = self.positions.len() as u32;
        for i in 0..8 {
            self.positions.push([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
        }
        for [a, b, c, d] in BOX_FACES {
            self.triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|v| v + base)));
        }
    }

    /// Adds a box whose triangles face inward.
    pub(super) fn add_room(&mut self, low: [f32; 3], high: [f32; 3]) {
        let first = self.triangles.len();
        self.add_box(low, high);
        self.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
    }

    /// Adds a surface of revolution around the vertical axis through `foot`, without caps. `profile` lists radius and
    /// height of its rings of `sides` vertices; `flutes` is the relative depth of 20 flutes. The number of triangles is
    /// 2·sides·(rings − 1).
    pub(super) fn add_revolved(&mut self, foot: [f32; 3], profile: &[(f32, f32)], sides: u32, flutes: f64) {
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
                let a = ring * sides + s;
                let b = ring * sides + (s + 1) % sides;
                let c = b + sides;
                let d = a + sides;
                self.triangles.extend([[a, c, b], [a, d, c]].map(|t| t.map(|v| v + base)));
            }
        }
    }

    /// Adds a grid of `columns` × `rows` cells. `point(u, v)` is the position at (u, v), both in 0…1.
    pub(super) fn add_grid(&mut self, columns: u32, rows: u32, point: impl Fn(f64, f64) -> [f32; 3]) {
        let base = self.positions.len() as u32;
        for j in 0..=rows {
            for i in 0..=columns {
                self.positions.push(point(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows)));
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

/// The columns of a transform: scale by `scale`, rotate by `angle` about the vertical axis, translate by
/// `translation`.
pub fn transform(scale: f32, angle: f32, translation: [f32; 3]) -> [[f32; 3]; 4] {
    let s = libm::sin(f64::from(angle)) as f32 * scale;
    let c = libm::cos(f64::from(angle)) as f32 * scale;
    [[c, 0.0, -s], [0.0, scale, 0.0], [s, 0.0, c], translation]
}
