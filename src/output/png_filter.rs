//! Filters of PNG rows (PNG specification, section 9): the difference of each byte to a prediction from its neighbours.

/// Bytes that a loop handles at once, for the vectoriser.
const LANES: usize = 32;

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
    pixel_bytes: usize,
    /// The row and the one above it, behind a pixel of zeros.
    row: Vec<u8>,
    above: Vec<u8>,
    /// The number of a filter and the differences: the best ones so far, and room for others.
    best: Vec<u8>,
    candidate: Vec<u8>,
}

impl RowFilter {
    /// Creates a filter for the rows below `above`, which is all zeros at the top of an image.
    pub fn new(pixel_bytes: usize, above: &[u8]) -> RowFilter {
        let mut row = vec![0; pixel_bytes];
        row.extend(above);
        RowFilter {
            pixel_bytes,
            above: vec![0; row.len()],
            row,
            best: vec![0; above.len() + 1],
            candidate: vec![0; above.len() + 1],
        }
    }

    /// Returns the number of a filter and the differences of the next row.
    pub fn filter(&mut self, row: &[u8]) -> &[u8] {
        std::mem::swap(&mut self.above, &mut self.row);
        self.row[self.pixel_bytes..].copy_from_slice(row);
        let mut least = u64::MAX;
        for filter in ORDER {
            let cost = self.try_filter(filter);
            if cost <= least {
                least = cost;
                std::mem::swap(&mut self.best, &mut self.candidate);
            }
            if cost == 0 {
                break;
            }
        }
        &self.best
    }

    /// Writes the differences of a filter into `candidate`, and returns the sum of their absolute values.
    fn try_filter(&mut self, filter: Filter) -> u64 {
        let length = self.row.len() - self.pixel_bytes;
        let [number, differences @ ..] = &mut self.candidate[..] else { return 0 };
        *number = filter as u8;
        let neighbours = Neighbours {
            row: &self.row[self.pixel_bytes..],
            left: &self.row[..length],
            above: &self.above[self.pixel_bytes..],
            above_left: &self.above[..length],
        };
        match filter {
            Filter::Sub => neighbours.subtract(differences, |left, _, _| left),
            Filter::Up => neighbours.subtract(differences, |_, above, _| above),
            Filter::Average => neighbours.subtract(differences, |left, above, _| mean(left, above)),
            Filter::Paeth => neighbours.subtract(differences, paeth),
        }
        sum_of_absolutes(differences)
    }
}

/// The bytes of a row, and at the same index those of the pixels beside them.
struct Neighbours<'r> {
    row: &'r [u8],
    left: &'r [u8],
    above: &'r [u8],
    above_left: &'r [u8],
}

impl Neighbours<'_> {
    /// Writes the difference of each byte to what `predict` returns for left, above and above left.
    #[inline(always)]
    fn subtract(&self, differences: &mut [u8], predict: impl Fn(u8, u8, u8) -> u8) {
        let (row, row_rest) = self.row.as_chunks::<LANES>();
        let (left, left_rest) = self.left.as_chunks::<LANES>();
        let (above, above_rest) = self.above.as_chunks::<LANES>();
        let (above_left, above_left_rest) = self.above_left.as_chunks::<LANES>();
        let (out, out_rest) = differences.as_chunks_mut::<LANES>();
        for ((((out, row), a), b), c) in out.iter_mut().zip(row).zip(left).zip(above).zip(above_left) {
            for i in 0..LANES {
                out[i] = row[i].wrapping_sub(predict(a[i], b[i], c[i]));
            }
        }
        for (i, out) in out_rest.iter_mut().enumerate() {
            *out = row_rest[i].wrapping_sub(predict(left_rest[i], above_rest[i], above_left_rest[i]));
        }
    }
}

/// The mean of two bytes, rounded down.
#[inline(always)]
fn mean(a: u8, b: u8) -> u8 {
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

/// The sum of the absolute values of bytes with a sign.
fn sum_of_absolutes(bytes: &[u8]) -> u64 {
    let sum = |bytes: &[u8]| bytes.iter().map(|&b| u64::from((b as i8).unsigned_abs())).sum::<u64>();
    let (chunks, rest) = bytes.as_chunks::<LANES>();
    chunks.iter().map(|chunk| sum(chunk)).sum::<u64>() + sum(rest)
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
}
