//! What goes into a tree: triangles that can be hit, each place once.
//!
//! Triangles that are not finite or have no area are left out and counted. Triangles in exactly
//! the same place, however wound, share one entry that lists them all; entries with exactly equal
//! boxes share one slot of the tree. Without that, thousands of equal boxes make a builder take
//! minutes over a tree as deep as they are many.

use rayon::prelude::*;

use super::CleanReport;
use super::hit::{Corners, Unfit};
use super::tree::Box3;
use crate::geometry::HitId;
use crate::scene::SurfaceClass;

/// What a ray needs to know of a triangle's surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Look {
    pub class: SurfaceClass,
    pub single_sided: bool,
    /// True where the front is seen by rays that run along the corners' normal.
    pub reversed: bool,
}

/// Triangles in one place that look alike, by rising id.
#[derive(Clone, Debug)]
pub(super) struct Alike {
    pub look: Look,
    pub ids: Vec<HitId>,
}

/// Who is at an entry.
#[derive(Clone, Debug)]
pub(super) enum Face {
    /// One triangle, as almost always.
    One(HitId, Look),
    /// The index of a list of several.
    Many(u32),
}

/// A triangle to be cleaned. `look.reversed` says that the corners' winding is that of the back.
pub(super) struct Raw {
    pub v: [glam::Vec3; 3],
    pub id: HitId,
    pub look: Look,
}

/// Entries by slot: the triangles of slot i are the next `sizes[i]` entries.
#[derive(Default)]
pub(super) struct Cleaned {
    pub boxes: Vec<Box3>,
    pub sizes: Vec<u32>,
    pub corners: Vec<Corners>,
    pub faces: Vec<Face>,
    pub groups: Vec<Vec<Alike>>,
    pub report: CleanReport,
}

struct Kept {
    corners: Corners,
    id: HitId,
    look: Look,
}

/// Cleans `raw(0..count)`, which come by rising id.
pub(super) fn clean(count: usize, raw: impl Fn(usize) -> Raw + Sync) -> Cleaned {
    let judged: Vec<Result<Kept, Unfit>> = (0..count)
        .into_par_iter()
        .with_min_len(4096)
        .map(|i| {
            let Raw { v, id, mut look } = raw(i);
            let (corners, turned) = Corners::new(v)?;
            look.reversed ^= turned;
            Ok(Kept { corners, id, look })
        })
        .collect();
    let unfit = |what| judged.iter().filter(|j| matches!(j, Err(u) if *u == what)).count() as u64;
    let report = CleanReport {
        non_finite: unfit(Unfit::NonFinite),
        zero_area: unfit(Unfit::ZeroArea),
        ..CleanReport::default()
    };
    let kept: Vec<Kept> = judged.into_iter().flatten().collect();
    let mut out = Cleaned { report, ..Cleaned::default() };
    let order = by_place(&kept);
    let same_box = |a: &u32, b: &u32| bounds(&kept, *a) == bounds(&kept, *b);
    let mut slots: Vec<&[u32]> = order.chunk_by(same_box).collect();
    // Back to the file's order, in which neighbours lie together.
    slots.par_sort_unstable_by_key(|slot| slot[0]);
    for slot in slots {
        let before = out.corners.len();
        for place in
            slot.chunk_by(|a, b| kept[*a as usize].corners.bits() == kept[*b as usize].corners.bits())
        {
            out.add(&kept, place);
        }
        out.boxes.push(kept[slot[0] as usize].corners.bounds());
        out.sizes.push((out.corners.len() - before) as u32);
    }
    out
}

fn bounds(kept: &[Kept], i: u32) -> Box3 {
    kept[i as usize].corners.bounds()
}

/// Indices in an order that has equal boxes together, within those equal corners, and within
/// those the lowest id first.
fn by_place(kept: &[Kept]) -> Vec<u32> {
    let mut keys: Vec<(u64, u32)> = kept
        .par_iter()
        .enumerate()
        .map(|(i, k)| {
            let (lo, hi) = k.corners.bounds();
            let bits = [lo.x, lo.y, lo.z, hi.x, hi.y, hi.z].map(f32::to_bits);
            (bits.into_iter().fold(0, mix), i as u32)
        })
        .collect();
    keys.par_sort_unstable();
    // Within equal hashes (hardly ever more than one): by the boxes and corners themselves.
    for run in keys.chunk_by_mut(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        run.sort_unstable_by_key(|&(_, i)| {
            let corners = &kept[i as usize].corners;
            let (lo, hi) = corners.bounds();
            let box_bits = [lo.x, lo.y, lo.z, hi.x, hi.y, hi.z].map(f32::to_bits);
            (box_bits, corners.bits(), i)
        });
    }
    keys.into_iter().map(|(_, i)| i).collect()
}

/// A step of a 64-bit hash: multiply by an odd constant, fold the high bits down.
fn mix(hash: u64, bits: u32) -> u64 {
    let x = (hash ^ u64::from(bits)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x ^ (x >> 29)
}

impl Cleaned {
    /// Adds the triangles of one place.
    fn add(&mut self, kept: &[Kept], place: &[u32]) {
        let first = &kept[place[0] as usize];
        self.corners.push(first.corners);
        if place.len() == 1 {
            self.faces.push(Face::One(first.id, first.look));
            return;
        }
        let mut alike: Vec<Alike> = Vec::new();
        for &i in place {
            let Kept { id, look, .. } = kept[i as usize];
            match alike.iter_mut().find(|a| a.look == look) {
                Some(a) => a.ids.push(id),
                None => alike.push(Alike { look, ids: vec![id] }),
            }
        }
        self.report.coincident += place.len() as u64 - 1;
        self.faces.push(Face::Many(self.groups.len() as u32));
        self.groups.push(alike);
    }
}
