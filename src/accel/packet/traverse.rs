//! The way of a packet through a tree.

use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::bvh8::{Bvh8Node, LEAF_BIT, Octant, SLOTS_ASCENDING, SLOTS_DESCENDING, WIDTH};
use crate::accel::bvh::triangle4::Triangle4;
use crate::accel::packet::group_bounds::Windows;
use crate::accel::packet::packet_kind::Beam;
use crate::accel::packet::{GROUP, GROUPS, Packet, Verdict};
use crate::simd::{Lanes, OutlinedKernel, Simd, prefetch_all_lines};

/// With so many rays left or fewer, they go on alone.
const FEW: u32 = 3;

/// Trees of so many bytes are in a processor's cache for the most part, and fetching them ahead only takes time.
const NEAR_BY: usize = 8 << 20;

/// Has a child of a node fetched.
#[inline(always)]
fn fetch_child(child: u32, nodes: &[Bvh8Node], blocks: &[Triangle4]) {
    if child & LEAF_BIT == 0 {
        nodes.get(child as usize).into_iter().for_each(prefetch_all_lines);
    } else {
        blocks.get((child & !LEAF_BIT) as usize).into_iter().for_each(prefetch_all_lines);
    }
}

/// Children that a packet has yet to visit.
#[derive(Clone, Debug)]
pub(crate) struct PacketStack {
    pending: Vec<Pending>,
    /// Entries in use.
    top: usize,
}

/// The children of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Pending {
    node: u32,
    /// Groups that may enter them.
    groups: u32,
    /// The slots of those that are left, the next one last.
    slots: [u32; WIDTH],
    /// No ray enters them before this.
    near: [f32; WIDTH],
    left: u32,
    /// What each covers: by the two axes across, slot.
    low: [[f32; WIDTH]; 2],
    high: [[f32; WIDTH]; 2],
}

impl Default for PacketStack {
    fn default() -> Self {
        PacketStack { pending: vec![Pending::default(); 16], top: 0 }
    }
}

impl PacketStack {
    /// Room for the children of one more node.
    #[inline(always)]
    fn room(&mut self) -> &mut Pending {
        if self.top >= self.pending.len() {
            self.grow();
        }
        &mut self.pending[self.top]
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self) {
        self.pending.resize(2 * (self.top + 1), Pending::default());
    }
}

impl Packet {
    /// Leads the rays through a tree.
    #[inline(always)]
    pub(crate) fn trace<S: Simd, B: Beam<S>, V: Verdict<S>>(
        &mut self,
        triangles: &Blas,
        beam: &B,
        (windows, octant): (&Windows<S::F32x16>, Octant),
        verdict: &mut V,
        stack: &mut PacketStack,
    ) {
        S::call_outlined(Trace { packet: self, triangles, beam, windows, octant, verdict, stack });
    }
}

/// [`Packet::trace`].
struct Trace<'a, S: Simd, B, V> {
    packet: &'a mut Packet,
    triangles: &'a Blas,
    beam: &'a B,
    windows: &'a Windows<S::F32x16>,
    octant: Octant,
    verdict: &'a mut V,
    stack: &'a mut PacketStack,
}

impl<S: Simd, B: Beam<S>, V: Verdict<S>> OutlinedKernel<S> for Trace<'_, S, B, V> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Trace { packet, triangles, beam, windows, octant, verdict, stack } = self;
        let Some(root) = triangles.bvh.root else { return };
        let blocks: &[Triangle4] = &triangles.blocks;
        stack.top = 0;
        let mut groups = 0;
        for g in 0..GROUPS {
            groups |= u32::from(packet.live[g] != 0) << g;
        }
        if root & LEAF_BIT != 0 {
            packet.meet_leaf::<S, B>(blocks, (beam, windows), root & !LEAF_BIT, groups, verdict);
            return;
        }
        let nodes: &[Bvh8Node] = &triangles.bvh.nodes;
        let by_odds = verdict.by_odds();
        let far_off = size_of_val(nodes) + size_of_val(blocks) > NEAR_BY;
        let mut last = windows.last::<S>(packet);
        let mut here = root;
        loop {
            let node = &nodes[here as usize];
            let outlines = beam.outlines(node);
            let hit = windows.meet(&outlines, &last) & node.child_mask();
            if hit != 0 {
                let next = stack.room();
                (next.node, next.groups, next.left) = (here, groups, hit.count_ones());
                let order = if by_odds { SLOTS_DESCENDING } else { node.order(octant) };
                S::permute_compress(
                    hit,
                    order,
                    outlines.near,
                    &SLOTS_ASCENDING,
                    &mut next.near,
                    &mut next.slots,
                );
                for axis in 0..2 {
                    outlines.low[axis].store(&mut next.low[axis]);
                    outlines.high[axis].store(&mut next.high[axis]);
                }
                stack.top += 1;
            }
            (here, groups) = loop {
                let Some(next) = stack.pending[..stack.top].last_mut() else { return };
                if next.left == 0 {
                    stack.top -= 1;
                    continue;
                }
                next.left -= 1;
                let nth = next.left as usize & (WIDTH - 1);
                let slot = next.slots[nth] as usize & (WIDTH - 1);
                let (low, high) =
                    ([next.low[0][slot], next.low[1][slot]], [next.high[0][slot], next.high[1][slot]]);
                let mut some = next.groups & windows.groups(low, high, next.near[nth], &last);
                if some == 0 {
                    continue;
                }
                let node = &nodes[next.node as usize];
                if far_off && next.left > 0 {
                    // What comes after this, unless this descends.
                    let coming = next.slots[(next.left - 1) as usize & (WIDTH - 1)] as usize & (WIDTH - 1);
                    fetch_child(node.child[coming], nodes, blocks);
                }
                let child = node.child[slot];
                let mut closely = some;
                if child & LEAF_BIT == 0 {
                    closely &= windows.wider_than([high[0] - low[0], high[1] - low[1]]);
                }
                if closely != 0 {
                    let planes = beam.planes(node, slot);
                    let mut entering = [0; GROUPS];
                    let mut count = (some & !closely).count_ones() << 4;
                    while closely != 0 {
                        let g = closely.trailing_zeros() as usize % GROUPS;
                        closely &= closely - 1;
                        entering[g] = beam.enters(packet, g, &planes) & packet.live[g];
                        count += entering[g].count_ones();
                        some &= !(u32::from(entering[g] == 0) << g);
                    }
                    if some == 0 {
                        continue;
                    }
                    if count <= FEW && child & LEAF_BIT == 0 {
                        let (mut left, mut changed) = (some, 0);
                        while left != 0 {
                            let g = left.trailing_zeros() as usize % GROUPS;
                            left &= left - 1;
                            let mut rays = entering[g];
                            while rays != 0 {
                                let ray = g * GROUP + rays.trailing_zeros() as usize;
                                changed |= u32::from(verdict.go_alone(packet, ray, child)) << g;
                                rays &= rays - 1;
                            }
                        }
                        if changed != 0 {
                            windows.shorten::<S>(packet, changed, &mut last);
                            if packet.live == [0; GROUPS] {
                                return;
                            }
                        }
                        continue;
                    }
                }
                if child & LEAF_BIT == 0 {
                    break (child, some);
                }
                let changed =
                    packet.meet_leaf::<S, B>(blocks, (beam, windows), child & !LEAF_BIT, some, verdict);
                if changed != 0 {
                    windows.shorten::<S>(packet, changed, &mut last);
                    if packet.live == [0; GROUPS] {
                        return;
                    }
                }
            };
        }
    }
}
