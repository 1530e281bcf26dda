//! The light of an environment that surfaces hide in part, from a few rays.

use std::collections::HashMap;

use glam::UVec2;

use crate::geometry::Rgb;

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
    let mut sums: HashMap<UVec2, PixelSums> = HashMap::new();
    for estimate in estimates {
        let sums = sums.entry(estimate.pixel).or_default();
        sums.estimates += 1;
        sums.visibility += fixed(estimate.visibility.dot(Rgb::splat(1.0 / 3.0)));
        for c in 0..3 {
            // Huge radiance saturates, in any order.
            sums.unoccluded[c] = sums.unoccluded[c].saturating_add(fixed(estimate.unoccluded[c]));
            sums.hidden[c] = sums.hidden[c].saturating_add(fixed(estimate.hidden[c]));
        }
    }
    let light = |estimate: &OcclusionEstimate| {
        let Some(sums) = sums.get(&estimate.pixel) else { return estimate.visible };
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
    estimates.iter().map(light).collect()
}

/// A number in fixed point.
fn fixed(v: f32) -> i128 {
    const ONE: f64 = (1u64 << 32) as f64;
    (f64::from(v) * ONE) as i128
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
}
