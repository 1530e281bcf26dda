//! Low-discrepancy sampling: Hammersley points on the film and Owen-scrambled Sobol' points for everything else.

use glam::UVec2;

use blinn_core::geometry::morton2;

/// A sampler without state: a function of pixel, sample index and dimension. It does not depend on the frame number, so
/// the noise of an animation stands still.
pub trait Sampler: Sync {
    /// A number in 0…1, never 1, for a dimension of a sample of a pixel.
    fn get(&self, pixel: UVec2, index: u32, dimension: u32) -> f32;
}

/// Low-discrepancy points, scrambled differently in each pixel. Dimensions come in pairs.
///
/// The first pair, the position on the film, is the Hammersley set. With the pixel cut into `count` rows and `count`
/// columns, each row and each column has one sample, for every count; if the count is a power of two, so has every other
/// rectangle of area 1/count that repeated halving yields (a (0,m,2)-net). Rows are paired with columns by Owen's nested
/// scrambling (“Randomly Permuted (t,m,s)-Nets and (t,s)-Sequences”, 1995). It has the least error of the patterns that
/// were measured on edges, lines, floors and zone plates, for all counts and filters; the table is in
/// docs/explanation/antialiasing.md.
///
/// The other pairs (lights, directions) are Sobol's (0,2)-sequence, each scrambled and shuffled by hashes (Burley,
/// “Practical Hash-based Owen Scrambling”, JCGT 9(4), 2020). All pixels share one sequence along the Morton curve (Ahmed and
/// Wonka, “Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels”, 2020):
/// neighbours receive nearly the same light, so that their errors cancel to the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LowDiscrepancySampler {
    /// Varies the scrambling.
    pub seed: u32,
    /// Samples per pixel.
    pub count: u32,
}

impl LowDiscrepancySampler {
    /// The random bits that scramble a pixel's positions on the film.
    #[inline(always)]
    pub(crate) fn film_scramble(&self, pixel: UVec2) -> u64 {
        hash(hash(pack(self.seed, 0) ^ hash(0)) ^ pack(pixel.x, pixel.y))
    }

    /// The film positions, x and y, of N samples: [`Sampler::get`] of dimensions 0 and 1, for indices below the count and
    /// the [`LowDiscrepancySampler::film_scramble`] of their pixels.
    #[inline(always)]
    pub(crate) fn film_positions<const N: usize>(
        &self,
        scramble: &[u64; N],
        index: &[u32; N],
    ) -> [[f32; N]; 2] {
        hammersley(scramble, self.count.max(1), index)
    }

    /// The point in a pair of dimensions: [`Sampler::get`] of dimensions 2 · `pair` and 2 · `pair` + 1.
    #[inline]
    pub(crate) fn get_2d(&self, pixel: UVec2, index: u32, pair: u32) -> [f32; 2] {
        match self.sequence_position(pixel, index) {
            Some(position) if pair > 0 => self.sequence_points(pair, &[position]).map(|axis| axis[0]),
            _ => [2 * pair, 2 * pair + 1].map(|dimension| self.get(pixel, index, dimension)),
        }
    }

    /// The position of a sample in the sequences that all pixels share, for [`LowDiscrepancySampler::sequence_points`];
    /// `None` if its index is not below the count. Positions of samples of a pixel follow each other.
    #[inline(always)]
    pub(crate) fn sequence_position(&self, pixel: UVec2, index: u32) -> Option<u64> {
        let count = self.count.max(1);
        (index < count).then(|| sequence_position(pixel, count, index))
    }

    /// The points of N samples in a pair of dimensions behind the first one, by the samples' positions. They do not depend on
    /// the count.
    #[inline(always)]
    pub(crate) fn sequence_points<const N: usize>(&self, pair: u32, position: &[u64; N]) -> [[f32; N]; 2] {
        screen_space_sobol(hash(pack(self.seed, 0) ^ hash(u64::from(pair))), position)
    }
}

/// The part of its stratum that a film sample is jittered over. Stratum centres have the least error; a little jitter costs
/// nothing measurable and keeps samples off the axis-aligned lines of modelled scenes.
const JITTER: f64 = 0.25;

impl Sampler for LowDiscrepancySampler {
    fn get(&self, pixel: UVec2, index: u32, dimension: u32) -> f32 {
        let count = self.count.max(1);
        // Indices past the count start another set. The branch avoids slow divisions.
        let (set, index) = if index < count { (0, index) } else { (index / count, index % count) };
        let (pair, axis) = (dimension / 2, dimension % 2);
        let key = hash(pack(self.seed, set) ^ hash(u64::from(pair)));
        match pair {
            0 => hammersley(&[hash(key ^ pack(pixel.x, pixel.y))], count, &[index])[axis as usize][0],
            _ => screen_space_sobol(key, &[sequence_position(pixel, count, index)])[axis as usize][0],
        }
    }
}

/// N points of the Hammersley set, each scrambled by the bits of its pixel.
#[inline(always)]
fn hammersley<const N: usize>(scramble: &[u64; N], count: u32, index: &[u32; N]) -> [[f32; N]; 2] {
    let mut column = [0; N];
    for i in 0..N {
        // Rotates the columns, because sample 0 would otherwise be on the left of every pixel.
        let first = (((scramble[i] >> 32) * u64::from(count)) >> 32) as u32;
        let before_end = count - first;
        column[i] = if index[i] < before_end { first.wrapping_add(index[i]) } else { index[i] - before_end };
    }
    let row = scrambled_rows(&column, count, scramble);
    let inv_count = 1.0 / f64::from(count);
    let mut positions = [[0.0; N]; 2];
    for i in 0..N {
        let jitter = hash(scramble[i] ^ pack(column[i], 0));
        let position = |stratum: u32, jitter: u32| {
            let offset = f64::from(jitter) * (1.0 / (1u64 << 32) as f64) - 0.5;
            let position = (f64::from(stratum) + 0.5 + JITTER * offset) * inv_count;
            (position as f32).min(1.0f32.next_down())
        };
        let u = position(column[i], (jitter >> 32) as u32);
        let v = position(row[i], jitter as u32);
        // Swaps the axes at random, by bit 0, which is not used otherwise: neither axis is sampled better.
        let swap = scramble[i] & 1 != 0;
        positions[0][i] = if swap { v } else { u };
        positions[1][i] = if swap { u } else { v };
    }
    positions
}

