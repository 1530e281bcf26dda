//! Memory that rays look into all over.
//!
//! Trees of large scenes take up far more pages than a processor keeps the addresses of, so that rays
//! would mostly wait for those. Where the system has larger pages to give, it is asked for them.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::Pod;
use memmap2::MmapMut;
use rayon::prelude::*;

/// As many `T` as it was made with.
#[derive(Debug)]
pub(super) struct Pages<T> {
    memory: Memory,
    len: usize,
    what: PhantomData<T>,
}

#[derive(Debug)]
enum Memory {
    /// Words of the strictest alignment that anything here has.
    Small(Vec<Line>),
    Large(MmapMut),
}

/// What a processor reads at once.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([u8; 64]);

/// From this many bytes on, large pages are asked for. A large page has mostly half as many.
const LARGE: usize = 4 << 20;

/// Parts that are filled at once.
const PART: usize = 256;

impl<T: Pod + Send + Sync> Pages<T> {
    /// `len` times what `of` says, by the index.
    pub fn filled(len: usize, of: impl Fn(usize) -> T + Sync) -> Self {
        let mut pages = Pages { memory: Memory::of(len * size_of::<T>()), len, what: PhantomData };
        pages.par_chunks_mut(PART).enumerate().for_each(|(part, to)| {
            to.iter_mut().zip(part * PART..).for_each(|(to, i)| *to = of(i));
        });
        pages
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.len * size_of::<T>()
    }
}

impl Memory {
    fn of(bytes: usize) -> Memory {
        // Where there is none to be had like this, the allocator has the last word.
        match (bytes >= LARGE).then(|| MmapMut::map_anon(bytes)) {
            Some(Ok(map)) => {
                // Advice alone: whether it is taken changes nothing but the time.
                #[cfg(target_os = "linux")]
                let _ = map.advise(memmap2::Advice::HugePage);
                Memory::Large(map)
            }
            _ => Memory::Small(vec![Line([0; 64]); bytes.div_ceil(size_of::<Line>())]),
        }
    }
}

impl<T> Default for Pages<T> {
    fn default() -> Self {
        Pages { memory: Memory::Small(Vec::new()), len: 0, what: PhantomData }
    }
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        let bytes: &[u8] = match &self.memory {
            Memory::Small(lines) => bytemuck::cast_slice(lines),
            Memory::Large(map) => map,
        };
        // Pages and lines are aligned as strictly as anything here: it cannot fail.
        bytemuck::try_cast_slice(&bytes[..self.len * size_of::<T>()]).unwrap_or_default()
    }
}

impl<T: Pod> DerefMut for Pages<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        let bytes: &mut [u8] = match &mut self.memory {
            Memory::Small(lines) => bytemuck::cast_slice_mut(lines),
            Memory::Large(map) => map,
        };
        bytemuck::try_cast_slice_mut(&mut bytes[..self.len * size_of::<T>()]).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_and_many_are_what_they_were_filled_with() {
        let many = LARGE / 8;
        for len in [0, 1, PART - 1, PART, 3 * PART + 7, many - 1, many, many + 1] {
            let mut pages = Pages::filled(len, |i| i as u64 * 3);
            assert_eq!(matches!(pages.memory, Memory::Large(_)), len >= many);
            assert_eq!((pages.len(), pages.bytes()), (len, 8 * len));
            assert!(pages.iter().zip(0..).all(|(&x, i)| x == 3 * i));
            pages.iter_mut().for_each(|x| *x += 1);
            assert!(pages.iter().zip(0..).all(|(&x, i)| x == 3 * i + 1));
        }
        assert!(Pages::<u64>::default().is_empty());
    }
}
