//! What a light gives many points at once, by the column.

use glam::{DVec3, Vec3};

use crate::accel::Accel;
use crate::geometry::Rgb;
use crate::integrator::Frame;
use crate::integrator::material::coefficients::lobe;
use crate::integrator::shading_batch::Seen;
use crate::integrator::surface::points::{Columns, Group, LANES, narrow, vector};
use crate::integrator::surface::shadow_terminator::start;
use crate::scene::{GroundKind, LightEval, PosedLight};
use crate::simd::AutovecKernel;

/// A number of each point of a group.
type Column<T> = [T; LANES];

/// A light at a group of points.
struct Arrival {
    l: [Column<f64>; 3],
    /// I/r², or E, by colour; 0 where the light does not reach, as it does not from behind.
    arrives: [Column<f32>; 3],
    /// n·l.
    cos: Column<f32>,
    /// The geometric normal's.
    cos_g: Column<f64>,
    /// Where shadow rays start.
    start: [Column<f32>; 3],
    /// (n·h)^p.
    lobe: Column<f32>,
}

/// A point that a light reaches where nothing is in the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    /// Which.
    pub point: usize,
    /// The way to the light, unit length.
    pub l: DVec3,
    /// Where a shadow ray starts.
    pub start: Vec3,
    /// Whether the triangle itself sees the light.
    pub above: bool,
}

/// Fills in the ways to the eye, where highlights need them.
pub(crate) fn look_back(accel: &Accel, columns: &mut Columns) {
    accel.run_autovec(LookBack(columns));
}

struct LookBack<'a>(&'a mut Columns);

impl AutovecKernel for LookBack<'_> {
    #[inline(always)]
    fn run(self) {
        for (group, _) in self.0.groups_mut() {
            if group.shading.shines {
                group.look_back();
            }
        }
    }
}

/// What `light` gives the points of `seen` on the side that is seen, if nothing is in the way; with
/// `highlights`, those too. [`Seen::reached`] says which points get some. [`sum_up`] adds it to their light,
/// once what is in the way has been looked at.
pub(crate) fn reach(frame: &Frame, seen: &mut Seen, light: &PosedLight, highlights: bool) {
    let Seen { columns, reached, .. } = seen;
    reached.clear();
    // Nobody else asks what the light would be without shadows.
    let catches = frame.ground.is_some_and(|ground| ground.kind == GroundKind::ShadowCatcher);
    frame.accel.run_autovec(Reach { columns, light, highlights, catches, reached });
}

/// Adds what a light gives the points to their light.
pub(crate) fn sum_up(accel: &Accel, columns: &mut Columns) {
    accel.run_autovec(SumUp(columns));
}

struct SumUp<'a>(&'a mut Columns);

impl AutovecKernel for SumUp<'_> {
    #[inline(always)]
    fn run(self) {
        for (group, _) in self.0.groups_mut() {
            group.shading.sum();
        }
    }
}

impl Group {
    /// What a light of that `intensity` gives, of which `sample` says the way to it from a point and its share
    /// there.
    #[inline(always)]
    fn arrive(&self, to: &mut Arrival, intensity: Rgb, sample: impl Fn(Vec3) -> (DVec3, f32)) {
        for i in 0..LANES {
            let (l, scale) = sample(narrow(&self.p, i));
            let (cos, cos_v) = (self.shading.n(i).dot(l), vector(&self.n_v, i).dot(l));
            // Nothing where the light sees one side of the surface and the eye the other.
            let facing = cos > 0.0 && cos_v > 0.0;
            // Of an infinite light too, nothing is nothing and not no number.
            let arrives = intensity * scale;
            let arrives = if facing && arrives.max_element() > 0.0 { arrives } else { Rgb::ZERO };
            to.l[0][i] = l.x;
            to.l[1][i] = l.y;
            to.l[2][i] = l.z;
            to.arrives[0][i] = arrives.x;
            to.arrives[1][i] = arrives.y;
            to.arrives[2][i] = arrives.z;
            to.cos[i] = cos as f32;
            let cos_g = vector(&self.n_g, i).dot(l);
            to.cos_g[i] = cos_g;
            let start = start(narrow(&self.clear, i), narrow(&self.up, i), cos_g);
            (to.start[0][i], to.start[1][i], to.start[2][i]) = (start.x, start.y, start.z);
        }
    }

