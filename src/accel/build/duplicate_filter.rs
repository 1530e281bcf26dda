//! Duplicate filter: a one-hash filter that flags bounding boxes that may be duplicates.
//!
//! The hash of each box sets a bit of a table, and, where that bit is set already, the same bit of a second one.
//! Only boxes with a bit in the second table have to be compared.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use crate::bvh::aabb::Aabb;
use blinn_core::simd::prefetch;

/// The two tables.
pub(crate) struct DuplicateFilter {
    once: BitTable,
    twice: BitTable,
}

impl DuplicateFilter {
    /// Makes a filter for `count` boxes.
    pub fn new(count: usize) -> DuplicateFilter {
        DuplicateFilter { once: BitTable::new(count), twice: BitTable::new(count) }
    }

    /// Returns an inserter. Each thread needs its own; call [`Inserter::finish`] on all of them before asking for
    /// duplicates.
    pub fn inserter(&self) -> Inserter<'_> {
        Inserter { filter: self, delayed: [None; DELAY], next: 0 }
    }

    fn insert(&self, hash: u64) {
        if self.once.set(hash) {
            self.twice.set(hash);
        }
    }

    /// Returns false for a box that was inserted at most once.
    pub fn maybe_duplicate(&self, bounds: &Aabb) -> bool {
        self.twice.get(hash(bounds))
    }
}

/// Boxes between prefetching their bit and setting it.
const DELAY: usize = 16;

/// Inserts boxes with a delay. The tables are large and are accessed at random: the delay hides the memory latency.
#[must_use]
pub(crate) struct Inserter<'a> {
    filter: &'a DuplicateFilter,
    delayed: [Option<u64>; DELAY],
    next: usize,
}

impl Inserter<'_> {
    /// Inserts a box.
    pub fn insert(&mut self, bounds: &Aabb) {
        let hash = hash(bounds);
        prefetch(self.filter.once.word_and_bit(hash).0);
        let oldest = &mut self.delayed[self.next % DELAY];
        self.next = self.next.wrapping_add(1);
        if let Some(hash) = oldest.replace(hash) {
            self.filter.insert(hash);
        }
    }

    /// Inserts the boxes that are still delayed.
    pub fn finish(self) {
        self.delayed.iter().flatten().for_each(|&hash| self.filter.insert(hash));
    }
}

/// A table of 16 bits or more for each box.
struct BitTable(Vec<AtomicU64>);

impl BitTable {
    fn new(count: usize) -> BitTable {
        let words = (count / 4).next_power_of_two().max(16);
        BitTable((0..words).map(|_| AtomicU64::new(0)).collect())
    }

    /// Returns the word and the bit in it.
    fn word_and_bit(&self, hash: u64) -> (&AtomicU64, u64) {
        (&self.0[(hash >> 6) as usize & (self.0.len() - 1)], 1 << (hash & 63))
    }

    /// Sets a bit and returns whether it was set before.
    fn set(&self, hash: u64) -> bool {
        let (word, bit) = self.word_and_bit(hash);
        word.fetch_or(bit, Relaxed) & bit != 0
    }

    fn get(&self, hash: u64) -> bool {
        let (word, bit) = self.word_and_bit(hash);
        word.load(Relaxed) & bit != 0
    }
}

/// A 64-bit hash of a box: each step multiplies by an odd constant and folds the high bits down.
fn hash(&Aabb { min, max }: &Aabb) -> u64 {
    let pair = |a: f32, b: f32| u64::from(a.to_bits()) | u64::from(b.to_bits()) << 32;
    let words = [pair(min.x, min.y), pair(min.z, max.x), pair(max.y, max.z)];
    words.into_iter().fold(0, |hash: u64, x| {
        let x = (hash ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x ^ (x >> 29)
    })
}
