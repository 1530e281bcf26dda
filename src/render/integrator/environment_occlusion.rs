//! The light of an environment that surfaces hide in part, from a few rays.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use glam::UVec2;

use blinn_core::geometry::Rgb;

/// Share of the solid angle that a ray stands for, over which it looks up the environment. Wider lookups have less noise, but
/// mix what is hidden with what is visible: a light box beside an edge would be hidden with the wall behind the edge.
pub(crate) const LOOKUP_SHARE: f64 = 0.1;

/// Visibility and light that a few rays of a sample found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OcclusionEstimate {
    pub pixel: UVec2,
    /// The environment's light if nothing were in the way, without noise.
    pub unoccluded: Rgb,
    /// The share of rays that escape, by colour.
    pub visibility: Rgb,
    /// The environment's light along the rays that escape: with `hidden` an estimate of `unoccluded`.
    pub visible: Rgb,
    /// The environment's light behind the surfaces that the other rays hit.
    pub hidden: Rgb,
}

/// Sums over the estimates of a pixel, in fixed point: exact, so that they do not depend on the order of estimates.
#[derive(Default)]
struct PixelSums {
    estimates: i128,
    visibility: i128,
    /// Light without occlusion, by colour.
    unoccluded: [i128; 3],
    /// Hidden light, by colour.
    hidden: [i128; 3],
}

/// Returns the environment's light that arrives, for each estimate.
///
/// In pixels where most rays escape, it is the unoccluded light minus what is hidden, and otherwise what the escaping rays
/// show: open surfaces have no noise, whatever the environment. Both have the same mean; the choice is made for pixels and
/// not for samples, whose few rays would prefer one of them when they miss a light.
pub(crate) fn arriving_light(estimates: &[OcclusionEstimate]) -> Vec<Rgb> {
    let (pixels, count) = number_pixels(estimates);
    let mut sums: Vec<PixelSums> = Vec::new();
    sums.resize_with(count, PixelSums::default);
    for (estimate, &pixel) in estimates.iter().zip(&pixels) {
        let sums = &mut sums[pixel as usize];
        sums.estimates += 1;
        sums.visibility += fixed(estimate.visibility.dot(Rgb::splat(1.0 / 3.0)));
        for c in 0..3 {
            sums.unoccluded[c] += fixed(estimate.unoccluded[c]);
            sums.hidden[c] += fixed(estimate.hidden[c]);
        }
    }
    let light = |(estimate, &pixel): (&OcclusionEstimate, &u32)| {
        let sums = &sums[pixel as usize];
        if 2 * sums.visibility < sums.estimates * fixed(1.0) {
            return estimate.visible;
        }
        // Noise may hide more than there is.
        let share = |c: usize| {
            let (all, hidden) = (sums.unoccluded[c], sums.hidden[c]);
            if hidden > all { (all as f64 / hidden as f64) as f32 } else { 1.0 }
        };
        estimate.unoccluded - estimate.hidden * Rgb::new(share(0), share(1), share(2))
    };
    estimates.iter().zip(&pixels).map(light).collect()
}

/// Numbers the pixels of estimates from 0. Returns the number of each estimate's pixel, and how many pixels there are.
fn number_pixels(estimates: &[OcclusionEstimate]) -> (Vec<u32>, usize) {
    let pixels = || estimates.iter().map(|estimate| estimate.pixel);
    let (low, high) = pixels().fold((UVec2::MAX, UVec2::ZERO), |(low, high), p| (low.min(p), high.max(p)));
    let mut numbers = Vec::with_capacity(estimates.len());
    let mut count = 0;
    let size = (high.as_u64vec2() + 1).saturating_sub(low.as_u64vec2());
    // Estimates mostly are of a tile's pixels: few pixels of the rectangle around them have none.
    if size.x.saturating_mul(size.y) <= 64 + 8 * estimates.len() as u64 {
        const NONE: u32 = u32::MAX;
        let mut table = vec![NONE; (size.x * size.y) as usize];
        for p in pixels() {
            let number = &mut table[(p.y - low.y) as usize * size.x as usize + (p.x - low.x) as usize];
            if *number == NONE {
                *number = count;
                count += 1;
            }
            numbers.push(*number);
        }
    } else {
        let mut table: HashMap<UVec2, u32, BuildHasherDefault<PixelHasher>> = HashMap::default();
        for p in pixels() {
            let number = *table.entry(p).or_insert(count);
            count = count.max(number + 1);
            numbers.push(number);
        }
    }
    (numbers, count as usize)
}

/// A hash of a pixel: the two coordinates, mixed by multiplication.
#[derive(Default)]
struct PixelHasher(u64);

impl Hasher for PixelHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u32(byte.into()));
    }

    fn write_u32(&mut self, x: u32) {
        self.0 = (self.0.rotate_left(32) ^ u64::from(x)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }
}

/// A number in fixed point. From 2³¹ on, it saturates.
#[inline(always)]
fn fixed(v: f32) -> i128 {
    const ONE: f64 = (1u64 << 32) as f64;
    i128::from((f64::from(v) * ONE) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums over the points of a pixel stay within their range, whatever an environment and its strength are.
    #[test]
    fn huge_radiance_does_not_overflow() {
        let light = Rgb::splat(3e38);
        let estimate = OcclusionEstimate {
            pixel: UVec2::ZERO,
            unoccluded: light,
            visibility: Rgb::splat(0.75),
            visible: Rgb::ZERO,
            hidden: light,
        };
        assert_eq!(arriving_light(&[estimate; 4]), [Rgb::ZERO; 4]);
    }

    /// Where most rays escape, the light has no noise; where most hit something, it is that of the rays that escape.
    #[test]
    fn the_estimate_depends_on_the_visibility_of_the_pixel() {
        let estimate = |pixel: u32, visibility: f32, radiance: f32| OcclusionEstimate {
            pixel: UVec2::splat(pixel),
            unoccluded: Rgb::ONE,
            visibility: Rgb::splat(visibility),
            visible: Rgb::splat(radiance * visibility),
            hidden: Rgb::splat(radiance * (1.0 - visibility)),
        };
        let open = [estimate(0, 1.0, 2.0), estimate(0, 1.0, 0.1), estimate(0, 0.0, 0.25)];
        let closed = [estimate(1, 0.0, 2.0), estimate(1, 1.0, 0.5)];
        let closed = [closed[0], closed[1], closed[0]];
        let light = arriving_light(&[open, closed].concat());
        let expected = [1.0, 1.0, 0.75, 0.0, 0.5, 0.0];
        assert_eq!(light, expected.map(Rgb::splat));
    }

    /// Pixels beside each other and far apart are numbered in the same way.
    #[test]
    fn pixels_are_numbered_in_the_order_in_which_they_are_met() {
        let near = [[3, 7], [4, 7], [3, 7], [3, 8], [4, 7]];
        let far = near.map(|[x, y]| [u32::MAX - 1_000_000_000 * x, u32::MAX - 1_000_000_000 * (y - 6)]);
        for pixels in [near, far] {
            let estimates = pixels.map(|[x, y]| OcclusionEstimate {
                pixel: UVec2::new(x, y),
                unoccluded: Rgb::ZERO,
                visibility: Rgb::ZERO,
                visible: Rgb::ZERO,
                hidden: Rgb::ZERO,
            });
            assert_eq!(number_pixels(&estimates), (vec![0, 1, 0, 2, 1], 3), "{pixels:?}");
        }
        assert_eq!(number_pixels(&[]), (Vec::new(), 0));
    }
}
