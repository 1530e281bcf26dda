//! Mip levels of an environment in the equal-area octahedral map.

use std::f32::consts::PI;

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::octahedral::to_direction;
use blinn_core::geometry::Rgb;

/// Mip levels of an environment, finest first. The last one has a single texel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pyramid {
    levels: Vec<Level>,
}

/// A level with a border of one texel, which repeats the texels that adjoin on the sphere.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Level {
    /// Texels on a side, without the border.
    side: usize,
    texels: Vec<Vec4>,
}

impl Pyramid {
    /// Makes the levels from a function of the direction. The finest level has `side` texels on a side, a power of two,
    /// each the mean of `samples`² directions.
    pub fn new(side: usize, samples: usize, radiance: impl Fn(Vec3) -> Rgb + Sync) -> Pyramid {
        let step = 1.0 / (side * samples) as f64;
        let mut texels = vec![Rgb::ZERO; side * side];
        texels.par_chunks_exact_mut(side).enumerate().for_each(|(j, row)| {
            for (i, texel) in row.iter_mut().enumerate() {
                let mut sum = Rgb::ZERO;
                for k in 0..samples * samples {
                    let x = (i * samples + k % samples) as f64 + 0.5;
                    let y = (j * samples + k / samples) as f64 + 0.5;
                    sum += radiance(to_direction(x * step, y * step).as_vec3());
                }
                *texel = sum / (samples * samples) as f32;
            }
        });
        Pyramid::from_texels(&texels, side)
    }

    /// Makes the levels from the texels of the finest, which has `side` texels on a side, a power of two.
    pub fn from_texels(texels: &[Rgb], side: usize) -> Pyramid {
        let mut texels: Vec<Vec4> = texels.iter().map(|texel| texel.extend(0.0)).collect();
        let mut levels = Vec::new();
        let mut side = side;
        while side > 1 {
            let next = downsample(&texels, side);
            levels.push(Level::with_border(&texels, side));
            texels = next;
            side /= 2;
        }
        levels.push(Level::with_border(&texels, side));
        Pyramid { levels }
    }

    /// Returns the texels of the finest level as bytes.
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.levels[0].texels)
    }

    /// Returns the bytes of all levels.
    pub fn memory_size(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(&level.texels[..])).sum()
    }

    /// Returns the mean radiance.
    pub fn mean(&self) -> Rgb {
        self.levels.last().map_or(Rgb::ZERO, |level| level.texels[0].truncate())
    }

    /// Returns the solid angle of a texel of the finest level, in steradians.
    pub fn texel_solid_angle(&self) -> f32 {
        let side = self.levels[0].side as f32;
        4.0 * PI / (side * side)
    }

    /// Returns the radiance from the direction of the point `p` of the unit square ([`to_square`](super::octahedral::to_square)), linear in the position
    /// and in the level. Level 0 is the finest.
    #[inline(always)]
    pub fn radiance(&self, p: Vec2, level: f32) -> Rgb {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        let fine = level as usize;
        let t = level - fine as f32;
        let radiance = self.levels[fine].radiance(p.x, p.y);
        if t == 0.0 {
            return radiance.truncate();
        }
        radiance.lerp(self.levels[fine + 1].radiance(p.x, p.y), t).truncate()
    }

    /// [`Pyramid::radiance`] of many points and levels, in structure of arrays. Positions are computed in a vectorised loop.
    #[inline(always)]
    pub fn radiance_of_lanes<const N: usize>(&self, p: &[[f32; N]; 2], level: &[f32; N]) -> [Rgb; N] {
        let last = (self.levels.len() - 1) as f32;
        let finest = self.levels[0].side as u32;
        let mut fine = [0; N];
        let mut t = [0.0; N];
        let [mut at_fine, mut at_coarse] = [TexelPositions::<N>::ZERO; 2];
        for i in 0..N {
            let level = level[i].clamp(0.0, last);
            fine[i] = level as u32;
            t[i] = level - fine[i] as f32;
            // Each level has half as many texels on a side.
            let side = finest >> fine[i];
            let p = Vec2::new(p[0][i], p[1][i]);
            at_fine.set(i, TexelPosition::new(p, side));
            at_coarse.set(i, TexelPosition::new(p, side / 2));
        }
        let mut radiance = [Rgb::ZERO; N];
        for i in 0..N {
            let fine = fine[i] as usize;
            let mut texel = self.levels[fine].at(at_fine.get(i));
            if t[i] != 0.0 {
                texel = texel.lerp(self.levels[fine + 1].at(at_coarse.get(i)), t[i]);
            }
            radiance[i] = texel.truncate();
        }
        radiance
    }

    /// [`Pyramid::radiance`] of many points in one level, in structure of arrays.
    #[inline(always)]
    pub fn radiance_at_level<const N: usize>(&self, p: &[[f32; N]; 2], level: f32) -> [Rgb; N] {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        let fine = level as usize;
        let t = level - fine as f32;
        let mut radiance = self.levels[fine].radiance_of_lanes(p);
        if t != 0.0 {
            let coarse = self.levels[fine + 1].radiance_of_lanes(p);
            for (radiance, coarse) in radiance.iter_mut().zip(coarse) {
                *radiance = radiance.lerp(coarse, t);
            }
        }
        let mut out = [Rgb::ZERO; N];
        for (out, radiance) in out.iter_mut().zip(radiance) {
            *out = radiance.truncate();
        }
        out
    }

    /// Calls `f` with the direction, the radiance and the solid angle of each texel of the finest level that has at most
    /// `max_side` texels on a side.
    pub fn for_each_texel(&self, max_side: usize, mut f: impl FnMut(glam::DVec3, Rgb, f64)) {
        let Some(level) = self.levels.iter().find(|level| level.side <= max_side) else { return };
        let n = level.side;
        let solid_angle = 4.0 * std::f64::consts::PI / (n * n) as f64;
        for j in 0..n {
            for i in 0..n {
                let d = to_direction((i as f64 + 0.5) / n as f64, (j as f64 + 0.5) / n as f64);
                f(d, level.texels[(j + 1) * (n + 2) + i + 1].truncate(), solid_angle);
            }
        }
    }
}

