//! Groups the hits of a ray batch by triangle, as linked lists: neighbouring samples hit the same few triangles.

use blinn_core::geometry::{Hit, HitId};

/// The hits of one triangle, as a linked list.
#[derive(Clone, Copy, Debug)]
struct List {
    triangle: HitId,
    first: u32,
    last: u32,
}

/// Hits by triangle. It keeps its memory between batches.
#[derive(Debug, Default)]
pub(crate) struct HitsByTriangle {
    lists: Vec<List>,
    /// For each hit the next one in its list.
    next: Vec<u32>,
    /// A direct-mapped cache: for each hash of a triangle the last list of one with that hash.
    slots: Vec<u32>,
}

/// Slots of the cache; a power of two. A triangle that was evicted starts another list.
const SLOTS: usize = 256;
const NONE: u32 = u32::MAX;

impl HitsByTriangle {
    /// Replaces the contents by `hits`.
    pub fn group(&mut self, hits: &[Hit]) {
        self.lists.clear();
        self.next.clear();
        self.next.resize(hits.len(), NONE);
        self.slots.clear();
        self.slots.resize(SLOTS, NONE);
        // A copy of the previous hit's list, which the next hit usually extends.
        let mut current = List { triangle: HitId::NONE, first: NONE, last: NONE };
        let mut current_index = NONE;
        for (i, id) in hits.iter().map(|hit| hit.id).enumerate().filter(|(_, id)| *id != HitId::NONE) {
            let i = i as u32;
            if id == current.triangle {
                self.next[current.last as usize] = i;
                current.last = i;
                continue;
            }
            self.write_back(current_index, current);
            // Triangles that are neighbours in the mesh are mostly neighbours in space.
            let slot = &mut self.slots[(id.triangle ^ id.instance.wrapping_mul(7)) as usize % SLOTS];
            match self.lists.get_mut(*slot as usize).filter(|list| list.triangle == id) {
                Some(list) => {
                    self.next[list.last as usize] = i;
                    current = List { last: i, ..*list };
                }
                None => {
                    *slot = self.lists.len() as u32;
                    current = List { triangle: id, first: i, last: i };
                    self.lists.push(current);
                }
            }
            current_index = *slot;
        }
        self.write_back(current_index, current);
    }

    fn write_back(&mut self, index: u32, current: List) {
        if let Some(list) = self.lists.get_mut(index as usize) {
            list.last = current.last;
        }
    }

    /// The number of lists.
    pub fn len(&self) -> usize {
        self.lists.len()
    }

    /// The triangle of each list, and its first hit.
    pub fn iter(&self) -> impl Iterator<Item = (HitId, u32)> {
        self.lists.iter().map(|list| (list.triangle, list.first))
    }

    /// The next hit in the list of `hit`.
    #[inline(always)]
    pub fn next(&self, hit: u32) -> Option<u32> {
        Some(self.next[hit as usize]).filter(|&next| next != NONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hit_is_in_one_list_of_its_triangle_in_order() {
        let id = |i: u32| HitId { instance: i % 3, triangle: (i / 3) % 200 };
        let mut hits: Vec<Hit> = (0..3000).map(|i| Hit { t: 1.0, id: id(i) }).collect();
        hits[17] = Hit::MISS;
        let mut by_triangle = HitsByTriangle::default();
        // Twice: nothing of the first batch is left in the second.
        for hits in [&hits[..900], &hits] {
            by_triangle.group(hits);
            let mut listed = vec![false; hits.len()];
            for (triangle, first) in by_triangle.iter() {
                let mut previous = None;
                let mut hit = Some(first);
                while let Some(i) = hit {
                    assert_eq!(hits[i as usize].id, triangle);
                    assert!(previous < Some(i) && !std::mem::replace(&mut listed[i as usize], true));
                    previous = Some(i);
                    hit = by_triangle.next(i);
                }
            }
            assert_eq!(listed.iter().filter(|listed| !**listed).count(), 1);
        }
    }
}
