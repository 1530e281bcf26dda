//! Environments as the six faces of a cube, as EXT_lights_image_based has them.

use glam::Vec3;

use super::{Environment, EnvironmentMap, Pyramid, SkyIrradiance};
use blinn_core::geometry::Rgb;

/// Six square pictures of linear radiance, in the order +X, −X, +Y, −Y, +Z, −Z.
///
/// They are what a viewer in the middle sees: OpenGL's faces, each mirrored, as EXT_lights_image_based asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct CubeMap {
    side: usize,
    faces: [Vec<[f32; 3]>; 6],
}

impl CubeMap {
    /// Makes a cube map of faces with `side`² texels, row by row. `None` unless each face has as many, at least 1.
    pub fn new(side: u32, faces: [Vec<[f32; 3]>; 6]) -> Option<CubeMap> {
        let side = side as usize;
        let is_square = |face: &Vec<[f32; 3]>| Some(face.len()) == side.checked_mul(side);
        (side > 0 && faces.iter().all(is_square)).then_some(CubeMap { side, faces })
    }

    /// Returns the radiance from the direction `d`, linear between texels of a face.
    fn radiance(&self, d: Vec3) -> Rgb {
        let a = d.abs();
        // The face, its distance, and the directions to the right and down.
        let (face, distance, right, down) = if a.x >= a.y && a.x >= a.z {
            if d.x >= 0.0 { (0, a.x, d.z, -d.y) } else { (1, a.x, -d.z, -d.y) }
        } else if a.y >= a.z {
            if d.y >= 0.0 { (2, a.y, -d.x, d.z) } else { (3, a.y, -d.x, -d.z) }
        } else if d.z >= 0.0 {
            (4, a.z, -d.x, -d.y)
        } else {
            (5, a.z, d.x, -d.y)
        };
        let last = (self.side - 1) as f32;
        let position = |v: f32| ((v / distance + 1.0) * 0.5 * self.side as f32 - 0.5).clamp(0.0, last);
        let (x, y) = (position(right), position(down));
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.side - 1), (y0 + 1).min(self.side - 1));
        let texel = |x: usize, y: usize| Rgb::from(self.faces[face][y * self.side + x]);
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        texel(x0, y0).lerp(texel(x1, y0), fx).lerp(texel(x0, y1).lerp(texel(x1, y1), fx), fy)
    }
}

impl Environment {
    /// Makes an environment from a cube map. `None` takes the irradiance from the map as well.
    pub fn from_cube_map(cube: &CubeMap, irradiance: Option<SkyIrradiance>) -> Environment {
        // The square of the octahedral map has about 6 · side² texels.
        let side = (2 * cube.side).clamp(16, super::MAX_PYRAMID_SIDE).next_power_of_two();
        let pyramid = Pyramid::new(side, 2, |d| cube.radiance(d).map(super::panorama::valid_radiance));
        let irradiance = irradiance.unwrap_or_else(|| SkyIrradiance::from_pyramid(&pyramid));
        Environment::new(Some(EnvironmentMap::new(None, pyramid)), Rgb::ONE, irradiance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faces that show the direction of each texel as a colour, by the mapping of the specification: OpenGL's faces,
    /// mirrored left to right.
    fn directions(side: usize) -> CubeMap {
        let face = |face: usize| {
            let texel = |i: usize| {
                let (x, y) = (i % side, i / side);
                // OpenGL's s and t of the texel of the mirrored picture.
                let s = 1.0 - (2 * x + 1) as f32 / side as f32;
                let t = (2 * y + 1) as f32 / side as f32 - 1.0;
                let d = match face {
                    0 => Vec3::new(1.0, -t, -s),
                    1 => Vec3::new(-1.0, -t, s),
                    2 => Vec3::new(s, 1.0, t),
                    3 => Vec3::new(s, -1.0, -t),
                    4 => Vec3::new(s, -t, 1.0),
                    _ => Vec3::new(-s, -t, -1.0),
                };
                (d.normalize() * 0.5 + 0.5).to_array()
            };
            (0..side * side).map(texel).collect()
        };
        CubeMap::new(side as u32, std::array::from_fn(face)).unwrap()
    }

    #[test]
    fn faces_surround_the_scene() {
        let environment = Environment::from_cube_map(&directions(64), None);
        for i in 0..200 {
            let y = 1.0 - (2 * i + 1) as f32 / 200.0;
            let (sin, cos) = (i as f32 * 2.4).sin_cos();
            let d = Vec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin);
            let found = environment.radiance(d, 0.0);
            assert!(found.abs_diff_eq(d * 0.5 + 0.5, 0.02), "{d}: {found}");
        }
        let up = environment.irradiance().ambient(glam::DVec3::Y);
        // The cosine scales first-order harmonics by 2/3.
        assert!(up.abs_diff_eq(Rgb::new(0.5, 0.5 + 1.0 / 3.0, 0.5), 0.01), "{up}");
    }

    #[test]
    fn sizes_are_checked() {
        let face = || vec![[0.0; 3]; 4];
        assert!(CubeMap::new(2, std::array::from_fn(|_| face())).is_some());
        assert!(CubeMap::new(0, std::array::from_fn(|_| Vec::new())).is_none());
        assert!(CubeMap::new(3, std::array::from_fn(|_| face())).is_none());
    }
}
