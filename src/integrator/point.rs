//! A point about to be shaded: on a surface of the scene, or on the ground below it.

use glam::{DVec3, Vec3};

use super::{Coefficients, Surface};
use crate::geometry::{HitId, Rgb, offset_point};
use crate::scene::PosedScene;

/// Where a point is.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place<'s> {
    /// On a triangle.
    Surface(Surface<'s>),
    /// On the ground, at this point; `catches`: only its shadows are seen.
    Ground { p: Vec3, catches: bool },
}

/// A point about to be shaded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<'s> {
    /// Whose eye ray met it.
    pub sample: usize,
    pub place: Place<'s>,
    pub k: Coefficients,
    /// Shading normal.
    pub n: DVec3,
    /// Of the eye ray that met it, as long as that came.
    pub d: Vec3,
    /// L, as far as it is summed up.
    pub radiance: Rgb,
    /// The same, were nothing in the way of any light.
    pub unshadowed: Rgb,
}

impl Place<'_> {
    /// The point, relative to the scene's centre.
    pub fn p(&self) -> Vec3 {
        match self {
            Place::Surface(s) => s.p,
            Place::Ground { p, .. } => *p,
        }
    }

    /// Geometric normal.
    pub fn n_g(&self) -> DVec3 {
        match self {
            Place::Surface(s) => s.n_g,
            Place::Ground { .. } => DVec3::Y,
        }
    }

    /// Vertex normal.
    pub fn n_v(&self) -> DVec3 {
        match self {
            Place::Surface(s) => s.n_v,
            Place::Ground { .. } => DVec3::Y,
        }
    }

    /// Where shadow rays start whose light does not graze the surface, and the triangle that cannot be in
    /// their way.
    pub fn clear(&self) -> (Vec3, HitId) {
        match self {
            Place::Surface(s) => (s.clear(), s.id),
            // A point of the ground is at its height exactly.
            Place::Ground { p, .. } => (offset_point(*p, Vec3::ZERO, Vec3::Y, Vec3::Y), HitId::NONE),
        }
    }

    /// Where a shadow ray towards `l` starts, and the triangle that cannot be in its way.
    pub fn start(&self, posed: &PosedScene, l: DVec3) -> (Vec3, HitId) {
        match self {
            Place::Surface(s) => {
                // A light that the smooth surface sees and the triangle does not is seen past the
                // triangle's edge, or not at all.
                let above = s.n_g.dot(l) > 0.0;
                (s.shadow_origin(posed, l), if above { s.id } else { HitId::NONE })
            }
            Place::Ground { .. } => self.clear(),
        }
    }
}

impl Point<'_> {
    /// What the eye receives from here, by alpha, and what passes of all that is behind.
    pub fn layer(&self) -> (Rgb, Rgb) {
        let Coefficients { alpha, through, .. } = self.k;
        match self.place {
            Place::Ground { catches: true, .. } => {
                (Rgb::ZERO, Rgb::ONE - (Rgb::ONE - self.light_share()) * alpha)
            }
            _ => (self.radiance * alpha, Rgb::splat(1.0 - alpha) + through * alpha),
        }
    }

    /// The share of the light that arrives, by colour; all of it where there is none to arrive.
    fn light_share(&self) -> Rgb {
        let share = |arrives: f32, all: f32| if all > 0.0 { (arrives / all).clamp(0.0, 1.0) } else { 1.0 };
        let (r, u) = (self.radiance, self.unshadowed);
        Rgb::new(share(r.x, u.x), share(r.y, u.y), share(r.z, u.z))
    }
}
