//! Filters of PNG rows (PNG specification, section 9): the difference of each byte to a prediction from its neighbours.

use std::ops::Range;

use blinn_core::simd::{AutovecKernel, SimdLevel};

/// Bytes that a loop handles at once, for the vectoriser.
const LANES: usize = 32;

/// Chunks of [`LANES`] bytes whose absolute differences, 128 at most, a lane of 16 bits can add.
const SUM_CHUNKS: usize = u16::MAX as usize / 128;

/// Predictions of a byte, by their number in the file.
#[derive(Clone, Copy)]
enum Filter {
    /// The byte of the pixel on the left.
    Sub = 1,
    /// The byte above.
    Up = 2,
    /// The mean of both.
    Average = 3,
    /// The one of left, above and above left that is nearest to left + above − above left.
    Paeth = 4,
}

/// The order in which filters are tried. The last one of the best is chosen, as by the crate `png`.
const ORDER: [Filter; 4] = [Filter::Up, Filter::Sub, Filter::Average, Filter::Paeth];

/// Filters rows one after the other, each by the filter with the least sum of absolute differences (specification,
/// section 12.7).
pub(super) struct RowFilter {
    simd: SimdLevel,
    pixel_bytes: usize,
    /// The row and the one above it, behind a pixel of zeros.
    row: Vec<u8>,
    above: Vec<u8>,
    /// The best differences so far, and room for others.
    best: Candidate,
    candidate: Candidate,
}

/// The differences that a filter leaves.
struct Candidate {
    /// The number of the filter and the differences.
    bytes: Vec<u8>,
    /// The chunks outside of which all differences are zero.
    chunks: Range<usize>,
}

impl RowFilter {
    /// Creates a filter for the rows below `above`, which is all zeros at the top of an image.
    pub fn new(pixel_bytes: usize, above: &[u8]) -> RowFilter {
        let mut row = vec![0; pixel_bytes];
        row.extend(above);
        let candidate = || Candidate { bytes: vec![0; above.len() + 1], chunks: 0..0 };
        RowFilter {
            simd: SimdLevel::detect(),
            pixel_bytes,
            above: vec![0; row.len()],
            row,
            best: candidate(),
            candidate: candidate(),
        }
    }

    /// Returns the number of a filter and the differences of the next row.
    pub fn filter(&mut self, row: &[u8]) -> &[u8] {
        std::mem::swap(&mut self.above, &mut self.row);
        self.row[self.pixel_bytes..].copy_from_slice(row);
        let neighbours = Neighbours::new(&self.row, &self.above, self.pixel_bytes);
        let mut chunks = 0..0;
        self.simd.run(FindUneven { neighbours, chunks: &mut chunks });
        let mut least = u64::MAX;
        for filter in ORDER {
            let cost = self.try_filter(filter, chunks.clone());
            if cost <= least {
                least = cost;
                std::mem::swap(&mut self.best, &mut self.candidate);
            }
            if cost == 0 {
                break;
            }
        }
        &self.best.bytes
    }

    /// Writes the differences of a filter into `candidate`, and returns the sum of their absolute values. Those outside of
    /// `chunks` are zero, whatever the filter.
    fn try_filter(&mut self, filter: Filter, chunks: Range<usize>) -> u64 {
        let Candidate { bytes, chunks: filled } = &mut self.candidate;
        let [number, differences @ ..] = &mut bytes[..] else { return 0 };
        *number = filter as u8;
        if *filled != chunks {
            differences[bytes_of(filled)].fill(0);
        }
        *filled = chunks.clone();
        let mut sum = 0;
        self.simd.run(Subtract {
            filter,
            neighbours: Neighbours::new(&self.row, &self.above, self.pixel_bytes),
            chunks,
            differences,
            sum: &mut sum,
        });
        sum
    }
}

/// The bytes of whole chunks.
fn bytes_of(chunks: &Range<usize>) -> Range<usize> {
    chunks.start * LANES..chunks.end * LANES
}

/// The bytes of a row, and at the same index those of the pixels beside them.
struct Neighbours<'r> {
    row: &'r [u8],
    left: &'r [u8],
    above: &'r [u8],
    above_left: &'r [u8],
}

impl<'r> Neighbours<'r> {
    /// The bytes of a row and the one above it, which are behind a pixel of zeros.
    fn new(row: &'r [u8], above: &'r [u8], pixel_bytes: usize) -> Neighbours<'r> {
        let length = row.len() - pixel_bytes;
        Neighbours {
            row: &row[pixel_bytes..],
            left: &row[..length],
            above: &above[pixel_bytes..],
            above_left: &above[..length],
        }
    }
}

