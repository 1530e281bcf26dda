//! Arrays in huge pages (transparent huge pages on Linux), for the nodes and blocks of large BVHs.
//!
//! Rays read a BVH at random. Large ones take far more 4 KiB pages than the TLB has entries for, and rays
//! would mostly wait for page walks.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::Pod;
use memmap2::MmapMut;
use rayon::prelude::*;

/// An array of fixed length, in huge pages if it is large.
#[derive(Debug)]
pub(crate) struct HugePageArray<T> {
    memory: Memory,
    len: usize,
    element: PhantomData<T>,
}

#[derive(Debug)]
enum Memory {
    /// Memory of the allocator.
    Heap(Vec<CacheLine>),
    /// An anonymous mapping of its own.
    Mapped(MmapMut),
}

/// The strictest alignment of any element type.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct CacheLine([u8; 64]);

/// Arrays of this many bytes or more are mapped in huge pages: two of 2 MiB, the usual size.
const MIN_MAPPED_BYTES: usize = 4 << 20;

impl<T: Pod + Send + Sync> HugePageArray<T> {
    /// Builds the array from `parts` in parallel: `fill` writes the `len` elements of each part.
    pub fn from_parts<P: Sync>(
        parts: &[P],
        len: impl Fn(&P) -> usize,
        fill: impl Fn(&P, &mut [T]) + Sync,
    ) -> Self {
        let total = parts.iter().map(&len).sum();
        let memory = Memory::zeroed(total * size_of::<T>());
        let mut elements = HugePageArray { memory, len: total, element: PhantomData };
        let mut rest: &mut [T] = &mut elements;
        let mut chunks = Vec::with_capacity(parts.len());
        for part in parts {
            chunks.push(rest.split_off_mut(..len(part)).unwrap_or_default());
        }
        parts.par_iter().zip(chunks).with_max_len(1).for_each(|(part, chunk)| fill(part, chunk));
        elements
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.len * size_of::<T>()
    }
}

impl Memory {
    fn zeroed(bytes: usize) -> Memory {
        // Where mapping fails, the allocator decides.
        match (bytes >= MIN_MAPPED_BYTES).then(|| MmapMut::map_anon(bytes)) {
            Some(Ok(map)) => {
                // Advice only: an error costs nothing but time.
                #[cfg(target_os = "linux")]
                let _ = map.advise(memmap2::Advice::HugePage);
                Memory::Mapped(map)
            }
            _ => Memory::Heap(bytemuck::zeroed_vec(bytes.div_ceil(size_of::<CacheLine>()))),
        }
    }
}

impl<T> Default for HugePageArray<T> {
    fn default() -> Self {
        HugePageArray { memory: Memory::Heap(Vec::new()), len: 0, element: PhantomData }
    }
}

impl<T: Pod> Deref for HugePageArray<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        let bytes: &[u8] = match &self.memory {
            Memory::Heap(lines) => bytemuck::cast_slice(lines),
            Memory::Mapped(map) => map,
        };
        // Pages and cache lines are aligned for every element type: this cannot fail.
        bytemuck::try_cast_slice(&bytes[..self.len * size_of::<T>()]).unwrap_or_default()
    }
}

impl<T: Pod> DerefMut for HugePageArray<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        let bytes: &mut [u8] = match &mut self.memory {
            Memory::Heap(lines) => bytemuck::cast_slice_mut(lines),
            Memory::Mapped(map) => map,
        };
        bytemuck::try_cast_slice_mut(&mut bytes[..self.len * size_of::<T>()]).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_arrays_hold_what_they_were_filled_with() {
        let many = MIN_MAPPED_BYTES / 8;
        for lens in [&[][..], &[0], &[1], &[3, 0, 700], &[many - 1], &[7, many - 7], &[many, 0, 5]] {
            let len: usize = lens.iter().sum();
            let starts = lens.iter().scan(0, |next, &len| Some((std::mem::replace(next, *next + len), len)));
            let parts: Vec<(usize, usize)> = starts.collect();
            let fill = |part: &(usize, usize), to: &mut [u64]| {
                assert_eq!(to.len(), part.1);
                to.iter_mut().zip(part.0..).for_each(|(to, i)| *to = 3 * i as u64);
            };
            let mut elements = HugePageArray::from_parts(&parts, |part| part.1, fill);
            assert_eq!(matches!(elements.memory, Memory::Mapped(_)), len >= many);
            assert_eq!((elements.len(), elements.bytes()), (len, 8 * len));
            assert!(elements.iter().zip(0..).all(|(&x, i)| x == 3 * i));
            elements.iter_mut().for_each(|x| *x += 1);
            assert!(elements.iter().zip(0..).all(|(&x, i)| x == 3 * i + 1));
        }
        assert!(HugePageArray::<u64>::default().is_empty());
    }
}
