//! The parser of colours.

use super::numbers::numbers;
use blinn_core::closest_name::closest_name;
use blinn_core::geometry::Rgb;
use blinn_scene::{color_names, named_color, srgb_to_linear};

/// The forms of a colour, for errors.
const FORMS: &str = "R,G,B or one number (linear), #rrggbb, #rgb, a CSS name, or srgb(R,G,B)";

/// A colour in linear light: `R,G,B` or one number for a grey, both linear; or in sRGB, as displayed: `#rrggbb`, `#rgb`,
/// a CSS name, `srgb(R,G,B)` or `srgb(GREY)` with numbers from 0 to 1.
pub fn color(text: &str) -> Result<Rgb, String> {
    color_or(text, &[])
}

/// As [`color`]. `words` are those that the option takes besides colours, for errors.
pub fn color_or(text: &str, words: &[&'static str]) -> Result<Rgb, String> {
    let text = text.trim();
    let lower = text.to_ascii_lowercase();
    if let Some(hex) = text.strip_prefix('#') {
        return from_hex(hex).ok_or_else(|| format!("expected #rrggbb or #rgb, not '{text}'"));
    }
    if let Some(values) = lower.strip_prefix("srgb(").and_then(|rest| rest.strip_suffix(')')) {
        let values = from_numbers(values, words)?;
        if values.max_element() > 1.0 {
            return Err("the values of srgb() are from 0 to 1".into());
        }
        return Ok(Rgb::from_array(values.to_array().map(srgb_to_linear)));
    }
    match named_color(&lower) {
        Some(color) => Ok(color),
        None if lower.starts_with(char::is_alphabetic) && lower.parse::<f64>().is_err() => {
            Err(unknown_name(text, words))
        }
        None => from_numbers(text, words),
    }
}

/// Three numbers, or one for all three channels.
fn from_numbers(text: &str, words: &[&'static str]) -> Result<Rgb, String> {
    let wrong = |reason: String| format!("{reason}; expected {}", forms(words));
    let values = match numbers(text).map_err(wrong)?[..] {
        [grey] => [grey; 3],
        [r, g, b] => [r, g, b],
        ref other => return Err(wrong(format!("{} numbers", other.len()))),
    };
    if values.iter().any(|v| *v < 0.0) {
        return Err("a colour must not be negative".into());
    }
    Ok(Rgb::from_array(values.map(|v| v as f32)))
}

fn from_hex(hex: &str) -> Option<Rgb> {
    let digits: Option<Vec<u32>> = hex.chars().map(|c| c.to_digit(16)).collect();
    let bytes = match digits?[..] {
        [r, g, b] => [r, g, b].map(|digit| 17 * digit),
        [r1, r2, g1, g2, b1, b2] => [16 * r1 + r2, 16 * g1 + g2, 16 * b1 + b2],
        _ => return None,
    };
    Some(Rgb::from_array(bytes.map(|byte| srgb_to_linear(byte as f32 / 255.0))))
}

fn unknown_name(text: &str, words: &[&'static str]) -> String {
    let names = words.iter().copied().chain(color_names());
    match closest_name(text, names) {
        Some(name) => format!("unknown colour '{text}'; did you mean '{name}'?"),
        None => format!("unknown colour '{text}'; expected {}", forms(words)),
    }
}

fn forms(words: &[&'static str]) -> String {
    words.iter().fold(FORMS.to_string(), |forms, word| forms + &format!(", or '{word}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_linear_numbers() {
        assert_eq!(color(".5,0,1").unwrap(), Rgb::new(0.5, 0.0, 1.0));
        assert_eq!(color(".3").unwrap(), Rgb::splat(0.3));
        for wrong in ["1,2", "1,2,3,4", "-1,0,0", "-1", "1e39,0,0", "", "nan", "inf,0,0", "1,,2"] {
            assert!(color(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn displayed_colours_are_decoded() {
        assert!(color("#ff0080").unwrap().abs_diff_eq(Rgb::new(1.0, 0.0, 0.2158605), 1e-6));
        assert_eq!(color("#f08").unwrap(), color("#ff0088").unwrap());
        assert_eq!(color("Orange").unwrap(), color("#ffa500").unwrap());
        assert_eq!(color("srgb(1, 0, 0)").unwrap(), Rgb::X);
        let grey = color("srgb(.5)").unwrap();
        assert_eq!(grey, color("srgb(.5,.5,.5)").unwrap());
        assert_eq!(blinn_scene::linear_to_srgb8(grey.x), 128);
        for wrong in ["#ff008", "#gg0000", "#+f0000", "#", "srgb(2,0,0)", "srgb(128)", "srgb()", "srgb(1,0"] {
            assert!(color(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn misspelt_names_are_suggested() {
        assert_eq!(color("ornage").unwrap_err(), "unknown colour 'ornage'; did you mean 'orange'?");
        assert!(color("transparent").unwrap_err().contains("a CSS name"));
        assert!(
            color_or("transparnt", &["transparent"]).unwrap_err().ends_with("did you mean 'transparent'?")
        );
    }
}
