//! How points look and what light they send to the eye, by the column.

use std::ops::Range;

use glam::DVec3;

use crate::geometry::Rgb;
use crate::integrator::material::coefficients::{Coefficients, Gloss};
use crate::integrator::surface::points::{
    Column, Columns3, LANES, NARROW3, TOGETHER, WIDE3, narrow, set, vector,
};

/// Of the points of a [`Group`](crate::integrator::surface::points::Group).
#[derive(Clone)]
pub(crate) struct Shading {
    /// Shading normals; 0 where there is nothing to see: it faces no light.
    pub n: Columns3<f64>,
    /// Of unit length, back to the eye; of value where some point has a highlight.
    pub v: Columns3<f64>,
    /// True where some point has a highlight.
    pub shines: bool,
    k_d: Columns3<f32>,
    /// With the exponent of highlights, as the normals that a sample sees have widened them.
    k_s: Columns3<f32>,
    pub shininess: Column<f32>,
    /// L, as far as it is summed up; the same, were nothing in the way of any light.
    light: Columns3<f32>,
    unshadowed: Columns3<f32>,
    /// What the light at hand adds to both.
    given: Columns3<f32>,
}

impl Shading {
    pub const NONE: Shading = Shading {
        n: WIDE3,
        v: WIDE3,
        shines: false,
        k_d: NARROW3,
        k_s: NARROW3,
        shininess: [0.0; LANES + TOGETHER],
        light: NARROW3,
        unshadowed: NARROW3,
        given: NARROW3,
    };

    /// Takes what is known of point `i` before any light comes: its shading normal, its look with an exponent, its
    /// light without lights.
    #[inline(always)]
    pub fn put(&mut self, i: usize, n: DVec3, (k, shininess): (&Coefficients, f32), unlit: Rgb) {
        set(&mut self.n, i, if k.alpha == 0.0 { [0.0; 3] } else { n.to_array() });
        set(&mut self.k_d, i, k.k_d.to_array());
        set(&mut self.k_s, i, k.k_s.to_array());
        self.shininess[i] = shininess;
        self.shines |= k.k_s != Rgb::ZERO;
        self.put_unlit(i, unlit);
    }

    /// The same of points from place `at` on that look alike, [`TOGETHER`] of them, of which those behind the last
    /// one are of no value; their normals are those in `n`.
    #[inline(always)]
    pub fn put_alike(
        &mut self,
        at: usize,
        n: &Columns3<f64>,
        (k, shininess): (&Coefficients, f32),
        unlit: Rgb,
    ) {
        // So that what follows stays within a column for sure.
        let at = at % LANES;
        let there = k.alpha != 0.0;
        put3(&mut self.n, at, |axis, i| if there { n[axis][i] } else { 0.0 });
        put3(&mut self.k_d, at, |axis, _| k.k_d[axis]);
        put3(&mut self.light, at, |axis, _| unlit[axis]);
        put3(&mut self.unshadowed, at, |axis, _| unlit[axis]);
        put3(&mut self.k_s, at, |axis, _| k.k_s[axis]);
        put(&mut self.shininess, at, |_| shininess);
        self.shines |= k.k_s != Rgb::ZERO;
    }

    /// Widens the highlights of points `at` some places of one material by the `roughening` of each, and those of
    /// what is behind them, which are of no value.
    #[inline(always)]
    pub fn widen(&mut self, at: Range<usize>, gloss: &Gloss, roughening: &Column<f32>) {
        if gloss.is_as_said() {
            return;
        }
        for at in at.step_by(TOGETHER) {
            // So that what follows stays within a column for sure.
            let at = at % LANES;
            let mut factor = [0.0; TOGETHER];
            for (i, factor) in factor.iter_mut().enumerate() {
                (self.shininess[at + i], *factor) = gloss.at(self.shininess[at + i], roughening[at + i]);
            }
            for k_s in &mut self.k_s {
                for (k_s, factor) in k_s[at..at + TOGETHER].iter_mut().zip(factor) {
                    *k_s *= factor;
                }
            }
        }
    }

    /// Point `i`'s light without lights.
    #[inline(always)]
    pub fn put_unlit(&mut self, i: usize, unlit: Rgb) {
        set(&mut self.light, i, unlit.to_array());
        set(&mut self.unshadowed, i, unlit.to_array());
    }

    /// Point `i`'s light without lights, where something keeps some of it away.
    pub fn put_shadowed(&mut self, i: usize, light: Rgb) {
        set(&mut self.light, i, light.to_array());
    }

    /// Shading normal of point `i`.
    #[inline(always)]
    pub fn n(&self, i: usize) -> DVec3 {
        vector(&self.n, i)
    }

    /// L of point `i`, and the same, were nothing in the way of any light.
    #[inline(always)]
    pub fn light(&self, i: usize) -> (Rgb, Rgb) {
        (narrow(&self.light, i), narrow(&self.unshadowed, i))
    }

    /// Takes what a light gives where nothing is in its way: it `arrives`, times
    /// `k_d (n·l) + k_s (n·h)^p`; nothing where it does not reach.
    #[inline(always)]
    pub fn give(&mut self, arrives: &[[f32; LANES]; 3], cos: &[f32; LANES], lobe: &[f32; LANES]) {
        let Shading { k_d, k_s, given, .. } = self;
        for ((given, arrives), (k_d, k_s)) in given.iter_mut().zip(arrives).zip(k_d.iter().zip(k_s)) {
            for i in 0..LANES {
                let reflected = arrives[i] * (k_d[i] * cos[i] + k_s[i] * lobe[i]);
                // Where it does not reach, the cosines may be no numbers.
                given[i] = if arrives[i] == 0.0 { 0.0 } else { reflected };
            }
        }
    }

    /// Of what the light at hand gives, only that share comes to point `i`.
    #[inline(always)]
    pub fn withhold(&mut self, i: usize, free: Rgb) {
        let given = narrow(&self.given, i);
        set(&mut self.given, i, (free * given).to_array());
    }

    /// Adds what the light at hand would give, were nothing in its way.
    #[inline(always)]
    pub fn sum_unshadowed(&mut self) {
        add(&mut self.unshadowed, &self.given);
    }

    /// Adds what the light at hand gives.
    #[inline(always)]
    pub fn sum(&mut self) {
        add(&mut self.light, &self.given);
    }
}

/// Puts what `value` says of the places from `at` on.
#[inline(always)]
fn put<T: Copy>(to: &mut Column<T>, at: usize, value: impl Fn(usize) -> T) {
    for (i, to) in to[at..at + TOGETHER].iter_mut().enumerate() {
        *to = value(at + i);
    }
}

#[inline(always)]
fn put3<T: Copy>(to: &mut Columns3<T>, at: usize, value: impl Fn(usize, usize) -> T) {
    for (axis, to) in to.iter_mut().enumerate() {
        put(to, at, |i| value(axis, i));
    }
}

#[inline(always)]
fn add(to: &mut Columns3<f32>, more: &Columns3<f32>) {
    for axis in 0..3 {
        for i in 0..LANES {
            to[axis][i] += more[axis][i];
        }
    }
}