/// Finds the chunks outside of which every byte equals those that it is predicted from, as where a row and the one above it
/// show the background. All filters leave zeros there.
struct FindUneven<'r> {
    neighbours: Neighbours<'r>,
    chunks: &'r mut Range<usize>,
}

impl AutovecKernel for FindUneven<'_> {
    #[inline(always)]
    fn run(self) {
        let Neighbours { row, left, above, above_left } = self.neighbours;
        let (row, left) = (row.as_chunks::<LANES>().0, left.as_chunks::<LANES>().0);
        let (above, above_left) = (above.as_chunks::<LANES>().0, above_left.as_chunks::<LANES>().0);
        let (left, above, above_left) = (&left[..row.len()], &above[..row.len()], &above_left[..row.len()]);
        let (mut start, mut end) = (0, row.len());
        while start < end && is_even(&row[start], &left[start], &above[start], &above_left[start]) {
            start += 1;
        }
        while start < end && is_even(&row[end - 1], &left[end - 1], &above[end - 1], &above_left[end - 1]) {
            end -= 1;
        }
        *self.chunks = start..end;
    }
}

#[inline(always)]
fn is_even(row: &[u8; LANES], a: &[u8; LANES], b: &[u8; LANES], c: &[u8; LANES]) -> bool {
    let mut differing = 0;
    for i in 0..LANES {
        differing |= (row[i] ^ a[i]) | (row[i] ^ b[i]) | (row[i] ^ c[i]);
    }
    differing == 0
}

/// Writes the difference of each byte of `chunks`, and behind the last whole chunk, to what a filter predicts.
struct Subtract<'r> {
    filter: Filter,
    neighbours: Neighbours<'r>,
    chunks: Range<usize>,
    differences: &'r mut [u8],
    /// The sum of their absolute values, as bytes with a sign.
    sum: &'r mut u64,
}

impl AutovecKernel for Subtract<'_> {
    #[inline(always)]
    fn run(self) {
        // No closures, which would not be compiled with the instructions of the kernel.
        match self.filter {
            Filter::Sub => self.subtract(left),
            Filter::Up => self.subtract(above),
            Filter::Average => self.subtract(mean),
            Filter::Paeth => self.subtract(paeth),
        }
    }
}

impl Subtract<'_> {
    /// Predicts by a function of left, above and above left.
    #[inline(always)]
    fn subtract(self, predict: impl Fn(u8, u8, u8) -> u8) {
        let (row, row_rest) = self.neighbours.row.as_chunks::<LANES>();
        let (left, left_rest) = self.neighbours.left.as_chunks::<LANES>();
        let (above, above_rest) = self.neighbours.above.as_chunks::<LANES>();
        let (above_left, above_left_rest) = self.neighbours.above_left.as_chunks::<LANES>();
        let (out, out_rest) = self.differences.as_chunks_mut::<LANES>();
        let Range { mut start, end } = self.chunks;
        let mut sum = 0;
        while start < end {
            let part = start..end.min(start + SUM_CHUNKS);
            start = part.end;
            let out = &mut out[part.clone()];
            let count = out.len();
            let (row, left) = (&row[part.clone()][..count], &left[part.clone()][..count]);
            let (above, above_left) = (&above[part.clone()][..count], &above_left[part][..count]);
            let mut sums = [0u16; LANES];
            for k in 0..count {
                let mut differences = [0; LANES];
                for i in 0..LANES {
                    differences[i] =
                        row[k][i].wrapping_sub(predict(left[k][i], above[k][i], above_left[k][i]));
                }
                for i in 0..LANES {
                    sums[i] += u16::from(absolute(differences[i]));
                }
                out[k] = differences;
            }
            for lane in sums {
                sum += u64::from(lane);
            }
        }
        for i in 0..out_rest.len() {
            out_rest[i] = row_rest[i].wrapping_sub(predict(left_rest[i], above_rest[i], above_left_rest[i]));
            sum += u64::from(absolute(out_rest[i]));
        }
        *self.sum = sum;
    }
}

#[inline(always)]
fn left(a: u8, _: u8, _: u8) -> u8 {
    a
}

#[inline(always)]
fn above(_: u8, b: u8, _: u8) -> u8 {
    b
}

/// The mean of two bytes, rounded down.
#[inline(always)]
fn mean(a: u8, b: u8, _: u8) -> u8 {
    (a & b) + ((a ^ b) >> 1)
}

