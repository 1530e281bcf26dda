//! A point about to be shaded: on a surface of the scene, or on the ground below it.

use super::Coefficients;
use crate::geometry::{HitId, Rgb};

/// A point about to be shaded. Where it is, and which way it faces, its
/// [columns](super::columns::Columns) say.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Whose eye ray met it.
    pub sample: usize,
    /// The triangle that it is on; [`HitId::NONE`] on the ground.
    pub id: HitId,
    /// Which of the batch's triangles that is.
    pub facet: u32,
    /// True on a ground of which only shadows are seen.
    pub catches: bool,
    /// What it looks like ([`Seen::looks`](super::seen::Seen::looks)).
    pub look: u32,
    /// L, as far as it is summed up.
    pub radiance: Rgb,
    /// The same, were nothing in the way of any light.
    pub unshadowed: Rgb,
}

impl Point {
    /// On triangle `id`, the batch's `facet`th, with the light that needs no light in particular.
    #[inline(always)]
    pub fn on(sample: usize, (id, facet): (HitId, usize), look: u32, radiance: Rgb) -> Point {
        Point { sample, id, facet: facet as u32, catches: false, look, radiance, unshadowed: radiance }
    }

    /// On the ground, which `catches` shadows alone or is seen itself.
    pub fn of_ground(sample: usize, look: u32, radiance: Rgb, catches: bool) -> Point {
        Point { catches, ..Point::on(sample, (HitId::NONE, u32::MAX as usize), look, radiance) }
    }

    /// What the eye receives from here, by alpha, and what passes of all that is behind; `k` is its look.
    #[inline(always)]
    pub fn layer(&self, &Coefficients { alpha, through, .. }: &Coefficients) -> (Rgb, Rgb) {
        if self.catches {
            return (Rgb::ZERO, Rgb::ONE - (Rgb::ONE - self.light_share()) * alpha);
        }
        (self.radiance * alpha, Rgb::splat(1.0 - alpha) + through * alpha)
    }

    /// The share of the light that arrives, by colour; all of it where there is none to arrive.
    fn light_share(&self) -> Rgb {
        let share = |arrives: f32, all: f32| if all > 0.0 { (arrives / all).clamp(0.0, 1.0) } else { 1.0 };
        let (r, u) = (self.radiance, self.unshadowed);
        Rgb::new(share(r.x, u.x), share(r.y, u.y), share(r.z, u.z))
    }
}
