//! Runs of decimal digits, eight at a time.

/// The value of the digits at `at`, and how many there are. Above 19 digits the value wraps.
#[inline(always)]
pub(super) fn read(bytes: &[u8], at: usize) -> (u64, usize) {
    let Some(eight) = bytes.get(at..).and_then(|rest| rest.first_chunk::<8>()) else {
        return rest(bytes, at, 0, 0);
    };
    // Digits become 0 to 9; a byte that is none, and any behind it that borrow from it, get a high
    // bit in `others`, of which only the first counts.
    let word = u64::from_le_bytes(*eight) ^ 0x3030_3030_3030_3030;
    let others = (word.wrapping_add(0x7676_7676_7676_7676) | word) & 0x8080_8080_8080_8080;
    let count = others.trailing_zeros() / 8;
    if count == 0 {
        return (0, 0);
    }
    // Zeros in front: the last digit stands in the highest byte. Then pairs, fours, all eight.
    let word = word << (64 - 8 * count);
    let pairs = word.wrapping_mul(10).wrapping_add(word >> 8);
    let low = (pairs & 0xff_0000_00ff).wrapping_mul(0x000f_4240_0000_0064);
    let high = ((pairs >> 16) & 0xff_0000_00ff).wrapping_mul(0x0000_2710_0000_0001);
    let value = low.wrapping_add(high) >> 32;
    if count < 8 { (value, count as usize) } else { rest(bytes, at, value, 8) }
}

/// Goes on behind `count` digits, one by one.
#[cold]
fn rest(bytes: &[u8], at: usize, mut value: u64, mut count: usize) -> (u64, usize) {
    while let Some(digit) = bytes.get(at + count).map(|b| b.wrapping_sub(b'0')).filter(|d| *d <= 9) {
        value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
        count += 1;
    }
    (value, count)
}

#[cfg(test)]
mod tests {
    use super::read;

    #[test]
    fn runs_of_all_lengths_with_anything_behind() {
        for length in 0..19 {
            let digits = &"9182736450192837465"[..length];
            let value = digits.parse().unwrap_or(0);
            for byte in 0..=255u8 {
                if byte.is_ascii_digit() {
                    continue;
                }
                for more in [0, 3, 20] {
                    let mut text = format!("x{digits}").into_bytes();
                    text.push(byte);
                    text.extend(std::iter::repeat_n(b'7', more));
                    assert_eq!(read(&text, 1), (value, length), "{text:?}");
                }
            }
            assert_eq!(read(digits.as_bytes(), 0), (value, length));
        }
        assert_eq!(read(b"1", 5), (0, 0));
    }
}
