//! Morton codes: the position of a grid cell along the Z-order curve, by interleaving the bits of its coordinates.
//! Cells with neighbouring codes lie close together.

use glam::{UVec2, UVec3};

/// Returns the 2-D Morton code: x in the even bits, y in the odd ones.
#[inline]
pub fn morton2(cell: UVec2) -> u64 {
    spread2(cell.x) | (spread2(cell.y) << 1)
}

/// Bits of the codes in [`LOW_CELLS`].
const LOW_BITS: u32 = 10;

/// The cells of the lowest codes: those of a tile.
static LOW_CELLS: [[u8; 2]; 1 << LOW_BITS] = low_cells();

const fn low_cells() -> [[u8; 2]; 1 << LOW_BITS] {
    let mut cells = [[0; 2]; 1 << LOW_BITS];
    let mut code = 0;
    while code < cells.len() {
        cells[code] = [compact2(code as u32) as u8, compact2(code as u32 >> 1) as u8];
        code += 1;
    }
    cells
}

/// Returns the cell of a 2-D Morton code of up to 32 bits.
#[inline]
pub fn decode_morton2(code: u32) -> UVec2 {
    match LOW_CELLS.get(code as usize) {
        Some(&[x, y]) => UVec2::new(x.into(), y.into()),
        None => UVec2::new(compact2(code), compact2(code >> 1)),
    }
}

/// Returns the 3-D Morton code of 21 bits for each axis: x in bits 0, 3, 6 …, then y, then z.
#[inline]
pub fn morton3(cell: UVec3) -> u64 {
    spread3(cell.x) | spread3(cell.y) << 1 | spread3(cell.z) << 2
}

/// Moves bit i to bit 2i.
#[inline]
fn spread2(x: u32) -> u64 {
    let mut x = u64::from(x);
    x = (x | (x << 16)) & 0x0000_ffff_0000_ffff;
    x = (x | (x << 8)) & 0x00ff_00ff_00ff_00ff;
    x = (x | (x << 4)) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | (x << 2)) & 0x3333_3333_3333_3333;
    (x | (x << 1)) & 0x5555_5555_5555_5555
}

/// Moves bit 2i to bit i.
#[inline]
const fn compact2(code: u32) -> u32 {
    let mut x = code & 0x5555_5555;
    x = (x | x >> 1) & 0x3333_3333;
    x = (x | x >> 2) & 0x0f0f_0f0f;
    x = (x | x >> 4) & 0x00ff_00ff;
    (x | x >> 8) & 0x0000_ffff
}

/// Moves bit i of the lowest 21 bits to bit 3i.
#[inline]
fn spread3(x: u32) -> u64 {
    let mut x = u64::from(x & 0x1f_ffff);
    x = (x | (x << 32)) & 0x001f_0000_0000_ffff;
    x = (x | (x << 16)) & 0x001f_0000_ff00_00ff;
    x = (x | (x << 8)) & 0x100f_00f0_0f00_f00f;
    x = (x | (x << 4)) & 0x10c3_0c30_c30c_30c3;
    (x | (x << 2)) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_interleave_the_bits_of_coordinates() {
        let mut state = 1u64;
        for _ in 0..10_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let cell = UVec3::new((state >> 40) as u32, (state >> 20) as u32, state as u32);
            let bit = |x: u32, i: u32| u64::from(x >> i & 1);
            let code2 =
                (0..32).fold(0, |code, i| code | bit(cell.x, i) << (2 * i) | bit(cell.y, i) << (2 * i + 1));
            assert_eq!(morton2(cell.truncate()), code2);
            let code3 = (0..21).fold(0, |code, i| {
                code | bit(cell.x, i) << (3 * i)
                    | bit(cell.y, i) << (3 * i + 1)
                    | bit(cell.z, i) << (3 * i + 2)
            });
            assert_eq!(morton3(cell), code3);
            assert_eq!(decode_morton2(code2 as u32), cell.truncate() & UVec2::splat(0xffff));
        }
        for (x, y) in (0..70).flat_map(|y| (0..70).map(move |x| (x, y))) {
            let cell = UVec2::new(x, y);
            assert_eq!(decode_morton2(morton2(cell) as u32), cell);
        }
    }
}
