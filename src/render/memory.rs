//! Memory that pictures use one after the other: new memory costs a page fault for every 4 KiB.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::film::Pixels;
use crate::integrator::{Sample, Scratch};
use blinn_core::geometry::Rgba;

/// Memory that a thread reuses from tile to tile.
#[derive(Default)]
pub(super) struct TileScratch {
    pub samples: Vec<Sample>,
    pub colors: Vec<Rgba>,
    pub integrator: Scratch,
}

/// Memory of finished pictures, for the next ones. It holds no results: pictures do not depend on it.
#[derive(Default)]
pub struct RenderMemory {
    film: Mutex<Vec<Rgba>>,
    scratches: Mutex<Vec<TileScratch>>,
}

impl RenderMemory {
    /// Keeps the memory of a picture that is no longer needed.
    pub fn recycle(&self, pixels: Pixels) {
        *lock(&self.film) = pixels.colors;
    }

    /// The memory of a picture; empty if none was recycled.
    pub(super) fn take_film(&self) -> Vec<Rgba> {
        std::mem::take(&mut *lock(&self.film))
    }

    /// Memory of one thread, which is kept when the guard is dropped.
    pub(super) fn scratch(&self) -> ScratchGuard<'_> {
        ScratchGuard { memory: self, scratch: lock(&self.scratches).pop().unwrap_or_default() }
    }
}

/// Memory of a thread while it renders.
pub(super) struct ScratchGuard<'m> {
    memory: &'m RenderMemory,
    pub scratch: TileScratch,
}

impl Drop for ScratchGuard<'_> {
    fn drop(&mut self) {
        lock(&self.memory.scratches).push(std::mem::take(&mut self.scratch));
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
