//! Parsers of numbers, vectors, angles, counts and patterns.

use std::num::IntErrorKind;
use std::ops::RangeInclusive;

use glam::DVec3;

use blinn_import::NormalMode;
use blinn_scene::Glob;

/// Comma-separated numbers. None of them overflows single precision.
///
/// # Errors
/// As all parsers: the form that is expected.
pub fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let parse = |part: &str| match part.trim().parse::<f64>() {
        Ok(v) if v.abs() <= f64::from(f32::MAX) => Ok(v),
        Ok(v) if v.is_finite() => Err(format!("'{part}' is too large")),
        _ => Err(format!("'{part}' is not a number")),
    };
    text.split(',').map(parse).collect()
}

/// Exactly `N` comma-separated numbers; `form` is their name in errors.
pub fn exactly<const N: usize>(text: &str, form: &str) -> Result<[f64; N], String> {
    numbers(text)?.try_into().map_err(|_| format!("expected {form}, such as {}", vec!["1"; N].join(",")))
}

/// `X,Y,Z`.
pub fn vector(text: &str) -> Result<DVec3, String> {
    exactly::<3>(text, "X,Y,Z").map(DVec3::from_array)
}

/// `X,Y,Z` of non-zero length.
pub fn direction(text: &str) -> Result<DVec3, String> {
    let direction = vector(text)?;
    direction.try_normalize().map(|_| direction).ok_or_else(|| "a direction must not be zero".to_string())
}

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    exactly::<1>(text, "a number").map(|[v]| v)
}

/// A number greater than zero.
pub fn positive(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v > 0.0 { Ok(v) } else { Err("must be greater than zero".into()) }
}

/// A factor of lengths. Coordinates of ordinary scenes remain within the range of `f32`.
pub fn length_scale(text: &str) -> Result<f64, String> {
    let v = positive(text)?;
    if (1e-9..=1e9).contains(&v) { Ok(v) } else { Err("must be between 1e-9 and 1e9".into()) }
}

/// A whole number in a range.
pub fn whole<T: TryFrom<i64>>(text: &str, range: RangeInclusive<i64>) -> Result<T, String> {
    let number: i64 = text.parse().map_err(|e: std::num::ParseIntError| match e.kind() {
        IntErrorKind::InvalidDigit => "expected a whole number".to_string(),
        _ => e.to_string(),
    })?;
    let outside = || format!("{number} is not in {}..={}", range.start(), range.end());
    if !range.contains(&number) {
        return Err(outside());
    }
    T::try_from(number).map_err(|_| outside())
}

/// `mm`, `m`, or metres per step.
pub fn depth_unit(text: &str) -> Result<f64, String> {
    match text {
        "mm" => Ok(0.001),
        "m" => Ok(1.0),
        _ => positive(text).map_err(|e| format!("{e}; expected mm, m or metres per step")),
    }
}

/// A number from 0 to 1.
pub fn fraction(text: &str) -> Result<f32, String> {
    let v = number(text)?;
    if (0.0..=1.0).contains(&v) { Ok(v as f32) } else { Err("must be from 0 to 1".into()) }
}

/// An angle in degrees, converted to radians.
pub fn angle(text: &str) -> Result<f64, String> {
    number(text).map(f64::to_radians)
}

/// An angle from 0 to 180 degrees, `off`, `file` or `auto`.
pub fn smooth(text: &str) -> Result<NormalMode, String> {
    match text {
        "auto" => return Ok(NormalMode::Auto),
        "file" => return Ok(NormalMode::File),
        "off" => return Ok(NormalMode::Flat),
        _ => {}
    }
    match number(text) {
        Ok(v) if (0.0..=180.0).contains(&v) => Ok(NormalMode::CreaseAngle(v)),
        _ => Err("expected auto, file, off, or an angle from 0 to 180 degrees".into()),
    }
}

/// A number of bytes with or without a unit: 1073741824, 1GiB, 1.5 GB.
pub fn bytes(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, u64); 10] = [
        ("TIB", 1 << 40),
        ("GIB", 1 << 30),
        ("MIB", 1 << 20),
        ("KIB", 1 << 10),
        ("TB", 1_000_000_000_000),
        ("GB", 1_000_000_000),
        ("MB", 1_000_000),
        ("KB", 1000),
        ("B", 1),
        ("", 1),
    ];
    let upper = text.trim().to_ascii_uppercase();
    let parse =
        |&(name, unit): &(&str, u64)| Some((upper.strip_suffix(name)?.trim_end().parse::<f64>().ok()?, unit));
    match UNITS.iter().find_map(parse) {
        Some((count, unit)) if count > 0.0 && count.is_finite() => Ok((count * unit as f64) as u64),
        _ => Err("expected a number of bytes, such as 4GiB or 800MB".into()),
    }
}

/// A pattern of names.
pub fn glob(text: &str) -> Result<Glob, String> {
    Glob::new(text).map_err(|e| format!("{e}; * matches any text, ? any character"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_take_exponents_and_minus_signs() {
        assert_eq!(vector("-5,-2.1,3e-2").unwrap(), DVec3::new(-5.0, -2.1, 0.03));
        for wrong in ["1,2", "1,2,3,4", "1,2,x", "", "1,,2", "nan,1,1", "inf,0,0"] {
            assert!(vector(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn whole_numbers_are_in_their_range() {
        assert_eq!(whole::<u8>("64", 0..=64), Ok(64));
        assert_eq!(whole::<u8>("65", 0..=64), Err("65 is not in 0..=64".into()));
        assert_eq!(whole::<u8>("1.5", 0..=64), Err("expected a whole number".into()));
        assert!(whole::<u32>("", 1..=9).unwrap_err().contains("empty"));
    }

    #[test]
    fn numbers_beyond_single_precision_are_rejected() {
        for wrong in ["1e39", "-1e39", "1e300"] {
            assert!(number(wrong).unwrap_err().contains("too large"), "{wrong}");
        }
        assert_eq!(number("-3e38").unwrap(), -3e38);
    }
}
