//! A point about to be shaded: on a surface of the scene, or on the ground below it.

use super::Coefficients;
use crate::geometry::{HitId, Rgb};

/// A point about to be shaded. Where it is, which way it faces, and what light it sends, its
/// [columns](crate::integrator::surface::points::Columns) say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// Whose eye ray met it.
    pub sample: usize,
    /// The triangle that it is on; [`HitId::NONE`] on the ground.
    pub id: HitId,
    /// True on a ground of which only shadows are seen.
    pub catches: bool,
    /// What it looks like ([`Seen::looks`](crate::integrator::shading_batch::Seen::looks)).
    pub look: u32,
}

impl Point {
    /// On triangle `id`.
    #[inline(always)]
    pub fn on(sample: usize, id: HitId, look: u32) -> Point {
        Point { sample, id, catches: false, look }
    }

    /// On the ground, which `catches` shadows alone or is seen itself.
    pub fn of_ground(sample: usize, look: u32, catches: bool) -> Point {
        Point { catches, ..Point::on(sample, HitId::NONE, look) }
    }

    /// What the eye receives from here, by alpha, and what passes of all that is behind; `k` is its look. It
    /// sends L, and would send the other, were nothing in the way of any light.
    #[inline(always)]
    pub fn layer(&self, k: &Coefficients, (light, unshadowed): (Rgb, Rgb)) -> (Rgb, Rgb) {
        if self.catches {
            return (Rgb::ZERO, Rgb::ONE - (Rgb::ONE - share(light, unshadowed)) * k.alpha);
        }
        (light * k.alpha, Rgb::splat(1.0 - k.alpha) + k.through * k.alpha)
    }
}

/// The share of light that arrives, by colour; all of it where there is none to arrive.
fn share(arrives: Rgb, all: Rgb) -> Rgb {
    let share = |arrives: f32, all: f32| if all > 0.0 { (arrives / all).clamp(0.0, 1.0) } else { 1.0 };
    Rgb::new(share(arrives.x, all.x), share(arrives.y, all.y), share(arrives.z, all.z))
}
