//! Triangles that lie together, each place once.
//!
//! Triangles in exactly the same place, however wound, share one entry of a leaf that lists them all;
//! entries with exactly equal boxes share one slot of the tree. Without that, thousands of equal boxes make
//! a builder take minutes over a tree as deep as they are many. Equal boxes lie in one cell of a region, and
//! hardly any two triangles do.
//!
//! Neighbours along the curve whose boxes mostly overlap, as those of the two halves of a quad do, share a slot
//! too: a builder has about half as much to do, and would have put them into one leaf anyway.

use obvhs::Boundable;
use obvhs::aabb::Aabb as ObvhsAabb;

use crate::accel::build::builder::{Filled, Region};
use crate::accel::build::input_triangles::{SurfaceFlags, TriangleRef};
use crate::accel::build::morton_clusters::MortonKey;
use crate::accel::build::occlusion_order::{OcclusionCost, stopping};
use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::triangle4::{COINCIDENT, TRIANGLE_LANES, Triangle4};

/// Triangles in one place that look alike, by rising index.
#[derive(Clone, Debug)]
pub(crate) struct Alike {
    pub look: SurfaceFlags,
    pub ids: Vec<u32>,
}

/// Triangles in one place, by rising index, by how they look.
pub(crate) fn alike(place: impl Iterator<Item = (u32, SurfaceFlags)>) -> Vec<Alike> {
    let mut alike: Vec<Alike> = Vec::new();
    for (id, look) in place {
        match alike.iter_mut().find(|a| a.look == look) {
            Some(a) => a.ids.push(id),
            None => alike.push(Alike { look, ids: vec![id] }),
        }
    }
    alike
}

/// A box around two takes the place of both where it has no more than this share of their surface.
const ALIKE: f32 = 0.95;

/// How much area stops light.
fn area(fit: &TriangleRef) -> f64 {
    fit.corners.area() * stopping(fit.look.class)
}

/// What is in a box.
#[derive(Clone, Copy)]
enum Slot {
    /// The index of a triangle among all.
    One(u32),
    Two([u32; 2]),
    /// The index of a pile.
    Pile(u32),
}

/// The triangles of a region.
#[derive(Default)]
pub(crate) struct Neighbours {
    boxes: Vec<ObvhsAabb>,
    /// What is in each.
    slots: Vec<Slot>,
    /// How much area stops light in each box.
    areas: Vec<f64>,
    /// Entries with equal boxes. The id of an entry is a triangle's, or [`COINCIDENT`] and that of a group.
    piles: Vec<Vec<TriangleRef>>,
    groups: Vec<Vec<Alike>>,
    /// Triangles that are where another is.
    coincident: u64,
}

impl Neighbours {
    /// Those of `all` that `keys` tells of, by cell.
    pub fn new(all: &[TriangleRef], keys: &[MortonKey]) -> Neighbours {
        let (boxes, slots) = (Vec::with_capacity(keys.len()), Vec::with_capacity(keys.len()));
        let areas = Vec::with_capacity(keys.len());
        let mut own = Neighbours { boxes, slots, areas, ..Neighbours::default() };
        for cell in keys.chunk_by(|a, b| a.cell() == b.cell()) {
            match cell {
                [key] => {
                    let fit = &all[key.index()];
                    own.add(fit.aabb(), Slot::One(key.index() as u32), area(fit));
                }
                _ => own.share(all, cell.iter().map(|key| key.index() as u32).collect()),
            }
        }
        own.pair();
        own
    }

    /// Adds a box, and how much area in it stops light.
    fn add(&mut self, bounds: ObvhsAabb, slot: Slot, area: f64) {
        self.boxes.push(bounds);
        self.slots.push(slot);
        self.areas.push(area);
    }

    /// Puts triangles into one box with the next along the curve, where that box is met by fewer lines than their
    /// own are together, and the next one has not more to gain from the one after it.
    fn pair(&mut self) {
        let mut coming = self.gain(0);
        let (mut from, mut to) = (0, 0);
        while from < self.slots.len() {
            let gain = coming;
            coming = self.gain(from + 1);
            let (mut bounds, mut slot, mut area) = (self.boxes[from], self.slots[from], self.areas[from]);
            if gain > 0.0
                && gain >= coming
                && let (Slot::One(a), Slot::One(b)) = (slot, self.slots[from + 1])
            {
                from += 1;
                (bounds, slot) = (bounds.union(&self.boxes[from]), Slot::Two([a, b]));
                area += self.areas[from];
                coming = self.gain(from + 1);
            }
            (self.boxes[to], self.slots[to], self.areas[to]) = (bounds, slot, area);
            (from, to) = (from + 1, to + 1);
        }
        self.boxes.truncate(to);
        self.slots.truncate(to);
        self.areas.truncate(to);
    }

