//! Where a group of lines meets triangles, exactly.

use glam::{DVec3, Vec3};

use super::super::hit::inverse;
use super::super::simd::Simd;
use super::lines::Lines;
use super::{GROUP, Packet};

/// Where the lines of a group meet triangles that they are known to go through and that surely face
/// them ([`Slack::facing`]): the t of [`FrameRay::place`], to the bit.
///
/// [`Slack::facing`]: super::super::bounds::Slack::facing
/// [`FrameRay::place`]: super::super::hit::FrameRay::place
#[derive(Clone, Debug)]
pub(super) struct Places {
    shared: Shared,
    /// By axis, what lines do not share.
    own: [[f64; GROUP]; 3],
    /// t is a quotient.
    above: [f64; GROUP],
    below: [f64; GROUP],
}

/// An origin, or a direction divided by a power of two about as long.
#[derive(Clone, Copy, Debug)]
enum Shared {
    Origin(DVec3),
    Direction(DVec3),
}

impl Places {
    /// Of group `g`.
    #[inline(always)]
    pub fn of(packet: &Packet, lines: &Lines, g: usize) -> Places {
        let shared = match *lines {
            Lines::From(o, _) => Shared::Origin(o.as_dvec3()),
            Lines::Along(d) => Shared::Direction(d.as_dvec3()),
        };
        let mut own = [[0.0; GROUP]; 3];
        for (own, from) in own.iter_mut().zip(&packet.own) {
            for (to, &x) in own.iter_mut().zip(&from.0[g]) {
                *to = f64::from(x);
            }
        }
        Places { shared, own, above: [0.0; GROUP], below: [1.0; GROUP] }
    }

    /// The lines of `mask` meet this triangle: what is its own is computed once.
    #[inline(always)]
    pub fn meet<S: Simd>(&mut self, mask: u32, v: &[Vec3; 3]) {
        let [v0, v1, v2] = [v[0].as_dvec3(), v[1].as_dvec3(), v[2].as_dvec3()];
        let n = (v1 - v0).cross(v2 - v0);
        let own = |i: usize| DVec3::new(self.own[0][i], self.own[1][i], self.own[2][i]);
        let (mut above, mut below) = ([0.0; GROUP], [0.0; GROUP]);
        match self.shared {
            Shared::Origin(o) => {
                above = [n.dot(v0 - o); GROUP];
                for (i, below) in below.iter_mut().enumerate() {
                    *below = n.dot(own(i));
                }
            }
            Shared::Direction(d) => {
                below = [n.dot(d); GROUP];
                for (i, above) in above.iter_mut().enumerate() {
                    *above = n.dot(v0 - own(i));
                }
            }
        }
        S::put(mask, &mut self.above, &above);
        S::put(mask, &mut self.below, &below);
    }

    /// Where each met the last that it met, in the parameter of directions that are `size` times as
    /// long.
    #[inline(always)]
    pub fn t(&self, size: f64) -> [f32; GROUP] {
        let unit = inverse(size);
        let mut t = [0.0; GROUP];
        for (i, t) in t.iter_mut().enumerate() {
            *t = (self.above[i] / self.below[i] * unit) as f32;
        }
        t
    }
}
