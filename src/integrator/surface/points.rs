//! Points by the column.
//!
//! What shading computes is the same few formulas for every point, so points are kept as columns of
//! numbers, over which the compiler runs the widest instructions there are. The formulas are sums,
//! products, quotients and roots, each rounded as IEEE 754 says: the same bits on any machine.

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::geometry::{Ray, Rgb};
use crate::integrator::material::coefficients::{Coefficients, Gloss};
use crate::integrator::surface::ray_differentials::{Spread, roughening};
use crate::integrator::surface::shading_block::Shading;

/// Points of a group.
pub(crate) const LANES: usize = 32;
/// Rays that meet one triangle together.
pub(crate) const TOGETHER: usize = 8;

/// A number of each point of a group, and room for what is written at once.
pub(crate) type Column<T> = [T; LANES + TOGETHER];
/// Of what is three numbers.
pub(crate) type Columns3<T> = [Column<T>; 3];

/// Nothing but zeros.
pub(crate) const NARROW3: Columns3<f32> = [[0.0; LANES + TOGETHER]; 3];
pub(crate) const WIDE3: Columns3<f64> = [[0.0; LANES + TOGETHER]; 3];

/// What a ray finds where it meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    pub p: Vec3,
    /// Where rays towards light start that does not graze the triangle, and the way up to the smooth surface.
    pub clear: Vec3,
    pub up: Vec3,
    pub n_g: DVec3,
    pub n_v: DVec3,
    pub b: [f32; 3],
    pub spread: Spread,
}

/// Points. What is behind the last one is of no value.
#[derive(Clone)]
pub(crate) struct Group {
    pub p: Columns3<f32>,
    /// Where rays towards light start that does not graze, and the way up to the smooth surface.
    pub clear: Columns3<f32>,
    pub up: Columns3<f32>,
    /// Of the eye rays, as long as they came.
    pub d: Columns3<f32>,
    pub b: Columns3<f32>,
    pub spread: [Column<f32>; Spread::NUMBERS],
    /// Geometric normals, vertex normals.
    pub n_g: Columns3<f64>,
    pub n_v: Columns3<f64>,
    pub shading: Shading,
}

impl Group {
    const NONE: Group = Group {
        p: NARROW3,
        clear: NARROW3,
        up: NARROW3,
        d: NARROW3,
        b: NARROW3,
        spread: [[0.0; LANES + TOGETHER]; Spread::NUMBERS],
        n_g: WIDE3,
        n_v: WIDE3,
        shading: Shading::NONE,
    };
}

/// What a column's three numbers are at `i`.
#[inline(always)]
pub(crate) fn vector<const N: usize>(of: &[[f64; N]; 3], i: usize) -> DVec3 {
    DVec3::new(of[0][i], of[1][i], of[2][i])
}

/// The same of narrow ones.
#[inline(always)]
pub(crate) fn narrow(of: &Columns3<f32>, i: usize) -> Vec3 {
    Vec3::new(of[0][i], of[1][i], of[2][i])
}

/// Sets them.
#[inline(always)]
pub(crate) fn set<T: Copy>(to: &mut Columns3<T>, i: usize, [x, y, z]: [T; 3]) {
    (to[0][i], to[1][i], to[2][i]) = (x, y, z);
}

/// All points of a batch, in groups that are full but for the last. It keeps its memory.
#[derive(Default)]
pub(crate) struct Columns {
    groups: Vec<Group>,
    count: usize,
}

impl Columns {
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// The groups, each with how many points it has.
    pub(crate) fn groups_mut(&mut self) -> impl Iterator<Item = (&mut Group, usize)> {
        self.groups.iter_mut().zip(counts(self.count))
    }

    /// The group of point `i`, and its place there.
    #[inline(always)]
    pub(crate) fn of(&self, i: usize) -> (&Group, usize) {
        (&self.groups[i / LANES], i % LANES)
    }

    #[inline(always)]
    pub(crate) fn of_mut(&mut self, i: usize) -> (&mut Group, usize) {
        (&mut self.groups[i / LANES], i % LANES)
    }

    /// [`Shading::light`] of point `i`.
    #[inline(always)]
    pub(crate) fn light(&self, i: usize) -> (Rgb, Rgb) {
        let (group, at) = self.of(i);
        group.shading.light(at)
    }

    /// [`Group::place`] of point `i`.
    #[inline(always)]
    pub(crate) fn place(&self, i: usize) -> ([f32; 3], Spread) {
        let (group, at) = self.of(i);
        group.place(at)
    }

    /// The groups of points, each with the places there.
    #[inline(always)]
    pub(crate) fn stretches(
        &mut self,
        Range { start, end }: Range<usize>,
    ) -> impl Iterator<Item = (&mut Group, Range<usize>)> {
        let first = start / LANES;
        let groups = self.groups[first..].iter_mut().zip((first * LANES..end).step_by(LANES));
        groups.map(move |(group, from)| (group, start.max(from) - from..LANES.min(end - from)))
    }

    /// How many more points the group of the next one can take.
    #[inline(always)]
    pub(crate) fn room(&self) -> usize {
        LANES - self.count % LANES
    }

    /// Takes so many more points, [`Columns::room`] at most, and says where they go.
    #[inline(always)]
    pub(crate) fn more(&mut self, points: usize) -> (&mut Group, usize) {
        let at = self.count;
        if at / LANES == self.groups.len() {
            self.groups.push(Group::NONE);
        }
        self.count += points;
        let (group, at) = self.of_mut(at);
        group.shading.shines &= at > 0;
        (group, at)
    }
}

/// How many points are in each group of so many points.
fn counts(points: usize) -> impl Iterator<Item = usize> {
    (0..points).step_by(LANES).map(move |first| LANES.min(points - first))
}

