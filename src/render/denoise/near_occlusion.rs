//! Near occlusion of pixels by what lies above their tangent plane: bounced light falls off in creases and below contacts,
//! where neither normal nor position tell how near the other surface is.

use blinn_core::simd::{AutovecKernel, SimdLevel};
use glam::Vec3;
use rayon::prelude::*;

use super::features::Features;

/// Pixels to each side that occlusion depends on.
pub(super) const REACH: usize = 12;

/// Radius in pixels and distance of the samples of each scale.
const SCALES: [[isize; 2]; 2] = [[REACH as isize, 2], [4, 1]];

/// Less than this sine above the tangent plane does not count: surfaces are curved.
const BIAS: f32 = 0.05;

/// Returns the occlusion of each pixel at each scale, 0–1: the mean sine over the tangent plane at which the points of its
/// neighbours lie, weighted by their distance in the picture. Those outside the picture and without a surface count as open.
pub(super) fn near_occlusion(features: &Features, simd: SimdLevel) -> Vec<Vec<f32>> {
    let (width, height) = (features.width, features.height);
    let plane = |vectors: &[Vec3], c: usize| vectors.iter().map(|v| v[c]).collect();
    let planes = Planes {
        width,
        height,
        normal: [0, 1, 2].map(|c| plane(&features.normal, c)),
        position: [0, 1, 2].map(|c| plane(&features.position, c)),
        covered: features.coverage.iter().map(|&share| f32::from(share > 0.0)).collect(),
    };
    let of_scale = |[radius, step]: [isize; 2]| {
        let neighbours = neighbours(radius, step);
        let mut out = vec![0.0; width * height];
        out.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, out)| {
            simd.run(OccludeRow { planes: &planes, neighbours: &neighbours, y, out });
        });
        out
    };
    SCALES.map(of_scale).into()
}

/// Offset and weight of the neighbours within a radius. All weights add up to 1.
fn neighbours(radius: isize, step: isize) -> Vec<(isize, isize, f32)> {
    let side = || (-radius..=radius).step_by(step as usize);
    let weight = |x: isize, y: isize| 1.0 - (x * x + y * y) as f32 / (radius * radius) as f32;
    let all = side().flat_map(|y| side().map(move |x| (x, y)));
    let near = all.filter(|&(x, y)| (x, y) != (0, 0) && weight(x, y) > 0.0);
    let mut out: Vec<(isize, isize, f32)> = near.map(|(x, y)| (x, y, weight(x, y))).collect();
    let total: f32 = out.iter().map(|neighbour| neighbour.2).sum();
    out.iter_mut().for_each(|neighbour| neighbour.2 /= total);
    out
}

/// The features of a picture as planes of numbers.
struct Planes {
    width: usize,
    height: usize,
    normal: [Vec<f32>; 3],
    position: [Vec<f32>; 3],
    /// 1 where there is a surface.
    covered: Vec<f32>,
}

/// Computes the occlusion of a row.
struct OccludeRow<'a> {
    planes: &'a Planes,
    neighbours: &'a [(isize, isize, f32)],
    y: usize,
    /// Zeros at first.
    out: &'a mut [f32],
}

impl AutovecKernel for OccludeRow<'_> {
    #[inline(always)]
    fn run(self) {
        let OccludeRow { planes, neighbours, y, out } = self;
        let Planes { width, height, normal, position, covered } = planes;
        for &(dx, dy, weight) in neighbours {
            let Some(v) = y.checked_add_signed(dy).filter(|v| v < height) else { continue };
            // Pixels from `first` on have the neighbour in the picture.
            let first = (-dx).max(0) as usize;
            let Some(count) = width.checked_sub(dx.unsigned_abs()) else { continue };
            let (p, q) = (y * width + first, v * width + (first as isize + dx) as usize);
            let [nx, ny, nz] = [0, 1, 2].map(|c| &normal[c][p..][..count]);
            let [px, py, pz] = [0, 1, 2].map(|c| &position[c][p..][..count]);
            let [qx, qy, qz] = [0, 1, 2].map(|c| &position[c][q..][..count]);
            let (is_surface, out) = (&covered[q..][..count], &mut out[first..][..count]);
            for i in 0..count {
                let [x, y, z] = [qx[i] - px[i], qy[i] - py[i], qz[i] - pz[i]];
                let sine = (nx[i] * x + ny[i] * y + nz[i] * z) / ((x * x + y * y + z * z).sqrt() + 1e-20);
                // Not a number does not occlude.
                let above = if sine > BIAS { sine - BIAS } else { 0.0 };
                let above = if above < 1.0 { above } else { 1.0 };
                out[i] += weight * is_surface[i] * above;
            }
        }
        for (out, covered) in out.iter_mut().zip(&covered[y * width..]) {
            *out *= covered;
        }
    }
}
