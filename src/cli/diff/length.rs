//! Lengths in texts, in units that suit them.

/// The unit of a scene's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LengthUnit {
    /// glTF has metres.
    #[default]
    Metre,
    /// OBJ, STL and PLY do not name their unit.
    Unknown,
}

/// Returns a length with two significant digits and its unit: `1.0 mm`.
pub fn length_text(length: f64, unit: LengthUnit) -> String {
    if !length.is_finite() {
        return "an infinite distance".into();
    }
    match unit {
        LengthUnit::Unknown => format!("{} units", two_digits(length)),
        LengthUnit::Metre => {
            const SCALES: [(f64, f64, &str); 4] =
                [(1e-3, 1e6, "µm"), (1.0, 1e3, "mm"), (1e3, 1.0, "m"), (f64::INFINITY, 1e-3, "km")];
            let fits = |(below, scale, _): &&(f64, f64, &str)| {
                // 0.9996 mm is shown as 1.0 mm.
                (length * scale).abs() < 999.5 && length < *below || *below == f64::INFINITY
            };
            let (_, scale, name) = SCALES.iter().find(fits).unwrap_or(&SCALES[3]);
            format!("{} {name}", two_digits(length * scale))
        }
    }
}

/// A number with two significant digits, in scientific notation where many zeros would be needed.
fn two_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let exponent = libm::floor(libm::log10(value.abs())) as i32;
    match exponent {
        -4..=0 => format!("{value:.*}", (1 - exponent) as usize),
        1..=5 => format!("{value:.0}"),
        _ => format!("{value:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_the_unit_that_suits_them() {
        for (length, text) in [
            (0.001, "1.0 mm"),
            (0.0123, "12 mm"),
            (0.25, "250 mm"),
            (1.0, "1.0 m"),
            (37.2, "37 m"),
            (1500.0, "1.5 km"),
            (2.5e-5, "25 µm"),
            (9.99e-4, "999 µm"),
            (3e-9, "0.0030 µm"),
            (1e-12, "1.0e-6 µm"),
            (0.0, "0 µm"),
            (f64::INFINITY, "an infinite distance"),
        ] {
            assert_eq!(length_text(length, LengthUnit::Metre), text, "{length}");
        }
        assert_eq!(length_text(0.001, LengthUnit::Unknown), "0.0010 units");
        assert_eq!(length_text(25.0, LengthUnit::Unknown), "25 units");
    }
}
