//! The hits of a batch, by triangle.

use crate::geometry::{Hit, HitId};

/// Hits of one triangle, as a chain from the first to the last.
#[derive(Clone, Copy, Debug)]
struct Chain {
    id: HitId,
    first: u32,
    last: u32,
}

/// Which hits are on the same triangle: rays of neighbouring samples meet the same few. It keeps its
/// memory.
#[derive(Debug, Default)]
pub(crate) struct ByTriangle {
    chains: Vec<Chain>,
    /// The hit after each in its chain.
    next: Vec<u32>,
    /// The last chain whose triangle belongs here.
    slots: Vec<u32>,
}

/// How many triangles are remembered; a power of two. One that is forgotten begins another chain.
const SLOTS: usize = 256;
const NONE: u32 = u32::MAX;

impl ByTriangle {
    /// Takes `hits` in place of all before.
    pub(crate) fn sort(&mut self, hits: &[Hit]) {
        self.chains.clear();
        self.next.clear();
        self.next.resize(hits.len(), NONE);
        self.slots.clear();
        self.slots.resize(SLOTS, NONE);
        // The chain of the hit before, which mostly goes on.
        let mut now = Chain { id: HitId::NONE, first: NONE, last: NONE };
        let mut now_at = NONE;
        for (i, id) in hits.iter().map(|hit| hit.id).enumerate().filter(|(_, id)| *id != HitId::NONE) {
            let i = i as u32;
            if id == now.id {
                self.next[now.last as usize] = i;
                now.last = i;
                continue;
            }
            if let Some(chain) = self.chains.get_mut(now_at as usize) {
                chain.last = now.last;
            }
            // Neighbours in a file mostly are neighbours in space.
            let slot = &mut self.slots[(id.triangle ^ id.instance.wrapping_mul(7)) as usize % SLOTS];
            match self.chains.get_mut(*slot as usize).filter(|chain| chain.id == id) {
                Some(chain) => {
                    self.next[chain.last as usize] = i;
                    now = Chain { last: i, ..*chain };
                }
                None => {
                    *slot = self.chains.len() as u32;
                    now = Chain { id, first: i, last: i };
                    self.chains.push(now);
                }
            }
            now_at = *slot;
        }
        if let Some(chain) = self.chains.get_mut(now_at as usize) {
            chain.last = now.last;
        }
    }

    /// How many chains there are.
    pub(crate) fn count(&self) -> usize {
        self.chains.len()
    }

    /// The triangle of each chain, and its first hit.
    pub(crate) fn chains(&self) -> impl Iterator<Item = (HitId, u32)> {
        self.chains.iter().map(|chain| (chain.id, chain.first))
    }

    /// The hit that follows in its chain.
    #[inline(always)]
    pub(crate) fn after(&self, hit: u32) -> Option<u32> {
        Some(self.next[hit as usize]).filter(|&next| next != NONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hit_is_in_one_chain_of_its_triangle_in_order() {
        let id = |i: u32| HitId { instance: i % 3, triangle: (i / 3) % 200 };
        let mut hits: Vec<Hit> = (0..3000).map(|i| Hit { t: 1.0, id: id(i) }).collect();
        hits[17] = Hit::MISS;
        let mut by = ByTriangle::default();
        // Twice: nothing is left of what was there before.
        for hits in [&hits[..900], &hits] {
            by.sort(hits);
            let mut seen = vec![false; hits.len()];
            for (id, first) in by.chains() {
                let mut last = None;
                let mut at = Some(first);
                while let Some(i) = at {
                    assert_eq!(hits[i as usize].id, id);
                    assert!(last < Some(i) && !std::mem::replace(&mut seen[i as usize], true));
                    (last, at) = (Some(i), by.after(i));
                }
            }
            assert_eq!(seen.iter().filter(|seen| !**seen).count(), 1);
        }
    }
}