/// The directions of the centres of the texels of a level.
pub(super) fn texel_directions(side: usize) -> Vec<Vec3> {
    let step = 1.0 / side as f64;
    let direction =
        |k: usize| to_direction(((k % side) as f64 + 0.5) * step, ((k / side) as f64 + 0.5) * step);
    (0..side * side).map(|k| direction(k).as_vec3()).collect()
}

/// Halves a square of texels: means of four. `side` is even.
fn downsample(texels: &[Vec4], side: usize) -> Vec<Vec4> {
    let half = side / 2;
    let mut out = vec![Vec4::ZERO; half * half];
    out.par_chunks_exact_mut(half).enumerate().for_each(|(j, row)| {
        let upper = &texels[2 * j * side..][..side];
        let lower = &texels[(2 * j + 1) * side..][..side];
        for (i, out) in row.iter_mut().enumerate() {
            *out = (upper[2 * i] + upper[2 * i + 1] + (lower[2 * i] + lower[2 * i + 1])) * 0.25;
        }
    });
    out
}

impl Level {
    /// Makes a level from its texels.
    pub fn from_texels(texels: &[Rgb], side: usize) -> Level {
        let texels: Vec<Vec4> = texels.iter().map(|texel| texel.extend(0.0)).collect();
        Level::with_border(&texels, side)
    }

    fn with_border(texels: &[Vec4], side: usize) -> Level {
        let last = side as isize - 1;
        let padded = side + 2;
        let at = |i: isize, j: isize| {
            // Beyond an edge of the square follows the same edge, reversed.
            let (i, j) = if i < 0 || i > last { (i.clamp(0, last), last - j) } else { (i, j) };
            let (i, j) = if j < 0 || j > last { (last - i, j.clamp(0, last)) } else { (i, j) };
            texels[j as usize * side + i as usize]
        };
        let texel = |k: usize| at((k % padded) as isize - 1, (k / padded) as isize - 1);
        Level { side, texels: (0..padded * padded).map(texel).collect() }
    }

    /// The radiance at a point of the unit square, linear between texels.
    #[inline(always)]
    pub fn radiance(&self, x: f32, y: f32) -> Vec4 {
        self.at(TexelPosition::new(Vec2::new(x, y), self.side as u32))
    }

    /// [`Level::radiance`] at many points, in structure of arrays.
    #[inline(always)]
    fn radiance_of_lanes<const N: usize>(&self, p: &[[f32; N]; 2]) -> [Vec4; N] {
        let mut positions = TexelPositions::<N>::ZERO;
        for i in 0..N {
            positions.set(i, TexelPosition::new(Vec2::new(p[0][i], p[1][i]), self.side as u32));
        }
        let mut radiance = [Vec4::ZERO; N];
        for (i, radiance) in radiance.iter_mut().enumerate() {
            *radiance = self.at(positions.get(i));
        }
        radiance
    }

    /// The radiance at a position in a level with as many texels on a side.
    #[inline(always)]
    pub fn at(&self, position: TexelPosition) -> Vec4 {
        let TexelPosition { first, fx, fy } = position;
        let upper = &self.texels[first as usize..][..2];
        let lower = &self.texels[first as usize + self.side + 2..][..2];
        let upper = upper[0].lerp(upper[1], fx);
        let lower = lower[0].lerp(lower[1], fx);
        upper.lerp(lower, fy)
    }
}

/// A position between four texels of a level.
#[derive(Clone, Copy, Debug)]
pub(super) struct TexelPosition {
    /// Index of the first of them.
    first: u32,
    /// Weight of the texels to the right.
    fx: f32,
    /// Weight of the lower texels.
    fy: f32,
}

impl TexelPosition {
    /// The position of the point `p` of the unit square in a level with `side` texels on a side.
    #[inline(always)]
    pub fn new(p: Vec2, side: u32) -> TexelPosition {
        // The border is the first row and the first column.
        let (x, y) = (p.x * side as f32 + 0.5, p.y * side as f32 + 0.5);
        let (i, j) = ((x as u32).min(side), (y as u32).min(side));
        TexelPosition { first: j * (side + 2) + i, fx: x - i as f32, fy: y - j as f32 }
    }
}

/// Many [`TexelPosition`]s, in structure of arrays.
#[derive(Clone, Copy)]
pub(super) struct TexelPositions<const N: usize> {
    first: [u32; N],
    fx: [f32; N],
    fy: [f32; N],
}

impl<const N: usize> TexelPositions<N> {
    /// The first texel of levels.
    pub const ZERO: TexelPositions<N> = TexelPositions { first: [0; N], fx: [0.0; N], fy: [0.0; N] };

    #[inline(always)]
    pub fn set(&mut self, i: usize, position: TexelPosition) {
        (self.first[i], self.fx[i], self.fy[i]) = (position.first, position.fx, position.fy);
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> TexelPosition {
        TexelPosition { first: self.first[i], fx: self.fx[i], fy: self.fy[i] }
    }
}