/// The rows of N columns: the rank of each column among all when they are sorted by their bits from the lowest up, where at
/// each node of that binary tree a random bit decides which half comes first. If the count is no power of two the halves
/// differ in size, and each column still has its own row.
#[inline(always)]
fn scrambled_rows<const N: usize>(column: &[u32; N], count: u32, scramble: &[u64; N]) -> [u32; N] {
    let mut scramble = *scramble;
    let mut bits = *column;
    let mut row = [0; N];
    let mut node = [1u32; N];
    let mut size = [count; N];
    let levels = u32::BITS - (count - 1).leading_zeros();
    for level in 0..levels {
        // 64 bits are enough for the nodes of six levels.
        if level > 0 && level % 6 == 0 {
            for i in 0..N {
                scramble[i] = hash(scramble[i] ^ u64::from(node[i]));
                node[i] = 1;
            }
        }
        for i in 0..N {
            let odd = bits[i] & 1;
            let flip = (scramble[i] >> node[i]) as u32 & 1;
            // The even half is larger by one in a node of odd size. A single column has no halves.
            let own = if size[i] > 1 { size[i] / 2 + (size[i] & (odd ^ 1)) } else { size[i] };
            row[i] += (odd ^ flip) * (size[i] - own);
            size[i] = own;
            bits[i] /= 2;
            node[i] = 2 * node[i] + odd;
        }
    }
    row
}

/// The position of a sample in the sequence that all pixels share along the Morton curve.
#[inline(always)]
fn sequence_position(pixel: UVec2, count: u32, index: u32) -> u64 {
    let bits = u32::BITS - (count - 1).leading_zeros();
    (morton2(pixel) << bits) | u64::from(index)
}

/// N points of the Sobol' sequence that all pixels share, by their positions.
#[inline(always)]
fn screen_space_sobol<const N: usize>(key: u64, position: &[u64; N]) -> [[f32; N]; 2] {
    let seeds = [hash(key), hash(key ^ 1)];
    let mut digits = [[0; N]; 2];
    for i in 0..N {
        // Shuffled from the highest bit down: pixels that share a quad, a quad of quads and so on still share a contiguous
        // part of the sequence.
        let index = owen_scramble(position[i].reverse_bits(), key).reverse_bits();
        // The lowest bit is the first binary place from here on.
        digits[0][i] = index as u32;
        digits[1][i] = sobol_second_dimension(index);
    }
    let mut points = [[0.0; N]; 2];
    for axis in 0..2 {
        for i in 0..N {
            let digits = owen_scramble_low(digits[axis][i], seeds[axis]).reverse_bits();
            points[axis][i] = (digits >> 8) as f32 * (1.0 / (1u32 << 24) as f32);
        }
    }
    points
}

/// Approximates Owen scrambling by a hash in the manner of Laine and Karras: each bit is flipped depending on the seed and
/// the bits below it, because no step carries anything downward. The constants are random, and even or odd as each step
/// needs to stay invertible.
#[inline(always)]
fn owen_scramble(mut x: u64, seed: u64) -> u64 {
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(SCRAMBLE[0]);
    x = x.wrapping_mul((seed >> 32) | 1);
    x ^= x.wrapping_mul(SCRAMBLE[1]);
    x = x.wrapping_mul(SCRAMBLE[2]);
    x ^ x.wrapping_mul(SCRAMBLE[3])
}

const SCRAMBLE: [u64; 4] =
    [0x6c50_b47c_2e1a_9d3e, 0xb823_10d5_94c6_e672, 0xe9b5_dba5_8189_dbbd, 0x4d1a_7f36_c722_d91a];

/// The lower half of [`owen_scramble`], which depends on the lower halves of its numbers alone.
#[inline(always)]
fn owen_scramble_low(mut x: u32, seed: u64) -> u32 {
    x = x.wrapping_add(seed as u32);
    x ^= x.wrapping_mul(SCRAMBLE[0] as u32);
    x = x.wrapping_mul((seed >> 32) as u32 | 1);
    x ^= x.wrapping_mul(SCRAMBLE[1] as u32);
    x = x.wrapping_mul(SCRAMBLE[2] as u32);
    x ^ x.wrapping_mul(SCRAMBLE[3] as u32)
}

/// The first 32 binary places of the second dimension of the Sobol' sequence. Its generator matrix is Pascal's triangle
/// modulo 2, whose entry (i, j) is 1 if the bits of j contain those of i, so that each bit of the index is one step.
#[inline(always)]
fn sobol_second_dimension(index: u64) -> u32 {
    let mut v = index as u32 ^ (index >> 32) as u32;
    v ^= v >> 16;
    v ^= (v >> 8) & 0x00ff_00ff;
    v ^= (v >> 4) & 0x0f0f_0f0f;
    v ^= (v >> 2) & 0x3333_3333;
    v ^ ((v >> 1) & 0x5555_5555)
}

#[inline(always)]
fn pack(high: u32, low: u32) -> u64 {
    (u64::from(high) << 32) | u64::from(low)
}

/// A hash: one step of SplitMix64.
#[inline(always)]
fn hash(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests;
