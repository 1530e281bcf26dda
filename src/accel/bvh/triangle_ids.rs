//! Whose triangle an index is.

use crate::geometry::HitId;

/// Whose triangle an index is.
#[derive(Clone, Debug, Default)]
pub(crate) struct TriangleIdMap {
    /// Where each instance's triangles begin in the count of all.
    starts: Vec<u32>,
    instances: Vec<u32>,
    /// For each instance of the scene up to the last one here, where it is among these; [`NOWHERE`]
    /// for one that is not.
    places: Vec<u32>,
    /// For every so many triangles, 2^[`STRIDE`], whose the first of them is.
    landmarks: Vec<u32>,
}

const NOWHERE: u32 = u32::MAX;
const STRIDE: u32 = 7;

impl TriangleIdMap {
    /// Adds the next `count` triangles, of an instance.
    pub fn new(of: impl Iterator<Item = (u32, usize)>) -> (TriangleIdMap, usize) {
        let (mut spans, mut count) = (TriangleIdMap::default(), 0usize);
        for (instance, triangles) in of {
            let place = spans.starts.len() as u32;
            spans.starts.push(count.min(u32::MAX as usize) as u32);
            spans.instances.push(instance);
            spans.places.resize(spans.places.len().max(instance as usize + 1), NOWHERE);
            spans.places[instance as usize] = place;
            count += triangles;
            let landmarks = count.min(u32::MAX as usize).div_ceil(1 << STRIDE);
            spans.landmarks.resize(spans.landmarks.len().max(landmarks), place);
        }
        (spans, count)
    }

    /// The instance of a triangle (its place in the order that was given) and the triangle there.
    #[inline(always)]
    pub fn find(&self, index: u32) -> (usize, u32) {
        let end = self.starts.len();
        let landmark = |nth: u32| self.landmarks.get(nth as usize).map_or(end, |&place| place as usize);
        // Mostly the two are one and the same.
        let (first, last) = (landmark(index >> STRIDE), landmark((index >> STRIDE) + 1));
        let others = self.starts.get(first + 1..end.min(last + 1)).unwrap_or_default();
        let which = first + others.partition_point(|&start| start <= index);
        (which, index - self.starts.get(which).copied().unwrap_or(0))
    }

    /// The id of a triangle.
    #[inline(always)]
    pub fn id(&self, index: u32) -> HitId {
        let (which, triangle) = self.find(index);
        HitId { instance: self.instances.get(which).copied().unwrap_or(0), triangle }
    }

    /// The index of a triangle, if it is here.
    #[inline(always)]
    pub fn index(&self, id: HitId) -> Option<u32> {
        let place = *self.places.get(id.instance as usize)?;
        Some(self.starts.get(place as usize)? + id.triangle)
    }

    /// Those of many, `u32::MAX` for one that is not here.
    #[inline(always)]
    pub fn indices(&self, of: &[HitId], to: &mut [u32]) {
        let index = |id| self.index(id).unwrap_or(u32::MAX);
        let Some(&HitId { instance, .. }) = of.first() else { return };
        let start = index(HitId { instance, triangle: 0 });
        // Neighbours mostly are one instance's: all are looked at without a branch, which is quicker.
        if start != u32::MAX && of.iter().fold(true, |all, id| all & (id.instance == instance)) {
            to.iter_mut().zip(of).for_each(|(to, id)| *to = start + id.triangle);
        } else {
            to.iter_mut().zip(of).for_each(|(to, &id)| *to = index(id));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Instances of all sizes, none among them, in a row and not: every triangle is found again.
    #[test]
    fn indices_and_ids_are_each_others() {
        let sizes = |i: u32| match i % 5 {
            0 => 0,
            1 => 1,
            2 => 1 << STRIDE,
            _ => (i as usize * 37) % 300,
        };
        let one = vec![(4u32, 1000usize)];
        let many = (0..200).map(|i| (3 * i + 1, sizes(i))).collect();
        let empty = (0..50).map(|i| (i, usize::from(i == 20))).collect();
        let lists: [Vec<(u32, usize)>; 3] = [one, many, empty];
        for list in lists {
            let (spans, count) = TriangleIdMap::new(list.iter().copied());
            let mut index = 0;
            for &(instance, triangles) in &list {
                for triangle in 0..triangles as u32 {
                    let id = HitId { instance, triangle };
                    assert_eq!((spans.id(index), spans.index(id)), (id, Some(index)));
                    index += 1;
                }
            }
            assert_eq!(index as usize, count);
            let ids: Vec<HitId> =
                (0..count as u32).map(|index| spans.id(index)).chain([HitId::NONE]).collect();
            let mut indices = vec![0; ids.len()];
            for (first, end) in [(0, ids.len()), (0, count), (count / 3, count / 3 + 1)] {
                spans.indices(&ids[first..end], &mut indices[first..end]);
                let expected = |i: usize| if i < count { i as u32 } else { u32::MAX };
                assert!((first..end).all(|i| indices[i] == expected(i)));
            }
            assert_eq!(spans.index(HitId { instance: 2, triangle: 0 }).is_some(), list[0].0 == 0);
            assert_eq!(spans.index(HitId::NONE), None);
        }
        assert_eq!(TriangleIdMap::default().find(7), (0, 7));
    }
}
