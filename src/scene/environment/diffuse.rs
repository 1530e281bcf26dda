//! The irradiance of an environment, tabulated by normal.

use glam::Vec3;

use super::Pyramid;
use blinn_core::geometry::Rgb;

/// Cells on a side of a face.
const CELLS: usize = 16;
/// Vertices on a side of a face. Those of edges belong to two faces, so that the table is continuous.
const VERTICES: usize = CELLS + 1;
/// Texels on a side of the mip level that is integrated.
const SOURCE_SIDE: usize = 64;

/// Irradiance over π at the vertices of a grid on a cube. The faces are those of +X, −X, +Y, −Y, +Z and −Z; on each, the
/// other two axes follow in the order x, y, z.
#[derive(Clone, Debug)]
pub(super) struct DiffuseTable(Vec<Rgb>);

impl DiffuseTable {
    /// Integrates the mip levels of an environment.
    pub fn new(pyramid: &Pyramid) -> DiffuseTable {
        let mut source = Vec::new();
        pyramid.for_each_texel(SOURCE_SIDE, |d, radiance, _| source.push((d.as_vec3(), radiance)));
        let irradiance = |k: usize| {
            let n = direction(k);
            let (mut sum, mut total) = (Rgb::ZERO, 0.0);
            for &(d, radiance) in &source {
                let cos = n.dot(d).max(0.0);
                sum += radiance * cos;
                total += cos;
            }
            sum / total.max(f32::MIN_POSITIVE)
        };
        DiffuseTable((0..6 * VERTICES * VERTICES).map(irradiance).collect())
    }

    /// Sums lights, each with a unit direction and its irradiance across it.
    pub fn of_lights(lights: &[(Vec3, Rgb)]) -> DiffuseTable {
        DiffuseTable((0..6 * VERTICES * VERTICES).map(|k| irradiance(lights, direction(k))).collect())
    }

    /// Returns the irradiance over π for the normal `n` of any length, linear between vertices.
    pub fn irradiance(&self, n: Vec3) -> Rgb {
        let a = n.abs();
        let (axis, others) = if a.x >= a.y && a.x >= a.z {
            (0, [n.y, n.z])
        } else if a.y >= a.z {
            (1, [n.x, n.z])
        } else {
            (2, [n.x, n.y])
        };
        let face = 2 * axis + usize::from(n[axis] < 0.0);
        let [x, y] = others.map(|v| ((v / a[axis] + 1.0) * (0.5 * CELLS as f32)).clamp(0.0, CELLS as f32));
        let (i, j) = ((x as usize).min(CELLS - 1), (y as usize).min(CELLS - 1));
        let (fx, fy) = (x - i as f32, y - j as f32);
        let row = |j: usize| {
            let at = (face * VERTICES + j) * VERTICES + i;
            self.0[at].lerp(self.0[at + 1], fx)
        };
        row(j).lerp(row(j + 1), fy)
    }
}

/// The irradiance over π for the unit normal `n` of lights, each with a unit direction and its irradiance across it.
pub(super) fn irradiance(lights: &[(Vec3, Rgb)], n: Vec3) -> Rgb {
    let sum: Rgb = lights.iter().map(|&(l, e)| e * n.dot(l).max(0.0)).sum();
    sum * std::f32::consts::FRAC_1_PI
}

/// The unit direction of a vertex.
fn direction(k: usize) -> Vec3 {
    let (face, i, j) = (k / (VERTICES * VERTICES), k % VERTICES, k / VERTICES % VERTICES);
    let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
    let [s, t] = [i, j].map(|i| 2.0 * i as f32 / CELLS as f32 - 1.0);
    let d = match face / 2 {
        0 => Vec3::new(sign, s, t),
        1 => Vec3::new(s, sign, t),
        _ => Vec3::new(s, t, sign),
    };
    d.normalize()
}
