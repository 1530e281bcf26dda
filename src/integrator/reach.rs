//! What a light gives many points at once.
//!
//! The same few formulas for every point and every light are most of what shading computes, so they
//! run over columns of numbers, which the compiler turns into the widest instructions there are. They
//! are sums, products, quotients and roots, each rounded as IEEE 754 says: the same bits on any machine.

use glam::{DVec3, Vec3};

use super::coefficients::{Coefficients, lobe};
use super::point::Point;
use super::surface::grazes;
use crate::accel::{Accel, Columnwise};
use crate::geometry::{HitId, Rgb};
use crate::scene::{Incident, PosedLight, Way};

/// Points of a group.
const LANES: usize = 32;

/// A number of each point.
type Column<T> = [T; LANES];

/// Points by the column. What is behind the last point is of no value.
#[derive(Clone)]
struct Group {
    p: [Column<f32>; 3],
    /// Shading normals, and vertex normals.
    n: [Column<f64>; 3],
    n_v: [Column<f64>; 3],
    /// Geometric normals.
    n_g: [Column<f64>; 3],
    /// Where rays towards light start that does not graze, and what cannot be in their way.
    clear: [Column<f32>; 3],
    id: Column<HitId>,
    /// Of the eye rays, and, of unit length, back to the eye.
    d: [Column<f32>; 3],
    v: [Column<f64>; 3],
    shininess: Column<f32>,
    /// Points that are there.
    count: usize,
    /// True where some point has a highlight.
    shines: bool,
}

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

/// All points of a batch.
#[derive(Default)]
pub(crate) struct Columns(Vec<Group>);

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
    /// Where a shadow ray starts, and the triangle that cannot be in its way; `None` where the light
    /// grazes the surface, and it takes a closer look ([`Place::start`](super::point::Place::start)).
    pub start: Option<(Vec3, HitId)>,
}

impl Reached {
    /// k_d (I/r²) max(0, n·l) + k_s (I/r²) max(0, n·h)^p.
    pub fn reflected(&self, k: &Coefficients) -> Rgb {
        self.incident.arriving * (k.k_d * self.cos + k.k_s * self.lobe)
    }
}

impl Columns {
    /// Takes `points` in place of all before.
    pub(super) fn set(&mut self, accel: &Accel, points: &[Point]) {
        self.0.resize(points.len().div_ceil(LANES), Group::NONE);
        for (group, points) in self.0.iter_mut().zip(points.chunks(LANES)) {
            group.count = points.len();
            group.shines = points.iter().any(|point| point.k.k_s != Rgb::ZERO);
            for (i, point) in points.iter().enumerate() {
                let place = &point.place;
                let (p, n_v, n_g) = (place.p(), place.n_v(), place.n_g());
                let (clear, id) = place.clear();
                for axis in 0..3 {
                    group.p[axis][i] = p[axis];
                    group.n[axis][i] = point.n[axis];
                    group.n_v[axis][i] = n_v[axis];
                    group.n_g[axis][i] = n_g[axis];
                    group.clear[axis][i] = clear[axis];
                    group.d[axis][i] = point.d[axis];
                }
                group.id[i] = id;
                group.shininess[i] = point.k.shininess;
            }
        }
        accel.columnwise(ToEye(&mut self.0));
    }

    /// The points that `light` reaches on the side that is seen, if nothing is in the way; with
    /// `highlights`, how those look.
    pub(super) fn reached(&self, accel: &Accel, light: &PosedLight, highlights: bool) -> Vec<Reached> {
        let mut reached = Vec::with_capacity(self.0.iter().map(|group| group.count).sum());
        accel.columnwise(Reach { groups: &self.0, light, highlights, reached: &mut reached });
        reached
    }
}

impl Group {
    const NONE: Group = Group {
        p: [[0.0; LANES]; 3],
        n: [[0.0; LANES]; 3],
        n_v: [[0.0; LANES]; 3],
        n_g: [[0.0; LANES]; 3],
        clear: [[0.0; LANES]; 3],
        id: [HitId::NONE; LANES],
        d: [[0.0; LANES]; 3],
        v: [[0.0; LANES]; 3],
        shininess: [0.0; LANES],
        count: 0,
        shines: false,
    };

    /// What a light gives, of which `towards` says the way to it from a point and its share there.
    #[inline(always)]
    fn arrive(&self, to: &mut Arrival, towards: impl Fn(Vec3) -> (DVec3, f32)) {
        for i in 0..LANES {
            let (l, scale) = towards(Vec3::new(self.p[0][i], self.p[1][i], self.p[2][i]));
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

#[inline(always)]
fn vector(of: &[Column<f64>; 3], i: usize) -> DVec3 {
    DVec3::new(of[0][i], of[1][i], of[2][i])
}

/// Fills in the ways to the eye, where highlights need them.
struct ToEye<'a>(&'a mut [Group]);

impl Columnwise for ToEye<'_> {
    #[inline(always)]
    fn run(self) {
        for group in self.0.iter_mut().filter(|group| group.shines) {
            for i in 0..LANES {
                let d = Vec3::new(group.d[0][i], group.d[1][i], group.d[2][i]).as_dvec3();
                let v = -(d * d.length_recip());
                (group.v[0][i], group.v[1][i], group.v[2][i]) = (v.x, v.y, v.z);
            }
        }
    }
}

/// [`Columns::reached`].
struct Reach<'a> {
    groups: &'a [Group],
    light: &'a PosedLight,
    highlights: bool,
    reached: &'a mut Vec<Reached>,
}

impl Columnwise for Reach<'_> {
    #[inline(always)]
    fn run(self) {
        let Reach { groups, light, highlights, reached } = self;
        let none = [0.0; LANES];
        let mut to =
            Arrival { l: [[0.0; LANES]; 3], scale: none, cos: none, cos_g: [0.0; LANES], lobe: none };
        let way = light.way();
        for (nth, group) in groups.iter().enumerate() {
            match way {
                Way::Sun(l) => group.arrive(&mut to, |_| (l, 1.0)),
                Way::Lamp(lamp) => group.arrive(&mut to, |p| lamp.towards(p)),
                Way::Stretched(lamp, to_round) => {
                    group.arrive(&mut to, |p| lamp.towards_stretched(p, &to_round))
                }
            }
            let some = to.scale[..group.count].iter().any(|&scale| scale > 0.0);
            match highlights && group.shines {
                true if some => group.lobes(&mut to),
                _ => to.lobe = none,
            }
            for i in (0..group.count).filter(|_| some) {
                let arriving = light.intensity * to.scale[i];
                if arriving.max_element() > 0.0 {
                    let clear = Vec3::new(group.clear[0][i], group.clear[1][i], group.clear[2][i]);
                    reached.push(Reached {
                        point: nth * LANES + i,
                        incident: Incident { l: vector(&to.l, i), arriving },
                        cos: to.cos[i],
                        lobe: to.lobe[i],
                        start: (!grazes(to.cos_g[i])).then_some((clear, group.id[i])),
                    });
                }
            }
        }
    }
}
