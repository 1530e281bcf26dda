//! What a light gives many points at once, by the column.

use glam::{DVec3, Vec3};

use super::coefficients::{Coefficients, lobe};
use super::columns::{Columns, Group, LANES, narrow, vector};
use super::facet::grazes;
use super::seen::Seen;
use crate::accel::{Accel, Columnwise};
use crate::geometry::{HitId, Rgb};
use crate::scene::{Incident, PosedLight, Way};

/// A number of each point of a group.
type Column<T> = [T; LANES];

/// A light at a group of points.
struct Arrival {
    l: [Column<f64>; 3],
    /// What the light's intensity is multiplied by; 0 where it reaches the surface from behind.
    scale: Column<f32>,
    /// n·l.
    cos: Column<f32>,
    /// The geometric normal's.
    cos_g: Column<f64>,
    /// n·h^p.
    lobe: Column<f32>,
}

/// A point that a light reaches where nothing is in the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    /// Which.
    pub point: usize,
    pub incident: Incident,
    /// n·l.
    pub cos: f32,
    /// n·h^p; 0 where no highlights were asked for.
    pub lobe: f32,
    /// What k_s is multiplied by.
    pub gloss: f32,
    /// Where a shadow ray starts, and the triangle that cannot be in its way; `None` where the light
    /// grazes the surface, and it takes a closer look ([`Seen::start`]).
    pub start: Option<(Vec3, HitId)>,
}

impl Reached {
    /// k_d (I/r²) max(0, n·l) + k_s (I/r²) max(0, n·h)^p.
    pub fn reflected(&self, k: &Coefficients) -> Rgb {
        self.incident.arriving * (k.k_d * self.cos + k.k_s * self.gloss * self.lobe)
    }
}

/// Fills in the ways to the eye, where highlights need them.
pub(super) fn look_back(accel: &Accel, columns: &mut Columns) {
    accel.columnwise(LookBack(columns));
}

struct LookBack<'a>(&'a mut Columns);

impl Columnwise for LookBack<'_> {
    #[inline(always)]
    fn run(self) {
        for (group, _) in self.0.groups_mut() {
            if group.shines {
                group.look_back();
            }
        }
    }
}

/// The points that `light` reaches on the side that is seen, if nothing is in the way; with
/// `highlights`, how those look.
pub(super) fn reached(accel: &Accel, seen: &Seen, light: &PosedLight, highlights: bool) -> Vec<Reached> {
    let mut reached = Vec::with_capacity(seen.points.len());
    accel.columnwise(Reach { seen, light, highlights, reached: &mut reached });
    reached
}

impl Group {
    /// What a light gives, of which `towards` says the way to it from a point and its share there.
    #[inline(always)]
    fn arrive(&self, to: &mut Arrival, towards: impl Fn(Vec3) -> (DVec3, f32)) {
        for i in 0..LANES {
            let (l, scale) = towards(narrow(&self.p, i));
            let (cos, cos_v) = (vector(&self.n, i).dot(l), vector(&self.n_v, i).dot(l));
            // Nothing where the light sees one side of the surface and the eye the other.
            let facing = cos > 0.0 && cos_v > 0.0;
            to.l[0][i] = l.x;
            to.l[1][i] = l.y;
            to.l[2][i] = l.z;
            to.scale[i] = if facing { scale } else { 0.0 };
            to.cos[i] = cos as f32;
            to.cos_g[i] = vector(&self.n_g, i).dot(l);
        }
    }

    #[inline(always)]
    fn lobes(&self, to: &mut Arrival) {
        for i in 0..LANES {
            let (n, v) = (vector(&self.n, i), vector(&self.v, i));
            to.lobe[i] = lobe(n, vector(&to.l, i), v, self.shininess[i]) as f32;
        }
    }
}

/// [`reached`].
struct Reach<'a> {
    seen: &'a Seen<'a>,
    light: &'a PosedLight,
    highlights: bool,
    reached: &'a mut Vec<Reached>,
}

impl Columnwise for Reach<'_> {
    #[inline(always)]
    fn run(self) {
        let Reach { seen, light, highlights, reached } = self;
        let none = [0.0; LANES];
        let mut to =
            Arrival { l: [[0.0; LANES]; 3], scale: none, cos: none, cos_g: [0.0; LANES], lobe: none };
        let way = light.way();
        for (nth, (group, count)) in seen.columns.groups().enumerate() {
            match way {
                Way::Sun(l) => group.arrive(&mut to, |_| (l, 1.0)),
                Way::Lamp(lamp) => group.arrive(&mut to, |p| lamp.towards(p)),
                Way::Stretched(lamp, to_round) => {
                    group.arrive(&mut to, |p| lamp.towards_stretched(p, &to_round))
                }
            }
            let some = to.scale[..count].iter().any(|&scale| scale > 0.0);
            match highlights && group.shines {
                true if some => group.lobes(&mut to),
                _ => to.lobe = none,
            }
            for i in (0..count).filter(|_| some) {
                let arriving = light.intensity * to.scale[i];
                if arriving.max_element() > 0.0 {
                    let (point, clear) = (nth * LANES + i, narrow(&group.clear, i));
                    reached.push(Reached {
                        point,
                        incident: Incident { l: vector(&to.l, i), arriving },
                        cos: to.cos[i],
                        lobe: to.lobe[i],
                        gloss: group.gloss[i],
                        start: (!grazes(to.cos_g[i])).then_some((clear, seen.points[point].id)),
                    });
                }
            }
        }
    }
}
