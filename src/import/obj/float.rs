//! A fast decimal-to-`f32` parser, correctly rounded: it returns the same as `str::parse::<f32>`.

use super::digits::parse_digits;

/// Powers of ten that scale the integer part by the number of fraction digits.
const POWERS: [u64; 20] = {
    let mut powers = [1; 20];
    let mut i = 1;
    while i < 20 {
        powers[i] = powers[i - 1] * 10;
        i += 1;
    }
    powers
};

/// Parses the number at the start of `bytes` and returns it with its length. `None` for anything but a plain
/// decimal number before white space or the end: the lenient parser reads those.
#[inline(always)]
pub(super) fn parse_f32(bytes: &[u8]) -> Option<(f32, usize)> {
    let at = |i: usize| bytes.get(i).copied().unwrap_or(b'\n');
    let negative = at(0) == b'-';
    let mut i = usize::from(negative || at(0) == b'+');
    // Nineteen digits fit. Longer numbers are parsed again below.
    let (mut mantissa, integer_digits) = parse_digits(bytes, i);
    i += integer_digits;
    let mut fraction_digits = 0;
    if at(i) == b'.' {
        let (value, count) = parse_digits(bytes, i + 1);
        fraction_digits = count;
        i += 1 + count;
        mantissa = POWERS.get(count).map_or(0, |power| mantissa.wrapping_mul(*power).wrapping_add(value));
    }
    if integer_digits + fraction_digits == 0 {
        return None;
    }
    let mut exponent = 0i64;
    if at(i) | 0x20 == b'e' {
        let (value, end) = parse_exponent(bytes, i + 1)?;
        (exponent, i) = (value, end);
    }
    if !matches!(at(i), b' ' | b'\t' | b'\r' | b'\n') {
        return None;
    }
    let exact = if integer_digits + fraction_digits <= 19 {
        scale(mantissa, exponent - fraction_digits as i64)
    } else {
        None
    };
    let value = match exact {
        Some(v) if negative => -v,
        Some(v) => v,
        None => std::str::from_utf8(&bytes[..i]).ok()?.parse().ok()?,
    };
    Some((value, i))
}

/// Parses the exponent after an `e` and returns it with its end. Saturates.
fn parse_exponent(bytes: &[u8], mut i: usize) -> Option<(i64, usize)> {
    let sign = bytes.get(i).copied()?;
    let negative = sign == b'-';
    i += usize::from(negative || sign == b'+');
    let first = i;
    let mut value = 0i64;
    while let Some(digit) = bytes.get(i).map(|b| b.wrapping_sub(b'0')).filter(|d| *d <= 9) {
        value = (value * 10 + i64::from(digit)).min(1 << 30);
        i += 1;
    }
    (i > first).then_some((if negative { -value } else { value }, i))
}

/// Returns mantissa·10^exponent if it is correctly rounded in one step, or in two where double rounding is
/// harmless; else `None`.
#[inline(always)]
fn scale(mantissa: u64, exponent: i64) -> Option<f32> {
    /// Powers of ten that f32 represents exactly.
    const SINGLE: [f32; 11] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10];
    /// Powers of ten that f64 represents exactly.
    const DOUBLE: [f64; 23] = [
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17,
        1e18, 1e19, 1e20, 1e21, 1e22,
    ];
    let power = exponent.unsigned_abs() as usize;
    // Both operands are exact, so the single rounding is correct (Clinger 1990).
    if mantissa <= 1 << 24 && power < SINGLE.len() {
        let m = mantissa as f32;
        return Some(if exponent < 0 { m / SINGLE[power] } else { m * SINGLE[power] });
    }
    if mantissa > 1 << 53 || power >= DOUBLE.len() {
        return None;
    }
    let m = mantissa as f64;
    let double = if exponent < 0 { m / DOUBLE[power] } else { m * DOUBLE[power] };
    // Double rounding is wrong only if the f64 lies halfway between two f32: the 29 bits that f32 lacks are
    // then a one followed by zeros. Subnormal f32 lack more bits and are left to the slow path.
    let middle = double.to_bits() & 0x1fff_ffff == 0x1000_0000;
    let normal = double == 0.0 || double >= f64::from(f32::MIN_POSITIVE);
    (normal && !middle).then_some(double as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_same(text: &str) {
        let expected: f32 = text.parse().unwrap();
        let (value, length) = parse_f32(text.as_bytes()).unwrap_or_else(|| panic!("{text}"));
        assert_eq!((value.to_bits(), length), (expected.to_bits(), text.len()), "{text}");
    }

    #[test]
    fn numbers_are_rounded_as_by_the_standard_library() {
        for text in [
            "0",
            "-0",
            "+3",
            "1.",
            ".5",
            "-.5",
            "1e5",
            "1E-5",
            "1e+05",
            "16777216",
            "16777217",
            "16777219",
            "0.1",
            "123456789",
            "1.17549435e-38",
            "1e-45",
            "7e-46",
            "3.4028235e38",
            "3.4028236e38",
            "1e39",
            "340282356779733661637539395458142568448",
            "1e400",
            "1e-400",
            "1e99999999999",
            "0.000000000000000000000000000000000001",
            "1.00000005960464477539062",
            "9007199254740993",
            // At and near the midpoint between two f32.
            "1.000000059604644775390625",
            "1.00000005960464477",
            "1.00000017881393433",
            "8388608.5",
            "8388609.5",
        ] {
            assert_same(text);
        }
    }

    #[test]
    fn a_million_numbers_of_all_lengths_agree() {
        let mut state = 1u64;
        let mut random = move |n: u64| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) % n
        };
        let mut text = String::new();
        for i in 0..1_000_000u64 {
            text.clear();
            match i % 3 {
                // Fixed point, as exporters write it.
                0 => {
                    let places = random(10) as usize;
                    text = format!("{:.places$}", (random(2_000_001) as f64 - 1e6) / 1e5);
                }
                // Any f32, and midpoints between two.
                1 => {
                    let v = f32::from_bits((random(1 << 31) << 1) as u32);
                    if v.is_finite() {
                        let middle = (f64::from(v) + f64::from(v.next_up())) / 2.0;
                        text = if random(2) == 0 { format!("{v}") } else { format!("{middle:e}") };
                    }
                }
                _ => {
                    for _ in 0..random(12) {
                        text.push((b'0' + random(10) as u8) as char);
                    }
                    text.push('.');
                    for _ in 0..1 + random(12) {
                        text.push((b'0' + random(10) as u8) as char);
                    }
                    text.push_str(["", "e3", "e-7", "E+21", "e-30"][random(5) as usize]);
                }
            }
            if !text.is_empty() && !text.contains("inf") {
                assert_same(&text);
            }
        }
    }

    #[test]
    fn other_notations_are_left_to_the_lenient_parser() {
        for text in " - . e5 1e 1e+ nan inf 1,5 0x1 1d5 1.#QNAN --1 1/2 1\\".split(' ') {
            assert_eq!(parse_f32(text.as_bytes()), None, "{text}");
        }
        assert_eq!(parse_f32(b"1.5 2"), Some((1.5, 3)));
        assert_eq!(parse_f32(b"1.5\r\n"), Some((1.5, 3)));
    }
}
