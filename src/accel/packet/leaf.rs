//! A packet at a leaf.

use super::{FOUR, GROUP, GROUPS, Packet, QUADS, Sure, Verdict};
use crate::accel::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::accel::packet::group_bounds::Windows;
use crate::accel::packet::packet_kind::Beam;
use crate::accel::traverse::error_bounds::W_SCALE;
use crate::simd::{Lanes, Simd};

impl Packet {
    /// The rays of `groups` at a leaf. The groups where anything changed.
    #[inline(always)]
    pub(crate) fn meet_leaf<S: Simd, B: Beam<S>>(
        &mut self,
        blocks: &[Triangle4],
        (beam, windows): (&B, &Windows<S::F32x16>),
        first: u32,
        groups: u32,
        verdict: &mut impl Verdict<S>,
    ) -> u32 {
        let mut changed = 0;
        for (index, block) in blocks.iter().enumerate().skip(first as usize) {
            let prepared = beam.prepare(block);
            let slack = beam.slack(block);
            let (side, minus) = (S::F32x16::splat(slack.side), S::F32x16::splat(-slack.side));
            let (unsure, facing) = (S::F32x16::splat(slack.depth), S::F32x16::splat(slack.facing));
            let (across, certain) = (beam.across(&prepared), beam.certain(block));
            let mut passed = 0;
            let mut left = groups;
            let mut quad = usize::MAX;
            while left != 0 {
                let g = left.trailing_zeros() as usize % GROUPS;
                left &= left - 1;
                if g / FOUR != quad {
                    quad = g / FOUR;
                    passed = windows.pass_by(quad % QUADS, &across, certain);
                }
                let mask = self.live[g];
                if mask == 0 {
                    continue;
                }
                let mut lanes = block.lane_mask() & !(passed >> (g % FOUR * TRIANGLE_LANES));
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize % TRIANGLE_LANES;
                    lanes &= lanes - 1;
                    let sides = beam.sides(self, g, &prepared, lane);
                    let (u, v) = (sides.u, sides.v);
                    let w = (sides.det - u - v) * S::F32x16::splat(W_SCALE);
                    let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
                    // Written so that NaN stays possible.
                    let outside = least.lt(minus) & side.lt(greatest);
                    let mut possible = self.live[g] & !outside;
                    if possible == 0 {
                        continue;
                    }
                    let det = sides.det.abs();
                    let depth = sides.depth.xor_sign(sides.det);
                    let faces = facing.lt(det);
                    if verdict.culls() {
                        let look = block.flags(lane);
                        if look.single_sided {
                            let against = sides.det.lt(S::F32x16::splat(0.0));
                            let back = if look.reversed { against } else { !against };
                            possible &= !(back & faces);
                        }
                    }
                    possible &= !verdict.ignores(block, lane, g);
                    let start = S::F32x16::load(self.start.group(g));
                    let inside = faces & (side.lt(least) | greatest.lt(minus));
                    let (before, behind) = (depth - unsure, depth + unsure);
                    let nearer = behind.lt(S::F32x16::load(self.lower.group(g)) * det)
                        & (start.max(S::F32x16::splat(self.sure_start)) * det).lt(before);
                    let plain = u32::from(verdict.plain(block) >> lane & 1).wrapping_neg();
                    let sure = possible & inside & nearer & plain;
                    let mut doubtful = possible & !sure;
                    if doubtful != 0 {
                        let upper = S::F32x16::load(self.upper.group(g));
                        let beyond = (upper * det).lt(before) | behind.lt(start * det);
                        doubtful &= !(beyond & faces);
                    }
                    if sure | doubtful == 0 {
                        continue;
                    }
                    changed |= 1 << g;
                    let entry = (index * TRIANGLE_LANES + lane) as u32;
                    if sure != 0 {
                        verdict.take(self, g, sure, entry, Sure { depth, det, slack: unsure });
                    }
                    while doubtful != 0 {
                        let ray = doubtful.trailing_zeros() as usize;
                        verdict.judge(self, g * GROUP + ray, entry, inside >> ray & 1 == 1);
                        doubtful &= doubtful - 1;
                    }
                }
            }
            if block.is_last_in_leaf() {
                break;
            }
        }
        changed
    }
}
