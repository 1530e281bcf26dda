//! The lists of rays that have yet to visit a node or a leaf.

use crate::bvh::bvh8::{Bvh8Node, WIDTH};
use crate::stream::prepared_rays::STREAM_RAYS;
use blinn_core::simd::Simd;

/// Rays of a list that are moved at a time.
const CHUNK: usize = 16;

/// Masks of a stream's rays, and of a chunk without rays behind them.
pub(super) const MASKS: usize = STREAM_RAYS + CHUNK;

/// The rays that reach a node or a leaf: a range of [`ListStack`]'s memory.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RayList {
    /// The node or leaf.
    pub child: u32,
    first: u32,
    len: u32,
}

/// A stack of lists.
#[derive(Debug)]
pub(super) struct ListStack {
    lists: Vec<RayList>,
    len: usize,
    /// The rays of all lists, one after the other. Each list begins a chunk behind the one before.
    rays: Vec<u32>,
    /// For each ray of the current list, the boxes of the current node that it meets.
    masks: Box<[u8; MASKS]>,
}

impl Default for ListStack {
    fn default() -> Self {
        ListStack { lists: Vec::new(), len: 0, rays: Vec::new(), masks: Box::new([0; MASKS]) }
    }
}

impl RayList {
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len as usize
    }

    /// Where the memory of the list ends.
    #[inline(always)]
    fn end(&self) -> usize {
        self.first as usize + self.len().next_multiple_of(CHUNK)
    }
}

impl ListStack {
    /// Starts with one list.
    pub fn start(&mut self, child: u32, rays: &[u32]) {
        let list = RayList { child, first: 0, len: rays.len() as u32 };
        self.reserve(list);
        self.rays[..rays.len()].copy_from_slice(rays);
        self.lists[0] = list;
        self.len = 1;
    }

    /// Removes the last list. Its rays stay readable until lists are pushed.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<RayList> {
        self.len = self.len.checked_sub(1)?;
        self.lists.get(self.len).copied()
    }

    /// The rays of a list.
    #[inline(always)]
    pub fn rays(&self, list: RayList) -> &[u32] {
        let first = list.first as usize;
        &self.rays[first..first + list.len()]
    }

    /// The rays of a list, and room for the boxes that each meets.
    #[inline(always)]
    pub fn rays_and_masks(&mut self, list: RayList) -> (&[u32], &mut [u8; MASKS]) {
        let first = list.first as usize;
        // Those behind the last ray count as rays that meet nothing.
        if let Some(masks) = self.masks[list.len()..].first_chunk_mut() {
            *masks = [0; CHUNK];
        }
        (&self.rays[first..first + list.len()], &mut self.masks)
    }

    /// Pushes a list of the rays of `list` that meet a box, by their masks, for each slot of `slots` that any ray meets.
    /// `list` is the one popped last.
    #[inline(always)]
    pub fn push_children<S: Simd>(
        &mut self,
        list: RayList,
        node: &Bvh8Node,
        slots: impl Iterator<Item = usize>,
    ) {
        self.reserve(list);
        let end = list.end();
        let (parent, room) = self.rays.split_at_mut(end);
        let (parent, _) = parent[list.first as usize..].as_chunks::<CHUNK>();
        let (masks, _) = self.masks.as_chunks::<CHUNK>();
        let mut first = 0;
        for slot in slots {
            let mut len = 0;
            for (rays, masks) in parent.iter().zip(masks) {
                // There is room: see `reserve`.
                let Some(to) = room[first + len..].first_chunk_mut() else { break };
                len += S::compress_ids(rays, masks, slot, to);
            }
            let child = RayList {
                child: node.child[slot & (WIDTH - 1)],
                first: (end + first) as u32,
                len: len as u32,
            };
            self.lists[self.len] = child;
            self.len += usize::from(len > 0);
            first += len.next_multiple_of(CHUNK);
        }
    }

    /// Makes room for the lists of eight children of `list`, behind it.
    #[inline(always)]
    fn reserve(&mut self, list: RayList) {
        let rays = list.end() + WIDTH * list.len().next_multiple_of(CHUNK) + CHUNK;
        if rays > self.rays.len() || self.len + WIDTH > self.lists.len() {
            self.grow(rays);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, rays: usize) {
        self.rays.resize(self.rays.len().max(2 * rays), 0);
        self.lists.resize(2 * (self.len + WIDTH), RayList::default());
    }
}
