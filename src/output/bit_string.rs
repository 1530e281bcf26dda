//! Strings of bits in bytes, the lowest bit of a byte first, as deflate has them (RFC 1951, section 3.1.1).

use std::ops::Range;

use rayon::prelude::*;

/// A part of the bits of `bytes`.
pub(super) struct Bits<'b> {
    pub bytes: &'b [u8],
    pub range: Range<usize>,
}

/// Joins parts, and fills the last byte with zeros. Parts are shifted to their places on all threads.
pub(super) fn join(parts: &[Bits]) -> Vec<u8> {
    let starts = parts.iter().scan(0, |end, part| {
        let start = *end;
        *end += part.range.len();
        Some(start)
    });
    let starts: Vec<usize> = starts.collect();
    let shifted: Vec<Vec<u8>> =
        parts.par_iter().zip(&starts).map(|(part, start)| part.shifted(start % 8)).collect();
    let mut joined: Vec<u8> = Vec::with_capacity(shifted.iter().map(Vec::len).sum());
    for (bytes, start) in shifted.iter().zip(starts) {
        let shared = bytes.first().filter(|_| start % 8 != 0);
        match (joined.last_mut(), shared) {
            (Some(last), Some(first)) => {
                *last |= *first;
                joined.extend_from_slice(&bytes[1..]);
            }
            _ => joined.extend_from_slice(bytes),
        }
    }
    joined
}

/// The first bit in which two strings differ; the length of the shorter one if there is none.
pub(super) fn common_length(a: &[u8], b: &[u8]) -> usize {
    let differs = a.iter().zip(b).position(|(a, b)| a != b);
    differs.map_or(8 * a.len().min(b.len()), |i| 8 * i + (a[i] ^ b[i]).trailing_zeros() as usize)
}

/// The number of bits up to the last one that is set.
pub(super) fn length_to_last_one(bytes: &[u8]) -> usize {
    let last = bytes.iter().rposition(|&byte| byte != 0);
    last.map_or(0, |i| 8 * (i + 1) - bytes[i].leading_zeros() as usize)
}

/// Bits that fit a word wherever they begin in a byte.
const STEP: usize = 56;

impl Bits<'_> {
    /// The bits behind `offset` zeros, fewer than 8, and zeros up to the end of the last byte.
    fn shifted(&self, offset: usize) -> Vec<u8> {
        let Range { start: mut at, end } = self.range;
        let mut shifted = Vec::with_capacity((offset + self.range.len()).div_ceil(8));
        // Bits that do not fill a byte yet: `offset` of them in the first loop.
        let mut pending = 0;
        while end - at >= STEP
            && let Some(word) = self.bytes.get(at / 8..).and_then(<[u8]>::first_chunk)
        {
            let step = (u64::from_le_bytes(*word) >> (at % 8)) & ((1u64 << STEP) - 1);
            pending |= step << offset;
            shifted.extend_from_slice(&pending.to_le_bytes()[..STEP / 8]);
            pending >>= STEP;
            at += STEP;
        }
        let mut pending_length = offset;
        for bit in at..end {
            pending |= u64::from((self.bytes[bit / 8] >> (bit % 8)) & 1) << pending_length;
            pending_length += 1;
            if pending_length == 8 {
                shifted.push(pending as u8);
                (pending, pending_length) = (0, 0);
            }
        }
        if pending_length > 0 {
            shifted.push(pending as u8);
        }
        shifted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_bit_by_bit() {
        let bytes: Vec<u8> = (0..100).map(|i: u32| (i * 151 % 256) as u8).collect();
        let bit = |i: usize| (bytes[i / 8] >> (i % 8)) & 1;
        let ranges = [0..3, 1..2, 5..5, 4..200, 7..63, 8..64, 1..57, 100..797, 3..6, 0..800];
        let parts: Vec<Bits> =
            ranges.iter().map(|range| Bits { bytes: &bytes, range: range.clone() }).collect();
        let expected: Vec<u8> = ranges.iter().cloned().flatten().map(bit).collect();
        for count in 0..=ranges.len() {
            let joined = join(&parts[..count]);
            let length: usize = ranges[..count].iter().map(Range::len).sum();
            assert_eq!(joined.len(), length.div_ceil(8));
            let found = (0..8 * joined.len()).map(|i| (joined[i / 8] >> (i % 8)) & 1);
            assert!(found.eq(expected[..length].iter().copied().chain(vec![0; 8 * joined.len() - length])));
        }
    }

    #[test]
    fn lengths_count_bits() {
        assert_eq!(common_length(&[1, 0b0110], &[1, 0b1010, 3]), 10);
        assert_eq!(common_length(&[1], &[1, 2]), 8);
        assert_eq!([&[][..], &[0], &[1, 0], &[0, 0x80, 0]].map(length_to_last_one), [0, 0, 1, 16]);
    }
}
