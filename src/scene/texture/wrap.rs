//! Wrap modes of textures: texel indices and coordinates outside 0…1.

use std::ops::Range;

/// How a texture continues outside 0…1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, every second tile mirrored.
    Mirror,
    /// Continues the edge texels.
    Clamp,
}

impl Wrap {
    /// Maps texel index `i` to 0…n − 1.
    #[inline(always)]
    pub(super) fn texel(self, i: i64, n: i64) -> usize {
        // Most indices are in range, and divisions are slow.
        if (0..n).contains(&i) {
            return i as usize;
        }
        let i = match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Clamp => i.clamp(0, n - 1),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
        };
        i as usize
    }

    /// Returns the texels, of `n`, that lookups at coordinates in low…high can touch, with either filter.
    pub(super) fn texel_ranges(self, [low, high]: [f64; 2], n: u32) -> [Range<usize>; 2] {
        let all = [0..n as usize, 0..0];
        let n = f64::from(n);
        let (first, last) = ((low * n - 0.5).floor(), (high * n - 0.5).floor() + 1.0);
        let inside = first >= 0.0 && last < n;
        let range = |first: f64, last: f64| first as usize..last as usize + 1;
        match self {
            // Also true for NaN.
            _ if !(last - first + 1.0 < n) => all,
            _ if inside => [range(first, last), 0..0],
            Wrap::Clamp => [range(first.clamp(0.0, n - 1.0), last.clamp(0.0, n - 1.0)), 0..0],
            Wrap::Repeat => {
                let start = first.rem_euclid(n);
                let end = start + (last - first);
                if end < n { [range(start, end), 0..0] } else { [range(start, n - 1.0), range(0.0, end - n)] }
            }
            Wrap::Mirror => {
                let start = first.rem_euclid(2.0 * n);
                let end = start + (last - first);
                match () {
                    _ if end < n => [range(start, end), 0..0],
                    _ if start >= n && end < 2.0 * n => {
                        [range(2.0 * n - 1.0 - end, 2.0 * n - 1.0 - start), 0..0]
                    }
                    // Across an edge of a tile.
                    _ => all,
                }
            }
        }
    }

    /// Maps a coordinate close to 0…1 without changing the texels that it selects. Large coordinates keep
    /// their fraction, and non-finite ones become 0.
    #[inline(always)]
    pub(super) fn fold(self, x: f32) -> f64 {
        /// From 2²⁵ on, every f32 is an even integer.
        const EVEN_INTEGERS: f64 = (1u64 << 25) as f64;
        let x = f64::from(x);
        match self {
            // The common case, which skips the slower ones.
            _ if (0.0..1.0).contains(&x) => x,
            _ if !x.is_finite() => 0.0,
            Wrap::Clamp => x.clamp(-1.0, 2.0),
            _ if x.abs() >= EVEN_INTEGERS => 0.0,
            Wrap::Repeat => x - floor(x).1,
            Wrap::Mirror => x - 2.0 * floor(0.5 * x).1,
        }
    }
}

/// Returns ⌊x⌋ for |x| < 2⁵¹, as an integer and as a float. Baseline x86-64 has no instruction for it, and checked conversions
/// to integers are slow.
#[inline(always)]
pub(super) fn floor(x: f64) -> (i64, f64) {
    /// Adding this to a float rounds it to an integer, which the lowest bits of the sum hold.
    const INTEGERS: f64 = 1.5 * (1u64 << 52) as f64;
    let sum = x + INTEGERS;
    let nearest = sum - INTEGERS;
    let i = sum.to_bits().wrapping_sub(INTEGERS.to_bits()) as i64;
    if nearest > x { (i - 1, nearest - 1.0) } else { (i, nearest) }
}
