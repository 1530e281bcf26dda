//! Lengths in texts, in units that suit them.

use glam::DVec3;

use blinn_core::geometry::Aabb;

/// The unit of a scene's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LengthUnit {
    /// glTF has metres.
    #[default]
    Metre,
    /// OBJ, STL and PLY do not name their unit.
    Unknown,
}

impl LengthUnit {
    /// The unit of coordinates.
    pub fn name(self) -> &'static str {
        match self {
            LengthUnit::Metre => "m",
            LengthUnit::Unknown => "units",
        }
    }
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

/// Returns the corners of a box: `from 1.00, 2.00, 0.00 to 1.50, 2.50, 0.00 m (y up)`.
pub fn bounds_text(bounds: &Aabb, unit: LengthUnit) -> String {
    let [min, max] = corner_texts(bounds);
    format!("from {min} to {max} {} (y up)", unit.name())
}

/// Returns the lowest and the highest corner of a box, with a hundredth of its size as the last digit.
pub fn corner_texts(bounds: &Aabb) -> [String; 2] {
    let size = bounds.extent().max_element();
    let size = if size > 0.0 { size } else { bounds.max.abs().max_element() };
    let digits = if size > 0.0 { (2.0 - libm::floor(libm::log10(size))).clamp(0.0, 12.0) } else { 0.0 };
    let corner = |v: DVec3| {
        let digits = digits as usize;
        v.to_array().map(|x| rounded(x, digits)).join(", ")
    };
    [corner(bounds.min), corner(bounds.max)]
}

/// A number with so many digits after the point. -0 is 0.
fn rounded(x: f64, digits: usize) -> String {
    let text = format!("{x:.digits$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => zero.to_string(),
        _ => text,
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

    #[test]
    fn boxes_have_digits_that_suit_their_size() {
        let bounds = Aabb { min: DVec3::new(25.25, -5.0, 0.0), max: DVec3::new(33.259, 5.0, 0.0) };
        let text = bounds_text(&bounds, LengthUnit::Unknown);
        assert_eq!(text, "from 25.2, -5.0, 0.0 to 33.3, 5.0, 0.0 units (y up)");
        let foot = Aabb { min: DVec3::new(-0.13, -3.7e-9, -0.0), max: DVec3::new(0.13, 0.029999997, 0.13) };
        assert_eq!(corner_texts(&foot), ["-0.130, 0.000, 0.000", "0.130, 0.030, 0.130"]);
        let small = Aabb { min: DVec3::splat(0.001), max: DVec3::splat(0.0045) };
        let text = bounds_text(&small, LengthUnit::Metre);
        assert_eq!(text, "from 0.00100, 0.00100, 0.00100 to 0.00450, 0.00450, 0.00450 m (y up)");
    }
}
