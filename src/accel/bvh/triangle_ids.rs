//! Maps between a BLAS's triangle indices and hit ids (instance, triangle).

use blinn_core::geometry::HitId;

/// The instances whose triangles a BLAS numbers one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct TriangleIdMap {
    /// Index of each instance's first triangle.
    first_triangles: Vec<u32>,
    instances: Vec<u32>,
    /// Position in `instances` of each instance of the scene, up to the last one here; [`ABSENT`] for others.
    positions: Vec<u32>,
    /// For every 2^[`STRIDE_BITS`] triangles, the position of the first one's instance: it narrows the search.
    landmarks: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;
const STRIDE_BITS: u32 = 7;

impl TriangleIdMap {
    /// Builds the map from (instance, number of triangles), and returns the number of all triangles with it.
    pub fn new(instances: impl Iterator<Item = (u32, usize)>) -> (TriangleIdMap, usize) {
        let mut map = TriangleIdMap::default();
        let mut count = 0usize;
        for (instance, triangles) in instances {
            let position = map.first_triangles.len() as u32;
            map.first_triangles.push(count.min(u32::MAX as usize) as u32);
            map.instances.push(instance);
            map.positions.resize(map.positions.len().max(instance as usize + 1), ABSENT);
            map.positions[instance as usize] = position;
            count += triangles;
            let landmarks = count.min(u32::MAX as usize).div_ceil(1 << STRIDE_BITS);
            map.landmarks.resize(map.landmarks.len().max(landmarks), position);
        }
        (map, count)
    }

    /// Returns the position of a triangle's instance, in the order of [`TriangleIdMap::new`], and the triangle's
    /// index in it.
    #[inline(always)]
    pub fn locate(&self, index: u32) -> (usize, u32) {
        let end = self.first_triangles.len();
        let landmark = |nth: u32| self.landmarks.get(nth as usize).map_or(end, |&position| position as usize);
        // Mostly both are the same.
        let first = landmark(index >> STRIDE_BITS);
        let last = landmark((index >> STRIDE_BITS) + 1);
        let others = self.first_triangles.get(first + 1..end.min(last + 1)).unwrap_or_default();
        let position = first + others.partition_point(|&start| start <= index);
        (position, index - self.first_triangles.get(position).copied().unwrap_or(0))
    }

    /// Returns the id of a triangle.
    #[inline(always)]
    pub fn id(&self, index: u32) -> HitId {
        let (position, triangle) = self.locate(index);
        HitId { instance: self.instances.get(position).copied().unwrap_or(0), triangle }
    }

    /// Returns the index of a triangle; `None` where its instance is not in the map.
    #[inline(always)]
    pub fn index(&self, id: HitId) -> Option<u32> {
        let position = *self.positions.get(id.instance as usize)?;
        self.first_triangles.get(position as usize)?.checked_add(id.triangle)
    }

    /// Writes the indices of `ids`; `u32::MAX` for those not in the map.
    #[inline(always)]
    pub fn indices(&self, ids: &[HitId], out: &mut [u32]) {
        let index = |id| self.index(id).unwrap_or(u32::MAX);
        let Some(&HitId { instance, .. }) = ids.first() else { return };
        let start = index(HitId { instance, triangle: 0 });
        // Neighbours are mostly of one instance: to compare all without a branch is faster.
        if start != u32::MAX && ids.iter().fold(true, |all, id| all & (id.instance == instance)) {
            out.iter_mut().zip(ids).for_each(|(out, id)| *out = start + id.triangle);
        } else {
            out.iter_mut().zip(ids).for_each(|(out, &id)| *out = index(id));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Instances of all sizes, some empty, with and without gaps between them: indices and ids are inverse.
    #[test]
    fn indices_and_ids_are_inverse() {
        let sizes = |i: u32| match i % 5 {
            0 => 0,
            1 => 1,
            2 => 1 << STRIDE_BITS,
            _ => (i as usize * 37) % 300,
        };
        let one = vec![(4u32, 1000usize)];
        let many = (0..200).map(|i| (3 * i + 1, sizes(i))).collect();
        let empty = (0..50).map(|i| (i, usize::from(i == 20))).collect();
        let lists: [Vec<(u32, usize)>; 3] = [one, many, empty];
        for list in lists {
            let (map, count) = TriangleIdMap::new(list.iter().copied());
            let mut index = 0;
            for &(instance, triangles) in &list {
                for triangle in 0..triangles as u32 {
                    let id = HitId { instance, triangle };
                    assert_eq!((map.id(index), map.index(id)), (id, Some(index)));
                    index += 1;
                }
            }
            assert_eq!(index as usize, count);
            let ids: Vec<HitId> = (0..count as u32).map(|index| map.id(index)).chain([HitId::NONE]).collect();
            let mut indices = vec![0; ids.len()];
            for (first, end) in [(0, ids.len()), (0, count), (count / 3, count / 3 + 1)] {
                map.indices(&ids[first..end], &mut indices[first..end]);
                let expected = |i: usize| if i < count { i as u32 } else { u32::MAX };
                assert!((first..end).all(|i| indices[i] == expected(i)));
            }
            assert_eq!(map.index(HitId { instance: 2, triangle: 0 }).is_some(), list[0].0 == 0);
            assert_eq!(map.index(HitId::NONE), None);
        }
        assert_eq!(TriangleIdMap::default().locate(7), (0, 7));
    }
}
