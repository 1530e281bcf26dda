//! Numbers of triangles as people write them.

/// Formats a number of triangles: `1499`, `70k`, `1.1m`. Small ones are exact, as they name scenes.
pub fn format_triangle_count(triangles: usize) -> String {
    let n = triangles as f64;
    if triangles < 10_000 && !triangles.is_multiple_of(1000) {
        return triangles.to_string();
    }
    if triangles < 999_500 { format!("{:.0}k", n / 1e3) } else { format!("{:.1}m", n / 1e6) }
}

/// Parses a number of triangles: `70000`, `70k`, `1.1m`.
///
/// # Errors
/// The text is not a number, or not between 1 and 10⁹.
pub fn parse_triangle_count(word: &str) -> Result<usize, String> {
    let lower = word.to_ascii_lowercase();
    let (digits, scale) = match lower.as_bytes().last() {
        Some(b'k') => (&lower[..lower.len() - 1], 1e3),
        Some(b'm') => (&lower[..lower.len() - 1], 1e6),
        _ => (&lower[..], 1.0),
    };
    match digits.parse::<f64>() {
        Ok(n) if n > 0.0 && n * scale <= 1e9 => Ok((n * scale).round() as usize),
        _ => Err(format!("'{word}' is not a number of triangles; use 70k, 1.1m or 70000, at most 1000m")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_they_are_read() {
        for (triangles, text) in
            [(100, "100"), (1499, "1499"), (2000, "2k"), (70_000, "70k"), (1_100_000, "1.1m")]
        {
            assert_eq!(format_triangle_count(triangles), text);
            assert_eq!(parse_triangle_count(text), Ok(triangles));
        }
    }
}
