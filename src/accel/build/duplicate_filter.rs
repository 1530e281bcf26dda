//! Which boxes are seen more than once, as far as bits can tell.
//!
//! Each box's hash sets a bit, and where that is set already, a bit in a second table. Only boxes with
//! a bit in the second table need to be compared.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use crate::accel::bvh::aabb::Aabb;
use crate::simd::prefetch;

/// Both tables.
pub(crate) struct DuplicateFilter {
    seen: Bits,
    again: Bits,
}

impl DuplicateFilter {
    /// For so many boxes.
    pub fn new(count: usize) -> DuplicateFilter {
        DuplicateFilter { seen: Bits::new(count), again: Bits::new(count) }
    }

    /// Takes note of boxes.
    pub fn watch(&self) -> Inserter<'_> {
        Inserter { again: self, late: [None; LATE], next: 0 }
    }

    fn see(&self, hash: u64) {
        if self.seen.set(hash) {
            self.again.set(hash);
        }
    }

    /// False for a box that was not seen more than once.
    pub fn repeated(&self, of: &Aabb) -> bool {
        self.again.get(hash(of))
    }
}

/// Boxes between being told of and being noted.
const LATE: usize = 16;

/// Takes note of boxes, each only when some more have been told of. The tables are large and boxes lie all
/// over them: meanwhile the memory comes that the note goes to.
pub(crate) struct Inserter<'a> {
    again: &'a DuplicateFilter,
    late: [Option<u64>; LATE],
    next: usize,
}

impl Inserter<'_> {
    /// Takes note of a box.
    pub fn see(&mut self, of: &Aabb) {
        let hash = hash(of);
        prefetch(self.again.seen.place(hash).0);
        let slot = &mut self.late[self.next % LATE];
        self.next = self.next.wrapping_add(1);
        if let Some(hash) = slot.replace(hash) {
            self.again.see(hash);
        }
    }
}

impl Drop for Inserter<'_> {
    fn drop(&mut self) {
        self.late.iter().flatten().for_each(|&hash| self.again.see(hash));
    }
}

/// A table of bits, 16 for each thing that is entered.
struct Bits(Vec<AtomicU64>);

impl Bits {
    fn new(count: usize) -> Bits {
        let words = (count / 4).next_power_of_two().max(16);
        Bits((0..words).map(|_| AtomicU64::new(0)).collect())
    }

    fn place(&self, hash: u64) -> (&AtomicU64, u64) {
        (&self.0[(hash >> 6) as usize & (self.0.len() - 1)], 1 << (hash & 63))
    }

    /// True where the bit was set before.
    fn set(&self, hash: u64) -> bool {
        let (word, bit) = self.place(hash);
        word.fetch_or(bit, Relaxed) & bit != 0
    }

    fn get(&self, hash: u64) -> bool {
        let (word, bit) = self.place(hash);
        word.load(Relaxed) & bit != 0
    }
}

/// A 64-bit hash of a box: each step multiplies by an odd constant and folds the high bits down.
fn hash(&Aabb { min: lo, max: hi }: &Aabb) -> u64 {
    let pair = |a: f32, b: f32| u64::from(a.to_bits()) | u64::from(b.to_bits()) << 32;
    [pair(lo.x, lo.y), pair(lo.z, hi.x), pair(hi.y, hi.z)].into_iter().fold(0, |hash: u64, x| {
        let x = (hash ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x ^ (x >> 29)
    })
}