    #[inline(always)]
    fn lobes(&self, to: &mut Arrival) {
        for i in 0..LANES {
            let (n, v) = (self.shading.n(i), vector(&self.shading.v, i));
            to.lobe[i] = lobe(n, vector(&to.l, i), v, self.shading.shininess[i]) as f32;
        }
    }
}

impl Arrival {
    /// Which of the first `count` points get some, bit by bit.
    #[inline(always)]
    fn reached(&self, count: usize) -> u32 {
        let mut bits = 0;
        for i in 0..LANES {
            let [r, g, b] = self.arrives.each_ref().map(|c| c[i] > 0.0);
            bits |= u32::from(r | g | b) << i;
        }
        bits & (u32::MAX >> (LANES - count))
    }
}

/// [`reach`].
struct Reach<'a> {
    columns: &'a mut Columns,
    light: &'a PosedLight,
    highlights: bool,
    catches: bool,
    reached: &'a mut Vec<Reached>,
}

impl AutovecKernel for Reach<'_> {
    #[inline(always)]
    fn run(self) {
        let Reach { columns, light, highlights, catches, reached } = self;
        let (none, none3) = ([0.0; LANES], [[0.0; LANES]; 3]);
        let mut to = Arrival {
            l: [[0.0; LANES]; 3],
            arrives: none3,
            cos: none,
            cos_g: [0.0; LANES],
            start: none3,
            lobe: none,
        };
        let (way, intensity) = (light.light_eval(), light.intensity);
        for (nth, (group, count)) in columns.groups_mut().enumerate() {
            match way {
                LightEval::Directional(l) => group.arrive(&mut to, intensity, |_| (l, 1.0)),
                LightEval::Local(lamp) => group.arrive(&mut to, intensity, |p| lamp.sample(p)),
                LightEval::ScaledSpot(lamp, to_round) => {
                    group.arrive(&mut to, intensity, |p| lamp.sample_in_cone_frame(p, &to_round))
                }
            }
            let mut left = to.reached(count);
            match highlights && group.shading.shines {
                true if left != 0 => group.lobes(&mut to),
                _ => to.lobe = none,
            }
            group.shading.give(&to.arrives, &to.cos, &to.lobe);
            if catches {
                group.shading.sum_unshadowed();
            }
            while left != 0 {
                let i = left.trailing_zeros() as usize % LANES;
                left &= left - 1;
                reached.push(Reached {
                    point: nth * LANES + i,
                    l: vector(&to.l, i),
                    start: Vec3::from_array(to.start.each_ref().map(|s| s[i])),
                    above: to.cos_g[i] > 0.0,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The points of a group all have one way to the light, and every other one turns away from it.
    #[test]
    fn what_a_light_does_not_reach_gets_nothing_of_it_however_strong() {
        let mut columns = Columns::default();
        let (group, _) = columns.more(LANES);
        for i in 0..LANES {
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            (group.n_v[2][i], group.shading.n[2][i]) = (side, side);
        }
        let k = crate::integrator::Coefficients {
            k_a: Rgb::ZERO,
            k_d: Rgb::ONE,
            k_s: Rgb::ZERO,
            shininess: 1.0,
            k_e: Rgb::ZERO,
            color: Rgb::ONE,
            alpha: 1.0,
            through: Rgb::ZERO,
        };
        for (intensity, reached) in [(1.0, true), (f32::INFINITY, true), (0.0, false), (-1.0, false)] {
            let light = PosedLight::sun(DVec3::NEG_Z, Rgb::splat(intensity));
            for (group, _) in columns.groups_mut() {
                for i in 0..LANES {
                    let n = group.shading.n(i);
                    group.shading.put(i, n, (&k, 1.0), Rgb::ZERO);
                }
            }
            let mut list = Vec::new();
            let (columns, points) = (&mut columns, &mut list);
            Reach { columns, light: &light, highlights: false, catches: false, reached: points }.run();
            SumUp(columns).run();
            let expected: Vec<usize> = (0..LANES).step_by(2).filter(|_| reached).collect();
            assert_eq!(list.iter().map(|to| to.point).collect::<Vec<_>>(), expected, "{intensity}");
            for i in 0..LANES {
                let given = if expected.contains(&i) { intensity } else { 0.0 };
                assert_eq!(columns.light(i).0, Rgb::splat(given), "{intensity} {i}");
            }
        }
    }
}
