//! Vertex deduplication: numbers distinct (vertex, attribute, attribute) keys in order of first use.
//! Welding and smoothing look up every corner of a file here.

use std::collections::HashMap;

/// Index of an attribute that a corner does not have.
pub(crate) const NO_INDEX: u32 = u32::MAX;

/// Longest list of one vertex's keys that is searched linearly.
const MAX_LIST_LENGTH: usize = 16;

/// Numbers keys (v, a, b) in order of first use. Most vertices have few distinct keys, so each vertex
/// has a linked list of them; keys of a vertex with a longer list go to a hash map.
pub(crate) struct VertexDeduplicator {
    /// The most recent key of each vertex.
    last: Vec<u32>,
    keys: Vec<VertexKey>,
    overflow: HashMap<(u32, u32, u32), u32>,
}

/// A vertex and two of its attributes.
pub(crate) struct VertexKey {
    pub v: u32,
    pub a: u32,
    pub b: u32,
    /// The previous key in the list of the same vertex.
    previous: u32,
}

impl VertexDeduplicator {
    /// Creates an empty set of keys for vertices 0 to `vertices` − 1.
    pub fn new(vertices: usize) -> VertexDeduplicator {
        VertexDeduplicator { last: vec![NO_INDEX; vertices], keys: Vec::new(), overflow: HashMap::new() }
    }

    /// Removes all keys, in time proportional to their number.
    pub fn clear(&mut self) {
        for key in self.keys.drain(..) {
            self.last[key.v as usize] = NO_INDEX;
        }
        self.overflow.clear();
    }

    /// Returns all keys by number.
    pub fn keys(&self) -> &[VertexKey] {
        &self.keys
    }

    /// Returns all keys by number.
    pub fn into_keys(self) -> Vec<VertexKey> {
        self.keys
    }

    /// Returns the number of a key, and adds the key if it is new.
    #[inline(always)]
    pub fn number_of(&mut self, v: u32, a: u32, b: u32) -> u32 {
        let last = self.last[v as usize];
        let mut at = last;
        for _ in 0..MAX_LIST_LENGTH {
            if at == NO_INDEX {
                self.last[v as usize] = self.keys.len() as u32;
                return self.push(v, a, b, last);
            }
            let key = &self.keys[at as usize];
            if key.a == a && key.b == b {
                return at;
            }
            at = key.previous;
        }
        self.number_by_hash(v, a, b)
    }

    #[cold]
    fn number_by_hash(&mut self, v: u32, a: u32, b: u32) -> u32 {
        if let Some(&known) = self.overflow.get(&(v, a, b)) {
            return known;
        }
        let new = self.push(v, a, b, NO_INDEX);
        self.overflow.insert((v, a, b), new);
        new
    }

    /// Adds a key with a new number that no lookup ever returns.
    pub fn add_unique(&mut self, v: u32, a: u32, b: u32) -> u32 {
        self.push(v, a, b, NO_INDEX)
    }

    fn push(&mut self, v: u32, a: u32, b: u32, previous: u32) -> u32 {
        self.keys.push(VertexKey { v, a, b, previous });
        self.keys.len() as u32 - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_numbered_in_order_of_first_use_for_any_number_per_vertex() {
        let mut vertices = VertexDeduplicator::new(3);
        for _ in 0..2 {
            for a in 0..50 {
                for v in 0..3 {
                    assert_eq!(vertices.number_of(v, a, 7), a * 3 + v);
                }
            }
            assert_eq!((vertices.number_of(1, 20, 7), vertices.number_of(2, 3, 7)), (61, 11));
            assert_eq!((vertices.add_unique(1, 20, 7), vertices.number_of(1, 20, 7)), (150, 61));
            vertices.clear();
            assert!(vertices.keys().is_empty());
        }
    }
}
