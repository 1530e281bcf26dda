//! Polygons that triangles were cut from.

/// Bits in a word.
const BITS: usize = 64;

/// The triangles that were cut from the same polygons, which follow each other in a list of triangles. A bit for each
/// triangle up to the last one of a larger polygon.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Polygons(Vec<u64>);

impl Polygons {
    /// Returns true if all polygons are triangles.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds a triangle to the polygon of the one before it.
    pub fn join(&mut self, triangle: usize) {
        let word = triangle / BITS;
        if self.0.len() <= word {
            self.0.resize(word + 1, 0);
        }
        self.0[word] |= 1 << (triangle % BITS);
    }

    /// Returns true if a triangle belongs to the polygon of the one before it.
    pub fn is_joined(&self, triangle: usize) -> bool {
        self.0.get(triangle / BITS).is_some_and(|word| word >> (triangle % BITS) & 1 == 1)
    }

    /// Returns true if two triangles belong to the same polygon.
    pub fn are_same(&self, a: usize, b: usize) -> bool {
        let (mut at, last) = (a.min(b) + 1, a.max(b));
        while at <= last {
            // A polygon of many triangles fills whole words.
            if at % BITS == 0 && at + BITS <= last + 1 {
                if self.0.get(at / BITS) != Some(&u64::MAX) {
                    return false;
                }
                at += BITS;
            } else {
                if !self.is_joined(at) {
                    return false;
                }
                at += 1;
            }
        }
        true
    }

    /// Returns the size in memory in bytes.
    pub(crate) fn memory_size(&self) -> usize {
        size_of_val(&self.0[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_of_a_polygon_follow_each_other() {
        let mut polygons = Polygons::default();
        assert!(polygons.is_empty() && !polygons.are_same(0, 1) && polygons.are_same(7, 7));
        // A quad from 1 on and a polygon of 200 triangles from 60 on.
        [2].into_iter().chain(61..260).for_each(|triangle| polygons.join(triangle));
        assert!(polygons.are_same(1, 2) && polygons.are_same(2, 1));
        assert!(!polygons.are_same(0, 1) && !polygons.are_same(2, 3) && !polygons.are_same(1, 60));
        assert!(polygons.are_same(60, 259) && polygons.are_same(130, 100) && polygons.are_same(63, 128));
        assert!(!polygons.are_same(59, 259) && !polygons.are_same(60, 260) && !polygons.are_same(60, 1000));
    }
}