    /// By how much fewer lines meet a box around triangle `i` and the next than meet their own; nothing where
    /// either is not alone in its box.
    fn gain(&self, i: usize) -> f32 {
        match (self.slots.get(i..i + 2), self.boxes.get(i..i + 2)) {
            (Some([Slot::One(_), Slot::One(_)]), Some([a, b])) => {
                ALIKE * (a.half_area() + b.half_area()) - a.union(b).half_area()
            }
            _ => 0.0,
        }
    }

    /// Takes the triangles of a cell.
    fn share(&mut self, all: &[TriangleRef], mut cell: Vec<u32>) {
        let of = |&i: &u32| &all[i as usize];
        let bounds = |i: &u32| of(i).corners.bounds().to_bits();
        cell.sort_unstable_by_key(|i| (bounds(i), of(i).corners.bits(), *i));
        for pile in cell.chunk_by(|a, b| bounds(a) == bounds(b)) {
            if let [only] = pile {
                self.add(of(only).aabb(), Slot::One(*only), area(of(only)));
                continue;
            }
            let places = pile.chunk_by(|a, b| of(a).corners.bits() == of(b).corners.bits());
            let entries: Vec<TriangleRef> = places.map(|place| self.entry(all, place)).collect();
            let area = entries.iter().map(area).sum();
            self.add(entries[0].aabb(), Slot::Pile(self.piles.len() as u32), area);
            self.piles.push(entries);
        }
    }

    /// The entry for triangles in one place.
    fn entry(&mut self, all: &[TriangleRef], place: &[u32]) -> TriangleRef {
        let first = all[place[0] as usize];
        if place.len() == 1 {
            return first;
        }
        self.coincident += place.len() as u64 - 1;
        let group = alike(place.iter().map(|&i| &all[i as usize]).map(|fit| (fit.id, fit.look)));
        self.groups.push(group);
        TriangleRef { id: COINCIDENT | (self.groups.len() - 1) as u32, ..first }
    }
}

impl Region for Neighbours {
    type Leaves = Held;

    fn boxes(&self) -> &[ObvhsAabb] {
        &self.boxes
    }

    fn entries(&self, i: u32) -> u32 {
        match self.slots[i as usize] {
            Slot::One(_) => 1,
            Slot::Two(_) => 2,
            Slot::Pile(pile) => self.piles[pile as usize].len() as u32,
        }
    }

    fn leaves<'a>(self, members: impl Iterator<Item = &'a [u32]>) -> Filled<Held> {
        let Neighbours { boxes, slots, areas, piles, groups, coincident } = self;
        // Most boxes hold two.
        let entries = Vec::with_capacity(2 * boxes.len());
        let mut leaves = Held { entries, ends: Vec::new(), others: Vec::new(), groups, coincident };
        let (mut firsts, mut odds) = (Vec::new(), Vec::new());
        let mut places = 0;
        for leaf in members {
            let start = leaves.entries.len();
            for &i in leaf {
                match slots[i as usize] {
                    Slot::One(triangle) => leaves.entries.push(triangle),
                    Slot::Two(both) => leaves.entries.extend(both),
                    Slot::Pile(pile) => leaves.pile(&piles[pile as usize]),
                }
            }
            let end = leaves.entries.len();
            leaves.ends.push(end as u32);
            firsts.push(places);
            let blocks = (end - start).div_ceil(TRIANGLE_LANES) as u32;
            places += blocks;
            let bounds = Aabb::union_of(leaf.iter().map(|&i| boxes[i as usize].into()));
            odds.push(OcclusionCost::of_leaf(bounds, leaf.iter().map(|&i| areas[i as usize]).sum(), blocks));
        }
        Filled { leaves, firsts, places, odds }
    }
}

/// What the leaves of a region hold.
pub(crate) struct Held {
    /// The index of a triangle among all, or [`COINCIDENT`] and an index of `others`; and where each leaf's end.
    entries: Vec<u32>,
    ends: Vec<u32>,
    /// What shares a box.
    others: Vec<TriangleRef>,
    pub groups: Vec<Vec<Alike>>,
    pub coincident: u64,
}

