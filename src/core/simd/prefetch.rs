//! Software prefetch into the first-level cache. It affects time only, never results.

/// Bytes of a cache line.
const CACHE_LINE: usize = 64;

/// Prefetches the first cache line of `value`.
#[inline(always)]
pub fn prefetch<T: ?Sized>(value: &T) {
    prefetch_line(value, 0);
}

/// Prefetches all cache lines of `value`.
#[inline(always)]
pub fn prefetch_all_lines<T>(value: &T) {
    for offset in (0..size_of::<T>()).step_by(CACHE_LINE) {
        prefetch_line(value, offset);
    }
}

#[inline(always)]
fn prefetch_line<T: ?Sized>(value: &T, offset: usize) {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    // SAFETY: every x86-64 processor has the instruction; it reads nothing and accepts any address.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast::<i8>().wrapping_add(offset));
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (value, offset);
}
