//! Which boxes are seen more than once, as far as bits can tell.
//!
//! Each box's hash sets a bit, and where that is set already, a bit in a second table. Only boxes with
//! a bit in the second table need to be compared.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use super::wide::Box3;

/// Both tables.
pub(super) struct Again {
    seen: Bits,
    again: Bits,
}

impl Again {
    /// For so many boxes.
    pub fn new(count: usize) -> Again {
        Again { seen: Bits::new(count), again: Bits::new(count) }
    }

    /// Takes note of a box.
    pub fn see(&self, of: &Box3) {
        let hash = hash(of);
        if self.seen.set(hash) {
            self.again.set(hash);
        }
    }

    /// The hash of a box that, perhaps, was seen more than once; `None` for one that was not.
    pub fn repeated(&self, of: &Box3) -> Option<u64> {
        let hash = hash(of);
        self.again.get(hash).then_some(hash)
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
fn hash((lo, hi): &Box3) -> u64 {
    [lo.x, lo.y, lo.z, hi.x, hi.y, hi.z].into_iter().fold(0, |hash: u64, x| {
        let x = (hash ^ u64::from(x.to_bits())).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x ^ (x >> 29)
    })
}