/// Rays that meet one triangle, by the column.
#[derive(Clone, Copy)]
pub(crate) struct Rays([[f32; TOGETHER]; 6]);

impl Rays {
    /// No rays.
    pub const NONE: Rays = Rays([[0.0; TOGETHER]; 6]);

    #[inline(always)]
    pub fn set(&mut self, i: usize, Ray { o, d }: Ray) {
        let r = &mut self.0;
        (r[0][i], r[1][i], r[2][i], r[3][i], r[4][i], r[5][i]) = (o.x, o.y, o.z, d.x, d.y, d.z);
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        let r = &self.0;
        Ray { o: Vec3::new(r[0][i], r[1][i], r[2][i]), d: Vec3::new(r[3][i], r[4][i], r[5][i]) }
    }
}

impl Group {
    /// Puts what rays have found, from place `at` on.
    #[inline(always)]
    pub fn put(&mut self, at: usize, rays: &Rays, found: &Found) {
        copy(&mut self.p, at, &found.p);
        copy(&mut self.clear, at, &found.clear);
        copy(&mut self.up, at, &found.up);
        copy(&mut self.d, at, &[rays.0[3], rays.0[4], rays.0[5]]);
        copy(&mut self.b, at, &found.b);
        copy(&mut self.spread, at, &found.spread);
        copy(&mut self.n_g, at, &found.n_g);
        copy(&mut self.n_v, at, &found.n_v);
    }

    /// Puts what one ray has found.
    #[inline(always)]
    pub fn put_one(&mut self, at: usize, d: Vec3, met: &Met) {
        set(&mut self.p, at, met.p.to_array());
        set(&mut self.clear, at, met.clear.to_array());
        set(&mut self.up, at, met.up.to_array());
        set(&mut self.d, at, d.to_array());
        set(&mut self.b, at, met.b);
        set(&mut self.n_g, at, met.n_g.to_array());
        set(&mut self.n_v, at, met.n_v.to_array());
        for (to, number) in self.spread.iter_mut().zip(met.spread.numbers()) {
            to[at] = number;
        }
    }

    /// Takes how points `at` some places look that look alike, where vertex normals are shading normals. What is
    /// behind them is overwritten.
    #[inline(always)]
    pub fn put_alike(&mut self, at: Range<usize>, look: (&Coefficients, f32), gloss: &Gloss, unlit: Rgb) {
        for at in at.clone().step_by(TOGETHER) {
            self.shading.put_alike(at, &self.n_v, look, unlit);
        }
        if !gloss.is_as_said() {
            let roughening = self.roughening();
            self.shading.widen(at, gloss, &roughening);
        }
    }

    /// What the turns of smooth surfaces add to highlights' α².
    #[inline(always)]
    pub fn roughening(&self) -> Column<f32> {
        self.spread[Spread::NUMBERS - 1].map(roughening)
    }

    /// Where on its triangle point `i` is, by barycentrics, and how much of that a sample stands for.
    #[inline(always)]
    pub fn place(&self, i: usize) -> ([f32; 3], Spread) {
        (self.b.each_ref().map(|b| b[i]), Spread::of_numbers(self.spread.each_ref().map(|s| s[i])))
    }

    /// What was found at `i`.
    #[inline(always)]
    pub fn met(&self, i: usize) -> Met {
        let (b, spread) = self.place(i);
        Met {
            p: narrow(&self.p, i),
            clear: narrow(&self.clear, i),
            up: narrow(&self.up, i),
            n_g: vector(&self.n_g, i),
            n_v: vector(&self.n_v, i),
            b,
            spread,
        }
    }

    /// Fills in the ways to the eye.
    #[inline(always)]
    pub fn look_back(&mut self) {
        for i in 0..LANES {
            let d = narrow(&self.d, i).as_dvec3();
            let v = -(d * d.length_recip());
            set(&mut self.shading.v, i, v.to_array());
        }
    }
}

#[inline(always)]
fn copy<T: Copy, const N: usize>(to: &mut [Column<T>; N], at: usize, from: &[[T; TOGETHER]; N]) {
    // So that what follows stays within a column for sure.
    let at = at % LANES;
    for k in 0..N {
        for i in 0..TOGETHER {
            to[k][at + i] = from[k][i];
        }
    }
}

/// What rays find that meet one triangle, by the column.
pub(crate) struct Found {
    p: [[f32; TOGETHER]; 3],
    clear: [[f32; TOGETHER]; 3],
    up: [[f32; TOGETHER]; 3],
    b: [[f32; TOGETHER]; 3],
    spread: [[f32; TOGETHER]; Spread::NUMBERS],
    n_g: [[f64; TOGETHER]; 3],
    n_v: [[f64; TOGETHER]; 3],
}

impl Found {
    /// Nothing.
    pub const NONE: Found = Found {
        p: [[0.0; TOGETHER]; 3],
        clear: [[0.0; TOGETHER]; 3],
        up: [[0.0; TOGETHER]; 3],
        b: [[0.0; TOGETHER]; 3],
        spread: [[0.0; TOGETHER]; Spread::NUMBERS],
        n_g: [[0.0; TOGETHER]; 3],
        n_v: [[0.0; TOGETHER]; 3],
    };

    #[inline(always)]
    pub fn set(&mut self, i: usize, met: &Met) {
        for k in 0..3 {
            self.p[k][i] = met.p[k];
            self.clear[k][i] = met.clear[k];
            self.up[k][i] = met.up[k];
            self.b[k][i] = met.b[k];
            self.n_g[k][i] = met.n_g[k];
            self.n_v[k][i] = met.n_v[k];
        }
        let s = &mut self.spread;
        [s[0][i], s[1][i], s[2][i], s[3][i], s[4][i]] = met.spread.numbers();
    }
}
