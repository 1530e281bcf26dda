//! Parses runs of decimal digits, eight at a time (SWAR).

/// Returns the value of the digits at `at` and their number. The value wraps above 19 digits.
#[inline(always)]
pub(super) fn parse_digits(bytes: &[u8], at: usize) -> (u64, usize) {
    let Some(eight) = bytes.get(at..).and_then(|rest| rest.first_chunk::<8>()) else {
        return parse_remaining(bytes, at, 0, 0);
    };
    // Digits become 0 to 9. The first byte that is no digit gets its high bit set in `others`; bits of later
    // bytes may be wrong, since they carry, and are not used.
    let word = u64::from_le_bytes(*eight) ^ 0x3030_3030_3030_3030;
    let others = (word.wrapping_add(0x7676_7676_7676_7676) | word) & 0x8080_8080_8080_8080;
    let count = others.trailing_zeros() / 8;
    if count == 0 {
        return (0, 0);
    }
    // Move the last digit to the highest byte, then combine pairs, fours and all eight.
    let word = word << (64 - 8 * count);
    let pairs = word.wrapping_mul(10).wrapping_add(word >> 8);
    let low = (pairs & 0xff_0000_00ff).wrapping_mul(0x000f_4240_0000_0064);
    let high = ((pairs >> 16) & 0xff_0000_00ff).wrapping_mul(0x0000_2710_0000_0001);
    let value = low.wrapping_add(high) >> 32;
    if count < 8 { (value, count as usize) } else { parse_remaining(bytes, at, value, 8) }
}

/// Parses the digits after the first `count`, one by one.
#[cold]
fn parse_remaining(bytes: &[u8], at: usize, mut value: u64, mut count: usize) -> (u64, usize) {
    while let Some(digit) = bytes.get(at + count).map(|b| b.wrapping_sub(b'0')).filter(|d| *d <= 9) {
        value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
        count += 1;
    }
    (value, count)
}

#[cfg(test)]
mod tests {
    use super::parse_digits;

    #[test]
    fn runs_of_all_lengths_end_at_any_other_byte() {
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
                    assert_eq!(parse_digits(&text, 1), (value, length), "{text:?}");
                }
            }
            assert_eq!(parse_digits(digits.as_bytes(), 0), (value, length));
        }
        assert_eq!(parse_digits(b"1", 5), (0, 0));
    }
}
