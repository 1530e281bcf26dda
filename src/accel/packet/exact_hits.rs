//! Where the lines of a packet meet triangles, exactly.

use glam::DVec3;

use crate::accel::bvh::triangle_ids::TriangleIdMap;
use crate::accel::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::accel::packet::shared_ray::Lines;
use crate::accel::packet::{GROUP, Packet};
use crate::accel::traverse::hit::inverse;
use crate::simd::Simd;
use crate::simd::vec3::per_axis;

/// Blocks whose triangles a table holds: as many of these as lines are in a group.
pub(crate) const BLOCKS: usize = GROUP / TRIANGLE_LANES;

/// The triangles of a few blocks, for lines that are known to go through one of them and that it surely
/// faces ([`Slack::facing`]): t is that of [`LocalRay::intersect_certain`], to the bit. What is a triangle's own is
/// computed once for all lines, and each looks up the triangle that it met.
///
/// [`Slack::facing`]: crate::accel::traverse::error_bounds::Slack::facing
/// [`LocalRay::intersect_certain`]: crate::accel::traverse::hit::LocalRay::intersect_certain
#[derive(Clone, Debug)]
pub(crate) struct Places {
    shared: Shared,
    /// By axis.
    normal: [[f64; GROUP]; 3],
    /// A corner, where directions are shared.
    corner: [[f64; GROUP]; 3],
    /// Of the quotient that t is, what all lines share: above, or, where directions are shared, below.
    common: [f64; GROUP],
    /// Instances, triangles.
    ids: [[u32; GROUP]; 2],
}

/// An origin, or a direction divided by a power of two about as long.
#[derive(Clone, Copy, Debug)]
enum Shared {
    Origin(DVec3),
    Direction(DVec3),
}

/// Where each line of a group meets its triangle, and which that is: t, instances, triangles.
pub(crate) type GroupHits = ([f32; GROUP], [[u32; GROUP]; 2]);

impl Places {
    /// Of nothing yet.
    #[inline(always)]
    pub fn new(lines: &Lines) -> Places {
        let shared = match *lines {
            Lines::From(o) => Shared::Origin(o.as_dvec3()),
            Lines::Along(d) => Shared::Direction(d.as_dvec3()),
        };
        let zero = [[0.0; GROUP]; 3];
        Places { shared, normal: zero, corner: zero, common: [0.0; GROUP], ids: [[0; GROUP]; 2] }
    }

    /// Holds the triangles of a block, as the four of number `nth`.
    #[inline(always)]
    pub fn put(&mut self, nth: usize, block: &Triangle4, spans: &TriangleIdMap) {
        let first = nth % BLOCKS * TRIANGLE_LANES;
        let v0 = per_axis(|axis| block.vertex[0][axis].map(f64::from));
        let edge = |corner: usize, axis: usize| {
            let mut edge = block.vertex[corner][axis].map(f64::from);
            edge.iter_mut().zip(&v0[axis]).for_each(|(x, from)| *x -= from);
            edge
        };
        let (e1, e2) = (per_axis(|axis| edge(1, axis)), per_axis(|axis| edge(2, axis)));
        for axis in 0..3 {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            for i in 0..TRIANGLE_LANES {
                self.normal[axis][first + i] = e1[b][i] * e2[c][i] - e2[b][i] * e1[c][i];
            }
        }
        let n = |i: usize| DVec3::from(per_axis(|axis| self.normal[axis][first + i]));
        let v0 = |i: usize| DVec3::from(per_axis(|axis| v0[axis][i]));
        match self.shared {
            Shared::Origin(o) => {
                for i in 0..TRIANGLE_LANES {
                    self.common[first + i] = n(i).dot(v0(i) - o);
                }
            }
            Shared::Direction(d) => {
                for i in 0..TRIANGLE_LANES {
                    self.common[first + i] = n(i).dot(d);
                    for axis in 0..3 {
                        self.corner[axis][first + i] = v0(i)[axis];
                    }
                }
            }
        }
        for (i, &entry) in block.ids.iter().enumerate().take(block.count()) {
            let id = spans.id(entry);
            self.ids[0][first + i] = id.instance;
            self.ids[1][first + i] = id.triangle;
        }
    }

    /// Where the lines of group `g` meet the triangles of numbers `of`.
    #[inline(always)]
    pub fn of<S: Simd>(&self, packet: &Packet, g: usize, of: &[u32; GROUP]) -> GroupHits {
        let unit = inverse(packet.size);
        let n = per_axis(|axis| S::lookup_f64(&self.normal[axis], of));
        let n = |i: usize| DVec3::new(n[0][i], n[1][i], n[2][i]);
        let common = S::lookup_f64(&self.common, of);
        let own = |i: usize| DVec3::from(per_axis(|axis| f64::from(packet.own[axis].group(g)[i])));
        let mut t = [0.0; GROUP];
        match self.shared {
            Shared::Origin(_) => {
                for (i, t) in t.iter_mut().enumerate() {
                    *t = (common[i] / n(i).dot(own(i)) * unit) as f32;
                }
            }
            Shared::Direction(_) => {
                let v0 = per_axis(|axis| S::lookup_f64(&self.corner[axis], of));
                let v0 = |i: usize| DVec3::new(v0[0][i], v0[1][i], v0[2][i]);
                for (i, t) in t.iter_mut().enumerate() {
                    *t = (n(i).dot(v0(i) - own(i)) / common[i] * unit) as f32;
                }
            }
        }
        (t, [S::lookup_u32(&self.ids[0], of), S::lookup_u32(&self.ids[1], of)])
    }
}