impl Held {
    fn pile(&mut self, pile: &[TriangleRef]) {
        for &entry in pile {
            self.entries.push(COINCIDENT | self.others.len() as u32);
            self.others.push(entry);
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Fills their blocks with triangles of `all`. The groups of other regions before this one's are so many.
    pub fn fill(&self, all: &[TriangleRef], groups: u32, blocks: &mut [Triangle4]) {
        let entry = |&entry: &u32| match entry & COINCIDENT {
            0 => all[entry as usize],
            _ => {
                let other = self.others[(entry & !COINCIDENT) as usize];
                TriangleRef {
                    id: if other.id & COINCIDENT == 0 { other.id } else { other.id + groups },
                    ..other
                }
            }
        };
        let mut start = 0;
        let mut to = blocks.iter_mut();
        for &end in &self.ends {
            let leaf = &self.entries[start..end as usize];
            start = end as usize;
            for (nth, (some, block)) in leaf.chunks(TRIANGLE_LANES).zip(&mut to).enumerate() {
                let mut triangles = [TriangleRef::NOWHERE; TRIANGLE_LANES];
                triangles.iter_mut().zip(some).for_each(|(to, of)| *to = entry(of));
                *block = Triangle4::new(&triangles[..some.len()], (nth + 1) * TRIANGLE_LANES >= leaf.len());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use rayon::iter::ParallelIterator;

    use super::*;
    use crate::accel::build::input_triangles::{InputTriangle, clean};
    use crate::accel::build::morton_clusters::MortonClusters;

    fn fits(corners: &[[Vec3; 3]]) -> Vec<TriangleRef> {
        clean(corners.len(), |i| InputTriangle { v: corners[i], look: SurfaceFlags::default() }).0
    }

    /// One region of all.
    fn region(all: &[TriangleRef]) -> Neighbours {
        let regions = MortonClusters::new(all, usize::MAX);
        let mut made: Vec<Neighbours> = regions.par_iter().map(|keys| Neighbours::new(all, keys)).collect();
        assert_eq!(made.len(), 1);
        made.remove(0)
    }

    /// A field of hills of so many quads each way, each cut in two.
    fn hills(quads: u32) -> Vec<[Vec3; 3]> {
        let height = |x: u32, y: u32| (x as f32 * 0.7).sin() + (y as f32 * 0.4).cos();
        let at = |x: u32, y: u32| Vec3::new(x as f32, y as f32, height(x, y));
        let both = |i: u32| {
            let (x, y) = (i % quads, i / quads);
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        };
        (0..quads * quads).flat_map(both).collect()
    }

    #[test]
    fn halves_of_quads_share_a_box_and_each_triangle_is_in_one() {
        let all = fits(&hills(40));
        let region = region(&all);
        let own = |i: &u32| all[*i as usize].aabb();
        let mut inside = Vec::new();
        for (bounds, slot) in region.boxes.iter().zip(&region.slots) {
            match slot {
                Slot::One(i) => {
                    assert_eq!(*bounds, own(i));
                    inside.push(*i);
                }
                Slot::Two(both) => {
                    let [a, b] = both.each_ref().map(own);
                    assert_eq!(*bounds, a.union(&b));
                    assert!(bounds.half_area() < a.half_area() + b.half_area());
                    inside.extend(both);
                }
                Slot::Pile(pile) => inside.extend(region.piles[*pile as usize].iter().map(|fit| fit.id)),
            }
        }
        inside.sort_unstable();
        assert!(inside.into_iter().eq(0..all.len() as u32));
        assert!(region.boxes.len() < all.len() * 6 / 10, "{} of {}", region.boxes.len(), all.len());
        // What stops light is all there still.
        let whole: f64 = all.iter().map(area).sum();
        assert!((region.areas.iter().sum::<f64>() / whole - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_lies_apart_keeps_its_own_box() {
        let apart = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + 3.0 * i as f32 * Vec3::X);
        let all = fits(&(0..50).map(apart).collect::<Vec<_>>());
        assert_eq!(region(&all).boxes.len(), 50);
        // Areas of boxes that are no numbers tell of nothing to gain.
        let huge = |i: u32| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| (p - 0.5) * 1e18 + i as f32 * 1e14);
        let all = fits(&(0..50).map(huge).collect::<Vec<_>>());
        let region = region(&all);
        assert_eq!((0..region.boxes.len() as u32).map(|i| region.entries(i)).sum::<u32>(), 50);
    }
}
