//! Counts the vertices of a file that no face, line or point uses.

/// A bit for each vertex of a file, which is set if something uses the vertex.
pub(crate) struct UsedVertices {
    words: Vec<u64>,
    count: usize,
}

impl UsedVertices {
    /// Returns the set without any of `count` vertices.
    pub fn new(count: usize) -> UsedVertices {
        UsedVertices { words: vec![0; count.div_ceil(64)], count }
    }

    /// Adds vertices. Those that do not exist are ignored.
    pub fn add(&mut self, vertices: impl IntoIterator<Item = u32>) {
        for vertex in vertices {
            if let Some(word) = self.words.get_mut(vertex as usize / 64) {
                *word |= 1 << (vertex % 64);
            }
        }
    }

    /// Returns the number of vertices that were not added.
    pub fn unused(&self) -> usize {
        let used: usize = self.words.iter().map(|word| word.count_ones() as usize).sum();
        self.count.saturating_sub(used)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_count_once_and_missing_ones_not_at_all() {
        let mut used = UsedVertices::new(130);
        used.add([0, 64, 129, 64, 500]);
        assert_eq!(used.unused(), 127);
        assert_eq!(UsedVertices::new(0).unused(), 0);
    }
}
