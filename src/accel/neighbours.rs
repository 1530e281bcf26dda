//! Triangles that lie together, each place once.
//!
//! Triangles in exactly the same place, however wound, share one entry of a leaf that lists them all;
//! entries with exactly equal boxes share one slot of the tree. Without that, thousands of equal boxes make
//! a builder take minutes over a tree as deep as they are many. Equal boxes lie in one cell of a region, and
//! hardly any two triangles do.

use obvhs::Boundable;
use obvhs::aabb::Aabb;

use super::block::{Block, CAPACITY, GROUP};
use super::clean::{Fit, Look};
use super::collapse::{Filled, Region};
use super::odds::{Odds, stopping};
use super::regions::Key;
use super::wide::{bits, box3, union};

/// Triangles in one place that look alike, by rising index.
#[derive(Clone, Debug)]
pub(super) struct Alike {
    pub look: Look,
    pub ids: Vec<u32>,
}

/// Triangles in one place, by rising index, by how they look.
pub(super) fn alike(place: impl Iterator<Item = (u32, Look)>) -> Vec<Alike> {
    let mut alike: Vec<Alike> = Vec::new();
    for (id, look) in place {
        match alike.iter_mut().find(|a| a.look == look) {
            Some(a) => a.ids.push(id),
            None => alike.push(Alike { look, ids: vec![id] }),
        }
    }
    alike
}

/// How much area stops light.
fn area(fit: &Fit) -> f64 {
    fit.corners.area() * stopping(fit.look.class)
}

/// The triangles of a region.
#[derive(Default)]
pub(super) struct Neighbours {
    boxes: Vec<Aabb>,
    /// What is in each box: the index of a triangle among all, or [`GROUP`] and that of a pile.
    slots: Vec<u32>,
    /// How much area stops light in each box.
    areas: Vec<f64>,
    /// Entries with equal boxes. The id of an entry is a triangle's, or [`GROUP`] and that of a group.
    piles: Vec<Vec<Fit>>,
    groups: Vec<Vec<Alike>>,
    /// Triangles that are where another is.
    coincident: u64,
}

impl Neighbours {
    /// Those of `all` that `keys` tells of, by cell.
    pub fn new(all: &[Fit], keys: &[Key]) -> Neighbours {
        let (boxes, slots) = (Vec::with_capacity(keys.len()), Vec::with_capacity(keys.len()));
        let areas = Vec::with_capacity(keys.len());
        let mut own = Neighbours { boxes, slots, areas, ..Neighbours::default() };
        for cell in keys.chunk_by(|a, b| a.cell() == b.cell()) {
            match cell {
                [key] => {
                    let fit = &all[key.index()];
                    own.add(fit.aabb(), key.index() as u32, area(fit));
                }
                _ => own.share(all, cell.iter().map(|key| key.index() as u32).collect()),
            }
        }
        own
    }

    /// Adds a box, and how much area in it stops light.
    fn add(&mut self, bounds: Aabb, slot: u32, area: f64) {
        self.boxes.push(bounds);
        self.slots.push(slot);
        self.areas.push(area);
    }

    /// Takes the triangles of a cell.
    fn share(&mut self, all: &[Fit], mut cell: Vec<u32>) {
        let of = |&i: &u32| &all[i as usize];
        let bounds = |i: &u32| bits(of(i).corners.bounds());
        cell.sort_unstable_by_key(|i| (bounds(i), of(i).corners.bits(), *i));
        for pile in cell.chunk_by(|a, b| bounds(a) == bounds(b)) {
            if let [only] = pile {
                self.add(of(only).aabb(), *only, area(of(only)));
                continue;
            }
            let places = pile.chunk_by(|a, b| of(a).corners.bits() == of(b).corners.bits());
            let entries: Vec<Fit> = places.map(|place| self.entry(all, place)).collect();
            let area = entries.iter().map(area).sum();
            self.add(entries[0].aabb(), GROUP | self.piles.len() as u32, area);
            self.piles.push(entries);
        }
    }

    /// The entry for triangles in one place.
    fn entry(&mut self, all: &[Fit], place: &[u32]) -> Fit {
        let first = all[place[0] as usize];
        if place.len() == 1 {
            return first;
        }
        self.coincident += place.len() as u64 - 1;
        let group = alike(place.iter().map(|&i| &all[i as usize]).map(|fit| (fit.id, fit.look)));
        self.groups.push(group);
        Fit { id: GROUP | (self.groups.len() - 1) as u32, ..first }
    }
}

impl Region for Neighbours {
    type Leaves = Held;

    fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    fn entries(&self, i: u32) -> u32 {
        match self.slots[i as usize] {
            slot if slot & GROUP != 0 => self.piles[(slot & !GROUP) as usize].len() as u32,
            _ => 1,
        }
    }

    fn leaves<'a>(self, members: impl Iterator<Item = &'a [u32]>) -> Filled<Held> {
        let Neighbours { boxes, slots, areas, piles, groups, coincident } = self;
        let entries = Vec::with_capacity(boxes.len());
        let mut leaves = Held { entries, ends: Vec::new(), others: Vec::new(), groups, coincident };
        let (mut firsts, mut odds) = (Vec::new(), Vec::new());
        let mut places = 0;
        for leaf in members {
            let start = leaves.entries.len();
            for &i in leaf {
                match slots[i as usize] {
                    slot if slot & GROUP != 0 => leaves.pile(&piles[(slot & !GROUP) as usize]),
                    triangle => leaves.entries.push(triangle),
                }
            }
            let end = leaves.entries.len();
            leaves.ends.push(end as u32);
            firsts.push(places);
            let blocks = (end - start).div_ceil(CAPACITY) as u32;
            places += blocks;
            let bounds = union(leaf.iter().map(|&i| box3(&boxes[i as usize])));
            odds.push(Odds::of_leaf(bounds, leaf.iter().map(|&i| areas[i as usize]).sum(), blocks));
        }
        Filled { leaves, firsts, places, odds }
    }
}

/// What the leaves of a region hold.
pub(super) struct Held {
    /// The index of a triangle among all, or [`GROUP`] and an index of `others`; and where each leaf's end.
    entries: Vec<u32>,
    ends: Vec<u32>,
    /// What shares a box.
    others: Vec<Fit>,
    pub groups: Vec<Vec<Alike>>,
    pub coincident: u64,
}

impl Held {
    fn pile(&mut self, pile: &[Fit]) {
        for &entry in pile {
            self.entries.push(GROUP | self.others.len() as u32);
            self.others.push(entry);
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Fills their blocks with triangles of `all`. The groups of other regions before this one's are so many.
    pub fn fill(&self, all: &[Fit], groups: u32, blocks: &mut [Block]) {
        let entry = |&entry: &u32| match entry & GROUP {
            0 => all[entry as usize],
            _ => {
                let other = self.others[(entry & !GROUP) as usize];
                Fit { id: if other.id & GROUP == 0 { other.id } else { other.id + groups }, ..other }
            }
        };
        let mut start = 0;
        let mut to = blocks.iter_mut();
        for &end in &self.ends {
            let leaf = &self.entries[start..end as usize];
            start = end as usize;
            for (nth, (some, block)) in leaf.chunks(CAPACITY).zip(&mut to).enumerate() {
                let mut triangles = [Fit::NOWHERE; CAPACITY];
                triangles.iter_mut().zip(some).for_each(|(to, of)| *to = entry(of));
                *block = Block::new(&triangles[..some.len()], (nth + 1) * CAPACITY >= leaf.len());
            }
        }
    }
}
