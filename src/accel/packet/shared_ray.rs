//! What the rays of a packet share, and how that leads them through a tree.

use glam::Vec3;

use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::bvh8::Octant;
use crate::accel::packet::group_bounds::{Cone, Windows};
use crate::accel::packet::packet_kind::{Direction, Origin};
use crate::accel::packet::{FOUR, GROUP, Packet, PacketStack, RAYS, Verdict};
use crate::accel::traverse::box_test::MIN_DIRECTION;
use crate::accel::traverse::error_bounds::Bounds;
use crate::accel::traverse::hit::{floor_power_of_two, inverse};
use crate::simd::{Lanes, Simd};

/// The lines that a packet's rays are on, in its own parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lines {
    /// From one place, in the packet's cone.
    From(Vec3),
    /// Along one direction.
    Along(Vec3),
}

/// Directions whose longest component is between these are worked with as they are.
const ORDINARY: [f32; 2] = [1.0 / 4096.0, 4096.0];

impl Packet {
    /// Takes `count` rays from `o` along what `of` is from `base`. `None` where they do not go together.
    #[inline(always)]
    pub(crate) fn take_directions<S: Simd>(
        &mut self,
        o: Vec3,
        (of, count): (&[Vec3; RAYS], usize),
        base: Vec3,
    ) -> Option<Lines> {
        self.quads = count.div_ceil(FOUR * GROUP);
        if !(o.abs().max_element() < 1e30) {
            return None;
        }
        self.size = 1.0;
        let mean = 0.5 * ((of[0] - base) + (of[RAYS - 1] - base));
        let longest = mean.abs().max_element();
        let fits = if longest > ORDINARY[0] && longest < ORDINARY[1] {
            self.fill::<S>(of, base);
            Cone::surround::<S>(self, mean)
        } else {
            let longest = of.iter().map(|v| (v - base).abs().max_element()).fold(0.0, f32::max);
            if !(longest > 1e-30 && longest < 1e30) {
                return None;
            }
            self.size = floor_power_of_two(f64::from(longest));
            let shrink = inverse(self.size) as f32;
            self.fill::<S>(&of.map(|v| (v - base) * shrink), Vec3::ZERO);
            Cone::surround::<S>(self, mean * shrink)
        };
        fits.then_some(Lines::From(o))
    }

    /// Takes `count` rays along `d` from what `of` says. `None` where they do not go together.
    #[inline(always)]
    pub(crate) fn take_origins<S: Simd>(
        &mut self,
        d: Vec3,
        (of, count): (&[Vec3; RAYS], usize),
    ) -> Option<Lines> {
        self.quads = count.div_ceil(FOUR * GROUP);
        let (zero, mut fits) = (S::F32x16::splat(0.0), S::F32x16::splat(0.0));
        let mut greatest = zero;
        for (g, of) in of.as_chunks().0.iter().enumerate().take(self.quads * FOUR) {
            for (own, x) in self.own.iter_mut().zip(S::deinterleave3(of)) {
                x.store(own.group_mut(g));
                // Times 0 what is infinite or no number is no number.
                fits = x.mul_add(zero, fits);
                greatest = x.abs().max(greatest);
            }
        }
        let longest = d.abs().max_element();
        self.greatest = greatest.reduce_max();
        if !(fits.reduce_sum() == 0.0 && self.greatest < 1e30 && longest > 1e-30 && longest < 1e30) {
            return None;
        }
        self.size = floor_power_of_two(f64::from(longest));
        Some(Lines::Along(d * inverse(self.size) as f32))
    }

    /// Takes directions, and their reciprocals.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, of: &[Vec3; RAYS], base: Vec3) {
        let least = S::F32x16::splat(MIN_DIRECTION);
        for (g, of) in of.as_chunks().0.iter().enumerate().take(self.quads * FOUR) {
            let columns = S::deinterleave3(of);
            for axis in 0..3 {
                let d = columns[axis] - S::F32x16::splat(base[axis]);
                d.store(self.own[axis].group_mut(g));
                let r = d.abs().max(least).rcp().xor_sign(d);
                r.store(self.reciprocal[axis].group_mut(g));
            }
        }
    }

    /// Leads the rays through a tree. False where they are too far apart for that, and nothing is done.
    #[inline(always)]
    pub(crate) fn lead<S: Simd, V: Verdict<S>>(
        &mut self,
        triangles: &Blas,
        lines: &Lines,
        verdict: &mut V,
        stack: &mut PacketStack,
    ) -> bool {
        let (centre, radius) = (triangles.centre, triangles.radius);
        match *lines {
            Lines::From(o) => {
                let cone = &self.cone;
                let far = o.as_dvec3().distance(centre) + radius;
                let beam = Origin {
                    o,
                    axes: cone.axes,
                    sign: cone.sign,
                    slowest: cone.slowest,
                    bounds: Bounds::new(cone.length(), far, 0.0),
                    near_end: cone.near_end(),
                };
                let (windows, octant) = (cone.windows::<S>(self), Octant::of(cone.mean));
                self.trace::<S, _, _>(triangles, &beam, (&windows, octant), verdict, stack);
            }
            Lines::Along(d) => {
                let size = triangles.max_coordinate();
                let Some(windows) = Windows::along::<S>(self, d, size, radius as f32) else { return false };
                let beam = Direction::new(d, self.reach::<S>(centre) + radius, self.greatest.max(size));
                self.trace::<S, _, _>(triangles, &beam, (&windows, Octant::of(d)), verdict, stack);
            }
        }
        true
    }
}
