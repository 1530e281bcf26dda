//! Parsers of numbers, vectors, angles, counts and patterns.

use glam::DVec3;

use blinn_bench::scenes;
use blinn_import::NormalMode;
use blinn_scene::Glob;
use blinn_session::FrameList;

/// Comma-separated numbers. None of them overflows single precision.
pub(super) fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let parse = |part: &str| match part.trim().parse::<f64>() {
        Ok(v) if v.abs() <= f64::from(f32::MAX) => Ok(v),
        Ok(v) if v.is_finite() => Err(format!("'{part}' is too large")),
        _ => Err(format!("'{part}' is not a number")),
    };
    text.split(',').map(parse).collect()
}

/// Exactly `N` comma-separated numbers; `form` is their name in errors.
pub(super) fn exactly<const N: usize>(text: &str, form: &str) -> Result<[f64; N], String> {
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

/// A number that is not negative, as the largest difference that counts as equal.
pub fn tolerance(text: &str) -> Result<f32, String> {
    let v = number(text)?;
    if v >= 0.0 { Ok(v as f32) } else { Err("must not be negative".into()) }
}

/// An angle in degrees, converted to radians.
pub fn angle(text: &str) -> Result<f64, String> {
    number(text).map(f64::to_radians)
}

/// An angle from 0 to 180 degrees, or `off`.
pub fn smooth(text: &str) -> Result<NormalMode, String> {
    if text == "off" {
        return Ok(NormalMode::Flat);
    }
    match number(text) {
        Ok(v) if (0.0..=180.0).contains(&v) => Ok(NormalMode::CreaseAngle(v)),
        _ => Err("expected off, or an angle from 0 to 180 degrees".into()),
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

/// Triangle counts such as `70k,1.1m`.
pub fn triangle_counts(text: &str) -> Result<Vec<usize>, String> {
    text.split(',').map(|part| scenes::parse_triangle_count(part.trim())).collect()
}

/// The number of frames in a turn. A list of frames, as `blinn render --frames` takes it, is an error that points to
/// --only.
pub fn frame_count(text: &str) -> Result<u32, String> {
    let count = text.parse().ok().filter(|count| (1..=1_000_000).contains(count));
    count.ok_or_else(|| {
        let is_list = text.parse::<u64>().is_err() && FrameList::parse(text).is_ok();
        let list = if is_list { text } else { "LIST" };
        format!(
            "expected the number of frames in a turn, 1 to 1000000; to render some of them, use --only {list}"
        )
    })
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
    fn numbers_beyond_single_precision_are_rejected() {
        for wrong in ["1e39", "-1e39", "1e300"] {
            assert!(number(wrong).unwrap_err().contains("too large"), "{wrong}");
        }
        assert_eq!(number("-3e38").unwrap(), -3e38);
    }
}
