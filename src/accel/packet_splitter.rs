//! Splits a batch of rays into ranges that are tried as ray packets.

use std::ops::Range;

use crate::bvh::scene_bvh::SceneBvh;
use crate::packet::{PACKET_SIZE, RAYS_PER_GROUP};
use crate::ray_batch::Coherence;

/// Ranges of fewer rays are not tried as packets.
const MIN_PACKET_RAYS: usize = 9;

/// Parts that a full packet is split into.
const PARTS: usize = 4;

/// Returns true if `count` rays can be tried as a packet: they share an origin or a direction, are not too few,
/// and have a world BVH to traverse.
pub(crate) fn can_trace_packet(bvh: &SceneBvh, coherence: Coherence, count: usize) -> bool {
    count >= MIN_PACKET_RAYS
        && coherence != Coherence::None
        && bvh.worlds().iter().any(|world| !world.is_empty())
}

/// The ranges of a batch, in order: full packets first; where the rays of one are too far apart, quarters of it,
/// then single groups.
pub(crate) struct PacketSplitter {
    next: usize,
    len: usize,
    /// Parts of split ranges, the next one last.
    parts: [Range<usize>; 2 * PARTS],
    part_count: usize,
}

impl PacketSplitter {
    /// Starts on a batch of `len` rays.
    pub fn new(len: usize) -> PacketSplitter {
        PacketSplitter { next: 0, len, parts: Default::default(), part_count: 0 }
    }

    /// Returns the next range of rays.
    pub fn pop(&mut self) -> Option<Range<usize>> {
        if self.part_count > 0 {
            self.part_count -= 1;
            return Some(self.parts[self.part_count].clone());
        }
        let first = self.next;
        self.next += PACKET_SIZE.min(self.len - first);
        (first < self.next).then_some(first..self.next)
    }

    /// Queues the parts of a range. Returns false if it is a single group or less.
    pub fn split(&mut self, range: Range<usize>) -> bool {
        let count = range.len();
        if count <= RAYS_PER_GROUP {
            return false;
        }
        let size = if count > PACKET_SIZE / PARTS { PACKET_SIZE / PARTS } else { RAYS_PER_GROUP };
        let parts = count.div_ceil(size);
        for (part, i) in self.parts[self.part_count..].iter_mut().zip((0..parts).rev()) {
            let first = range.start + i * size;
            *part = first..range.end.min(first + size);
        }
        self.part_count += parts;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_packet_comes_in_quarters_and_then_in_groups() {
        let mut splitter = PacketSplitter::new(PACKET_SIZE + 70);
        assert_eq!(splitter.pop(), Some(0..PACKET_SIZE));
        assert!(splitter.split(0..PACKET_SIZE));
        assert_eq!(splitter.pop(), Some(0..PACKET_SIZE / 4));
        assert!(splitter.split(0..PACKET_SIZE / 4));
        for g in 0..4 {
            assert_eq!(splitter.pop(), Some(g * RAYS_PER_GROUP..(g + 1) * RAYS_PER_GROUP));
            assert!(!splitter.split(g * RAYS_PER_GROUP..(g + 1) * RAYS_PER_GROUP));
        }
        for q in 1..4 {
            assert_eq!(splitter.pop(), Some(q * PACKET_SIZE / 4..(q + 1) * PACKET_SIZE / 4));
        }
        assert_eq!(splitter.pop(), Some(PACKET_SIZE..PACKET_SIZE + 70));
        assert!(splitter.split(PACKET_SIZE..PACKET_SIZE + 70));
        assert_eq!(splitter.pop(), Some(PACKET_SIZE..PACKET_SIZE + 64));
        assert_eq!(splitter.pop(), Some(PACKET_SIZE + 64..PACKET_SIZE + 70));
        assert_eq!(splitter.pop(), None);
    }
}
