//! Batches of pixels in SoA layout, sized so that compilers vectorise the loops over them.

/// Pixels in a batch.
pub(super) const BATCH: usize = 16;

/// Linear colours of a batch: the red, green and blue channels.
pub(super) type RgbBatch = [[f32; BATCH]; 3];

/// Splits x, from 0 to 2²², into an integer of at most `last` and the rest. Branch-free, so that loops vectorise.
#[inline(always)]
pub(super) fn split(x: f32, last: f32) -> (u32, f32) {
    // Numbers from here to its double are integers, which the lowest bits hold.
    const INTEGERS: f32 = 8_388_608.0;
    let rounded = (x + INTEGERS) - INTEGERS;
    let floor = if rounded > x { rounded - 1.0 } else { rounded };
    let integer = floor.min(last);
    ((integer + INTEGERS).to_bits() - INTEGERS.to_bits(), x - integer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_split_as_by_conversion() {
        for i in 0..=57 * 64 {
            let exact = i as f32 / 64.0;
            for x in [exact, exact.next_up(), exact.next_down().max(0.0)] {
                let integer = (x as u32).min(55);
                assert_eq!(split(x, 55.0), (integer, x - integer as f32), "{x}");
            }
        }
    }
}
