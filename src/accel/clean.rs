//! What goes into a tree: triangles that can be hit, each place once.
//!
//! Triangles that are not finite or have no area are left out and counted. Triangles in exactly
//! the same place, however wound, share one entry that lists them all; entries with exactly equal
//! boxes share one slot of the tree. Without that, thousands of equal boxes make a builder take
//! minutes over a tree as deep as they are many.
//!
//! Nearly all triangles are alone in their box, so most of the work is to find that out (`again.rs`).

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use obvhs::Boundable;
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::CleanReport;
use super::again::{Again, Watch};
use super::block::GROUP;
use super::corners::{Corners, Unfit};
use super::wide::Box3;
use crate::scene::SurfaceClass;

/// What a ray needs to know of a triangle's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Look {
    pub class: SurfaceClass,
    pub single_sided: bool,
    /// True where the front is seen by rays that run along the corners' normal.
    pub reversed: bool,
}

/// Triangles in one place that look alike, by rising index.
#[derive(Clone, Debug)]
pub(super) struct Alike {
    pub look: Look,
    pub ids: Vec<u32>,
}

/// A triangle to be cleaned. `look.reversed` says that the corners' winding is that of the back.
#[derive(Clone, Copy)]
pub(super) struct Raw {
    pub v: [glam::Vec3; 3],
    pub look: Look,
}

impl Raw {
    /// Its corners in the order of the hit test, and how it looks with them.
    pub fn sorted(self) -> Result<(Corners, Look), Unfit> {
        let (corners, turned) = Corners::new(self.v)?;
        Ok((corners, Look { reversed: self.look.reversed ^ turned, ..self.look }))
    }
}

/// What a tree has a box for.
#[derive(Clone, Copy)]
pub(super) struct Slot {
    /// The corners of its first triangle, which are those of all in a group.
    pub corners: Corners,
    /// How that looks.
    pub look: Look,
    /// An entry (the index of a triangle, or [`GROUP`] and that of a group), or [`PILE`] and the
    /// index of a pile.
    entry: u32,
}

impl Slot {
    /// What cannot be hit.
    const UNFIT: u32 = u32::MAX;
}

impl Boundable for Slot {
    fn aabb(&self) -> Aabb {
        let (lo, hi) = self.corners.bounds();
        Aabb { min: lo.into(), max: hi.into() }
    }
}

/// Slots of a tree.
#[derive(Default)]
pub(super) struct Cleaned {
    pub slots: Vec<Slot>,
    /// Entries with equal boxes.
    piles: Vec<Vec<u32>>,
    /// Triangles in one place.
    pub groups: Vec<Vec<Alike>>,
    pub report: CleanReport,
}

/// Marks the index of a pile.
const PILE: u32 = GROUP | 1 << 30;

/// Most triangles that a tree can hold: their indices share 32 bits with two marks.
pub(super) const MOST: usize = (1 << 30) - 1;

impl Cleaned {
    /// The entries of a slot.
    pub fn entries(&self, slot: u32) -> &[u32] {
        let entry = &self.slots[slot as usize].entry;
        match entry & PILE {
            PILE => &self.piles[(entry & !PILE) as usize],
            _ => std::slice::from_ref(entry),
        }
    }
}

/// Cleans `raw(0..count)`. Those beyond [`MOST`] are left out.
pub(super) fn clean(count: usize, raw: &(impl Fn(usize) -> Raw + Sync)) -> Cleaned {
    let count = count.min(MOST);
    let again = Again::new(count);
    let (non_finite, zero_area) = (AtomicU64::new(0), AtomicU64::new(0));
    let slot = |watch: &mut Watch, i: usize| {
        let raw = raw(i);
        match raw.sorted() {
            Ok((corners, look)) => {
                watch.see(&corners.bounds());
                Slot { corners, look, entry: i as u32 }
            }
            Err(unfit) => {
                let counter = if unfit == Unfit::NonFinite { &non_finite } else { &zero_area };
                counter.fetch_add(1, Relaxed);
                Slot { corners: Corners::NOWHERE, look: raw.look, entry: Slot::UNFIT }
            }
        }
    };
    let mut slots: Vec<Slot> =
        (0..count).into_par_iter().with_min_len(1 << 12).map_init(|| again.watch(), slot).collect();
    let report = CleanReport {
        non_finite: non_finite.into_inner(),
        zero_area: zero_area.into_inner(),
        ..CleanReport::default()
    };
    if report != CleanReport::default() {
        slots.retain(|slot| slot.entry != Slot::UNFIT);
    }
    let mut out = Cleaned { slots, report, ..Cleaned::default() };
    out.share(&again, raw);
    out
}

fn box_bits((lo, hi): &Box3) -> [u32; 6] {
    [lo.x, lo.y, lo.z, hi.x, hi.y, hi.z].map(f32::to_bits)
}

impl Cleaned {
    /// Brings slots together that have equal boxes.
    fn share(&mut self, again: &Again, raw: &(impl Fn(usize) -> Raw + Sync)) {
        let slots = &self.slots;
        let bounds = |slot: u32| slots[slot as usize].corners.bounds();
        let mut suspects: Vec<(u64, u32)> = (0..slots.len() as u32)
            .into_par_iter()
            .with_min_len(1 << 14)
            .filter_map(|slot| Some((again.repeated(&bounds(slot))?, slot)))
            .collect();
        suspects.par_sort_unstable();
        // (the slot that stays, what becomes of its entry)
        let mut shared: Vec<(u32, Vec<u32>)> = Vec::new();
        let mut gone = vec![];
        let (groups, report) = (&mut self.groups, &mut self.report);
        for same_hash in suspects.chunk_by_mut(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
            let bits = |of: &(u64, u32)| box_bits(&bounds(of.1));
            same_hash.sort_unstable_by_key(|of| (bits(of), of.1));
            for run in same_hash.chunk_by(|a, b| bits(a) == bits(b)).filter(|run| run.len() > 1) {
                let ids: Vec<u32> = run.iter().map(|of| slots[of.1 as usize].entry).collect();
                shared.push((run[0].1, group(&ids, raw, groups, report)));
                gone.extend(run[1..].iter().map(|of| of.1));
            }
        }
        for (slot, mut entries) in shared {
            self.slots[slot as usize].entry = match entries[..] {
                [only] => only,
                _ => {
                    entries.shrink_to_fit();
                    self.piles.push(entries);
                    PILE | (self.piles.len() - 1) as u32
                }
            };
        }
        if !gone.is_empty() {
            let mut stays = vec![true; self.slots.len()];
            gone.iter().for_each(|&slot| stays[slot as usize] = false);
            let mut stay = stays.iter();
            self.slots.retain(|_| *stay.next().unwrap_or(&true));
        }
    }
}

/// The entries for triangles with equal boxes: those in exactly one place share one.
fn group(
    ids: &[u32],
    raw: &impl Fn(usize) -> Raw,
    groups: &mut Vec<Vec<Alike>>,
    report: &mut CleanReport,
) -> Vec<u32> {
    let mut placed: Vec<([u32; 9], u32, Look)> = ids
        .iter()
        .filter_map(|&id| raw(id as usize).sorted().ok().map(|(corners, look)| (corners.bits(), id, look)))
        .collect();
    placed.sort_unstable();
    let mut entries = Vec::new();
    for place in placed.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, id, _)] = place {
            entries.push(*id);
            continue;
        }
        report.coincident += place.len() as u64 - 1;
        entries.push(GROUP | groups.len() as u32);
        groups.push(alike(place.iter().map(|&(_, id, look)| (id, look))));
    }
    entries
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
