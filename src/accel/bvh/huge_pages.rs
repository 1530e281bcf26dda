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
pub(crate) struct HugePageVec<T> {
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

impl<T: Pod + Send + Sync> HugePageVec<T> {
    /// As many for each of `parts` as `len` says, with what `fill` makes of them.
    pub fn filled<P: Sync>(
        parts: &[P],
        len: impl Fn(&P) -> usize,
        fill: impl Fn(&P, &mut [T]) + Sync,
    ) -> Self {
        let all = parts.iter().map(&len).sum();
        let mut pages = HugePageVec { memory: Memory::of(all * size_of::<T>()), len: all, what: PhantomData };
        let mut rest: &mut [T] = &mut pages;
        let mut chunks = Vec::with_capacity(parts.len());
        for part in parts {
            chunks.push(rest.split_off_mut(..len(part)).unwrap_or_default());
        }
        parts.par_iter().zip(chunks).with_max_len(1).for_each(|(part, chunk)| fill(part, chunk));
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

impl<T> Default for HugePageVec<T> {
    fn default() -> Self {
        HugePageVec { memory: Memory::Small(Vec::new()), len: 0, what: PhantomData }
    }
}

impl<T: Pod> Deref for HugePageVec<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        let bytes: &[u8] = match &self.memory {
            Memory::Small(lines) => bytemuck::cast_slice(lines),
            Memory::Large(map) => map,
        };
        // HugePageVec and lines are aligned as strictly as anything here: it cannot fail.
        bytemuck::try_cast_slice(&bytes[..self.len * size_of::<T>()]).unwrap_or_default()
    }
}

impl<T: Pod> DerefMut for HugePageVec<T> {
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
        for lens in [&[][..], &[0], &[1], &[3, 0, 700], &[many - 1], &[7, many - 7], &[many, 0, 5]] {
            let len: usize = lens.iter().sum();
            let starts = lens.iter().scan(0, |next, &len| Some((std::mem::replace(next, *next + len), len)));
            let parts: Vec<(usize, usize)> = starts.collect();
            let fill = |part: &(usize, usize), to: &mut [u64]| {
                assert_eq!(to.len(), part.1);
                to.iter_mut().zip(part.0..).for_each(|(to, i)| *to = 3 * i as u64);
            };
            let mut pages = HugePageVec::filled(&parts, |part| part.1, fill);
            assert_eq!(matches!(pages.memory, Memory::Large(_)), len >= many);
            assert_eq!((pages.len(), pages.bytes()), (len, 8 * len));
            assert!(pages.iter().zip(0..).all(|(&x, i)| x == 3 * i));
            pages.iter_mut().for_each(|x| *x += 1);
            assert!(pages.iter().zip(0..).all(|(&x, i)| x == 3 * i + 1));
        }
        assert!(HugePageVec::<u64>::default().is_empty());
    }
}
