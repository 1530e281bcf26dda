//! Numbers for keys that begin with a vertex, in the order in which they come: what welding and
//! smoothing do for every corner of a file.

use std::collections::HashMap;

use super::block::NONE;

/// Keys of one vertex that are looked through one by one.
const FEW: usize = 16;

/// Keys (v, a, b), numbered as they come. Most vertices have few different keys, so these stand in
/// a list for each vertex; where one has many, the rest of its keys is hashed.
pub(super) struct Table {
    /// The last key in each vertex's list.
    last: Vec<u32>,
    keys: Vec<Key>,
    many: HashMap<(u32, u32, u32), u32>,
}

/// A key.
pub(super) struct Key {
    pub v: u32,
    pub a: u32,
    pub b: u32,
    /// The key before it in its vertex's list.
    before: u32,
}

impl Table {
    /// For vertices below `vertices`.
    pub fn new(vertices: usize) -> Table {
        Table { last: vec![NONE; vertices], keys: Vec::new(), many: HashMap::new() }
    }

    /// Forgets all keys, in a time that depends on their number alone.
    pub fn clear(&mut self) {
        for key in self.keys.drain(..) {
            self.last[key.v as usize] = NONE;
        }
        self.many.clear();
    }

    /// All keys by number.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// The number of a key.
    #[inline(always)]
    pub fn number(&mut self, v: u32, a: u32, b: u32) -> u32 {
        let last = self.last[v as usize];
        let mut at = last;
        for _ in 0..FEW {
            if at == NONE {
                self.last[v as usize] = self.keys.len() as u32;
                return self.push(v, a, b, last);
            }
            let key = &self.keys[at as usize];
            if key.a == a && key.b == b {
                return at;
            }
            at = key.before;
        }
        self.one_of_many(v, a, b)
    }

    #[cold]
    fn one_of_many(&mut self, v: u32, a: u32, b: u32) -> u32 {
        if let Some(&known) = self.many.get(&(v, a, b)) {
            return known;
        }
        let new = self.push(v, a, b, NONE);
        self.many.insert((v, a, b), new);
        new
    }

    /// A number of its own, which no key is given again.
    pub fn alone(&mut self, v: u32, a: u32, b: u32) -> u32 {
        self.push(v, a, b, NONE)
    }

    fn push(&mut self, v: u32, a: u32, b: u32, before: u32) -> u32 {
        self.keys.push(Key { v, a, b, before });
        self.keys.len() as u32 - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_numbered_as_they_come_however_many_a_vertex_has() {
        let mut table = Table::new(3);
        for _ in 0..2 {
            for a in 0..50 {
                for v in 0..3 {
                    assert_eq!(table.number(v, a, 7), a * 3 + v);
                }
            }
            assert_eq!((table.number(1, 20, 7), table.number(2, 3, 7)), (61, 11));
            assert_eq!((table.alone(1, 20, 7), table.number(1, 20, 7)), (150, 61));
            table.clear();
            assert!(table.keys().is_empty());
        }
    }
}