/// The prediction of Paeth's filter from left (a), above (b) and above left (c), in 8 bits.
#[inline(always)]
fn paeth(a: u8, b: u8, c: u8) -> u8 {
    // Distances of a, b and c to a + b − c. If c is not between a and b, it is never the nearest.
    let to_a = b.abs_diff(c);
    let to_b = a.abs_diff(c);
    let is_between = (a < c) == (c < b);
    let to_c = if is_between { to_a.abs_diff(to_b) } else { u8::MAX };
    let nearer = if to_b <= to_c { b } else { c };
    if to_a <= to_b && to_a <= to_c { a } else { nearer }
}

/// The absolute value of a byte with a sign.
#[inline(always)]
fn absolute(byte: u8) -> u8 {
    (byte as i8).unsigned_abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition of the specification, section 9.4.
    #[test]
    fn paeth_is_that_of_the_specification() {
        let levels = || (0u8..=255).step_by(3).chain([1, 2, 254]);
        for a in levels() {
            for b in levels() {
                for c in levels() {
                    let p = i16::from(a) + i16::from(b) - i16::from(c);
                    let distance = |x: u8| (p - i16::from(x)).abs();
                    let expected = if distance(a) <= distance(b) && distance(a) <= distance(c) {
                        a
                    } else if distance(b) <= distance(c) {
                        b
                    } else {
                        c
                    };
                    assert_eq!(paeth(a, b, c), expected, "{a} {b} {c}");
                }
            }
        }
    }

    /// Constant rows have no differences but in the first pixel, and a row that is repeated has none.
    #[test]
    fn the_filter_with_the_least_differences_is_chosen() {
        let row: Vec<u8> = (0..300).map(|i| if i < 3 { 9 } else { (i * i % 251) as u8 }).collect();
        let mut filter = RowFilter::new(3, &[0; 300]);
        let first = filter.filter(&row).to_vec();
        assert_ne!(first[0], Filter::Up as u8);
        let second = filter.filter(&row).to_vec();
        assert_eq!((second[0], &second[1..]), (Filter::Up as u8, &[0; 300][..]));
        let flat = filter.filter(&[7; 300]).to_vec();
        assert_eq!((&flat[..4], &flat[4..]), (&[Filter::Sub as u8, 7, 7, 7][..], &[0; 297][..]));
    }

    /// Rows with a background on both sides, at several widths and places: against each filter by its definition.
    #[test]
    fn backgrounds_and_pixels_between_have_the_differences_of_all_pixels() {
        for (pixel_bytes, width) in [(3, 200), (4, 64), (1, 33), (6, 11), (3, 1)] {
            let length = pixel_bytes * width;
            let mut above = vec![0; length];
            let mut filter = RowFilter::new(pixel_bytes, &above);
            for y in 0..40 {
                let inside = (y * 7 % 20 * length / 40)..(length - y * 3 % 17 * length / 40);
                let shown = |i: usize| y % 5 > 0 && inside.contains(&i);
                let row: Vec<u8> = (0..length)
                    .map(|i| if shown(i) { ((i * i + y * y * 31) >> 2) as u8 } else { 60 })
                    .collect();
                let at = |of: &[u8], i: usize| i.checked_sub(pixel_bytes).map_or(0, |i| of[i]);
                let differences = |filter: Filter| -> Vec<u8> {
                    let predict = |i: usize| match filter {
                        Filter::Sub => at(&row, i),
                        Filter::Up => above[i],
                        Filter::Average => ((u16::from(at(&row, i)) + u16::from(above[i])) / 2) as u8,
                        Filter::Paeth => paeth(at(&row, i), above[i], at(&above, i)),
                    };
                    (0..length).map(|i| row[i].wrapping_sub(predict(i))).collect()
                };
                let cost = |bytes: &[u8]| bytes.iter().map(|&b| u64::from(absolute(b))).sum::<u64>();
                let found = filter.filter(&row).to_vec();
                let tried = ORDER.map(|filter| (filter as u8, differences(filter)));
                let least = tried.iter().map(|(_, bytes)| cost(bytes)).min();
                let chosen = tried.iter().find(|(number, _)| *number == found[0]).unwrap();
                assert_eq!(chosen.1, found[1..], "{pixel_bytes} {width} {y}");
                assert_eq!(Some(cost(&found[1..])), least, "{pixel_bytes} {width} {y}");
                above = row;
            }
        }
    }
}
